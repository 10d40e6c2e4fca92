//! [`CpuEngine`] for [`Pic16`]: what the shared run loop asks between two instructions.

use std::sync::Arc;

use emu_core::cpu::{Bus, Probe, ProgramError};
use emu_core::engine::{CpuEngine, InstructionMark, LoopPlan};

use super::Pic16;
use crate::core_state::BANK;
use crate::executor::DATA_ADDRESSES;
use crate::isa::{Pic16OpKind, SPAN};
use crate::soc::CoreRequest;

/// The core registers that an iteration of a polling loop must repeat.
#[derive(PartialEq)]
pub struct Pic16LoopState {
    w: u32,
    status: u8,
    indirect_address: u32,
    pclath: u32,
}

impl CpuEngine for Pic16 {
    type CoreState = Pic16LoopState;

    emu_core::engine_methods!();

    fn apply_request(&mut self, request: CoreRequest) {
        let now = self.core.clock.now();
        match request {
            CoreRequest::EndStandby { by_watchdog } => {
                // DS30292, table 12-3: the watchdog clears TO when it wakes the core; SLEEP has cleared PD.
                if by_watchdog {
                    self.core.timeout_bits = 0;
                }
            }
            CoreRequest::ReadWord { addr } => {
                let word = self.code.words[usize::from(addr) % SPAN];
                self.soc.finish_flash_read(word);
            }
            CoreRequest::WriteWords { addr, words, erased } => {
                let code = Arc::make_mut(&mut self.code);
                for (at, word) in (u32::from(addr)..).zip(words) {
                    let old = if erased { 0x3FFF } else { code.words[at as usize % SPAN] };
                    code.poke(at, old & word);
                }
            }
            CoreRequest::Stall { until } => {
                self.core.clock.advance_cycles(until - now);
                self.core.clock.expire();
            }
            CoreRequest::Ignore { until } => {
                self.core.clock.advance_cycles(until - now);
                self.core.clock.expire();
                self.core.set_pc(self.core.pc() + (until - now) as u32);
            }
        }
    }

    fn enter_interrupt<P: Probe>(&mut self, now: u64, probe: &mut P) -> bool {
        let Some(since) = self.soc.interrupt_since(now) else { return false };
        // Two cycles without an instruction. If the interrupt was pending before the second cycle of the
        // previous instruction, that cycle counts, so the latency is the same after one-cycle and two-cycle
        // instructions (DS30292, 12.10.1).
        let cycles = if since < now { 1 } else { 2 };
        self.soc.acknowledge_interrupt(1, now);
        probe.on_interrupt(now, 1);
        self.core = self.executor(probe).executor.enter_interrupt(cycles);
        true
    }

    fn instruction_mark(&self, pc: u32) -> InstructionMark {
        self.code.instruction_mark(self.core.bank_and_pc & BANK, pc)
    }
    fn loop_plan(&self, end: u32) -> Option<&LoopPlan> {
        self.code.loop_plan(self.core.bank_and_pc & BANK, end)
    }
    fn counter_byte(&self, number: u16) -> u8 {
        self.ram[usize::from(number) % DATA_ADDRESSES]
    }
    fn set_counter_byte(&mut self, number: u16, value: u8) {
        self.ram[usize::from(number) % DATA_ADDRESSES] = value;
    }
    fn core_state(&self) -> Self::CoreState {
        let core = &self.core;
        Pic16LoopState {
            w: core.w,
            status: core.status(),
            indirect_address: core.indirect_address,
            pclath: core.pclath,
        }
    }

    fn execute_single<P: Probe>(&mut self, pc: u32, probe: &mut P) -> Result<(), ProgramError> {
        self.core.set_pc(pc);
        let op = self.code.ops_unmarked[self.op_index(pc)];
        if op.kind == Pic16OpKind::Illegal {
            return Err(ProgramError::Illegal { pc, word: self.code.words[pc as usize % SPAN] });
        }
        self.core = self.executor(probe).executor.single(op);
        Ok(())
    }
}
