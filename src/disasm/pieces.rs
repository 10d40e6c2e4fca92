//! Program memory cut into instructions, erased stretches and gaps.

use emu_core::chip::Chip;
use emu_core::image::Image;
use emu_core::table::Line;

/// Erased bytes in a row from which on they are no longer printed one by one.
const ERASED: usize = 8;

/// A stretch of program memory.
pub(super) enum Piece {
    /// An instruction: word address, its words, what it is.
    Instruction(u32, Vec<u16>, Line),
    /// Words that the image fills as if they were erased: first and after the last.
    Erased(u32, u32),
    /// Words that the image does not fill: first and after the last.
    Gap(u32, u32),
}

/// Program memory.
pub(super) struct Code {
    chip: &'static Chip,
    words: Vec<u16>,
    /// For each word: the image has something there.
    filled: Vec<bool>,
}

impl Code {
    /// The program memory of a chip with an image in it.
    pub(super) fn new(chip: &'static Chip, image: &Image) -> Code {
        let size = chip.word_bytes as usize;
        let erased = chip.isa.erased.to_le_bytes();
        let mut bytes: Vec<u8> = erased.iter().copied().take(size).cycle().take(chip.flash as usize).collect();
        image.fill(chip.code, &mut bytes);
        let words = bytes.chunks(size).map(|word| word.iter().rev().fold(0, |high, &low| high << 8 | u16::from(low)));
        let mut code = Code { chip, words: words.collect(), filled: vec![false; bytes.len() / size] };
        for (addr, _) in image.bytes_in(chip.code) {
            if let Some(word) = code.filled.get_mut(addr as usize / size) {
                *word = true;
            }
        }
        code
    }

    /// All pieces from one word to another. Neither an instruction nor an erased stretch reaches into a gap.
    pub(super) fn pieces(&self, from: u32, to: u32) -> Vec<Piece> {
        let mut pieces = Vec::new();
        let mut at = from as usize;
        let to = (to as usize).min(self.words.len());
        while at < to {
            let filled = self.filled.get(at) == Some(&true);
            let rest = self.filled.iter().skip(at).take_while(|&&word| word == filled).count();
            let len = if filled { rest } else { rest.min(to - at) };
            let here = self.words.get(at..at + len).unwrap_or_default();
            let erased = here.iter().take(to - at).take_while(|&&word| word == self.chip.isa.erased).count();
            let (piece, len) = if !filled {
                (Piece::Gap(at as u32, (at + len) as u32), len)
            } else if erased * self.chip.word_bytes as usize >= ERASED {
                (Piece::Erased(at as u32, (at + erased) as u32), erased)
            } else {
                let instruction = (self.chip.isa.disassemble)(here, at as u32);
                let len = instruction.len.clamp(1, here.len().max(1));
                let shown = here.get(..len).unwrap_or(here).to_vec();
                (Piece::Instruction(at as u32, shown, instruction), len)
            };
            pieces.push(piece);
            at += len.max(1);
        }
        pieces
    }
}
