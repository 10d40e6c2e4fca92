//! Who has a run in hand: asked before every stretch of it whether, and up to when, it goes on.

use emu_core::cpu::Cpu;
use emu_core::pins::PinId;

/// Machine cycles after which the host is asked whether to go on.
pub(crate) const SLICE: u64 = 1 << 22;

/// How a run goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Going {
    /// Up to this machine cycle, or until something in [`Watched`] moves.
    Until(u64),
    /// Not at all: the host does not want to wait any longer.
    Stop,
    /// Not at all: what it was for is over.
    Over,
}

/// What also ends a stretch.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Watched {
    /// A level of one of these pins changes.
    pub pins: Vec<PinId>,
    /// A byte is sent over the first serial port.
    pub bytes: bool,
    /// It has happened.
    pub moved: bool,
}

/// Has a run in hand. It may do to the machine what could be done from outside.
pub trait Host<C> {
    /// How it goes on; `sent` is all that the chip has sent so far.
    fn going(&mut self, cpu: &mut C, sent: &[u8], watched: &mut Watched) -> Going;
    /// It is not over with the text that a run waits for: the run goes on behind that.
    fn waits(&self) -> bool {
        false
    }
    /// The run has ended.
    fn over(&mut self, cpu: &mut C, sent: &[u8]);
}

/// A host that only says whether to go on.
pub struct Patience<'a>(pub &'a mut dyn FnMut(&[u8]) -> bool);

impl<C: Cpu> Host<C> for Patience<'_> {
    fn going(&mut self, cpu: &mut C, sent: &[u8], _: &mut Watched) -> Going {
        if (self.0)(sent) { Going::Until(cpu.cycle().saturating_add(SLICE)) } else { Going::Stop }
    }

    fn over(&mut self, _: &mut C, sent: &[u8]) {
        (self.0)(sent);
    }
}
