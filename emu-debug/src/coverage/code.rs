//! Program memory as instructions.

use emu_core::chip::Chip;
use emu_core::image::Image;
use emu_core::table::Flow;

/// Erased bytes in a row from which on they are no program.
const ERASED: usize = 8;

/// An instruction of an image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Instruction {
    /// Address in program words.
    pub pc: u32,
    /// Length in program words.
    pub len: u32,
    /// What it may do to the order in which the program runs.
    pub flow: Flow,
    /// Its text.
    pub text: String,
}

/// The instructions of the program memory that an image fills, one behind the other; where one was `executed` another begins
/// anew. Words that are no instruction are left out, and so are erased ones that were not executed.
#[must_use]
pub fn instructions(chip: &'static Chip, image: &Image, executed: impl Fn(u32) -> bool) -> Vec<Instruction> {
    let words = words(chip, image);
    let erased = |at: usize| words.get(at) == Some(&Some(chip.isa.erased));
    let (mut found, mut at) = (Vec::new(), 0);
    while at < words.len() {
        let run = (at..).take_while(|&at| erased(at) && !executed(at as u32)).count();
        if run * chip.word_bytes as usize >= ERASED {
            at += run;
            continue;
        }
        let here: Vec<u16> = words.iter().skip(at).take(4).map_while(|word| *word).collect();
        let pc = at as u32;
        let line = (chip.isa.disassemble)(&here, pc);
        let len = line.len.max(1);
        // An instruction within it was executed: this is none, unless it was executed too.
        let broken = !executed(pc) && (at + 1..at + len).any(|at| executed(at as u32));
        if let (Some(row), false, false) = (line.row, here.is_empty(), broken) {
            found.push(Instruction { pc, len: len as u32, flow: (chip.isa.flow)(row), text: line.text });
            at += len;
        } else {
            at += 1;
        }
    }
    found
}

/// Program memory by words; nothing where the image fills nothing.
fn words(chip: &Chip, image: &Image) -> Vec<Option<u16>> {
    let size = chip.word_bytes.max(1);
    let end = image.end(chip.code).min(chip.flash).div_ceil(size);
    let mut words: Vec<Option<u16>> = vec![None; end as usize];
    for (addr, byte) in image.bytes_in(chip.code) {
        if let Some(word) = words.get_mut((addr / size) as usize) {
            let shift = 8 * (addr % size);
            let mask = if size == 1 { 0xFF } else { 0xFFu16 << shift };
            *word = Some(word.unwrap_or(chip.isa.erased) & !mask | u16::from(byte) << shift);
        }
    }
    words
}
