//! Steps of a machine as lines of text, or as JSON, one document a line.

use std::collections::HashMap;
use std::io::Write;

use emu_core::chip::{Chip, Family};
use emu_core::cpu::Cpu;

use super::signals::register_bits;
use crate::bits::BIT;
use crate::source::Source;

/// Version of both shapes.
const VERSION: u32 = 1;

/// Column in which what has changed begins.
const CHANGES: usize = 56;

/// Most program words of an instruction.
const WORDS: u32 = 3;

/// Registers that say where the program is, which the line does anyway.
const PLACES: &[&str] = &["PC", "NA", "RIC"];

/// How lines are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// For people.
    Text,
    /// A JSON document a line.
    Json,
}

/// What a step of the machine was.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum What {
    /// The instruction at a program word.
    Instruction(u32),
    /// The entry of an interrupt, by its vector.
    Interrupt(u8),
}

/// An access to data memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Access {
    /// Position of the memory in [`Chip::spaces`].
    pub space: u8,
    /// Address in it.
    pub addr: u16,
    /// The byte.
    pub value: u8,
    /// It was written.
    pub write: bool,
}

/// A step of the machine.
#[derive(Debug, Clone, Copy)]
pub struct Step<'a> {
    /// Machine cycle in which it begins.
    pub at: u64,
    /// What it was.
    pub what: What,
    /// Values of [`Chip::cpu_regs`] before it; empty where they are not known.
    pub before: &'a [u32],
    /// Values behind it.
    pub after: &'a [u32],
    /// Its accesses to data memory, in their order.
    pub accesses: &'a [Access],
}

/// Writes steps as lines. Every program word is disassembled once, and again where it has changed.
#[derive(Debug)]
pub struct Lines<'a> {
    source: Source<'a>,
    chip: &'static Chip,
    format: Format,
    /// Names of the registers that are shown, and their hexadecimal digits; in the order of the chip's registers.
    regs: Vec<Option<(&'static str, usize)>>,
    code: Vec<Option<Code>>,
    places: HashMap<(u8, u16), String>,
}

/// An instruction as it stands in its line.
#[derive(Debug)]
struct Code {
    bytes: Vec<u8>,
    text: String,
}

impl<'a> Lines<'a> {
    /// Lines in a format, with the names of `source`.
    #[must_use]
    pub fn new(source: Source<'a>, format: Format) -> Lines<'a> {
        let chip = source.names.chip;
        let shown = |name: &&'static str| {
            (!PLACES.contains(name)).then(|| (*name, register_bits(chip, name).div_ceil(4) as usize))
        };
        let words = (chip.flash / chip.word_bytes) as usize;
        let code = std::iter::repeat_with(|| None).take(words).collect();
        let regs = chip.cpu_regs.iter().map(shown).collect();
        Lines { source, chip, format, regs, code, places: HashMap::new() }
    }

    /// The head of a trace.
    pub fn head(&self, out: &mut Vec<u8>, hz: u64) {
        let name = self.chip.name;
        let line = match self.format {
            Format::Text => format!("emu-trace {VERSION} mcu={name} hz={hz}\n"),
            Format::Json => format!("{{\"emu-trace\":{VERSION},\"mcu\":\"{name}\",\"hz\":{hz}}}\n"),
        };
        out.extend_from_slice(line.as_bytes());
    }

    /// The end of a trace.
    pub fn end(&self, out: &mut Vec<u8>, cycle: u64, why: &str) {
        let line = match self.format {
            Format::Text => format!("{cycle:>10}  end: {why}\n"),
            Format::Json => format!("{{\"cycle\":{cycle},\"end\":{}}}\n", quoted(why)),
        };
        out.extend_from_slice(line.as_bytes());
    }

    /// The line of a step that the machine has just done.
    pub fn step<C: Cpu>(&mut self, out: &mut Vec<u8>, cpu: &C, step: &Step<'_>) {
        let json = self.format == Format::Json;
        let begin = out.len();
        if json {
            out.extend_from_slice(b"{\"cycle\":");
            decimal(out, step.at, 0);
            out.push(b',');
        } else {
            decimal(out, step.at, 10);
            out.extend_from_slice(b"  ");
        }
        match step.what {
            What::Instruction(pc) => {
                let index = pc as usize;
                if !self.code.get(index).and_then(Option::as_ref).is_some_and(|code| code.stands(cpu, pc)) {
                    let code = self.code(cpu, pc);
                    if let Some(place) = self.code.get_mut(index) {
                        *place = Some(code);
                    }
                }
                match self.code.get(index) {
                    Some(Some(code)) => out.extend_from_slice(code.text.as_bytes()),
                    // Behind the end of program memory.
                    _ => out.extend_from_slice(self.code(cpu, pc).text.as_bytes()),
                }
            }
            What::Interrupt(vector) => {
                let name = interrupt_name(cpu, self.chip, vector);
                // Writing to a vector of bytes does not fail.
                _ = match self.format {
                    Format::Text => write!(out, "interrupt {vector} {name}"),
                    Format::Json => write!(out, "\"interrupt\":{vector},\"name\":{}", quoted(&name)),
                };
            }
        }
        if json {
            self.json_changes(out, step)
        } else {
            self.text_changes(out, begin, step)
        }
        out.push(b'\n');
    }

    fn text_changes(&mut self, out: &mut Vec<u8>, begin: usize, step: &Step<'_>) {
        let mut first = true;
        let mut begin = |out: &mut Vec<u8>| {
            if std::mem::take(&mut first) {
                out.resize(out.len().max(begin + CHANGES), b' ');
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
                hex(out, *new, *digits);
            }
        }
        for access in step.accesses {
            begin(out);
            out.extend_from_slice(if access.write { b"write " } else { b"read " });
            let place = place(&mut self.places, &self.source, self.format, access);
            out.extend_from_slice(place.as_bytes());
            out.push(b'=');
            hex(out, access.value.into(), if is_of_bits(self.chip, access.space) { 1 } else { 2 });
        }
    }

    fn json_changes(&mut self, out: &mut Vec<u8>, step: &Step<'_>) {
        let mut open: &[u8] = b",\"regs\":{\"";
        for (shown, (old, new)) in self.regs.iter().zip(step.before.iter().zip(step.after)) {
            if let Some((name, _)) = shown
                && old != new
            {
                out.extend_from_slice(open);
                open = b",\"";
                out.extend_from_slice(name.as_bytes());
                out.extend_from_slice(b"\":");
                decimal(out, (*new).into(), 0);
            }
        }
        if open == b",\"" {
            out.push(b'}');
        }
        for (i, access) in step.accesses.iter().enumerate() {
            out.extend_from_slice(if i == 0 { b",\"data\":[{" } else { b",{" });
            out.extend_from_slice(if access.write { b"\"write\":" } else { b"\"read\":" });
            let place = place(&mut self.places, &self.source, self.format, access);
            out.extend_from_slice(place.as_bytes());
            out.extend_from_slice(b",\"value\":");
            decimal(out, access.value.into(), 0);
            out.push(b'}');
        }
        if !step.accesses.is_empty() {
            out.push(b']');
        }
        out.push(b'}');
    }

    /// The instruction at a program word: its address, the symbol that it belongs to, and its text.
    fn code<C: Cpu>(&self, cpu: &C, pc: u32) -> Code {
        let chip = self.chip;
        let addr = chip.code_address(pc);
        let byte = pc.saturating_mul(chip.word_bytes);
        let peek = |at: u32| cpu.peek(chip.code, byte + at);
        let bytes: Vec<u8> = (0..WORDS * chip.word_bytes).map_while(peek).collect();
        let word = |bytes: &[u8]| bytes.iter().rev().fold(0, |high, &low| high << 8 | u16::from(low));
        let words: Vec<u16> = bytes.chunks_exact(chip.word_bytes as usize).map(word).collect();
        let line = (chip.isa.disassemble)(&words, pc);
        let text = line.text.split(';').next().unwrap_or_default().trim();
        let near = self.source.names.near(byte);
        let text = match (self.format, near) {
            (Format::Text, Some(near)) => format!("0x{addr:04x} <{near}>  {text}"),
            (Format::Text, None) => format!("0x{addr:04x}  {text}"),
            (Format::Json, Some(near)) => format!("\"addr\":{addr},\"at\":{},\"text\":{}", quoted(&near), quoted(text)),
            (Format::Json, None) => format!("\"addr\":{addr},\"text\":{}", quoted(text)),
        };
        let len = line.len.max(1) * chip.word_bytes as usize;
        Code { bytes: bytes.into_iter().take(len).collect(), text }
    }
}

impl Code {
    /// Program memory still holds it.
    fn stands<C: Cpu>(&self, cpu: &C, pc: u32) -> bool {
        let chip = cpu.chip();
        let byte = pc.saturating_mul(chip.word_bytes);
        (byte..).zip(&self.bytes).all(|(at, held)| cpu.peek(chip.code, at) == Some(*held))
    }
}

/// The place of an access, made once.
fn place<'p>(
    places: &'p mut HashMap<(u8, u16), String>,
    source: &Source<'_>,
    format: Format,
    access: &Access,
) -> &'p str {
    places.entry((access.space, access.addr)).or_insert_with(|| {
        let chip = source.names.chip;
        let (space, addr) = (chip.spaces.get(usize::from(access.space)), u32::from(access.addr));
        let &(space, size, _) = space.unwrap_or(&("?", 0, 1));
        let digits = if size > 0x100 { 4 } else { 2 };
        let regs = if space == BIT { chip.bits } else { chip.regs };
        let named = space == BIT || space == chip.reg_space && chip.family != Family::Ap101;
        let reg = || regs.iter().find(|reg| named && reg.addr == access.addr).map(|reg| reg.name.to_owned());
        let name = source.names.object(space, addr).or_else(reg);
        match (format, name) {
            (Format::Text, Some(name)) => format!("{space}:0x{addr:0digits$x}({name})"),
            (Format::Text, None) => format!("{space}:0x{addr:0digits$x}"),
            (Format::Json, Some(name)) => format!("\"{space}\",\"addr\":{addr},\"name\":{}", quoted(&name)),
            (Format::Json, None) => format!("\"{space}\",\"addr\":{addr}"),
        }
    })
}

/// An address of this memory holds a single bit.
fn is_of_bits(chip: &Chip, space: u8) -> bool {
    let space = chip.spaces.get(usize::from(space));
    space.is_some_and(|&(name, _, width)| name == BIT || chip.family == Family::Ap101 && width == 1)
}

/// A text as a JSON string.
fn quoted(text: &str) -> String {
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

/// A number in so many hexadecimal digits, more where it has more.
fn hex(out: &mut Vec<u8>, value: u32, digits: usize) {
    let needed = (8 - value.leading_zeros() as usize / 4).max(digits).max(1);
    for digit in (0..needed.min(8)).rev() {
        let digit = (value >> (4 * digit) & 15) as u8;
        out.push(if digit < 10 { b'0' + digit } else { b'a' + digit - 10 });
    }
}

/// A decimal number, with spaces before it up to a width.
fn decimal(out: &mut Vec<u8>, value: u64, width: usize) {
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

/// What has interrupted, by name: that of the vector, or where several sources share it those of all flags that are set and enabled.
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
            hex(&mut out, value, digits);
            assert_eq!(String::from_utf8_lossy(&out), wanted);
        }
        for (value, width, wanted) in
            [(0, 0, "0"), (7, 3, "  7"), (1234, 3, "1234"), (u64::MAX, 9, "18446744073709551615")]
        {
            let mut out = Vec::new();
            decimal(&mut out, value, width);
            assert_eq!(String::from_utf8_lossy(&out), wanted);
        }
        assert_eq!(quoted("a\"b\\\n"), "\"a\\\"b\\\\\\u000a\"");
    }
}
