//! Devices at the pins of a chip, whatever the chip, as models that are told of edges. They move lines only in answer to edges.
//!
//! ```text
//!   eeprom24.rs  24Cxx at a two-wire bus     cells.rs  what they hold, shared by clones
//!   flash25.rs   25Qxx at an SPI bus
//! ```

pub mod cells;
pub mod eeprom24;
pub mod flash25;

use cells::SharedBytes;
use eeprom24::Eeprom24;
use emu_core::pins::PinLevel;
use flash25::Flash25;

/// A device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ExternalDevice {
    /// At a two-wire bus.
    Eeprom(Eeprom24),
    /// At an SPI bus.
    Flash(Flash25),
}

/// Nanoseconds from the edge of SCL to that of SDA: between tDH and tAA of the data sheets, 50 to 900 ns.
const SDA_NS: u64 = 300;

impl ExternalDevice {
    /// Names of its pins.
    #[must_use]
    pub fn pins(&self) -> &'static [&'static str] {
        match self {
            ExternalDevice::Eeprom(_) => &eeprom24::PINS,
            ExternalDevice::Flash(_) => &flash25::PINS,
        }
    }

    /// The pin that it drives.
    #[must_use]
    pub fn driven_pin(&self) -> usize {
        match self {
            ExternalDevice::Eeprom(_) => 0,
            ExternalDevice::Flash(_) => 3,
        }
    }

    /// What it does to that pin. The lines of a two-wire bus have resistors to the supply.
    #[must_use]
    pub fn driven_level(&self) -> PinLevel {
        match self {
            ExternalDevice::Eeprom(eeprom) if eeprom.pulls_sda => PinLevel::Low,
            ExternalDevice::Eeprom(_) => PinLevel::PullUp,
            ExternalDevice::Flash(flash) => flash.out.map_or(PinLevel::Float, PinLevel::from_bit),
        }
    }

    /// Nanoseconds from an edge to its answer; the answer to an edge of SCL must not come with that edge, since it would be a start
    /// or a stop.
    #[must_use]
    pub fn delay_ns(&self) -> u64 {
        match self {
            ExternalDevice::Eeprom(_) => SDA_NS,
            ExternalDevice::Flash(_) => 0,
        }
    }

    /// The level of a pin has changed at the clock `t`, of `hz` to a second.
    pub fn on_pin_change(&mut self, pin: usize, high: bool, t: u64, hz: u64) {
        match self {
            ExternalDevice::Eeprom(eeprom) => eeprom.on_pin_change(pin, high, t, hz),
            ExternalDevice::Flash(flash) => flash.on_pin_change(pin, high, t, hz),
        }
    }

    /// What it holds.
    #[must_use]
    pub fn cells(&self) -> &SharedBytes {
        match self {
            ExternalDevice::Eeprom(eeprom) => &eeprom.cells,
            ExternalDevice::Flash(flash) => &flash.cells,
        }
    }

    /// What it holds, to be set.
    pub fn cells_mut(&mut self) -> &mut SharedBytes {
        match self {
            ExternalDevice::Eeprom(eeprom) => &mut eeprom.cells,
            ExternalDevice::Flash(flash) => &mut flash.cells,
        }
    }
}
