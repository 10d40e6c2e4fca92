//! Prints the instructions of an image as text that assembles back to the same image.
//!
//! Each line begins with an instruction or directive. A comment gives its address, its words and the names of
//! its operands.

use std::collections::HashSet;

use emu_core::chip::Chip;
use emu_core::image::{Image, SymbolAt, WordBits};
use emu_core::table::DisassembledInstruction;
use emu_debug::{AddressNames, ProgramSource};

use super::config::directives;
use super::listing::SourceLineListing;
use super::pieces::CodePiece;

/// Column in which comments begin.
const COMMENT_COLUMN: usize = 32;

/// Bytes per line for memories other than program memory.
const BYTES_PER_LINE: usize = 8;

/// The output text.
pub(super) struct AssemblableText<'a> {
    chip: &'static Chip,
    source: &'a ProgramSource<'a>,
    out: String,
    /// Labels that the text defines, in lower case.
    defined_labels: HashSet<String>,
    /// The word address at which the assembler continues.
    next_word: u32,
}

impl<'a> AssemblableText<'a> {
    /// Creates an empty text.
    pub(super) fn new(source: &'a ProgramSource<'a>) -> AssemblableText<'a> {
        let chip = source.names.chip;
        AssemblableText { chip, source, out: String::new(), defined_labels: HashSet::new(), next_word: 0 }
    }

    /// Returns the text.
    pub(super) fn finish(self) -> String {
        self.out
    }

    /// Writes program memory.
    pub(super) fn program(&mut self, pieces: &[CodePiece], mut listing: Option<SourceLineListing<'_>>) {
        for (i, piece) in pieces.iter().enumerate() {
            match piece {
                CodePiece::Gap(from, to) if i + 1 == pieces.len() => {
                    let erased = self.erased(*from, *to);
                    self.out.push_str(&format!("; {erased}\n"));
                }
                CodePiece::Gap(from, to) => {
                    let erased = self.erased(*from, *to);
                    self.org(*to, &erased);
                }
                CodePiece::Erased(from, to) => {
                    self.advance_to(*from);
                    let erased = self.erased(*from, *to);
                    self.line(&format!(".rept 0x{:X}", to - from), &erased);
                    let (word, digits) = (self.word(), self.digits());
                    self.line(&format!("{word} 0x{:0digits$X}", self.chip.isa.erased_word), "");
                    self.line(".endr", "");
                    self.next_word = *to;
                }
                CodePiece::Instruction(at, words, line) => {
                    self.advance_to(*at);
                    self.labels(*at, words.len());
                    let heading = listing.as_mut().and_then(|listing| listing.heading(*at, self.source));
                    self.out.push_str(&heading.unwrap_or_default());
                    self.instruction(*at, words, line);
                    self.next_word = at + words.len() as u32;
                }
            }
        }
    }

    /// Writes the contents of memories other than program memory: at their addresses in the HEX file, or in
    /// sections if the HEX file has no place for them. Bytes of RAM, which an ELF file may contain, become
    /// comments.
    pub(super) fn memories(&mut self, image: &Image) {
        for segment in image.segments.iter().filter(|segment| segment.space != self.chip.code_space) {
            if let Some(lines) = directives(self.chip, segment) {
                lines.iter().for_each(|line| self.line(line, ""));
                continue;
            }
            let window = self.chip.hex_spaces.iter().find(|space| space.name == segment.space);
            let ram = segment.space == self.chip.ram_space;
            let unit = if window.is_some() { self.chip.bytes_per_address(self.chip.code_space) } else { 1 };
            let at = (window.map_or(0, |space| space.start) + segment.addr) / unit;
            if window.is_none() && !ram {
                self.line(&format!(".section .{}", segment.space), "");
            }
            if !ram {
                self.line(&format!(".org 0x{at:04X}{}", self.filler()), segment.space);
            }
            let mask = match window.map(|space| space.word_bits) {
                Some(WordBits::Low(bits)) => (1 << bits) - 1,
                _ => u16::MAX,
            };
            for (i, bytes) in segment.bytes.chunks(BYTES_PER_LINE).enumerate() {
                let text = values(bytes, unit, mask);
                let addr = at + (i * BYTES_PER_LINE) as u32 / unit;
                if ram {
                    self.out.push_str(&format!("; {addr:04X}  {}  {text}\n", segment.space));
                } else {
                    self.line(&text, &format!("{addr:04X}  {}", segment.space));
                }
            }
        }
    }

    /// Writes a line of source with a comment.
    fn line(&mut self, text: &str, comment: &str) {
        let width = COMMENT_COLUMN - 4;
        let line = if comment.is_empty() { format!("    {text}") } else { format!("    {text:<width$}; {comment}") };
        self.out.push_str(line.trim_end());
        self.out.push('\n');
    }

    fn org(&mut self, word: u32, comment: &str) {
        self.line(&format!(".org 0x{:04X}{}", self.chip.code_address(word), self.filler()), comment);
        self.next_word = word;
    }

    /// Returns the filler for an `.org`. On AVR `.org` fills the skipped bytes with zeros by default; the
    /// erased value as filler leaves them unchanged.
    fn filler(&self) -> &'static str {
        self.chip.family_traits().assembly.filler
    }

    /// Writes an `.org` unless the assembler is already at this word.
    fn advance_to(&mut self, word: u32) {
        if self.next_word != word {
            self.org(word, "");
        }
    }

    /// Returns the directive for one raw program word.
    fn word(&self) -> &'static str {
        if self.chip.word_bytes == 1 { ".db" } else { ".word" }
    }

    fn digits(&self) -> usize {
        self.chip.word_bytes as usize * 2
    }

    fn erased(&self, from: u32, to: u32) -> String {
        let (from, to) = (self.chip.code_address(from), self.chip.code_address(to));
        let unit = if self.chip.bytes_per_address(self.chip.code_space) == 1 { "bytes" } else { "words" };
        format!("{from:04X} to {:04X} erased, {} {unit}", to - 1, to - from)
    }

    /// Writes the labels of an instruction's words. A name that the assembler would read as something else,
    /// or that is inside the instruction, becomes a comment.
    fn labels(&mut self, word: u32, len: usize) {
        let start = self.chip.code_address(word);
        for symbol in labels_at(&self.source.names, word, len) {
            // The label has the linker's name; a demangled C++ name becomes a comment.
            let name = symbol.linkage_name();
            let meant = if symbol.mangled.is_some() { format!("  ; {}", symbol.name) } else { String::new() };
            let line = match symbol.addr - word * self.chip.word_bytes {
                0 if self.label(name) => format!("{name}:{meant}\n"),
                0 => format!("; {name}:\n"),
                within => format!("; {name} = {start:04X} + {within}\n"),
            };
            self.out.push_str(&line);
        }
    }

    /// Returns true if the name can be a label, and records it as defined.
    fn label(&mut self, name: &str) -> bool {
        is_identifier(name)
            && !emu_asm::is_taken(self.chip, name)
            && self.defined_labels.insert(name.to_ascii_lowercase())
    }

    fn instruction(
        &mut self,
        at: u32,
        words: &[u16],
        DisassembledInstruction { text, operands, .. }: &DisassembledInstruction,
    ) {
        let digits = self.digits();
        let hex: Vec<String> = words.iter().map(|word| format!("{word:0digits$X}")).collect();
        let (text, why) = text.split_once(';').unwrap_or((text, ""));
        let mut meant = self.source.describe_operands(operands);
        meant.extend((!why.is_empty()).then(|| why.trim().to_owned()));
        // On AP101 a program may contain words that no source can produce, such as one that sets an input.
        // For other families the tests of the instruction tables cover every word.
        let back = !self.chip.is_bit_controller()
            || emu_asm::assemble_line(self.chip, text, at).is_ok_and(|back| back == words);
        let text = if back {
            text.to_owned()
        } else {
            meant.insert(0, text.trim_end().to_owned());
            let all: Vec<String> = words.iter().map(|word| format!("0x{word:0digits$x}")).collect();
            format!("{} {}", self.word(), all.join(", "))
        };
        let comment = format!("{:04X}  {:<9}  {}", self.chip.code_address(at), hex.join(" "), meant.join(", "));
        self.line(text.trim_end(), comment.trim_end());
    }
}

/// Returns the directive for some bytes, `unit` bytes per address. The memory keeps only the bits in `mask`.
fn values(bytes: &[u8], unit: u32, mask: u16) -> String {
    let (directive, digits) = if unit == 2 { (".word", 4) } else { (".byte", 2) };
    let words = bytes.chunks(unit.max(1) as usize);
    let words = words.map(|word| word.iter().rev().fold(0, |high, &low| high << 8 | u16::from(low)));
    let words: Vec<String> = words.map(|word| format!("0x{:0digits$X}", word & mask)).collect();
    format!("{directive} {}", words.join(", "))
}

/// Returns the symbols at the words of an instruction.
pub(super) fn labels_at<'a>(
    names: &AddressNames<'a>,
    word: u32,
    len: usize,
) -> impl Iterator<Item = &'a SymbolAt> + use<'a> {
    let (code, size) = (names.chip.code_space, names.chip.word_bytes);
    let (start, end) = (word * size, (word + len as u32) * size);
    names.symbols.iter().filter(move |s| s.space == code && (start..end).contains(&s.addr))
}

/// Returns true for a name that every dialect accepts as an identifier.
fn is_identifier(name: &str) -> bool {
    let first = name.bytes().next().is_some_and(|byte| byte.is_ascii_alphabetic() || byte == b'_');
    first && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_')
}
