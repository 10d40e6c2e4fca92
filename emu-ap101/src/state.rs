//! The machine as bytes: [`Cpu::save`](emu_core::Cpu::save) and [`Cpu::restore`](emu_core::Cpu::restore).

use std::sync::Arc;

use emu_core::state::{Damaged, State, Tape, load, save};

use crate::boundary::Phase;
use crate::cpu::Ap101;
use crate::isa::SPAN;

impl Ap101 {
    /// The bytes of this machine.
    pub(crate) fn to_bytes(&self) -> Vec<u8> {
        save(&mut self.clone())
    }

    /// This machine as the bytes have it.
    pub(crate) fn of_bytes(&self, bytes: &[u8]) -> Result<Ap101, Damaged> {
        let mut copy = self.clone();
        load(&mut copy, bytes)?;
        Ok(copy)
    }
}

impl State for Ap101 {
    fn state(&mut self, tape: &mut Tape<'_>) -> Result<(), Damaged> {
        self.hot.time.state(tape)?;
        self.hot.a.state(tape)?;
        let mut na = (self.hot.na % SPAN as u32) as u16;
        na.state(tape)?;
        tape.demand(usize::from(na) < SPAN)?;
        // A program cycle that has come to its end stands behind it, which may be behind memory.
        let behind = tape.flag(self.hot.na >= SPAN as u32)?;
        self.hot.na = u32::from(na) + if behind { SPAN as u32 } else { 0 };
        tape.demand(self.hot.na <= SPAN as u32)?;
        (self.hot.stop, self.passing) = (false, None);
        for (addr, word) in self.code.changes.pass(&*self.code.words, tape)? {
            Arc::make_mut(&mut self.code).poke(addr as u32, word);
        }
        self.phase.state(tape)?;
        self.ric.state(tape)?;
        self.fetched.state(tape)?;
        self.which.state(tape)?;
        self.current.state(tape)?;
        self.overruns.state(tape)?;
        let programs = self.code.programs.len().max(1);
        tape.demand(self.which < programs && self.current.is_none_or(|which| which < programs))?;
        let now = tape.now();
        let begun = match self.phase {
            Phase::Run { begun } => begun,
            _ => 0,
        };
        // Only a program has instructions.
        tape.demand(self.fetched.is_none() || matches!(self.phase, Phase::Run { .. }))?;
        let sound = match self.phase {
            Phase::Off => true,
            Phase::Reload { from, .. } => from <= now,
            Phase::Ready { at } => at != u64::MAX,
            Phase::Run { begun } => begun <= now,
        };
        tape.demand(sound)?;
        tape.set_now(begun);
        self.soc.state(tape)?;
        tape.set_now(now);
        self.known_state(tape)
    }
}
