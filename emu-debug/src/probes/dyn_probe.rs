//! Probes behind a pointer: a run is compiled once for each level of observation, not once for each probe.

use emu_core::cpu::Probe;
use emu_core::pins::ChipEvent;

/// How closely a run is observed. Each level has a loop compiled for it, and costs more than the previous
/// one. The levels are not nested: `Instructions` has no writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ObserveLevel {
    /// Nothing is reported.
    Nothing,
    /// Pin edges, sent bytes, and resets.
    Events,
    /// Also every interrupt entry, every write to data memory, and instructions, except in skipped iterations
    /// of polling loops.
    Writes,
    /// Every instruction and every interrupt entry, but no writes.
    Instructions,
    /// All of these, and every access to data memory.
    All,
}

/// A [`Probe`] behind a pointer. The [`ObserveLevel`] determines which methods are called.
pub trait DynProbe {
    /// Calls [`Probe::on_instruction`].
    fn on_instruction(&mut self, at: u64, pc: u32) -> bool;
    /// Calls [`Probe::on_data_access`].
    fn on_data_access(&mut self, at: u64, space: u8, addr: u16, value: u8, write: bool) -> bool;
    /// Calls [`Probe::on_interrupt`].
    fn on_interrupt(&mut self, at: u64, vector: u8);
    /// Calls [`Probe::on_event`].
    fn on_event(&mut self, event: ChipEvent) -> bool;
}

impl<P: Probe> DynProbe for P {
    fn on_instruction(&mut self, at: u64, pc: u32) -> bool {
        Probe::on_instruction(self, at, pc)
    }
    fn on_data_access(&mut self, at: u64, space: u8, addr: u16, value: u8, write: bool) -> bool {
        Probe::on_data_access(self, at, space, addr, value, write)
    }
    fn on_interrupt(&mut self, at: u64, vector: u8) {
        Probe::on_interrupt(self, at, vector);
    }
    fn on_event(&mut self, event: ChipEvent) -> bool {
        Probe::on_event(self, event)
    }
}

/// The probe for a level above `Nothing`; `N` is the number of the level.
pub(crate) struct LevelProbe<'a, const N: u8>(&'a mut dyn DynProbe);

/// Returns the probe for [`ObserveLevel::Events`].
pub(crate) fn probe_events(probe: &mut dyn DynProbe) -> LevelProbe<'_, { ObserveLevel::Events as u8 }> {
    LevelProbe(probe)
}

/// Returns the probe for [`ObserveLevel::Writes`].
pub(crate) fn probe_writes(probe: &mut dyn DynProbe) -> LevelProbe<'_, { ObserveLevel::Writes as u8 }> {
    LevelProbe(probe)
}

/// Returns the probe for [`ObserveLevel::Instructions`].
pub(crate) fn probe_instructions(probe: &mut dyn DynProbe) -> LevelProbe<'_, { ObserveLevel::Instructions as u8 }> {
    LevelProbe(probe)
}

/// Returns the probe for [`ObserveLevel::All`].
pub(crate) fn probe_everything(probe: &mut dyn DynProbe) -> LevelProbe<'_, { ObserveLevel::All as u8 }> {
    LevelProbe(probe)
}

impl<const N: u8> Probe for LevelProbe<'_, N> {
    const INSN: bool = N >= ObserveLevel::Writes as u8;
    const EVERY_ITERATION: bool = N >= ObserveLevel::Instructions as u8;
    const DATA: bool = N == ObserveLevel::Writes as u8 || N >= ObserveLevel::All as u8;
    const DATA_READS: bool = N >= ObserveLevel::All as u8;
    const EVENTS: bool = N >= ObserveLevel::Events as u8;

    fn on_instruction(&mut self, at: u64, pc: u32) -> bool {
        self.0.on_instruction(at, pc)
    }
    fn on_data_access(&mut self, at: u64, space: u8, addr: u16, value: u8, write: bool) -> bool {
        self.0.on_data_access(at, space, addr, value, write)
    }
    fn on_interrupt(&mut self, at: u64, vector: u8) {
        self.0.on_interrupt(at, vector);
    }
    fn on_event(&mut self, event: ChipEvent) -> bool {
        self.0.on_event(event)
    }
}
