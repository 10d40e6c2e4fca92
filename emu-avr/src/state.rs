//! Snapshots of the machine as bytes: [`Cpu::save`](emu_core::Cpu::save) and
//! [`Cpu::restore`](emu_core::Cpu::restore).

use std::sync::Arc;

use emu_core::engine::RunState;
use emu_core::state::{CellWrite, SnapshotDamaged, SnapshotState, StateTape};

use crate::cpu::Avr;
use crate::executor::{CoreRegisters, RAM_START};
use crate::flags::SregFlags;

impl SnapshotState for Avr {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        self.core.pc &= self.code.mask();
        self.core.pass_state(tape)?;
        tape.require(self.core.pc <= self.code.mask())?;
        let (registers, rest) = self.data.bytes.split_at_mut(RAM_START);
        tape.pass_slice(&mut registers[..32])?;
        tape.pass_memory(&mut rest[..usize::from(self.data.ram_len)])?;
        for CellWrite { index: addr, value: byte } in self.code.changes.pass_state(&self.code.bytes, tape)? {
            Arc::make_mut(&mut self.code).poke(addr, byte);
        }
        self.soc.pass_state(tape)?;
        self.run_state = RunState { skip_idle_loops: self.run_state.skip_idle_loops, ..RunState::START };
        tape.require(self.soc.is_settled(tape.now()))
    }
}

/// Fields that the run loop recomputes are not saved.
impl SnapshotState for CoreRegisters {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        let mut sreg = self.flags.pack();
        self.clock.pass_state(tape)?;
        // Interrupts can only be held at the boundary of the current cycle.
        let held = tape.pass_flag(self.no_interrupt_at == tape.now())?;
        self.pc.pass_state(tape)?;
        self.sp.pass_state(tape)?;
        sreg.pass_state(tape)?;
        self.is_sleeping.pass_state(tape)?;
        let hold_at = if held { tape.now() } else { CoreRegisters::START.no_interrupt_at };
        *self = CoreRegisters {
            flags: SregFlags::unpack(sreg),
            no_interrupt_at: hold_at,
            slow_path_requested: false,
            stop_requested: false,
            ..*self
        };
        Ok(())
    }
}
