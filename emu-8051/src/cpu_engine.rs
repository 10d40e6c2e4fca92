//! [`CpuEngine`] for [`Mcs51`]: what the shared run loop asks between two instructions.

use std::convert::Infallible;

use emu_core::cpu::{Bus, Probe, ProgramError};
use emu_core::engine::{CpuEngine, InstructionMark, LoopPlan};

use crate::chips::{LATER_VECTORS_BACK, VECTOR_WORDS};
use crate::cpu::Mcs51;
use crate::isa::Mcs51OpKind;
use crate::predecode::BANKED;

/// The core registers that an iteration of a polling loop must repeat.
#[derive(PartialEq)]
pub struct Mcs51LoopState {
    acc: u32,
    b: u32,
    psw: u8,
    dptr: u32,
    other_dptr: u32,
}

impl CpuEngine for Mcs51 {
    type CoreState = Mcs51LoopState;

    emu_core::engine_methods!();

    fn apply_request(&mut self, request: Infallible) {
        match request {}
    }
    fn holds_interrupts(&self, now: u64) -> bool {
        self.core.no_interrupt_at == now
    }

    fn enter_interrupt<P: Probe>(&mut self, now: u64, probe: &mut P) -> bool {
        let Some(vector) = self.soc.pending_interrupt(now) else { return false };
        self.soc.acknowledge_interrupt(vector, now);
        probe.on_interrupt(now, vector);
        self.core =
            self.executor(probe).executor.enter_interrupt(u32::from(vector) * VECTOR_WORDS - LATER_VECTORS_BACK);
        true
    }

    fn instruction_mark(&self, pc: u32) -> InstructionMark {
        self.code.instruction_mark(pc)
    }
    fn loop_plan(&self, end: u32) -> Option<&LoopPlan> {
        self.code.loop_plan(end)
    }
    fn counter_byte(&self, number: u16) -> u8 {
        self.ram[self.counter_address(number)]
    }
    fn set_counter_byte(&mut self, number: u16, value: u8) {
        let addr = self.counter_address(number);
        self.ram[addr] = value;
    }
    fn core_state(&self) -> Self::CoreState {
        let core = &self.core;
        Mcs51LoopState { acc: core.acc, b: core.b, psw: core.psw(), dptr: core.dptr, other_dptr: core.other_dptr }
    }

    fn execute_single<P: Probe>(&mut self, pc: u32, probe: &mut P) -> Result<(), ProgramError> {
        let op = self.code.ops_unmarked[pc as usize];
        match op.kind {
            Mcs51OpKind::Illegal => {
                return Err(ProgramError::Illegal { pc, word: u16::from(self.code.bytes[pc as usize]) });
            }
            Mcs51OpKind::RewriteCode => self.run_external_access(pc, probe),
            _ => self.core = self.executor(probe).executor.single(op),
        }
        Ok(())
    }
}

impl Mcs51 {
    /// The RAM address of a counter.
    fn counter_address(&self, number: u16) -> usize {
        let bank = if number & BANKED != 0 { self.core.bank } else { 0 };
        (bank | u32::from(number)) as usize % self.ram.len()
    }

    /// Executes a MOVX that is not a plain memory access: a write that can change the program, or a chip
    /// without an external bus. On a chip without a bus, external memory always reads FFh because nothing
    /// drives it, and the access is not reported to the probe.
    fn run_external_access<P: Probe>(&mut self, pc: u32, probe: &mut P) {
        let op = self.code.movx(pc);
        let page = [self.ram[(self.core.bank | u32::from(op.args[0] & 1)) as usize], self.soc.port2()];
        let by_register = matches!(op.kind, Mcs51OpKind::MovxAInd | Mcs51OpKind::MovxIndA);
        let addr = if by_register { u16::from_le_bytes(page) } else { self.core.dptr as u16 };
        if self.part.has_bus {
            self.core = self.executor(probe).executor.single(op);
            let value = self.xdata[usize::from(addr)];
            self.write_external(addr, value);
        } else {
            self.core = self.executor(&mut ()).executor.single(op);
            self.write_external(addr, 0xFF);
        }
    }
}
