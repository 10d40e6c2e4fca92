//! The machine as bytes: [`Cpu::save`] and [`Cpu::restore`].

use std::sync::Arc;

use emu_core::cpu::Cpu;
use emu_core::engine::Looks;
use emu_core::state::{Damaged, State, Tape, load, save};

use crate::cpu::Mcs51;
use crate::hot::Hot;
use crate::turn::SPAN;

impl Mcs51 {
    /// The bytes of this machine.
    pub(crate) fn to_bytes(&self) -> Vec<u8> {
        let mut copy = self.clone();
        let now = copy.cycle();
        copy.soc.settle_down(now);
        save(&mut copy)
    }

    /// This machine as the bytes have it.
    pub(crate) fn of_bytes(&self, bytes: &[u8]) -> Result<Mcs51, Damaged> {
        let mut copy = self.clone();
        load(&mut copy, bytes)?;
        // A state that no machine comes to may be one that it cannot save.
        load(&mut self.clone(), &copy.to_bytes())?;
        Ok(copy)
    }
}

impl State for Mcs51 {
    fn state(&mut self, tape: &mut Tape<'_>) -> Result<(), Damaged> {
        self.hot.state(tape)?;
        tape.memory(&mut self.ram)?;
        if self.part.bus {
            let xdata: &mut [u8; SPAN] = Arc::make_mut(&mut self.xdata);
            tape.memory(xdata)?;
        }
        for (addr, byte) in self.code.changes.pass(&*self.code.bytes, tape)? {
            Arc::make_mut(&mut self.code).poke(addr as u16, byte);
        }
        self.looks = Looks { skip: self.looks.skip, ..Looks::START };
        self.soc.state(tape)
    }
}

/// What the loop has noted for itself is not in it: it finds that again.
impl State for Hot {
    fn state(&mut self, tape: &mut Tape<'_>) -> Result<(), Damaged> {
        let (mut pc, mut psw) = (self.pc as u16, self.psw());
        let mut bytes = [self.acc as u8, self.b as u8, self.sp as u8];
        let mut pointers = [self.dptr as u16, self.other_dptr as u16];
        self.time.state(tape)?;
        // Only the boundary at this very cycle is held.
        let held = tape.flag(self.hold_at == tape.now())?;
        pc.state(tape)?;
        bytes.state(tape)?;
        psw.state(tape)?;
        pointers.state(tape)?;
        let dps = tape.flag(self.dps != 0)?;
        let [acc, b, sp] = bytes.map(u32::from);
        let [dptr, other_dptr] = pointers.map(u32::from);
        let hold_at = if held { tape.now() } else { Hot::START.hold_at };
        *self = Hot {
            time: self.time,
            pc: pc.into(),
            acc,
            b,
            sp,
            dptr,
            other_dptr,
            dps: dps.into(),
            hold_at,
            ..Hot::START
        };
        self.set_psw(psw);
        // P is what A makes it.
        tape.demand(self.psw() == psw)
    }
}
