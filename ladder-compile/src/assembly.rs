//! Writes the image as an assembly source that assembles to the same bytes.
//!
//! `emu asm` accepts it, and so do the usual assemblers of the family: gpasm; as31, and sdas8051 with an
//! absolute area; avr-as.

use std::collections::BTreeSet;
use std::fmt::Write;

use emu_core::chip::{AssemblyWords, Chip, ChipFamily};
use ladder::LadderProgram;

use crate::ap101;
use crate::map::ImageMap;
use crate::target::{BuiltImage, CodeMark, ImageLine};

/// Spelling of directives in the assemblers of a family.
struct AssemblySyntax {
    /// Directive for words of the chip as data.
    data: &'static str,
    /// Directive that sets the address.
    org: &'static str,
    /// First lines of the source; `tail` has the last ones.
    head: String,
    tail: &'static str,
}

/// Column in which comments begin.
const COMMENT_COLUMN: usize = 40;

/// Maximum length of a comment in characters, because some assemblers limit the length of lines.
const MAX_COMMENT_CHARS: usize = 80;

/// Returns the source of `built`, with the elements of `program` as comments.
#[must_use]
pub fn assembly(program: &LadderProgram, chip: &Chip, built: &BuiltImage, map: &ImageMap) -> String {
    let dialect = assembly_syntax(chip);
    let starts: BTreeSet<u32> = built.lines.iter().map(|line| line.addr).collect();
    let labels: BTreeSet<u32> = built.lines.iter().filter_map(|l| l.target).filter(|at| starts.contains(at)).collect();
    let mut out = String::new();
    push_comment(&mut out, &format!("{} for {} at {} Hz", program.file, map.mcu, map.clock_hz));
    map.fuses.iter().for_each(|line| push_comment(&mut out, line));
    out += &dialect.head;
    let mut marks = built.marks.iter().peekable();
    let mut elements = map.elements.iter();
    let mut at = 0;
    for line in &built.lines {
        while let Some((mark, _)) = marks.next_if(|(_, at)| *at <= line.addr) {
            match mark {
                CodeMark::Section(title) => push_comment(&mut out, title),
                CodeMark::Rung(number) => push_comment(&mut out, &format!("rung {}", number + 1)),
                CodeMark::Element(_) => {
                    if let Some(element) = elements.next().filter(|e| e.start != e.end) {
                        push_comment(&mut out, &format!("{}.{} {}", element.rung, element.element, element.text));
                    }
                }
                _ => {}
            }
        }
        if line.addr != at {
            _ = writeln!(out, "    {} 0x{:04X}", dialect.org, chip.code_address(line.addr));
        }
        at = line.addr + line.words.len() as u32;
        if labels.contains(&line.addr) {
            _ = writeln!(out, "{}:", label_name(line.addr));
        }
        push_instruction(&mut out, chip, &dialect, line, &labels);
    }
    for (from, bytes) in data_segments(chip, built) {
        // The AP101 configuration has its own directives.
        if let Some(lines) = Some(bytes).filter(|_| chip.is_bit_controller()).and_then(ap101::config_directives) {
            out += &lines;
            continue;
        }
        _ = writeln!(out, "    {} 0x{:04X}", dialect.org, from / chip.word_bytes);
        for word in bytes.chunks(chip.word_bytes as usize) {
            let word = word.iter().rev().fold(0u16, |high, &low| high << 8 | u16::from(low));
            _ = writeln!(out, "    {} 0x{word:04X}", dialect.data);
        }
    }
    out += dialect.tail;
    out
}

fn assembly_syntax(chip: &Chip) -> AssemblySyntax {
    let AssemblyWords { data, org, is_mpasm, .. } = chip.family_traits().assembly;
    let (head, tail) = match is_mpasm {
        true => (format!("    list p={}\n", chip.name.trim_start_matches("pic")), "    end\n"),
        false => (String::new(), ""),
    };
    AssemblySyntax { data, org, head, tail }
}

/// Segments of the file that are not code: byte address in the file, and bytes.
fn data_segments<'a>(chip: &Chip, built: &'a BuiltImage) -> impl Iterator<Item = (u32, &'a [u8])> {
    let end = built.lines.last().map_or(0, |line| (line.addr + line.words.len() as u32) * chip.word_bytes);
    built.segments.iter().filter(move |(from, _)| *from >= end).map(|(from, bytes)| (*from, &bytes[..]))
}

fn push_comment(out: &mut String, text: &str) {
    let plain: String =
        text.chars().map(|c| if c.is_ascii_graphic() { c } else { ' ' }).take(MAX_COMMENT_CHARS).collect();
    _ = writeln!(out, "; {}", plain.trim_end());
}

fn label_name(at: u32) -> String {
    format!("L{at:04X}")
}

fn push_instruction(out: &mut String, chip: &Chip, dialect: &AssemblySyntax, line: &ImageLine, labels: &BTreeSet<u32>) {
    let digits = chip.word_bytes as usize * 2;
    let words: Vec<String> = line.words.iter().map(|word| format!("0x{word:0digits$X}")).collect();
    if line.text.is_empty() || line.text.starts_with('.') {
        for some in words.chunks(8) {
            _ = writeln!(out, "    {} {}", dialect.data, some.join(", "));
        }
        return;
    }
    let text = line.text.split(';').next().unwrap_or("").trim_end();
    let plain = if chip.family == ChipFamily::Mcs51 { numeric_bit_operands(chip, text) } else { text.to_owned() };
    let text = plain.as_str();
    let text = match line.target.filter(|at| labels.contains(at)) {
        Some(at) => with_target_label(text, &label_name(at)),
        None => text.to_owned(),
    };
    let width = COMMENT_COLUMN - 4;
    _ = writeln!(out, "    {text:<width$}; {:04X}", chip.code_address(line.addr));
}

/// Replaces bit operands such as `0x22.3` or `T2CON.7` by numbers, because not every 8051 assembler accepts
/// both forms.
fn numeric_bit_operands(chip: &Chip, text: &str) -> String {
    let number = |word: &str| -> Option<String> {
        let (byte, bit) = word.split_once('.')?;
        let bit: u32 = bit.parse().ok().filter(|bit| *bit < 8)?;
        let addr = match byte.strip_prefix("0x") {
            Some(hex) => u32::from_str_radix(hex, 16).ok()?,
            None => chip.reg(byte)?.into(),
        };
        let base = if addr < 0x80 { addr.checked_sub(0x20)? * 8 } else { addr };
        Some(format!("0x{:02X}", base + bit))
    };
    let words = text.split_inclusive([' ', ',', '/']);
    words
        .map(|word| {
            let end = word.trim_end_matches([' ', ',', '/']);
            number(end).map_or_else(|| word.to_owned(), |n| n + &word[end.len()..])
        })
        .collect()
}

/// Replaces the last operand of an instruction, the target, by a label.
fn with_target_label(text: &str, label: &str) -> String {
    let before = text.rfind(',').or_else(|| text.find(char::is_whitespace));
    match before {
        Some(at) if text[at..].starts_with(',') => format!("{}, {label}", &text[..at]),
        Some(at) => format!("{} {label}", &text[..at]),
        None => text.to_owned(),
    }
}
