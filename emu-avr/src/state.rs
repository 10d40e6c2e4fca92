//! The machine as bytes: [`Cpu::save`] and [`Cpu::restore`].

use std::sync::Arc;

use emu_core::cpu::Cpu;
use emu_core::engine::Looks;
use emu_core::state::{Damaged, State, Tape, load, save};

use crate::cpu::Avr;
use crate::flags::Flags;
use crate::turn::{Hot, RAM};

impl Avr {
    /// The bytes of this machine.
    pub(crate) fn to_bytes(&self) -> Vec<u8> {
        let mut copy = self.clone();
        let now = copy.cycle();
        copy.soc.settle_down(now);
        save(&mut copy)
    }

    /// This machine as the bytes have it.
    pub(crate) fn of_bytes(&self, bytes: &[u8]) -> Result<Avr, Damaged> {
        let mut copy = self.clone();
        load(&mut copy, bytes)?;
        Ok(copy)
    }
}

impl State for Avr {
    fn state(&mut self, tape: &mut Tape<'_>) -> Result<(), Damaged> {
        self.hot.pc &= self.code.mask();
        self.hot.state(tape)?;
        tape.demand(self.hot.pc <= self.code.mask())?;
        let (registers, rest) = self.data.bytes.split_at_mut(RAM);
        tape.all(&mut registers[..32])?;
        tape.memory(&mut rest[..usize::from(self.data.ram_len)])?;
        for (addr, byte) in self.code.changes.pass(&self.code.bytes, tape)? {
            Arc::make_mut(&mut self.code).poke(addr, byte);
        }
        self.soc.state(tape)?;
        self.looks = Looks { skip: self.looks.skip, ..Looks::START };
        tape.demand(self.soc.is_settled(tape.now()))
    }
}

/// What the loop has noted for itself is not in it: it finds that again.
impl State for Hot {
    fn state(&mut self, tape: &mut Tape<'_>) -> Result<(), Damaged> {
        let mut sreg = self.flags.pack();
        self.time.state(tape)?;
        // Only the boundary at this very cycle is held.
        let held = tape.flag(self.hold_at == tape.now())?;
        self.pc.state(tape)?;
        self.sp.state(tape)?;
        sreg.state(tape)?;
        self.sleeping.state(tape)?;
        let hold_at = if held { tape.now() } else { Hot::START.hold_at };
        *self = Hot { flags: Flags::unpack(sreg), hold_at, escape: false, stop: false, ..*self };
        Ok(())
    }
}
