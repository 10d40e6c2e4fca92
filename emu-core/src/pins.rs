//! Time, pin levels, and the events that leave a chip.

use crate::cpu::ResetCause;

/// A point in time: machine cycles since power-up, and clocks within the cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct CycleTime {
    /// Machine cycles since power-up.
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

/// How a pin is driven, or the level on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum PinLevel {
    /// 0 V.
    Low,
    /// Supply voltage.
    High,
    /// Nothing drives it.
    #[default]
    Float,
    /// From outside only: a resistor to the supply, weaker than every driver of the chip. It is never the
    /// level of a wire.
    PullUp,
    /// From outside only: a resistor to 0 V, stronger than a pull-up of the chip.
    PullDown,
}

impl PinLevel {
    /// High for true, low for false.
    #[must_use]
    pub const fn from_bit(bit: bool) -> PinLevel {
        if bit { PinLevel::High } else { PinLevel::Low }
    }
}

/// A pin, by its position in the chip's list of pins ([`crate::chip::Chip::pins`]).
pub type PinId = u16;

/// Something that a chip did or detected, with its time. Events are given to
/// [`Probe::on_event`](crate::cpu::Probe::on_event) in order of time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ChipEvent {
    /// The level of a pin changed.
    Edge {
        /// Time of the change.
        at: CycleTime,
        /// The pin.
        pin: PinId,
        /// The new level.
        level: PinLevel,
    },
    /// From now on, the chip and the outside drive a pin to opposite levels.
    Contention {
        /// Time at which the contention starts.
        at: CycleTime,
        /// The pin.
        pin: PinId,
    },
    /// A serial port finished sending a byte: its last stop bit has ended.
    Sent {
        /// Time of the end of the stop bit.
        at: CycleTime,
        /// Number of the port, from 0.
        uart: u8,
        /// The byte.
        byte: u8,
    },
    /// The chip was reset by itself, its supply or its reset pin, not by
    /// [`Cpu::reset`](crate::cpu::Cpu::reset).
    Reset {
        /// Time of the reset.
        at: CycleTime,
        /// Source of the reset.
        cause: ResetCause,
    },
}

impl ChipEvent {
    /// The time of the event.
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

/// How the chip drives a pin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PinOutput {
    /// The level, or floating.
    pub level: PinLevel,
    /// Whether the pull-up is on.
    pub pull_up: bool,
}

/// One pin: how the chip and the outside drive it, and the resulting level.
///
/// If both sides drive the pin to opposite levels, the chip wins and [`PinState::has_contention`] is true; a
/// resistor never causes contention. A floating pin reads high if the chip's pull-up is on. Without a pull-up
/// it keeps its last level, like a charged input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PinState {
    /// How the chip drives it.
    pub driven: PinLevel,
    /// Whether the chip's pull-up is on.
    pub pull_up: bool,
    /// How the outside drives it.
    pub external: PinLevel,
    /// The present level of the wire. The level before the last change is kept too, for a peripheral that
    /// samples late.
    pub reads_high: bool,
    high_before: bool,
    changed_cycle: u64,
}

crate::state! { PinState { driven, pull_up, external, reads_high, high_before, changed_cycle } }

impl PinState {
    /// A pin that nothing drives. It reads high until something pulls it low.
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

    /// The level of the wire.
    #[must_use]
    pub const fn level(&self) -> PinLevel {
        match (self.driven, self.external, self.pull_up) {
            (PinLevel::Float, PinLevel::Float, false) => PinLevel::Float,
            _ => PinLevel::from_bit(self.reads_high),
        }
    }

    /// Returns true if chip and outside drive the pin to opposite levels.
    #[must_use]
    pub fn has_contention(&self) -> bool {
        matches!((self.driven, self.external), (PinLevel::Low, PinLevel::High) | (PinLevel::High, PinLevel::Low))
    }

    /// Computes the level after a change of the drivers at machine cycle `cycle`. Returns true if the level
    /// changed.
    pub fn settle(&mut self, cycle: u64) -> bool {
        // Of several changes in one cycle only the last one lasts long enough to be sampled, or to charge the
        // wire.
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

    /// The level at machine cycle `cycle`, for a sampler that looks back at most one change.
    #[must_use]
    pub const fn was_high_at(&self, cycle: u64) -> bool {
        if cycle >= self.changed_cycle { self.reads_high } else { self.high_before }
    }
}
