//! Words of program memory and EEPROM given as values.

use std::ops::Range;

use crate::dialect::common::{required_arguments, value_of};
use crate::engine::{Assembler, DirectiveCall};
use crate::fault::LineFault;
use crate::lines::{behind_name, byte, trim};
use crate::number::read_string;

/// Bits of a program word.
const WORD: u32 = 14;
/// The first word address of the EEPROM.
pub(super) const EEPROM: i64 = 0x2100;
/// `retlw 0`.
const RETLW: u16 = 0x3400;

/// Returns a quoted text. A single character in single quotes is a number instead.
fn text_in(call: &DirectiveCall<'_>, part: &Range<usize>) -> Option<Vec<u8>> {
    let text = read_string(call.text, part.start, part.end)?;
    (byte(call.text, part.start) == b'"' || text.len() != 1).then_some(text)
}

/// Emits a word, truncated to the 14 bits of program memory.
fn give(asm: &mut Assembler<'_>, word: u16, part: Range<usize>) {
    if word >> WORD != 0 {
        let cause = format!("0x{word:04X} has more than {WORD} bits: its upper bits are dropped");
        let hint = "select the bits with &; for texts `da` has 7 bits for each character";
        asm.report(LineFault::new("ASM045", part.clone(), cause, hint).note());
    }
    asm.emit_words(&[word & ((1 << WORD) - 1)], part);
}

/// Emits values, one per word, and texts, two characters per word.
pub(super) fn words(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    if super::link::in_initial(asm) {
        return initial_words(asm, call);
    }
    for part in required_arguments(asm, call) {
        match text_in(call, &part) {
            Some(text) => pairs(asm, &text, 8, part),
            None => {
                let word = value_of(asm, call.text, part.clone(), 16) as u16;
                give(asm, word, part);
            }
        }
    }
}

/// Emits initial values of variables, low byte first; a text has one word per character and a terminating 0.
fn initial_words(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    for part in required_arguments(asm, call) {
        let words = match text_in(call, &part) {
            Some(text) => text.into_iter().chain([0]).map(u16::from).collect(),
            None => vec![value_of(asm, call.text, part.clone(), 16) as u16],
        };
        give_initial_words(asm, words);
    }
}

fn give_initial_words(asm: &mut Assembler<'_>, words: Vec<u16>) {
    let bytes: Vec<u8> = words.into_iter().flat_map(u16::to_le_bytes).collect();
    super::link::give_initial(asm, &bytes);
}

/// Emits two characters per word, the first in the upper half.
fn pairs(asm: &mut Assembler<'_>, text: &[u8], bits: u32, part: Range<usize>) {
    for pair in text.chunks(2) {
        let code = |i: usize| u16::from(pair.get(i).copied().unwrap_or(0)) & ((1 << bits) - 1);
        give(asm, code(0) << bits | code(1), part.clone());
    }
}

/// Returns the bytes of all values and texts, with their positions.
fn all_bytes(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) -> Vec<(u8, Range<usize>)> {
    let mut bytes = Vec::new();
    for part in required_arguments(asm, call) {
        match text_in(call, &part) {
            Some(text) => bytes.extend(text.into_iter().map(|byte| (byte, part.clone()))),
            None => bytes.push((value_of(asm, call.text, part.clone(), 8) as u8, part)),
        }
    }
    bytes
}

/// Emits bytes, two per word with the first in the upper half; in the EEPROM one per word.
pub(super) fn bytes(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    if super::link::in_initial(asm) {
        let bytes: Vec<u8> = all_bytes(asm, call).into_iter().map(|(byte, _)| byte).collect();
        return super::link::give_initial(asm, &bytes);
    }
    if asm.out.next_address() >= EEPROM {
        return cells(asm, call);
    }
    for pair in all_bytes(asm, call).chunks(2) {
        let byte = |i: usize| pair.get(i).map_or(0, |(byte, _)| u16::from(*byte));
        let place = pair.first().map_or(0..0, |(_, place)| place.clone());
        give(asm, byte(0) << 8 | byte(1), place);
    }
}

/// Emits values, one per word, and texts, two 7-bit characters per word.
pub(super) fn packed(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    if super::link::in_initial(asm) {
        return initial_words(asm, call);
    }
    for part in required_arguments(asm, call) {
        match text_in(call, &part) {
            Some(text) => pairs(asm, &text, 7, part),
            None => {
                let word = value_of(asm, call.text, part.clone(), 16) as u16;
                give(asm, word, part);
            }
        }
    }
}

/// Emits bytes, one per word.
pub(super) fn cells(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    if super::link::in_initial(asm) {
        let words = all_bytes(asm, call).into_iter().map(|(byte, _)| byte.into()).collect();
        return give_initial_words(asm, words);
    }
    for (byte, part) in all_bytes(asm, call) {
        give(asm, byte.into(), part);
    }
}

/// Emits a RETLW for each byte; as in gpasm, also for initial values of variables.
pub(super) fn table(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    if super::link::in_initial(asm) {
        let words = all_bytes(asm, call).into_iter().map(|(byte, _)| RETLW | u16::from(byte)).collect();
        return give_initial_words(asm, words);
    }
    for (byte, part) in all_bytes(asm, call) {
        give(asm, RETLW | u16::from(byte), part);
    }
}

/// `fill value, count`, and `fill (instruction), count`.
pub(super) fn fill(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let parts = required_arguments(asm, call);
    let [what, count] = parts.as_slice() else {
        let hint = "write `fill value, count`, or an instruction in brackets for the value";
        return asm.report(LineFault::new("ASM023", call.word.clone(), "a value and a count are wanted", hint));
    };
    let Some(n) = asm.evaluate_number(call.text, count.clone()) else { return };
    if !(0..=0x1_0000).contains(&n) {
        let cause = format!("{n} words cannot be filled");
        return asm.report(LineFault::new(
            "ASM003",
            count.clone(),
            cause,
            "give a number from 0 to the size of the memory",
        ));
    }
    match instruction_in(asm, call, what) {
        Some((word, rest)) => {
            let mnemonic = call.get(word.clone()).to_ascii_lowercase();
            for _ in 0..n {
                let Some(words) = asm.assemble_instruction(call.text, &mnemonic, word.clone(), rest.clone()) else {
                    return;
                };
                asm.emit_words(&words, what.clone());
            }
        }
        None => {
            let word = value_of(asm, call.text, what.clone(), 16) as u16;
            // Truncation is reported once.
            if n > 0 {
                give(asm, word, what.clone());
            }
            (1..n).for_each(|_| asm.emit_words(&[word & ((1 << WORD) - 1)], what.clone()));
        }
    }
}

/// Returns mnemonic and operands of an instruction in parentheses.
fn instruction_in(
    asm: &Assembler<'_>,
    call: &DirectiveCall<'_>,
    part: &Range<usize>,
) -> Option<(Range<usize>, Range<usize>)> {
    if byte(call.text, part.start) != b'(' || byte(call.text, part.end.checked_sub(1)?) != b')' {
        return None;
    }
    let inner = trim(call.text, part.start + 1..part.end - 1);
    let end = behind_name(call.text, inner.start, false).min(inner.end);
    let known = !asm.table.forms(&call.get(inner.start..end).to_ascii_lowercase()).is_empty();
    known.then_some((inner.start..end, end..inner.end))
}
