//! [`CpuEngine`] for [`Pic16`]: what the shared run loop asks between two instructions.

use std::sync::Arc;

use emu_core::countdown::Countdown;
use emu_core::cpu::{Bus, Cpu, NEVER, Probe, ResetCause, StopReason};
use emu_core::engine::{CpuEngine, InstructionMark, RunState};
use emu_core::pins::ChipEvent;

use super::Pic16;
use crate::core_state::BANK;
use crate::isa::{Kind, SPAN};
use crate::soc::CoreRequest;

impl CpuEngine for Pic16 {
    type CoreState = (u32, u8, u32, u32);

    fn clock(&mut self) -> &mut Countdown {
        &mut self.core.clock
    }
    fn stop_requested(&mut self) -> &mut bool {
        &mut self.core.stop_requested
    }
    fn slow_path_requested(&mut self) -> &mut bool {
        &mut self.core.slow_path_requested
    }
    fn run_state(&mut self) -> &mut RunState {
        &mut self.run_state
    }
    fn fire(&mut self, now: u64) -> u64 {
        self.soc.fire(now)
    }
    fn set_event_log(&mut self, on: bool) {
        let now = self.cycle();
        self.soc.set_event_log(on, now);
    }
    fn next_event(&mut self) -> Option<ChipEvent> {
        self.soc.next_event()
    }
    fn requested_reset(&mut self) -> Option<ResetCause> {
        self.soc.requested_reset()
    }

    fn apply_request(&mut self) -> bool {
        let now = self.core.clock.now();
        let Some(request) = self.soc.next_request(now) else { return false };
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
        true
    }

    fn has_pending_interrupt(&self, now: u64) -> bool {
        self.soc.pending_interrupt(now).is_some()
    }

    fn enter_interrupt<P: Probe>(&mut self, now: u64, probe: &mut P) -> bool {
        let Some(since) = self.soc.interrupt_since(now) else { return false };
        // Two cycles without an instruction. If the interrupt was pending before the second cycle of the
        // previous instruction, that cycle counts, so the latency is the same after one-cycle and two-cycle
        // instructions (DS30292, 12.10.1).
        let cycles = if since < now { 1 } else { 2 };
        self.soc.acknowledge_interrupt(1, now);
        probe.on_interrupt(now, 1);
        self.core = self.executor(probe).0.enter_interrupt(cycles);
        true
    }

    fn is_core_asleep(&self) -> bool {
        self.soc.is_asleep()
    }
    fn is_halted(&self) -> bool {
        !self.soc.is_busy() && !self.soc.can_wake(true)
    }
    fn has_breakpoint(&self, pc: u32) -> bool {
        self.code.has_breakpoint(pc)
    }
    fn instruction_mark(&self, pc: u32) -> InstructionMark {
        self.code.instruction_mark(self.core.bank_and_pc & BANK, pc)
    }
    fn loop_head(&self, end: u32) -> Option<u32> {
        self.code.loop_plan(self.core.bank_and_pc & BANK, end).map(|plan| plan.head)
    }
    fn loop_steady_until(&self, end: u32, at: u64) -> u64 {
        let registers_read =
            self.code.loop_plan(self.core.bank_and_pc & BANK, end).map_or(&[][..], |plan| &plan.registers_read);
        registers_read.iter().map(|&sfr| self.soc.steady_until(sfr as u16, at)).min().unwrap_or(NEVER)
    }
    fn loop_clears_watchdog(&self, end: u32) -> bool {
        self.code.loop_plan(self.core.bank_and_pc & BANK, end).is_some_and(|plan| plan.clears_watchdog)
    }
    fn loop_counter(&self, end: u32) -> Option<u64> {
        self.ram
            .get(usize::from(self.code.loop_plan(self.core.bank_and_pc & BANK, end)?.counted_address?))
            .map(|&byte| byte.into())
    }
    fn set_loop_counter(&mut self, end: u32, value: u64) {
        let place = self.code.loop_plan(self.core.bank_and_pc & BANK, end).and_then(|plan| plan.counted_address);
        place.and_then(|at| self.ram.get_mut(usize::from(at))).into_iter().for_each(|byte| *byte = value as u8);
    }
    fn core_state(&self) -> Self::CoreState {
        (self.core.w, self.core.status(), self.core.indirect_address, self.core.pclath)
    }

    fn burst<P: Probe>(&mut self, stop_at_polling_loops: bool, probe: &mut P) {
        let (executor, code) = self.executor(probe);
        self.core = executor.burst(&code.ops[usize::from(stop_at_polling_loops)]);
    }

    fn execute_single<P: Probe>(&mut self, pc: u32, probe: &mut P) -> Result<(), StopReason> {
        self.core.set_pc(pc);
        let op = self.code.ops_unmarked[self.op_index(pc)];
        if op.kind == Kind::Illegal {
            return Err(StopReason::Illegal { pc, word: self.code.words[pc as usize % SPAN] });
        }
        self.core = self.executor(probe).0.single(op);
        Ok(())
    }
}
