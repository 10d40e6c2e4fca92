//! The text of the disassembler, assembled, gives back the words: random programs of every chip, as one
//! source. proptest prints the smallest program that fails and its seed.

mod common;

use std::fmt::Write;

use common::chips;
use emu_asm::{assemble_line, assemble_text};
use emu_core::chip::Chip;
use proptest::prelude::*;

/// Maximum length of a program, in program words.
const LONGEST: usize = 24;

/// Returns `words` as a source with one instruction a line, and the number of words that it stands for. Where
/// the instruction would be cut off by the end, the source ends before it.
fn source(chip: &Chip, words: &[u16]) -> (String, usize) {
    let mut text = String::new();
    let mut at = 0;
    while at < words.len() {
        let line = (chip.isa.disassemble)(&words[at..], at as u32);
        if line.text.contains("cut off") {
            break;
        }
        let _ = writeln!(text, " {}", line.text);
        at += line.len;
    }
    (text, at)
}

/// Returns the bytes of program memory from address 0.
fn program_bytes(chip: &'static Chip, text: &str) -> Result<Vec<u8>, String> {
    let image = assemble_text(chip, text).map_err(|refused| refused.to_string())?;
    Ok(image.bytes_in(chip.hex_spaces[0].name).map(|one| one.byte).collect())
}

/// Whether the assembler refuses the text of `word` on purpose: AP101 executes such words, but an operand
/// beyond its zone (E256) or a set input latch (STC I0) is an error in a source.
fn is_refused(chip: &'static Chip, word: u16) -> bool {
    let line = (chip.isa.disassemble)(&[word], 0);
    chip.name == "ap101" && assemble_line(chip, &line.text, 0).is_err()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn disassembled_programs_assemble_to_their_words(
        which in any::<prop::sample::Index>(),
        words in prop::collection::vec(any::<u16>(), 1..LONGEST),
    ) {
        let all: Vec<&'static Chip> = chips().collect();
        let chip = *which.get(&all);
        let bits = chip.isa.word_bits;
        let words = words.into_iter().map(|word| word & (u16::MAX >> (16 - bits)));
        let words: Vec<u16> = words.map(|word| if is_refused(chip, word) { 0 } else { word }).collect();
        let (text, count) = source(chip, &words);
        let wanted: Vec<u8> = if bits == 8 {
            words[..count].iter().map(|&word| word as u8).collect()
        } else {
            words[..count].iter().flat_map(|word| word.to_le_bytes()).collect()
        };
        prop_assert_eq!(program_bytes(chip, &text), Ok(wanted), "{}:\n{}", chip.name, text);
    }
}
