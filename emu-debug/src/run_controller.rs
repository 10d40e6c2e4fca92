//! Who has a run in hand: asked before every stretch of it whether, and up to when, it goes on.

use emu_core::cpu::Cpu;
use emu_core::pins::PinId;

/// Machine cycles after which the host is asked whether to go on.
pub(crate) const CYCLES_BETWEEN_DECISIONS: u64 = 1 << 22;

/// How a run goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RunDecision {
    /// Up to this machine cycle, or until something in [`StretchWatch`] moves.
    RunUntil(u64),
    /// Not at all: the host does not want to wait any longer.
    StopWaiting,
    /// Not at all: what it was for is over.
    Finished,
}

/// What also ends a stretch.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct StretchWatch {
    /// A level of one of these pins changes.
    pub pins: Vec<PinId>,
    /// A byte is sent over the first serial port.
    pub bytes: bool,
    /// It has happened.
    pub triggered: bool,
}

/// Has a run in hand. It may do to the machine what could be done from outside.
pub trait RunController<C> {
    /// How it goes on; `sent` is all that the chip has sent so far.
    fn next_decision(&mut self, cpu: &mut C, sent: &[u8], watched: &mut StretchWatch) -> RunDecision;
    /// It is not over with the text that a run waits for: the run goes on behind that.
    fn is_waiting(&self) -> bool {
        false
    }
    /// The run has ended.
    fn finish(&mut self, cpu: &mut C, sent: &[u8]);
}

/// A host that only says whether to go on.
pub struct ContinueCallback<'a>(pub &'a mut dyn FnMut(&[u8]) -> bool);

impl<C: Cpu> RunController<C> for ContinueCallback<'_> {
    fn next_decision(&mut self, cpu: &mut C, sent: &[u8], _: &mut StretchWatch) -> RunDecision {
        if (self.0)(sent) {
            RunDecision::RunUntil(cpu.cycle().saturating_add(CYCLES_BETWEEN_DECISIONS))
        } else {
            RunDecision::StopWaiting
        }
    }

    fn finish(&mut self, _: &mut C, sent: &[u8]) {
        (self.0)(sent);
    }
}
