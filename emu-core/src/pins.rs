//! Time, pin levels and the events that leave a chip.

use crate::cpu::ResetCause;

/// A moment: machine cycle since power-up, and clocks within it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct CycleTime {
    /// Machine cycle since power-up.
    pub cycle: u64,
    /// Clock within the cycle, 0 to `clocks_per_cycle - 1` (Q1 to Q4, S1 to S6; always 0 on AVR).
    pub phase: u8,
}

crate::state! { CycleTime { cycle, phase } }

impl CycleTime {
    /// The first clock of `cycle`.
    #[must_use]
    pub const fn at(cycle: u64) -> CycleTime {
        CycleTime { cycle, phase: 0 }
    }
}

/// What drives a pin, or what stands on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum PinLevel {
    /// 0 V.
    Low,
    /// Supply voltage.
    High,
    /// Nothing drives it.
    #[default]
    Float,
    /// From outside only: a resistor to the supply, which every driver of the chip overcomes. No wire stands on it.
    PullUp,
    /// From outside only: a resistor to 0 V, stronger than a pull-up of the chip.
    PullDown,
}

impl PinLevel {
    /// High for true.
    #[must_use]
    pub const fn from_bit(bit: bool) -> PinLevel {
        if bit { PinLevel::High } else { PinLevel::Low }
    }
}

/// A pin: position in the chip's list of pins ([`crate::chip::Chip::pins`]).
pub type PinId = u16;

/// Something that a chip did or saw, with its time; handed to [`Probe::event`](crate::cpu::Probe::on_event) in order of time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ChipEvent {
    /// The level of a pin changed.
    Edge {
        /// When.
        at: CycleTime,
        /// Which pin.
        pin: PinId,
        /// Its level from then on.
        level: PinLevel,
    },
    /// Chip and outside drive a pin against each other from now on.
    Contention {
        /// When.
        at: CycleTime,
        /// Which pin.
        pin: PinId,
    },
    /// A serial port finished a byte (the last stop bit has passed).
    Sent {
        /// When.
        at: CycleTime,
        /// Which port, from 0.
        uart: u8,
        /// The byte.
        byte: u8,
    },
    /// The chip was reset by itself, its supply or its reset pin, not by [`Cpu::reset`](crate::cpu::Cpu::reset).
    Reset {
        /// When.
        at: CycleTime,
        /// Why.
        cause: ResetCause,
    },
}

impl ChipEvent {
    /// When it happened.
    #[must_use]
    pub const fn time(&self) -> CycleTime {
        match self {
            ChipEvent::Edge { at, .. }
            | ChipEvent::Contention { at, .. }
            | ChipEvent::Sent { at, .. }
            | ChipEvent::Reset { at, .. } => *at,
        }
    }
}

/// One pin: who drives it from both sides, and the level that follows.
///
/// The chip wins where both sides drive (the fight is reported by [`Pin::has_contention`]; a resistor fights nobody); a floating
/// pin with the chip's pull-up on reads high; a floating pin without one keeps the level it had last, as a charged input does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PinState {
    /// What the chip drives.
    pub driven: PinLevel,
    /// The chip's pull-up is on.
    pub pull_up: bool,
    /// What the outside drives.
    pub external: PinLevel,
    /// The level of the wire, and the level one change ago, for what samples it late.
    pub reads_high: bool,
    high_before: bool,
    changed_cycle: u64,
}

crate::state! { PinState { driven, pull_up, external, reads_high, high_before, changed_cycle } }

impl PinState {
    /// A pin that nothing drives and that reads high until something has pulled it low.
    #[must_use]
    pub const fn new_charged() -> PinState {
        PinState {
            driven: PinLevel::Float,
            pull_up: false,
            external: PinLevel::Float,
            reads_high: true,
            high_before: true,
            changed_cycle: 0,
        }
    }

    /// Level of the wire.
    #[must_use]
    pub const fn level(&self) -> PinLevel {
        match (self.driven, self.external, self.pull_up) {
            (PinLevel::Float, PinLevel::Float, false) => PinLevel::Float,
            _ => PinLevel::from_bit(self.reads_high),
        }
    }

    /// True when chip and outside drive against each other.
    #[must_use]
    pub fn has_contention(&self) -> bool {
        matches!((self.driven, self.external), (PinLevel::Low, PinLevel::High) | (PinLevel::High, PinLevel::Low))
    }

    /// Settles the wire after a change of its drivers at machine cycle `cycle`; true when its level changed.
    pub fn settle(&mut self, cycle: u64) -> bool {
        // Of several changes in one cycle only the last one lasts long enough to be sampled, or to charge the wire.
        let held = if self.changed_cycle == cycle { self.high_before } else { self.reads_high };
        let high = match (self.driven, self.external) {
            (PinLevel::Float, PinLevel::Float) => self.pull_up || held,
            (PinLevel::Float, level) | (level, _) => matches!(level, PinLevel::High | PinLevel::PullUp),
        };
        let changed = high != self.reads_high;
        if changed {
            (self.high_before, self.reads_high, self.changed_cycle) = (held, high, cycle);
        }
        changed
    }

    /// The level at machine cycle `cycle`, for a sampler that looks at most one change back.
    #[must_use]
    pub const fn was_high_at(&self, cycle: u64) -> bool {
        if cycle >= self.changed_cycle { self.reads_high } else { self.high_before }
    }
}
