//! Divides program memory into instructions, erased areas and gaps.

use emu_core::chip::Chip;
use emu_core::image::{AddressedByte, Image};
use emu_core::table::DisassembledInstruction;

/// Minimum length of an erased area that is not printed byte by byte.
const ERASED_RUN: usize = 8;

/// A range of program memory.
pub(super) enum CodePiece {
    /// An instruction: word address, its words, and the decoded instruction.
    Instruction(u32, Vec<u16>, DisassembledInstruction),
    /// Words that the image fills with the erased value: the first word, and the one after the last.
    Erased(u32, u32),
    /// Words that the image does not fill: the first word, and the one after the last.
    Gap(u32, u32),
}

/// Program memory with the contents of an image.
pub(super) struct ProgramMemory {
    chip: &'static Chip,
    words: Vec<u16>,
    /// For each word: true if the image fills it.
    filled: Vec<bool>,
}

impl ProgramMemory {
    /// Loads an image into the program memory of a chip.
    pub(super) fn new(chip: &'static Chip, image: &Image) -> ProgramMemory {
        let size = chip.word_bytes as usize;
        let erased = chip.isa.erased_word.to_le_bytes();
        let mut bytes: Vec<u8> = erased.iter().copied().take(size).cycle().take(chip.flash_bytes as usize).collect();
        image.fill(chip.code_space, &mut bytes);
        let words = bytes.chunks(size).map(|word| word.iter().rev().fold(0, |high, &low| high << 8 | u16::from(low)));
        let mut code = ProgramMemory { chip, words: words.collect(), filled: vec![false; bytes.len() / size] };
        for AddressedByte { addr, .. } in image.bytes_in(chip.code_space) {
            if let Some(word) = code.filled.get_mut(addr as usize / size) {
                *word = true;
            }
        }
        code
    }

    /// Returns all pieces of a range of words. Instructions and erased areas never extend into a gap.
    pub(super) fn pieces(&self, from: u32, to: u32) -> Vec<CodePiece> {
        let mut pieces = Vec::new();
        let mut at = from as usize;
        let to = (to as usize).min(self.words.len());
        while at < to {
            let filled = self.filled.get(at) == Some(&true);
            let rest = self.filled.iter().skip(at).take_while(|&&word| word == filled).count();
            let len = if filled { rest } else { rest.min(to - at) };
            let here = self.words.get(at..at + len).unwrap_or_default();
            let erased = here.iter().take(to - at).take_while(|&&word| word == self.chip.isa.erased_word).count();
            let (piece, len) = if !filled {
                (CodePiece::Gap(at as u32, (at + len) as u32), len)
            } else if erased * self.chip.word_bytes as usize >= ERASED_RUN {
                (CodePiece::Erased(at as u32, (at + erased) as u32), erased)
            } else {
                let instruction = (self.chip.isa.disassemble)(here, at as u32);
                let len = instruction.len.clamp(1, here.len().max(1));
                let shown = here.get(..len).unwrap_or(here).to_vec();
                (CodePiece::Instruction(at as u32, shown, instruction), len)
            };
            pieces.push(piece);
            at += len.max(1);
        }
        pieces
    }
}
