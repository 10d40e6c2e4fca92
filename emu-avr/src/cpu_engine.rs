//! [`CpuEngine`] for [`Avr`]: what the shared run loop asks between two instructions.

use std::sync::Arc;

use emu_core::cpu::{Bus, Cpu, Probe, ProgramError};
use emu_core::engine::{CpuEngine, InstructionMark, LoopPlan};

use crate::cpu::Avr;
use crate::flags::{SregFlag, SregFlags};
use crate::isa::AvrOpKind;
use crate::soc::CoreRequest;

/// The core registers that an iteration of a polling loop must repeat.
#[derive(PartialEq)]
pub struct AvrLoopState {
    registers: [u8; 32],
    flags: SregFlags,
}

impl CpuEngine for Avr {
    type CoreState = AvrLoopState;

    emu_core::engine_methods!();

    fn apply_request(&mut self, request: CoreRequest) {
        match request {
            CoreRequest::Erase { addr, len } => {
                let code = Arc::make_mut(&mut self.code);
                (addr..addr.saturating_add(len)).for_each(|addr| code.poke(addr as usize, 0xFF));
            }
            CoreRequest::Program { addr, words } => {
                let code = Arc::make_mut(&mut self.code);
                let bytes = words.iter().flat_map(|word| word.to_le_bytes());
                for (addr, byte) in (addr as usize..).zip(bytes) {
                    let old = code.byte(addr);
                    code.poke(addr, old & byte);
                }
            }
        }
    }
    fn holds_interrupts(&self, now: u64) -> bool {
        self.core.no_interrupt_at == now || self.is_interrupt_locked(now)
    }
    fn has_pending_interrupt(&self, now: u64) -> bool {
        self.core.flags.get(SregFlag::I) && self.soc.pending_interrupt(now).is_some() && !self.soc.is_core_stopped()
    }

    fn enter_interrupt<P: Probe>(&mut self, now: u64, probe: &mut P) -> bool {
        if !self.has_pending_interrupt(now) {
            return false;
        }
        if self.core.is_sleeping {
            // An interrupt that lock bits block does not wake the core either.
            if self.soc.locks_interrupts(2 * self.pc()) {
                return false;
            }
            self.core.is_sleeping = false;
            self.soc.wake_up(now);
            return true;
        }
        if let Some(vector) = self.soc.pending_interrupt(now) {
            self.soc.acknowledge_interrupt(vector, now);
            probe.on_interrupt(now, vector);
            let at = self.soc.vector_base() + u32::from(vector) * self.part.chip.words_per_vector;
            self.core = self.executor(probe).executor.enter_interrupt(at);
        }
        true
    }

    fn is_core_asleep(&self) -> bool {
        self.core.is_sleeping || self.soc.is_core_stopped()
    }
    fn accepts_interrupts(&self) -> bool {
        self.core.flags.get(SregFlag::I)
    }
    fn instruction_mark(&self, pc: u32) -> InstructionMark {
        self.code.instruction_mark(pc)
    }
    fn loop_plan(&self, end: u32) -> Option<&LoopPlan> {
        self.code.loop_plan(end)
    }
    fn counter_byte(&self, number: u16) -> u8 {
        self.data.bytes[usize::from(number)]
    }
    fn set_counter_byte(&mut self, number: u16, value: u8) {
        self.data.bytes[usize::from(number)] = value;
    }
    fn core_state(&self) -> Self::CoreState {
        AvrLoopState { registers: std::array::from_fn(|r| self.data.bytes[r]), flags: self.core.flags }
    }

    fn execute_single<P: Probe>(&mut self, pc: u32, probe: &mut P) -> Result<(), ProgramError> {
        // `pc` can be past the end of memory; it wraps to the start.
        self.core.pc = pc;
        let op = self.code.ops_unmarked[pc as usize];
        if op.kind == AvrOpKind::Illegal {
            return Err(ProgramError::Illegal { pc, word: self.code.word(pc) });
        }
        self.core = self.executor(probe).executor.single(op);
        Ok(())
    }
}

impl Avr {
    /// Reports whether a pending interrupt must not be taken before the next instruction. The engine checks
    /// again after that instruction.
    fn is_interrupt_locked(&self, now: u64) -> bool {
        self.core.flags.get(SregFlag::I)
            && self.soc.pending_interrupt(now).is_some()
            && (self.soc.ivce(now) || self.soc.locks_interrupts(2 * self.pc()))
            && !self.is_core_asleep()
    }
}
