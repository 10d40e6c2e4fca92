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
pub mod timer;
pub mod timer2;

pub use emu_core::device::Device;
use emu_core::device::{DeviceSignal, Outbox};
use emu_core::pins::PinId;

/// A signal of a peripheral. There are none yet: the chip asks its peripherals for their flags and lines.
#[derive(Debug, Clone, Copy)]
pub enum Mcs51Signal {}

impl DeviceSignal for Mcs51Signal {
    type Line = PinId;
}

/// The list in which peripherals leave their signals.
pub type Mcs51Outbox = Outbox<Mcs51Signal>;
