//! Probes behind a pointer: with them a run is compiled once for each way of looking, and not once for each that looks.

use emu_core::cpu::Probe;
use emu_core::pins::Event;

/// How closely a run is looked at. Each is a loop of its own that was made for it, and costs more than the one before.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Look {
    /// Nothing is told.
    Nothing,
    /// Edges of pins, bytes sent, and resets.
    Events,
    /// Also every entry of an interrupt, every write to data memory, and instructions, but for turns of a loop that only waits.
    Writes,
    /// Every instruction and every entry of an interrupt, no writes.
    Insns,
    /// All of this, and every access to data memory.
    All,
}

/// What is told of a run: a [`Probe`] whose type is not known. Which of it is told says the [`Look`].
pub trait Seer {
    /// [`Probe::insn`].
    fn insn(&mut self, at: u64, pc: u32) -> bool;
    /// [`Probe::data`].
    fn data(&mut self, at: u64, space: u8, addr: u16, value: u8, write: bool) -> bool;
    /// [`Probe::irq`].
    fn irq(&mut self, at: u64, vector: u8);
    /// [`Probe::event`].
    fn event(&mut self, event: Event) -> bool;
}

impl<P: Probe> Seer for P {
    fn insn(&mut self, at: u64, pc: u32) -> bool {
        Probe::insn(self, at, pc)
    }
    fn data(&mut self, at: u64, space: u8, addr: u16, value: u8, write: bool) -> bool {
        Probe::data(self, at, space, addr, value, write)
    }
    fn irq(&mut self, at: u64, vector: u8) {
        Probe::irq(self, at, vector);
    }
    fn event(&mut self, event: Event) -> bool {
        Probe::event(self, event)
    }
}

/// The probes of the looks that tell something: `N` is the look's number.
pub(crate) struct Eye<'a, const N: u8>(&'a mut dyn Seer);

/// For [`Look::Events`].
pub(crate) fn events(seer: &mut dyn Seer) -> Eye<'_, { Look::Events as u8 }> {
    Eye(seer)
}

/// For [`Look::Writes`].
pub(crate) fn writes(seer: &mut dyn Seer) -> Eye<'_, { Look::Writes as u8 }> {
    Eye(seer)
}

/// For [`Look::Insns`].
pub(crate) fn insns(seer: &mut dyn Seer) -> Eye<'_, { Look::Insns as u8 }> {
    Eye(seer)
}

/// For [`Look::All`].
pub(crate) fn all(seer: &mut dyn Seer) -> Eye<'_, { Look::All as u8 }> {
    Eye(seer)
}

impl<const N: u8> Probe for Eye<'_, N> {
    const INSN: bool = N >= Look::Writes as u8;
    const EVERY: bool = N >= Look::Insns as u8;
    const DATA: bool = N == Look::Writes as u8 || N >= Look::All as u8;
    const READS: bool = N >= Look::All as u8;
    const EVENTS: bool = N >= Look::Events as u8;

    fn insn(&mut self, at: u64, pc: u32) -> bool {
        self.0.insn(at, pc)
    }
    fn data(&mut self, at: u64, space: u8, addr: u16, value: u8, write: bool) -> bool {
        self.0.data(at, space, addr, value, write)
    }
    fn irq(&mut self, at: u64, vector: u8) {
        self.0.irq(at, vector);
    }
    fn event(&mut self, event: Event) -> bool {
        self.0.event(event)
    }
}
