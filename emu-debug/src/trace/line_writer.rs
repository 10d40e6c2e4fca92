//! Writes steps of a machine as lines of text, or as JSON with one document per line.

use std::collections::HashMap;
use std::io::Write;

use emu_core::chip::{Chip, ChipSpace};
use emu_core::cpu::Cpu;

use super::signals::register_bits;
use crate::names::bit_space::BIT_SPACE;
use crate::names::program_source::ProgramSource;

/// Version of both formats.
const VERSION: u32 = 1;

/// Column at which the changes begin.
const CHANGES_COLUMN: usize = 56;

/// Maximum number of program words of an instruction.
const MAX_INSTRUCTION_WORDS: u32 = 3;

/// Registers with the program's location, which the line shows anyway.
const POSITION_REGISTERS: &[&str] = &["PC", "NA", "RIC"];

/// The format of lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TraceFormat {
    /// For humans.
    Text,
    /// One JSON document per line.
    Json,
}

/// The kind of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TraceEventKind {
    /// The instruction at a program word.
    Instruction(u32),
    /// The entry of an interrupt, by its vector.
    Interrupt(u8),
}

/// An access to data memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TracedAccess {
    /// Position of the memory in [`Chip::spaces`].
    pub space: u8,
    /// Address in the memory.
    pub addr: u16,
    /// The byte.
    pub value: u8,
    /// Whether it was written.
    pub write: bool,
}

/// A step of the machine.
#[derive(Debug, Clone, Copy)]
pub struct TraceLine<'a> {
    /// Machine cycle in which it begins.
    pub at: u64,
    /// Its kind.
    pub kind: TraceEventKind,
    /// Values of [`Chip::cpu_regs`] before the step; empty if they are not known.
    pub before: &'a [u32],
    /// Values after the step.
    pub after: &'a [u32],
    /// Its accesses to data memory, in order.
    pub accesses: &'a [TracedAccess],
}

/// Writes steps as lines. Every program word is disassembled once, and again after it has changed.
#[derive(Debug)]
pub struct TraceLineWriter<'a> {
    source: ProgramSource<'a>,
    chip: &'static Chip,
    format: TraceFormat,
    /// Names and hexadecimal digits of the registers that are shown, in the order of the chip's registers.
    regs: Vec<Option<(&'static str, usize)>>,
    code: Vec<Option<CachedInstruction>>,
    places: HashMap<PlaceKey, String>,
}

/// An instruction as printed in its line.
#[derive(Debug)]
struct CachedInstruction {
    bytes: Vec<u8>,
    text: String,
}

impl<'a> TraceLineWriter<'a> {
    /// Returns a writer for a format, with the names of `source`.
    #[must_use]
    pub fn new(source: ProgramSource<'a>, format: TraceFormat) -> TraceLineWriter<'a> {
        let chip = source.names.chip;
        let shown = |name: &&'static str| {
            (!POSITION_REGISTERS.contains(name)).then(|| (*name, register_bits(chip, name).div_ceil(4) as usize))
        };
        let words = (chip.flash_bytes / chip.word_bytes) as usize;
        let code = std::iter::repeat_with(|| None).take(words).collect();
        let regs = chip.cpu_regs.iter().map(shown).collect();
        TraceLineWriter { source, chip, format, regs, code, places: HashMap::new() }
    }

    /// Writes the header of a trace.
    pub fn write_header(&self, out: &mut Vec<u8>, hz: u64) {
        let name = self.chip.name;
        let line = match self.format {
            TraceFormat::Text => format!("emu-trace {VERSION} mcu={name} hz={hz}\n"),
            TraceFormat::Json => format!("{{\"emu-trace\":{VERSION},\"mcu\":\"{name}\",\"hz\":{hz}}}\n"),
        };
        out.extend_from_slice(line.as_bytes());
    }

    /// Writes the end of a trace.
    pub fn write_end(&self, out: &mut Vec<u8>, cycle: u64, why: &str) {
        let line = match self.format {
            TraceFormat::Text => format!("{cycle:>10}  end: {why}\n"),
            TraceFormat::Json => format!("{{\"cycle\":{cycle},\"end\":{}}}\n", quote_json(why)),
        };
        out.extend_from_slice(line.as_bytes());
    }

    /// Writes the line of a step that the machine has just executed.
    pub fn write_step<C: Cpu>(&mut self, out: &mut Vec<u8>, cpu: &C, step: &TraceLine<'_>) {
        let json = self.format == TraceFormat::Json;
        let begin = out.len();
        if json {
            out.extend_from_slice(b"{\"cycle\":");
            write_decimal(out, step.at, 0);
            out.push(b',');
        } else {
            write_decimal(out, step.at, 10);
            out.extend_from_slice(b"  ");
        }
        match step.kind {
            TraceEventKind::Instruction(pc) => {
                let index = pc as usize;
                if !self.code.get(index).and_then(Option::as_ref).is_some_and(|code| code.is_current(cpu, pc)) {
                    let code = self.disassemble_at(cpu, pc);
                    if let Some(place) = self.code.get_mut(index) {
                        *place = Some(code);
                    }
                }
                match self.code.get(index) {
                    Some(Some(code)) => out.extend_from_slice(code.text.as_bytes()),
                    // After the end of program memory.
                    _ => out.extend_from_slice(self.disassemble_at(cpu, pc).text.as_bytes()),
                }
            }
            TraceEventKind::Interrupt(vector) => {
                let name = interrupt_name(cpu, self.chip, vector);
                // Writing to a vector of bytes does not fail.
                _ = match self.format {
                    TraceFormat::Text => write!(out, "interrupt {vector} {name}"),
                    TraceFormat::Json => write!(out, "\"interrupt\":{vector},\"name\":{}", quote_json(&name)),
                };
            }
        }
        if json {
            self.write_json_changes(out, step)
        } else {
            self.write_text_changes(out, begin, step)
        }
        out.push(b'\n');
    }

    fn write_text_changes(&mut self, out: &mut Vec<u8>, begin: usize, step: &TraceLine<'_>) {
        let mut first = true;
        let mut begin = |out: &mut Vec<u8>| {
            if std::mem::take(&mut first) {
                out.resize(out.len().max(begin + CHANGES_COLUMN), b' ');
                out.push(b';');
            }
            out.push(b' ');
        };
        for (shown, (old, new)) in self.regs.iter().zip(step.before.iter().zip(step.after)) {
            if let Some((name, digits)) = shown
                && old != new
            {
                begin(out);
                out.extend_from_slice(name.as_bytes());
                out.push(b'=');
                write_hex(out, *new, *digits);
            }
        }
        for access in step.accesses {
            begin(out);
            out.extend_from_slice(if access.write { b"write " } else { b"read " });
            let place = place_name(&mut self.places, &self.source, self.format, access);
            out.extend_from_slice(place.as_bytes());
            out.push(b'=');
            write_hex(out, access.value.into(), if is_bit_space(self.chip, access.space) { 1 } else { 2 });
        }
    }

    fn write_json_changes(&mut self, out: &mut Vec<u8>, step: &TraceLine<'_>) {
        let mut open: &[u8] = b",\"regs\":{\"";
        for (shown, (old, new)) in self.regs.iter().zip(step.before.iter().zip(step.after)) {
            if let Some((name, _)) = shown
                && old != new
            {
                out.extend_from_slice(open);
                open = b",\"";
                out.extend_from_slice(name.as_bytes());
                out.extend_from_slice(b"\":");
                write_decimal(out, (*new).into(), 0);
            }
        }
        if open == b",\"" {
            out.push(b'}');
        }
        for (i, access) in step.accesses.iter().enumerate() {
            out.extend_from_slice(if i == 0 { b",\"data\":[{" } else { b",{" });
            out.extend_from_slice(if access.write { b"\"write\":" } else { b"\"read\":" });
            let place = place_name(&mut self.places, &self.source, self.format, access);
            out.extend_from_slice(place.as_bytes());
            out.extend_from_slice(b",\"value\":");
            write_decimal(out, access.value.into(), 0);
            out.push(b'}');
        }
        if !step.accesses.is_empty() {
            out.push(b']');
        }
        out.push(b'}');
    }

    /// Returns the instruction at a program word: its address, its symbol, and its text.
    fn disassemble_at<C: Cpu>(&self, cpu: &C, pc: u32) -> CachedInstruction {
        let chip = self.chip;
        let addr = chip.code_address(pc);
        let byte = pc.saturating_mul(chip.word_bytes);
        let peek = |at: u32| cpu.peek(chip.code_space, byte + at);
        let bytes: Vec<u8> = (0..MAX_INSTRUCTION_WORDS * chip.word_bytes).map_while(peek).collect();
        let word = |bytes: &[u8]| bytes.iter().rev().fold(0, |high, &low| high << 8 | u16::from(low));
        let words: Vec<u16> = bytes.chunks_exact(chip.word_bytes as usize).map(word).collect();
        let line = (chip.isa.disassemble)(&words, pc);
        let text = line.text.split(';').next().unwrap_or_default().trim();
        let near = self.source.names.nearest_symbol(byte);
        let text = match (self.format, near) {
            (TraceFormat::Text, Some(near)) => format!("0x{addr:04x} <{near}>  {text}"),
            (TraceFormat::Text, None) => format!("0x{addr:04x}  {text}"),
            (TraceFormat::Json, Some(near)) => {
                format!("\"addr\":{addr},\"at\":{},\"text\":{}", quote_json(&near), quote_json(text))
            }
            (TraceFormat::Json, None) => format!("\"addr\":{addr},\"text\":{}", quote_json(text)),
        };
        let len = line.len.max(1) * chip.word_bytes as usize;
        CachedInstruction { bytes: bytes.into_iter().take(len).collect(), text }
    }
}

impl CachedInstruction {
    /// Returns true if program memory still contains it.
    fn is_current<C: Cpu>(&self, cpu: &C, pc: u32) -> bool {
        let chip = cpu.chip();
        let byte = pc.saturating_mul(chip.word_bytes);
        (byte..).zip(&self.bytes).all(|(at, cached)| cpu.peek(chip.code_space, at) == Some(*cached))
    }
}

/// The memory and the address of an access.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct PlaceKey {
    space: u8,
    addr: u16,
}

/// Returns the location text of an access; it is formatted once.
fn place_name<'p>(
    places: &'p mut HashMap<PlaceKey, String>,
    source: &ProgramSource<'_>,
    format: TraceFormat,
    access: &TracedAccess,
) -> &'p str {
    places.entry(PlaceKey { space: access.space, addr: access.addr }).or_insert_with(|| {
        let chip = source.names.chip;
        let (space, addr) = (chip.spaces.get(usize::from(access.space)), u32::from(access.addr));
        let &ChipSpace { name: space, size, .. } = space.unwrap_or(&ChipSpace { name: "?", size: 0, width: 1 });
        let digits = if size > 0x100 { 4 } else { 2 };
        let regs = if space == BIT_SPACE { chip.bits } else { chip.regs };
        let named = space == BIT_SPACE || space == chip.reg_space && !chip.is_bit_controller();
        let reg = || regs.iter().find(|reg| named && reg.addr == access.addr).map(|reg| reg.name.to_owned());
        let name = source.names.containing_symbol(space, addr).or_else(reg);
        match (format, name) {
            (TraceFormat::Text, Some(name)) => format!("{space}:0x{addr:0digits$x}({name})"),
            (TraceFormat::Text, None) => format!("{space}:0x{addr:0digits$x}"),
            (TraceFormat::Json, Some(name)) => format!("\"{space}\",\"addr\":{addr},\"name\":{}", quote_json(&name)),
            (TraceFormat::Json, None) => format!("\"{space}\",\"addr\":{addr}"),
        }
    })
}

/// Returns true if an address of this memory is a single bit.
fn is_bit_space(chip: &Chip, space: u8) -> bool {
    let space = chip.spaces.get(usize::from(space));
    space.is_some_and(|&ChipSpace { name, width, .. }| name == BIT_SPACE || chip.is_bit_controller() && width == 1)
}

/// Returns a text as a JSON string.
fn quote_json(text: &str) -> String {
    let mut out = String::from('"');
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if u32::from(c) < 0x20 => out.push_str(&format!("\\u{:04x}", u32::from(c))),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

/// Writes a number with at least this many hexadecimal digits.
fn write_hex(out: &mut Vec<u8>, value: u32, digits: usize) {
    let needed = (8 - value.leading_zeros() as usize / 4).max(digits).max(1);
    for digit in (0..needed.min(8)).rev() {
        let digit = (value >> (4 * digit) & 15) as u8;
        out.push(if digit < 10 { b'0' + digit } else { b'a' + digit - 10 });
    }
}

/// Writes a decimal number, padded with spaces to a width.
fn write_decimal(out: &mut Vec<u8>, value: u64, width: usize) {
    let (mut digits, mut at, mut rest) = ([b' '; 20], 20, value);
    loop {
        at -= 1;
        digits[at] = b'0' + (rest % 10) as u8;
        rest /= 10;
        if rest == 0 {
            break;
        }
    }
    out.extend_from_slice(&digits[at.min(20 - width.min(20))..]);
}

/// Returns the name of an interrupt: that of the vector, or if several sources share it, of all flags that
/// are set and enabled.
fn interrupt_name<C: Cpu>(cpu: &C, chip: &Chip, vector: u8) -> String {
    let flags = cpu.interrupt_flags();
    if flags.is_empty() {
        return chip.vectors.get(usize::from(vector)).copied().unwrap_or_default().to_owned();
    }
    flags.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_texts() {
        let hexes = [(0, 1, "0"), (0, 2, "00"), (0x1F, 2, "1f"), (0x100, 2, "100"), (u32::MAX, 2, "ffffffff")];
        for (value, digits, wanted) in hexes {
            let mut out = Vec::new();
            write_hex(&mut out, value, digits);
            assert_eq!(String::from_utf8_lossy(&out), wanted);
        }
        for (value, width, wanted) in
            [(0, 0, "0"), (7, 3, "  7"), (1234, 3, "1234"), (u64::MAX, 9, "18446744073709551615")]
        {
            let mut out = Vec::new();
            write_decimal(&mut out, value, width);
            assert_eq!(String::from_utf8_lossy(&out), wanted);
        }
        assert_eq!(quote_json("a\"b\\\n"), "\"a\\\"b\\\\\\u000a\"");
    }
}
