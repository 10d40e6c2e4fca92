//! Classifies calls and returns.

use emu_core::chip::Chip;

use super::dyn_machine::DynMachine;
use super::session;

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

/// A call in a program.
#[derive(Debug, Clone, Copy)]
pub(super) struct CallInstruction {
    /// The program word of the call.
    pub at: u32,
    /// Its destination, if the instruction contains it.
    pub goal: Option<u32>,
}

/// Returns the call directly before a program word, and its destination, if the instruction contains it.
pub(super) fn call_before(machine: &dyn DynMachine, word: u32) -> Option<CallInstruction> {
    const LONGEST: u32 = 3;
    let chip = machine.chip();
    if word >= chip.flash_bytes / chip.word_bytes.max(1) {
        return None;
    }
    let read = |word| session::program_word_at(machine, word);
    (1..=LONGEST).find_map(|len| {
        let at = word.checked_sub(len)?;
        if call_flow(chip, read, at) != (InstructionFlow { flow: CallFlow::Call, words: len }) {
            return None;
        }
        let line = (chip.isa.disassemble)(&[read(at), read(at + 1), read(at + 2)], at);
        let goal = line.operands.iter().find(|operand| operand.kind == "target").map(|operand| operand.value);
        Some(CallInstruction { at, goal: goal.and_then(|goal| u32::try_from(goal).ok()) })
    })
}
