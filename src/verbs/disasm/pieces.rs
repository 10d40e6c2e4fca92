//! Program memory cut into instructions, erased stretches and gaps.

use emu_core::chip::Chip;
use emu_core::image::Image;
use emu_core::table::DisassembledInstruction;

/// Erased bytes in a row from which on they are no longer printed one by one.
const ERASED_RUN: usize = 8;

/// A stretch of program memory.
pub(super) enum CodePiece {
    /// An instruction: word address, its words, what it is.
    Instruction(u32, Vec<u16>, DisassembledInstruction),
    /// Words that the image fills as if they were erased: first and after the last.
    Erased(u32, u32),
    /// Words that the image does not fill: first and after the last.
    Gap(u32, u32),
}

/// Program memory.
pub(super) struct ProgramMemory {
    chip: &'static Chip,
    words: Vec<u16>,
    /// For each word: the image has something there.
    filled: Vec<bool>,
}

impl ProgramMemory {
    /// The program memory of a chip with an image in it.
    pub(super) fn new(chip: &'static Chip, image: &Image) -> ProgramMemory {
        let size = chip.word_bytes as usize;
        let erased = chip.isa.erased_word.to_le_bytes();
        let mut bytes: Vec<u8> = erased.iter().copied().take(size).cycle().take(chip.flash_bytes as usize).collect();
        image.fill(chip.code_space, &mut bytes);
        let words = bytes.chunks(size).map(|word| word.iter().rev().fold(0, |high, &low| high << 8 | u16::from(low)));
        let mut code = ProgramMemory { chip, words: words.collect(), filled: vec![false; bytes.len() / size] };
        for (addr, _) in image.bytes_in(chip.code_space) {
            if let Some(word) = code.filled.get_mut(addr as usize / size) {
                *word = true;
            }
        }
        code
    }

    /// All pieces from one word to another. Neither an instruction nor an erased stretch reaches into a gap.
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
