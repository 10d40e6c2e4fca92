//! Program addresses as words: the symbol and the source line of an address, and back.

use emu_core::chip::Family;
use emu_core::image::{LineAt, Lines};

use crate::bits::BIT;
use crate::place::{Names, number};
use crate::until::{Until, until};

/// Bytes of program memory that GOTO and CALL of a PIC16 reach (2048 words of two bytes).
const PAGE: u32 = 4096;

/// What is known of program addresses.
#[derive(Debug, Clone, Copy)]
pub struct Source<'a> {
    /// Symbols.
    pub names: Names<'a>,
    /// Source lines.
    pub lines: &'a Lines,
}

impl Source<'_> {
    /// A program word as a place: `0x0086 (main+0x4, main.c:12)`, with what of it is known.
    #[must_use]
    pub fn place(&self, word: u32) -> String {
        let known: Vec<String> = self.names.near(self.byte(word)).into_iter().chain(self.line(word)).collect();
        let addr = self.names.chip.code_address(word);
        match known.as_slice() {
            [] => format!("0x{addr:04x}"),
            known => format!("0x{addr:04x} ({})", known.join(", ")),
        }
    }

    /// The source line of a program word, `main.c:12`.
    #[must_use]
    pub fn line(&self, word: u32) -> Option<String> {
        self.line_at(word).map(|line| format!("{}:{}", line.file, line.line))
    }

    /// The source line of a program word. Where it is not known how far a line goes, it ends with its function.
    #[must_use]
    pub fn line_at(&self, word: u32) -> Option<&LineAt> {
        let (chip, byte) = (self.names.chip, self.byte(word));
        let functions = self.names.symbols.iter().filter(|s| s.space == chip.code && s.addr <= byte);
        self.lines.at(byte, functions.map(|s| s.addr).max().unwrap_or(0))
    }

    /// The program words that a text stands for, as [`Names::program_word`] has them; also those with which the code of a source
    /// line begins, `main.c:12`, of which there may be several. Never none.
    ///
    /// # Errors
    /// As [`Names::program_word`]; no such file, or a line without code.
    pub fn words(&self, text: &str) -> Result<Vec<u32>, String> {
        let Some((file, line)) = file_and_line(text) else { return Ok(vec![self.names.program_word(text)?]) };
        let chip = self.names.chip;
        let places = self.lines.of(file, line)?.into_iter();
        let words = places.filter(|byte| *byte < chip.flash && byte % chip.word_bytes == 0);
        let words: Vec<u32> = words.map(|byte| byte / chip.word_bytes).collect();
        if words.is_empty() { Err(format!("`{text}` lies beyond {}", chip.code)) } else { Ok(words) }
    }

    /// A condition, as [`until`] reads it, and `pc=main.c:12`.
    ///
    /// # Errors
    /// As [`until`] and [`Source::words`].
    pub fn until(&self, text: &str) -> Result<Until, String> {
        let place = text.trim().strip_prefix("pc").map(|rest| rest.trim_start_matches([' ', '=']).trim());
        match place.filter(|place| file_and_line(place).is_some()) {
            Some(place) => Ok(Until::Line(place.to_owned(), self.words(place)?)),
            None => until(&self.names, text),
        }
    }

    /// What the operands of a disassembled instruction ([`Line::operands`](emu_core::table::Line::operands)) mean in the
    /// program: the places that it goes to (`main+0x4`), and the objects in RAM that it names by address (`buf+0x1`).
    #[must_use]
    pub fn operands(&self, operands: &[(&'static str, i32)]) -> Vec<String> {
        let chip = self.names.chip;
        // GOTO and CALL of a PIC name their target within a page, and a register of the chip chooses that.
        let paged = chip.family == Family::Pic16 && chip.flash > PAGE;
        let named = operands.iter().filter_map(|&(kind, value)| {
            let value = u32::try_from(value).ok()?;
            match kind {
                "target" | "target in the page" if !paged => self.names.near(self.byte(value)),
                "data address" => self.names.object(chip.ram, value),
                "direct address" if value < 0x80 => self.names.object(chip.ram, value),
                "bit address" => self.names.object(BIT, value),
                _ => None,
            }
        });
        named.collect()
    }

    fn byte(&self, word: u32) -> u32 {
        word.saturating_mul(self.names.chip.word_bytes)
    }
}

/// `main.c:12`.
fn file_and_line(text: &str) -> Option<(&str, u32)> {
    let (file, line) = text.trim().rsplit_once(':')?;
    let line = number(line).filter(|_| line.bytes().all(|byte| byte.is_ascii_digit()))?;
    (!file.is_empty()).then_some((file, line))
}
