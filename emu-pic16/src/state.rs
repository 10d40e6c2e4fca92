//! Snapshots of the machine as bytes: [`Cpu::save`](emu_core::Cpu::save) and
//! [`Cpu::restore`](emu_core::Cpu::restore).

use std::sync::Arc;

use emu_core::engine::RunState;
use emu_core::state::{CellWrite, SnapshotDamaged, SnapshotState, StateTape};

use crate::core_state::{CoreRegisters, PD, TO};
use crate::cpu::Pic16;
use crate::lint::LintState;

impl SnapshotState for Pic16 {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        self.core.pass_state(tape)?;
        tape.pass_memory(&mut self.ram)?;
        self.stack.pass_state(tape)?;
        for CellWrite { index: addr, value: word } in self.code.changes.pass_state(&*self.code.words, tape)? {
            Arc::make_mut(&mut self.code).poke(addr as u32, word);
        }
        self.run_state = RunState { skip_idle_loops: self.run_state.skip_idle_loops, ..RunState::START };
        self.lints = LintState::default();
        self.soc.pass_state(tape)
    }
}

/// Fields that the run loop recomputes are not saved.
impl SnapshotState for CoreRegisters {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        let mut pc = self.pc() as u16;
        let mut bytes =
            [self.w as u8, self.status(), self.indirect_address as u8, self.pclath as u8, self.sp as u8 & 7];
        self.clock.pass_state(tape)?;
        pc.pass_state(tape)?;
        bytes.pass_state(tape)?;
        let [w, status, fsr, pclath, sp] = bytes.map(u32::from);
        tape.require(pc < 0x2000 && pclath < 0x20 && sp < 8)?;
        *self = CoreRegisters {
            clock: self.clock,
            bank_and_pc: pc.into(),
            w,
            indirect_address: fsr,
            pclath,
            sp,
            timeout_bits: status & (TO | PD),
            ..CoreRegisters::START
        };
        self.set_status(status);
        Ok(())
    }
}
