//! Devices at the pins of a chip, whatever the chip, as models that are told of edges. They move lines only in answer to edges.
//!
//! ```text
//!   eeprom24.rs  24Cxx at a two-wire bus     cells.rs  what they hold, shared by clones
//!   flash25.rs   25Qxx at an SPI bus
//! ```

pub mod cells;
pub mod eeprom24;
pub mod flash25;

use cells::Cells;
use eeprom24::Eeprom;
use emu_core::pins::Level;
use flash25::Flash;

/// A device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Device {
    /// At a two-wire bus.
    Eeprom(Eeprom),
    /// At an SPI bus.
    Flash(Flash),
}

/// Nanoseconds from the edge of SCL to that of SDA: between tDH and tAA of the data sheets, 50 to 900 ns.
const SDA_NS: u64 = 300;

impl Device {
    /// Names of its pins.
    #[must_use]
    pub fn pins(&self) -> &'static [&'static str] {
        match self {
            Device::Eeprom(_) => &eeprom24::PINS,
            Device::Flash(_) => &flash25::PINS,
        }
    }

    /// The pin that it drives.
    #[must_use]
    pub fn driven(&self) -> usize {
        match self {
            Device::Eeprom(_) => 0,
            Device::Flash(_) => 3,
        }
    }

    /// What it does to that pin. The lines of a two-wire bus have resistors to the supply.
    #[must_use]
    pub fn level(&self) -> Level {
        match self {
            Device::Eeprom(eeprom) if eeprom.pulls => Level::Low,
            Device::Eeprom(_) => Level::PullUp,
            Device::Flash(flash) => flash.out.map_or(Level::Float, Level::of),
        }
    }

    /// Nanoseconds from an edge to its answer; the answer to an edge of SCL must not come with that edge, since it would be a start
    /// or a stop.
    #[must_use]
    pub fn delay_ns(&self) -> u64 {
        match self {
            Device::Eeprom(_) => SDA_NS,
            Device::Flash(_) => 0,
        }
    }

    /// The level of a pin has changed at the clock `t`, of `hz` to a second.
    pub fn line(&mut self, pin: usize, high: bool, t: u64, hz: u64) {
        match self {
            Device::Eeprom(eeprom) => eeprom.line(pin, high, t, hz),
            Device::Flash(flash) => flash.line(pin, high, t, hz),
        }
    }

    /// What it holds.
    #[must_use]
    pub fn cells(&self) -> &Cells {
        match self {
            Device::Eeprom(eeprom) => &eeprom.cells,
            Device::Flash(flash) => &flash.cells,
        }
    }

    /// What it holds, to be set.
    pub fn cells_mut(&mut self) -> &mut Cells {
        match self {
            Device::Eeprom(eeprom) => &mut eeprom.cells,
            Device::Flash(flash) => &mut flash.cells,
        }
    }
}
