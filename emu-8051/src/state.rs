//! Saves and restores the state of the machine: [`Cpu::save`] and [`Cpu::restore`].

use std::sync::Arc;

use emu_core::cpu::Cpu;
use emu_core::engine::RunState;
use emu_core::state::{CellWrite, SnapshotDamaged, SnapshotState, StateTape, load_state};

use crate::core_state::CoreRegisters;
use crate::cpu::Mcs51;
use crate::executor::ADDRESS_SPACE;

impl Mcs51 {
    /// A copy of this machine with the state in `bytes`.
    pub(crate) fn restored(&self, bytes: &[u8]) -> Result<Mcs51, SnapshotDamaged> {
        let mut copy = self.clone();
        load_state(&mut copy, bytes)?;
        // Bytes can describe a state that no machine reaches and that cannot be saved again.
        load_state(&mut self.clone(), &copy.save())?;
        Ok(copy)
    }
}

impl SnapshotState for Mcs51 {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        self.core.pass_state(tape)?;
        tape.pass_memory(&mut self.ram)?;
        if self.part.has_bus {
            let xdata: &mut [u8; ADDRESS_SPACE] = Arc::make_mut(&mut self.xdata);
            tape.pass_memory(xdata)?;
        }
        for CellWrite { index: addr, value: byte } in self.code.changes.pass_state(&*self.code.bytes, tape)? {
            Arc::make_mut(&mut self.code).poke(addr as u16, byte);
        }
        self.run_state = RunState { skip_idle_loops: self.run_state.skip_idle_loops, ..RunState::START };
        self.soc.pass_state(tape)
    }
}

/// Requests to the loop around the hot loop are not saved; it sets them again.
impl SnapshotState for CoreRegisters {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        let (mut pc, mut psw) = (self.pc as u16, self.psw());
        let mut bytes = [self.acc as u8, self.b as u8, self.sp as u8];
        let mut pointers = [self.dptr as u16, self.other_dptr as u16];
        self.clock.pass_state(tape)?;
        // An interrupt hold-off matters only at the present cycle.
        let held = tape.pass_flag(self.no_interrupt_at == tape.now())?;
        pc.pass_state(tape)?;
        bytes.pass_state(tape)?;
        psw.pass_state(tape)?;
        pointers.pass_state(tape)?;
        let dps = tape.pass_flag(self.dps != 0)?;
        let [acc, b, sp] = bytes.map(u32::from);
        let [dptr, other_dptr] = pointers.map(u32::from);
        let hold_at = if held { tape.now() } else { CoreRegisters::START.no_interrupt_at };
        *self = CoreRegisters {
            clock: self.clock,
            pc: pc.into(),
            acc,
            b,
            sp,
            dptr,
            other_dptr,
            dps: dps.into(),
            no_interrupt_at: hold_at,
            ..CoreRegisters::START
        };
        self.set_psw(psw);
        // P always follows A.
        tape.require(self.psw() == psw)
    }
}
