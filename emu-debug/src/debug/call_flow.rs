//! Classifies calls and returns.

use emu_core::chip::Chip;

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

/// What an instruction does to the call stack.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InstructionFlow {
    /// The effect on the call stack.
    pub flow: CallFlow,
    /// The length of the instruction in program words.
    pub words: u32,
}

/// Returns what the instruction at a program word does to the call stack, and its length in program words.
/// `word` reads program memory.
#[must_use]
pub fn call_flow(chip: &Chip, word: impl Fn(u32) -> u16, pc: u32) -> InstructionFlow {
    let line = (chip.isa.disassemble)(&[word(pc), word(pc + 1), word(pc + 2)], pc);
    let mnemonic = line.row.and_then(|row| chip.isa.rows.get(row)).map_or("", |row| row.mnemonic);
    // Compilers call the next instruction to allocate space on the stack.
    let family = chip.family_traits();
    let room = family.stack_allocation == Some(word(pc));
    let is = |names: &[&str]| names.iter().any(|name| name.eq_ignore_ascii_case(mnemonic));
    let flow = match () {
        () if room => CallFlow::Plain,
        () if is(family.calls) => CallFlow::Call,
        () if is(family.returns) => CallFlow::Return,
        () => CallFlow::Plain,
    };
    InstructionFlow { flow, words: line.len as u32 }
}
