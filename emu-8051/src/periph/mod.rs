//! The peripherals. They are not ticked: a peripheral is advanced to a cycle when it is accessed, and
//! computes when it acts next.
//!
//! The order within a machine cycle is (user's manual, "CPU timing", "Interrupts", "Port structures"): pins
//! take what was written at the end of the cycle before (S1P1), timer 2 sets TF2 (S2P2), counters count
//! (S3P1), pins are sampled and flags set (S5P2), a program reads, and at the end it writes (S6P2). A
//! peripheral that is advanced to a cycle has done everything up to S5P2 of it. A write at the end of the
//! cycle takes effect from the next cycle on.

pub mod map;
pub mod ports;
pub mod serial;
pub mod ticks;
pub mod timer;
pub mod timer2;
pub mod watchdog;

pub use emu_core::device::{Device, SignalReceiver};
use emu_core::device::{DeviceSignal, Outbox};
use emu_core::pins::{CycleTime, PinId};

use serial::SerialEdge;

/// A signal of a peripheral. Times are in oscillator time.
#[derive(Debug, Clone, Copy)]
pub enum Mcs51Signal {
    /// In cycle `t` the serial port changes a line, now or later.
    Edge {
        /// The cycle of the signal.
        t: u64,
        /// The change.
        edge: SerialEdge,
    },
    /// A byte was sent: its stop bit ended, or in mode 0 its last bit.
    Sent {
        /// The cycle.
        t: u64,
        /// The byte.
        byte: u8,
    },
    /// The serial port has set one of its flags.
    Flag,
    /// The clock output of timer 2 gets a level.
    ClockOut {
        /// Cycle, and clock 0 to 11 in it.
        at: CycleTime,
        /// The level.
        high: bool,
    },
    /// The watchdog has overflowed.
    Watchdog {
        /// The cycle.
        t: u64,
    },
}

impl DeviceSignal for Mcs51Signal {
    type Line = PinId;
}

/// The list in which peripherals leave their signals.
pub type Mcs51Outbox = Outbox<Mcs51Signal>;
