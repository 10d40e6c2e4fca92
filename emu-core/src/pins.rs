//! Time, pin levels and the events that leave a chip.

use crate::cpu::Reset;

/// A moment: machine cycle since power-up, and clocks within it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Time {
    /// Machine cycle since power-up.
    pub cycle: u64,
    /// Clock within the cycle, 0 to `clocks_per_cycle - 1` (Q1 to Q4, S1 to S6; always 0 on AVR).
    pub phase: u8,
}

crate::state! { Time { cycle, phase } }

impl Time {
    /// The first clock of `cycle`.
    #[must_use]
    pub const fn at(cycle: u64) -> Time {
        Time { cycle, phase: 0 }
    }
}

/// What drives a pin, or what stands on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Level {
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

impl Level {
    /// High for true.
    #[must_use]
    pub const fn of(bit: bool) -> Level {
        if bit { Level::High } else { Level::Low }
    }
}

/// A pin: position in the chip's list of pins ([`crate::chip::Chip::pins`]).
pub type PinId = u16;

/// Something that a chip did or saw, with its time; handed to [`Probe::event`](crate::cpu::Probe::event) in order of time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event {
    /// The level of a pin changed.
    Edge {
        /// When.
        at: Time,
        /// Which pin.
        pin: PinId,
        /// Its level from then on.
        level: Level,
    },
    /// Chip and outside drive a pin against each other from now on.
    Contention {
        /// When.
        at: Time,
        /// Which pin.
        pin: PinId,
    },
    /// A serial port finished a byte (the last stop bit has passed).
    Sent {
        /// When.
        at: Time,
        /// Which port, from 0.
        uart: u8,
        /// The byte.
        byte: u8,
    },
    /// The chip was reset by itself, its supply or its reset pin, not by [`Cpu::reset`](crate::cpu::Cpu::reset).
    Reset {
        /// When.
        at: Time,
        /// Why.
        why: Reset,
    },
}

impl Event {
    /// When it happened.
    #[must_use]
    pub const fn at(&self) -> Time {
        match self {
            Event::Edge { at, .. }
            | Event::Contention { at, .. }
            | Event::Sent { at, .. }
            | Event::Reset { at, .. } => *at,
        }
    }
}

/// One pin: who drives it from both sides, and the level that follows.
///
/// The chip wins where both sides drive (the fight is reported by [`Pin::contention`]; a resistor fights nobody); a floating
/// pin with the chip's pull-up on reads high; a floating pin without one keeps the level it had last, as a charged input does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Pin {
    /// What the chip drives.
    pub own: Level,
    /// The chip's pull-up is on.
    pub pull_up: bool,
    /// What the outside drives.
    pub outside: Level,
    /// The level of the wire, and the level one change ago, for what samples it late.
    pub high: bool,
    before: bool,
    changed: u64,
}

crate::state! { Pin { own, pull_up, outside, high, before, changed } }

impl Pin {
    /// A pin that nothing drives and that reads high until something has pulled it low.
    #[must_use]
    pub const fn charged() -> Pin {
        Pin { own: Level::Float, pull_up: false, outside: Level::Float, high: true, before: true, changed: 0 }
    }

    /// Level of the wire.
    #[must_use]
    pub const fn level(&self) -> Level {
        match (self.own, self.outside, self.pull_up) {
            (Level::Float, Level::Float, false) => Level::Float,
            _ => Level::of(self.high),
        }
    }

    /// True when chip and outside drive against each other.
    #[must_use]
    pub fn contention(&self) -> bool {
        matches!((self.own, self.outside), (Level::Low, Level::High) | (Level::High, Level::Low))
    }

    /// Settles the wire after a change of its drivers at machine cycle `cycle`; true when its level changed.
    pub fn settle(&mut self, cycle: u64) -> bool {
        // Of several changes in one cycle only the last one lasts long enough to be sampled, or to charge the wire.
        let held = if self.changed == cycle { self.before } else { self.high };
        let high = match (self.own, self.outside) {
            (Level::Float, Level::Float) => self.pull_up || held,
            (Level::Float, level) | (level, _) => matches!(level, Level::High | Level::PullUp),
        };
        let changed = high != self.high;
        if changed {
            (self.before, self.high, self.changed) = (held, high, cycle);
        }
        changed
    }

    /// The level at machine cycle `cycle`, for a sampler that looks at most one change back.
    #[must_use]
    pub const fn at(&self, cycle: u64) -> bool {
        if cycle >= self.changed { self.high } else { self.before }
    }
}
