//! Program addresses as text: the symbol and the source line of an address, and back.

use emu_core::chip::ChipFamily;
use emu_core::image::{SourceLine, SourceLines};
use emu_core::table::NamedOperand;

use crate::InputError;
use crate::names::address_names::{AddressNames, parse_number};
use crate::names::bit_space::BIT_SPACE;
use crate::run::stop_condition::{StopCondition, parse_condition};

/// Bytes of program memory that GOTO and CALL of a PIC16 reach (2048 words of two bytes).
const PIC16_PAGE_BYTES: u32 = 4096;

/// The information on program addresses.
#[derive(Debug, Clone, Copy)]
pub struct ProgramSource<'a> {
    /// Symbols.
    pub names: AddressNames<'a>,
    /// Source lines.
    pub lines: &'a SourceLines,
}

impl ProgramSource<'_> {
    /// Describes a program word with all that is known: `0x0086 (main+0x4, main.c:12)`.
    #[must_use]
    pub fn describe_word(&self, word: u32) -> String {
        let known: Vec<String> =
            self.names.nearest_symbol(self.byte_address(word)).into_iter().chain(self.line_text(word)).collect();
        let addr = self.names.chip.code_address(word);
        match known.as_slice() {
            [] => format!("0x{addr:04x}"),
            known => format!("0x{addr:04x} ({})", known.join(", ")),
        }
    }

    /// Returns the source line of a program word, `main.c:12`.
    #[must_use]
    pub fn line_text(&self, word: u32) -> Option<String> {
        self.line_at(word).map(|line| format!("{}:{}", line.file, line.line))
    }

    /// Returns the source line of a program word. A line of unknown extent ends with its function.
    #[must_use]
    pub fn line_at(&self, word: u32) -> Option<&SourceLine> {
        let (chip, byte) = (self.names.chip, self.byte_address(word));
        let functions = self.names.symbols.iter().filter(|s| s.space == chip.code_space && s.addr <= byte);
        self.lines.line_at(byte, functions.map(|s| s.addr).max().unwrap_or(0))
    }

    /// Parses program words as [`AddressNames::parse_program_word`] does; or `main.c:12`, the words at which
    /// the code of a source line begins. The result is never empty.
    ///
    /// # Errors
    /// As [`AddressNames::parse_program_word`]; no such file, or a line without code.
    pub fn parse_words(&self, text: &str) -> Result<Vec<u32>, InputError> {
        let Some(NamedLine { file, line }) = split_file_and_line(text) else {
            return Ok(vec![self.names.parse_program_word(text)?]);
        };
        let chip = self.names.chip;
        let places = self.lines.addresses_of_line(file, line)?.into_iter();
        let words = places.filter(|byte| *byte < chip.flash_bytes && byte % chip.word_bytes == 0);
        let words: Vec<u32> = words.map(|byte| byte / chip.word_bytes).collect();
        if words.is_empty() {
            Err(InputError::LineBeyondMemory { text: text.to_owned(), space: chip.code_space })
        } else {
            Ok(words)
        }
    }

    /// Parses a condition as [`parse_condition`] does, or `pc=main.c:12`.
    ///
    /// # Errors
    /// As [`parse_condition`] and [`ProgramSource::parse_words`].
    pub fn parse_condition(&self, text: &str) -> Result<StopCondition, InputError> {
        let place = text.trim().strip_prefix("pc").map(|rest| rest.trim_start_matches([' ', '=']).trim());
        match place.filter(|place| split_file_and_line(place).is_some()) {
            Some(place) => Ok(StopCondition::Line(place.to_owned(), self.parse_words(place)?)),
            None => parse_condition(&self.names, text),
        }
    }

    /// Describes the operands of a disassembled instruction ([its
    /// `operands`](emu_core::table::DisassembledInstruction)): jump targets (`main+0x4`), and objects in RAM
    /// given by address (`buf+0x1`).
    #[must_use]
    pub fn describe_operands(&self, operands: &[NamedOperand]) -> Vec<String> {
        let chip = self.names.chip;
        // GOTO and CALL of a PIC contain a target within a page, and a chip register selects the page.
        let paged = chip.family == ChipFamily::Pic16 && chip.flash_bytes > PIC16_PAGE_BYTES;
        let named = operands.iter().filter_map(|&NamedOperand { kind, value }| {
            let value = u32::try_from(value).ok()?;
            match kind {
                "target" | "target in the page" if !paged => self.names.nearest_symbol(self.byte_address(value)),
                "data address" => self.names.containing_symbol(chip.ram_space, value),
                "direct address" if value < 0x80 => self.names.containing_symbol(chip.ram_space, value),
                "bit address" => self.names.containing_symbol(BIT_SPACE, value),
                _ => None,
            }
        });
        named.collect()
    }

    fn byte_address(&self, word: u32) -> u32 {
        word.saturating_mul(self.names.chip.word_bytes)
    }
}

/// The parts of `main.c:12`.
#[derive(Debug, Clone, Copy)]
struct NamedLine<'a> {
    /// The file.
    file: &'a str,
    /// The line, from 1.
    line: u32,
}

/// Splits `main.c:12`.
fn split_file_and_line(text: &str) -> Option<NamedLine<'_>> {
    let (file, line) = text.trim().rsplit_once(':')?;
    let line = parse_number(line).filter(|_| line.bytes().all(|byte| byte.is_ascii_digit()))?;
    (!file.is_empty()).then_some(NamedLine { file, line })
}
