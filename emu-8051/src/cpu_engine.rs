//! [`CpuEngine`] for [`Mcs51`]: what the shared run loop asks between two instructions.

use emu_core::countdown::Countdown;
use emu_core::cpu::{Bus, Cpu, NEVER, Probe, ResetCause, StopReason};
use emu_core::engine::{CpuEngine, InstructionMark, RunState};
use emu_core::pins::ChipEvent;

use crate::chips::{LATER_VECTORS_BACK, VECTOR_WORDS};
use crate::cpu::Mcs51;
use crate::isa::Kind;
use crate::predecode::LoopCounter;

impl CpuEngine for Mcs51 {
    /// A, B, PSW and the data pointers.
    type CoreState = (u32, u32, u8, u32, u32);

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
    fn holds_interrupts(&self, now: u64) -> bool {
        self.core.no_interrupt_at == now
    }
    fn has_pending_interrupt(&self, now: u64) -> bool {
        self.soc.pending_interrupt(now).is_some()
    }

    fn enter_interrupt<P: Probe>(&mut self, now: u64, probe: &mut P) -> bool {
        let Some(vector) = self.soc.pending_interrupt(now) else { return false };
        self.soc.acknowledge_interrupt(vector, now);
        probe.on_interrupt(now, vector);
        self.core = self.executor(probe).0.enter_interrupt(u32::from(vector) * VECTOR_WORDS - LATER_VECTORS_BACK);
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
        self.code.instruction_mark(pc)
    }
    fn loop_head(&self, end: u32) -> Option<u32> {
        self.code.loop_plan(end).map(|plan| plan.head)
    }
    fn loop_steady_until(&self, end: u32, at: u64) -> u64 {
        let registers_read = self.code.loop_plan(end).map_or(&[][..], |plan| &plan.registers_read);
        registers_read.iter().map(|&addr| self.soc.steady_until(addr.into(), at)).min().unwrap_or(NEVER)
    }
    fn loop_clears_watchdog(&self, end: u32) -> bool {
        self.code.loop_plan(end).is_some_and(|plan| plan.clears_watchdog)
    }
    fn loop_counter(&self, end: u32) -> Option<u64> {
        let place = self.counter_address(self.code.loop_plan(end)?.counted_byte?);
        Some(self.ram[place].into())
    }
    fn set_loop_counter(&mut self, end: u32, value: u64) {
        if let Some(counter) = self.code.loop_plan(end).and_then(|plan| plan.counted_byte) {
            self.ram[self.counter_address(counter)] = value as u8;
        }
    }
    fn core_state(&self) -> Self::CoreState {
        let core = &self.core;
        (core.acc, core.b, core.psw(), core.dptr, core.other_dptr)
    }

    fn burst<P: Probe>(&mut self, stop_at_polling_loops: bool, probe: &mut P) {
        let (executor, code) = self.executor(probe);
        self.core = executor.burst(&code.ops[usize::from(stop_at_polling_loops)]);
    }

    fn execute_single<P: Probe>(&mut self, pc: u32, probe: &mut P) -> Result<(), StopReason> {
        let op = self.code.ops_unmarked[pc as usize];
        match op.kind {
            Kind::Illegal => {
                return Err(StopReason::Illegal { pc, word: u16::from(self.code.bytes[pc as usize]) });
            }
            Kind::RewriteCode => self.run_external_access(pc, probe),
            _ => self.core = self.executor(probe).0.single(op),
        }
        Ok(())
    }
}

impl Mcs51 {
    /// The RAM address of a counter.
    fn counter_address(&self, counter: LoopCounter) -> usize {
        match counter {
            LoopCounter::Reg(n) => (self.core.bank | u32::from(n)) as usize % self.ram.len(),
            LoopCounter::Ram(addr) => addr.into(),
        }
    }

    /// Executes a MOVX that is not a plain memory access: a write that can change the program, or a chip
    /// without an external bus. On a chip without a bus, external memory always reads FFh because nothing
    /// drives it, and the access is not reported to the probe.
    fn run_external_access<P: Probe>(&mut self, pc: u32, probe: &mut P) {
        let op = self.code.movx(pc);
        let page = [self.ram[(self.core.bank | u32::from(op.args[0] & 1)) as usize], self.soc.port2()];
        let by_register = matches!(op.kind, Kind::MovxAInd | Kind::MovxIndA);
        let addr = if by_register { u16::from_le_bytes(page) } else { self.core.dptr as u16 };
        if self.part.has_bus {
            self.core = self.executor(probe).0.single(op);
            let value = self.xdata[usize::from(addr)];
            self.write_external(addr, value);
        } else {
            self.core = self.executor(&mut ()).0.single(op);
            self.write_external(addr, 0xFF);
        }
    }
}
