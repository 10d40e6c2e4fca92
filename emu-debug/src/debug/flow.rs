//! Which instructions call and which return.

use emu_core::chip::{Chip, Family};

/// What an instruction does to the stack of calls.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Flow {
    /// Nothing.
    Plain,
    /// It calls a subroutine.
    Call,
    /// It returns from one, or from a service routine.
    Return,
}

/// Mnemonics by family, of the instruction tables: calls, then returns. AP101 has neither.
#[rustfmt::skip]
const FLOWS: &[(Family, &[&str], &[&str])] = &[
    (Family::Avr,   &["call", "rcall", "icall", "eicall"], &["ret", "reti"]),
    (Family::Mcs51, &["lcall", "acall"],                   &["ret", "reti"]),
    (Family::Pic16, &["call"],                             &["return", "retlw", "retfie"]),
];

/// `rcall .+0`.
const RCALL_NEXT: u16 = 0xD000;

/// What the instruction at a program word does to the stack of calls, and its length in program words. `word` reads program memory.
#[must_use]
pub fn flow(chip: &Chip, word: impl Fn(u32) -> u16, pc: u32) -> (Flow, u32) {
    let line = (chip.isa.disassemble)(&[word(pc), word(pc + 1), word(pc + 2)], pc);
    let mnemonic = line.row.and_then(|row| chip.isa.rows.get(row)).map_or("", |row| row.mnemonic);
    // Compilers call the next instruction to make room on the stack.
    let room = chip.family == Family::Avr && word(pc) == RCALL_NEXT;
    let of = FLOWS.iter().find(|(family, ..)| *family == chip.family);
    let is = |names: &[&str]| names.iter().any(|name| name.eq_ignore_ascii_case(mnemonic));
    let flow = match of {
        _ if room => Flow::Plain,
        Some((_, calls, _)) if is(calls) => Flow::Call,
        Some((.., returns)) if is(returns) => Flow::Return,
        _ => Flow::Plain,
    };
    (flow, line.len as u32)
}
