//! The peripherals around the core, one file each, and the interface that they share.
//!
//! Time is counted in cycles of the core's clock since power-on, `t`. Cycle `t` is between the edges `t` and
//! `t + 1`. Time continues while clocks are stopped in sleep, at the rate that they had. The I/O clock is the
//! core's clock, so peripherals on it count cycles. A peripheral on another oscillator (watchdog, EEPROM,
//! timer 2 on its crystal) gets the clock in Hz by [`Device::set_clock_hz`]. Nothing is called in every
//! cycle: a peripheral computes its state at a given cycle, and the cycle of its next event.
//!
//! Within a cycle:
//!
//! - An instruction that reads in cycle `t` sees everything up to the edge `t`: [`Device::read`] gets `t`,
//!   and everything due at `t` or before has been done.
//! - A write in cycle `t` takes effect at the edge that ends the cycle: [`Device::write`] gets `t + 1`.
//!   What happens at that very edge by the settings before the write still happens, and flags that it sets
//!   stay set. Then the write takes effect (a counter that is written takes the value instead of counting).
//! - Pins change at edges; [`Device::on_line_changed`] gets the edge. Synchronizers belong to the
//!   peripheral: a flip-flop that samples a line at the edge `t` sees its level in cycle `t - 1`.
//!
//! Interrupt flags are in the registers of the peripheral. It computes a flag that nobody waits for only when
//! the flag is read: [`Device::next_deadline`] considers only flags that are enabled or that another
//! peripheral listens to.

pub use emu_core::device::Device;
pub(crate) use emu_core::device::SignalReceiver;
use emu_core::device::{DeviceSignal, Outbox};
use emu_core::state;

pub mod adc;
pub mod comparator;
mod edges;
pub mod eeprom;
pub mod external;
pub(crate) mod ports;
pub mod real_time_delay;
pub mod spi;
pub mod spm;
pub mod timers;
pub mod twi;
pub mod usart;
pub mod watchdog;

/// A line between a peripheral and a pin. The chip's row and the number of the peripheral select the pin. A
/// line that the chip does not have stays low.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum AvrLine {
    /// Clock input of a timer, T0 to T3.
    T,
    /// Input capture of a timer, ICP1 or ICP3, or the comparator instead of the pin.
    Icp,
    /// Compare output A of a timer.
    OcA,
    /// Compare output B of a timer.
    OcB,
    /// Compare output C of a timer.
    OcC,
    /// USART: transmit.
    Txd,
    /// USART: receive.
    Rxd,
    /// USART: clock of synchronous mode.
    Xck,
    /// SPI clock.
    Sck,
    /// SPI data from the slave.
    Miso,
    /// SPI data from the master.
    Mosi,
    /// SPI slave select, active low.
    Ss,
    /// Two-wire clock.
    Scl,
    /// Two-wire data.
    Sda,
    /// External interrupt: the pin INT0 to INT7 by its number.
    Int(u8),
    /// Pin change interrupt: the pin PCINT0 to PCINT31 by its number.
    Pc(u8),
}

/// How a peripheral overrides the port of a pin (the overriding signals of section 14.3).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum AvrDrive {
    /// No override: the port controls the pin.
    #[default]
    Port,
    /// Overrides the level of an output; DDR still selects whether the pin is one (PVOE).
    Value(bool),
    /// Makes the pin an output of this level, regardless of DDR (DDOE, DDOV = 1, PVOE).
    Output(bool),
    /// Makes the pin an input, regardless of DDR; PORT still controls the pull-up (DDOE, DDOV = 0).
    Input,
}

state! { enum AvrDrive { 0 = Port, 1 = Value(high), 2 = Output(high), 3 = Input } }

/// An effect of a peripheral outside itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum AvrSignal {
    /// Overrides a pin from the edge `t` on.
    Drive {
        /// Edge at which it takes effect, in cycles.
        t: u64,
        /// Line of the peripheral.
        line: AvrLine,
        /// New override.
        drive: AvrDrive,
    },
    /// A USART has sent a character; its last stop bit ends at the edge `t`.
    Sent {
        /// Edge, in cycles.
        t: u64,
        /// Lower eight bits of the character.
        byte: u8,
    },
    /// A flag was set that other peripherals listen to.
    Flag {
        /// Edge, in cycles.
        t: u64,
        /// Interrupt number of the flag in the peripheral.
        irq: u8,
    },
    /// The chip must be reset (watchdog).
    Reset {
        /// Edge, in cycles.
        t: u64,
    },
    /// The core halts and starts its next instruction at the edge `until`.
    Stall {
        /// Edge, in cycles.
        until: u64,
    },
    /// A page of program memory is erased.
    ErasePage {
        /// Byte address of the first byte of the page.
        addr: u32,
    },
    /// Words are programmed into program memory: bits that are 0 become 0, the others do not change.
    WritePage {
        /// Byte address of the first word.
        addr: u32,
        /// The words.
        words: Vec<u16>,
    },
}

/// List in which peripherals leave their signals. Signals of one peripheral are in order of time.
pub type AvrOutbox = Outbox<AvrSignal>;

impl DeviceSignal for AvrSignal {
    type Line = AvrLine;
}
