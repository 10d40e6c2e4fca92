//! The peripherals around the core, and the interface that they share.
//!
//! Time is counted in clocks of the oscillator since power-up, four per instruction cycle: Q1 of cycle `c` is
//! the clock `4 c`. Time continues while the oscillator is stopped in sleep; a peripheral that depends on the
//! oscillator is notified by [`Device::stop_clock`] and [`Device::restart_clock`]. Nothing is
//! called in every clock: a peripheral computes its state at a given clock, and the clock of its next event.
//!
//! Within an instruction cycle:
//!
//! - An instruction that reads in Q2 sees everything up to the first edge of Q1: [`Device::read`] in
//!   cycle `c` gets `t = 4 c`.
//! - It writes at the end of Q4: [`Device::write`] in cycle `c` gets `t = 4 c + 4`. What happens at that
//!   very clock by the settings before the write still happens (a timer that is stopped counts a last time,
//!   one that is started counts first at `t + 4`); a counter that is itself written takes the value instead
//!   of counting.
//! - Counters of instruction cycles count at the end of a cycle, at clocks that are multiples of four.
//! - Pins change at any clock.

pub mod adc;
pub mod comparator;
pub mod eeprom;
pub mod map;
pub mod ports;
pub mod psp;
pub mod ssp;
pub mod timer0;
pub mod timers;
pub mod usart;
pub mod watchdog;

pub use emu_core::device::Device;
pub(crate) use emu_core::device::SignalReceiver;
use emu_core::device::{DeviceSignal, Outbox};
use map::{InterruptFlag, Pic16Line};

/// How a peripheral overrides the port of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Pic16Drive {
    /// No override: the port controls the pin.
    #[default]
    Port,
    /// Drives 0 instead of the port's latch.
    Low,
    /// Drives 1 instead of the port's latch.
    High,
    /// Does not drive the pin.
    Float,
    /// Overrides the latch with 0 for I2C: TRIS = 1 releases the pin, TRIS = 0 drives it low.
    Open,
}

emu_core::state! { enum Pic16Drive { 0 = Port, 1 = Low, 2 = High, 3 = Float, 4 = Open } }

impl Pic16Drive {
    /// Returns High for true, Low for false.
    #[must_use]
    pub const fn from_bit(high: bool) -> Pic16Drive {
        if high { Pic16Drive::High } else { Pic16Drive::Low }
    }
}

/// An effect of a peripheral outside itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Pic16Signal {
    /// An interrupt flag is set.
    Flag {
        /// Clock at which it takes effect.
        t: u64,
        /// The flag.
        flag: InterruptFlag,
    },
    /// The override of a line changes.
    Drive {
        /// Clock at which it takes effect.
        t: u64,
        /// The line.
        line: Pic16Line,
        /// The new override.
        drive: Pic16Drive,
    },
    /// The USART has sent a byte; its stop bit is over.
    Sent {
        /// Clock of the end.
        t: u64,
        /// The byte.
        byte: u8,
    },
    /// The special event of a CCP module starts a conversion.
    Convert {
        /// Clock of the event.
        t: u64,
    },
    /// The watchdog has timed out.
    Watchdog {
        /// Clock of the time-out.
        t: u64,
    },
    /// A word of program memory must be read for EEDATA and EEDATH.
    FlashRead {
        /// Program word address.
        addr: u16,
    },
    /// Program words must be written.
    FlashWrite {
        /// Word address of the first word.
        addr: u16,
        /// The words.
        words: Vec<u16>,
    },
    /// Program words must be programmed without an erase: bits that are 0 become 0, the others do not change.
    FlashProgram {
        /// Word address of the first word.
        addr: u16,
        /// The words.
        words: Vec<u16>,
    },
    /// Instructions whose first cycle starts at `from` or later and before `until` execute as NOP.
    Ignore {
        /// First clock.
        from: u64,
        /// End clock (exclusive).
        until: u64,
    },
    /// Timer 2 has reached its period, for peripherals that use it as a clock.
    Timer2 {
        /// Clock of the event.
        t: u64,
    },
    /// The core halts up to a clock.
    Stall {
        /// Clock at which the core continues.
        until: u64,
    },
}

/// List in which peripherals leave their signals. Signals of one peripheral are in order of time.
pub type Pic16Outbox = Outbox<Pic16Signal>;

impl DeviceSignal for Pic16Signal {
    type Line = Pic16Line;
}
