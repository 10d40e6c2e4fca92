//! The controller of a run. A run is a sequence of stretches; the controller is called before each of them
//! and decides whether and up to which cycle the run continues.

use emu_core::cpu::Cpu;
use emu_core::pins::PinId;

/// Machine cycles between two decisions of the controller.
pub(crate) const CYCLES_BETWEEN_DECISIONS: u64 = 1 << 22;

/// How a run continues.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RunDecision {
    /// The run continues up to this machine cycle, or until an event in [`StretchWatch`].
    RunUntil(u64),
    /// The run ends: the controller does not wait any longer.
    StopWaiting,
    /// The run ends: the controller has finished.
    Finished,
}

/// Events that also end a stretch.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct StretchWatch {
    /// The stretch ends when the level of one of these pins changes.
    pub pins: Vec<PinId>,
    /// The stretch ends when a byte is sent over the first serial port.
    pub bytes: bool,
    /// Whether such an event has occurred.
    pub triggered: bool,
}

/// Controls a run. It may apply stimuli to the machine.
pub trait RunController<C> {
    /// Decides how the run continues. `sent` is all that the chip has sent so far. Sets in `stretch_watch`
    /// which events also end the next stretch.
    fn next_decision(&mut self, cpu: &mut C, sent: &[u8], stretch_watch: &mut StretchWatch) -> RunDecision;
    /// Returns true if the run continues even after its awaited text.
    fn is_waiting(&self) -> bool {
        false
    }
    /// Called when the run has ended.
    fn finish(&mut self, cpu: &mut C, sent: &[u8]);
}

/// A controller that only decides whether to continue.
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
