//! The machine as bytes: [`Cpu::save`] and [`Cpu::restore`].

use std::sync::Arc;

use emu_core::cpu::Cpu;
use emu_core::engine::Looks;
use emu_core::state::{Damaged, State, Tape, load, save};

use crate::cpu::Pic16;
use crate::hot::{Hot, PD, TO};
use crate::lint::Lints;

impl Pic16 {
    /// The bytes of this machine.
    pub(crate) fn to_bytes(&self) -> Vec<u8> {
        let mut copy = self.clone();
        let now = copy.cycle();
        copy.soc.settle_down(now);
        save(&mut copy)
    }

    /// This machine as the bytes have it.
    pub(crate) fn of_bytes(&self, bytes: &[u8]) -> Result<Pic16, Damaged> {
        let mut copy = self.clone();
        load(&mut copy, bytes)?;
        Ok(copy)
    }
}

impl State for Pic16 {
    fn state(&mut self, tape: &mut Tape<'_>) -> Result<(), Damaged> {
        self.hot.state(tape)?;
        tape.memory(&mut self.ram)?;
        self.stack.state(tape)?;
        for (addr, word) in self.code.changes.pass(&*self.code.words, tape)? {
            Arc::make_mut(&mut self.code).poke(addr as u32, word);
        }
        self.looks = Looks { skip: self.looks.skip, ..Looks::START };
        self.lints = Lints::default();
        self.soc.state(tape)
    }
}

/// What the loop has noted for itself is not in it: it finds that again.
impl State for Hot {
    fn state(&mut self, tape: &mut Tape<'_>) -> Result<(), Damaged> {
        let mut pc = self.pc() as u16;
        let mut bytes = [self.w as u8, self.status(), self.pointer as u8, self.pclath as u8, self.sp as u8 & 7];
        self.time.state(tape)?;
        pc.state(tape)?;
        bytes.state(tape)?;
        let [w, status, fsr, pclath, sp] = bytes.map(u32::from);
        tape.demand(pc < 0x2000 && pclath < 0x20 && sp < 8)?;
        *self = Hot {
            time: self.time,
            at: pc.into(),
            w,
            pointer: fsr,
            pclath,
            sp,
            to_pd: status & (TO | PD),
            ..Hot::START
        };
        self.set_status(status);
        Ok(())
    }
}
