//! Saves and restores the state of the machine: [`Cpu::save`](emu_core::Cpu::save) and
//! [`Cpu::restore`](emu_core::Cpu::restore).

use std::sync::Arc;

use emu_core::state::{CellWrite, SnapshotDamaged, SnapshotState, StateTape};

use crate::cpu::Ap101;
use crate::isa::SPAN;
use crate::program_cycle::ProgramPhase;

impl SnapshotState for Ap101 {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        self.core.clock.pass_state(tape)?;
        self.core.a.pass_state(tape)?;
        let mut na = (self.core.next_address % SPAN as u32) as u16;
        na.pass_state(tape)?;
        tape.require(usize::from(na) < SPAN)?;
        // At the end of a program cycle NA is after its last word, which can be after the end of memory.
        let behind = tape.pass_flag(self.core.next_address >= SPAN as u32)?;
        self.core.next_address = u32::from(na) + if behind { SPAN as u32 } else { 0 };
        tape.require(self.core.next_address <= SPAN as u32)?;
        (self.core.stop_requested, self.run_state.breakpoint_to_pass) = (false, None);
        for CellWrite { index: addr, value: word } in self.code.changes.pass_state(&*self.code.words, tape)? {
            Arc::make_mut(&mut self.code).poke(addr as u32, word);
        }
        self.phase.pass_state(tape)?;
        self.ric.pass_state(tape)?;
        self.fetched_word.pass_state(tape)?;
        self.program_index.pass_state(tape)?;
        self.running_program.pass_state(tape)?;
        self.overruns.pass_state(tape)?;
        let programs = self.code.programs.len().max(1);
        tape.require(self.program_index < programs && self.running_program.is_none_or(|which| which < programs))?;
        let now = tape.now();
        let begun = match self.phase {
            ProgramPhase::Run { begun } => begun,
            _ => 0,
        };
        // Only a running program has a fetched instruction.
        tape.require(self.fetched_word.is_none() || matches!(self.phase, ProgramPhase::Run { .. }))?;
        let sound = match self.phase {
            ProgramPhase::NoSupply => true,
            ProgramPhase::Reload { from, .. } => from <= now,
            ProgramPhase::Ready { at } => at != u64::MAX,
            ProgramPhase::Run { begun } => begun <= now,
        };
        tape.require(sound)?;
        tape.set_now(begun);
        self.soc.is_supplied = self.phase != ProgramPhase::NoSupply;
        self.soc.pass_state(tape)?;
        tape.set_now(now);
        self.pass_repetition_state(tape)
    }
}
