//! Devices at the pins of any chip, as models that react to edges. They change lines only in answer to edges.
//!
//! ```text
//!   eeprom24.rs  24Cxx at a two-wire bus     cells.rs  their contents, shared by clones
//!   flash25.rs   25Qxx at an SPI bus         attached_devices.rs  runs a chip with devices
//! ```

pub mod attached_devices;
pub mod cells;
pub mod eeprom24;
pub mod flash25;

use cells::SharedBytes;
use eeprom24::Eeprom24;
use emu_core::pins::PinLevel;
use flash25::Flash25;

/// An attached device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ExternalDevice {
    /// An EEPROM at a two-wire bus.
    Eeprom(Eeprom24),
    /// A flash memory at an SPI bus.
    Flash(Flash25),
}

/// Nanoseconds from an edge of SCL to the following edge of SDA: between tDH and tAA of the data sheets, 50
/// to 900 ns.
const SDA_NS: u64 = 300;

impl ExternalDevice {
    /// Returns the names of its pins.
    #[must_use]
    pub fn pins(&self) -> &'static [&'static str] {
        match self {
            ExternalDevice::Eeprom(_) => &eeprom24::PINS,
            ExternalDevice::Flash(_) => &flash25::PINS,
        }
    }

    /// Returns the pin that it drives.
    #[must_use]
    pub fn driven_pin(&self) -> usize {
        match self {
            ExternalDevice::Eeprom(_) => 0,
            ExternalDevice::Flash(_) => 3,
        }
    }

    /// Returns the level of the driven pin. The lines of a two-wire bus have pull-up resistors.
    #[must_use]
    pub fn driven_level(&self) -> PinLevel {
        match self {
            ExternalDevice::Eeprom(eeprom) if eeprom.pulls_sda => PinLevel::Low,
            ExternalDevice::Eeprom(_) => PinLevel::PullUp,
            ExternalDevice::Flash(flash) => flash.out.map_or(PinLevel::Float, PinLevel::from_bit),
        }
    }

    /// Returns the delay of an answer after its edge in nanoseconds. The answer to an edge of SCL must come
    /// later than the edge; otherwise it would be a start or a stop.
    #[must_use]
    pub fn delay_ns(&self) -> u64 {
        match self {
            ExternalDevice::Eeprom(_) => SDA_NS,
            ExternalDevice::Flash(_) => 0,
        }
    }

    /// Reports a level change of a pin at the clock `t`; there are `hz` clocks per second.
    pub fn on_pin_change(&mut self, pin: usize, high: bool, t: u64, hz: u64) {
        match self {
            ExternalDevice::Eeprom(eeprom) => eeprom.on_pin_change(pin, high, t, hz),
            ExternalDevice::Flash(flash) => flash.on_pin_change(pin, high, t, hz),
        }
    }

    /// Returns its contents.
    #[must_use]
    pub fn cells(&self) -> &SharedBytes {
        match self {
            ExternalDevice::Eeprom(eeprom) => &eeprom.cells,
            ExternalDevice::Flash(flash) => &flash.cells,
        }
    }

    /// Returns its contents for modification.
    pub fn cells_mut(&mut self) -> &mut SharedBytes {
        match self {
            ExternalDevice::Eeprom(eeprom) => &mut eeprom.cells,
            ExternalDevice::Flash(flash) => &mut flash.cells,
        }
    }
}
