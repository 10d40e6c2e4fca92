//! Classifies calls and returns.

use emu_core::chip::{Chip, ChipFamily};

/// What an instruction does to the call stack.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CallFlow {
    /// Nothing.
    Plain,
    /// Calls a subroutine.
    Call,
    /// Returns from a subroutine or an interrupt service routine.
    Return,
}

/// Mnemonics per family, from the instruction tables: calls, then returns. AP101 has neither.
#[rustfmt::skip]
const CALL_MNEMONICS: &[(ChipFamily, &[&str], &[&str])] = &[
    (ChipFamily::Avr,   &["call", "rcall", "icall", "eicall"], &["ret", "reti"]),
    (ChipFamily::Mcs51, &["lcall", "acall"],                   &["ret", "reti"]),
    (ChipFamily::Pic16, &["call"],                             &["return", "retlw", "retfie"]),
];

/// `rcall .+0`.
const RCALL_NEXT: u16 = 0xD000;

/// Returns what the instruction at a program word does to the call stack, and its length in program words.
/// `word` reads program memory.
#[must_use]
pub fn call_flow(chip: &Chip, word: impl Fn(u32) -> u16, pc: u32) -> (CallFlow, u32) {
    let line = (chip.isa.disassemble)(&[word(pc), word(pc + 1), word(pc + 2)], pc);
    let mnemonic = line.row.and_then(|row| chip.isa.rows.get(row)).map_or("", |row| row.mnemonic);
    // Compilers call the next instruction to allocate space on the stack.
    let room = chip.family == ChipFamily::Avr && word(pc) == RCALL_NEXT;
    let of = CALL_MNEMONICS.iter().find(|(family, ..)| *family == chip.family);
    let is = |names: &[&str]| names.iter().any(|name| name.eq_ignore_ascii_case(mnemonic));
    let flow = match of {
        _ if room => CallFlow::Plain,
        Some((_, calls, _)) if is(calls) => CallFlow::Call,
        Some((.., returns)) if is(returns) => CallFlow::Return,
        _ => CallFlow::Plain,
    };
    (flow, line.len as u32)
}
