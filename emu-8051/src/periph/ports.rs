//! The ports (user's manual, "Port structures and operation"): latches, and pins that both sides can drive.
//!
//! A latch of 0 pulls its pin low. A latch of 1 releases it: ports 1 to 3 then have weak pull-ups; port 0
//! (and P1.0, P1.1 of the AT89C2051 and AT89C4051) has none. A driver that pulls low wins. If the chip pulls
//! a pin low that the outside drives high, a contention is reported.

use emu_core::pins::{PinId, PinLevel, PinState};
use emu_core::{PinOutput, state};

use crate::chips::Mcs51Part;
use crate::periph::map::pin;

/// Number of pins: all ports and RST.
pub const PINS: usize = 33;

/// Latches, pins, and how other peripherals drive the pins.
#[derive(Debug, Clone)]
pub struct Mcs51Ports {
    latch: [u8; 4],
    pins: [PinState; PINS],
    /// Whether the serial port pulls TXD low.
    pub txd_low: bool,
    /// Whether mode 0 of the serial port pulls RXD low.
    pub rxd_low: bool,
    /// Whether the clock output of timer 2 pulls T2 low.
    pub t2_low: bool,
    /// Whether the watchdog drives RST high.
    pub rst_high: bool,
    /// Whether P0 and P2 carry addresses and data of external program memory.
    has_bus: bool,
    has_comparator: bool,
}

state! { Mcs51Ports { latch, pins, txd_low, rxd_low, t2_low, rst_high } stays { has_bus, has_comparator } }

impl Mcs51Ports {
    /// The ports after reset. `bus` means that P0 and P2 are used by external program memory.
    #[must_use]
    pub fn new(part: &Mcs51Part, bus: bool) -> Mcs51Ports {
        let mut ports = Mcs51Ports {
            latch: [0xFF; 4],
            // A pin that nothing drives reads high until something has pulled it low.
            pins: [PinState::new_charged(); PINS],
            txd_low: false,
            rxd_low: false,
            t2_low: false,
            rst_high: false,
            has_bus: bus,
            has_comparator: part.has_comparator,
        };
        ports.pins[usize::from(pin::RST)] = PinState::default();
        (0..PINS as PinId).for_each(|pin| _ = ports.update_level(pin, 0));
        ports
    }

    /// Sets the latches to ones and releases the alternate functions; drives from outside stay. The caller
    /// must update the pins.
    pub fn reset(&mut self) {
        self.latch = [0xFF; 4];
        (self.txd_low, self.rxd_low, self.t2_low) = (false, false, false);
    }

    /// The latch of a port, 0 to 3.
    #[must_use]
    pub const fn latch(&self, port: usize) -> u8 {
        self.latch[port & 3]
    }

    /// Writes a latch. Returns the bits that changed; the caller must update their pins.
    pub const fn set_latch(&mut self, port: usize, value: u8) -> u8 {
        let changed = self.latch[port & 3] ^ value;
        self.latch[port & 3] = value;
        changed
    }

    /// The levels of a port's pins.
    #[must_use]
    pub fn input(&self, port: usize) -> u8 {
        let pins = self.pins.iter().skip((port & 3) * 8).take(8);
        let levels = pins.enumerate().fold(0, |byte, (bit, pin)| byte | u8::from(pin.reads_high) << bit);
        if self.has_comparator && port & 3 == 3 {
            levels & !0x40 | u8::from(self.comparator_out()) << 6
        } else {
            levels
        }
    }

    /// The state of a pin; an undriven one if the pin does not exist.
    #[must_use]
    pub fn pin(&self, pin: PinId) -> PinState {
        self.pins.get(usize::from(pin)).copied().unwrap_or_default()
    }

    /// All pins.
    #[must_use]
    pub fn pins(&self) -> &[PinState] {
        &self.pins
    }

    /// Drives a pin from outside from the cycle `at` on. Returns its new level if that changed.
    pub fn drive(&mut self, pin: PinId, level: PinLevel, at: u64) -> Option<PinLevel> {
        self.update_pin(pin, at, |wire| wire.external = level)
    }

    /// Updates a pin at the cycle `at` after a driver of it has changed. Returns its new level if that
    /// changed.
    pub fn update_level(&mut self, pin: PinId, at: u64) -> Option<PinLevel> {
        self.update_pin(pin, at, |_| ())
    }

    fn update_pin(&mut self, pin: PinId, at: u64, outside: impl FnOnce(&mut PinState)) -> Option<PinLevel> {
        let wire = self.pins.get_mut(usize::from(pin))?;
        let before = wire.level();
        outside(wire);
        let PinOutput { level: own, pull_up } = self.driven_level(pin);
        let wire = self.pins.get_mut(usize::from(pin))?;
        (wire.driven, wire.pull_up) = (own, pull_up);
        wire.settle(at);
        let after = wire.level();
        (before != after).then_some(after)
    }

    /// Whether chip and outside drive a pin to opposite levels, or the outside drives a pin of the bus.
    #[must_use]
    pub fn has_contention(&self, pin: PinId) -> bool {
        let wire = self.pin(pin);
        wire.has_contention() || self.is_bus(pin) && matches!(wire.external, PinLevel::Low | PinLevel::High)
    }

    /// Output of the analog comparator: whether P1.0 is above P1.1 (AT89C2051 data sheet, "Analog
    /// comparator").
    #[must_use]
    pub fn comparator_out(&self) -> bool {
        self.pin(8).reads_high && !self.pin(9).reads_high
    }

    /// Whether the pin is used by external program memory.
    #[must_use]
    pub const fn is_bus(&self, pin: PinId) -> bool {
        self.has_bus && matches!(pin / 8, 0 | 2)
    }

    /// How the chip drives a pin: the level, and whether a pull-up is on.
    fn driven_level(&self, pin: PinId) -> PinOutput {
        let port = usize::from(pin / 8);
        let low = match pin {
            // RST has an internal pull-down ("Reset").
            pin::RST if self.rst_high => return PinOutput { level: PinLevel::High, pull_up: false },
            pin::RST if self.pin(pin).external == PinLevel::Float => {
                return PinOutput { level: PinLevel::Low, pull_up: false };
            }
            pin::RST => return PinOutput { level: PinLevel::Float, pull_up: false },
            _ if self.is_bus(pin) => return PinOutput { level: PinLevel::Float, pull_up: false },
            pin::OUT if self.has_comparator => {
                return PinOutput { level: PinLevel::from_bit(self.comparator_out()), pull_up: false };
            }
            pin::RXD => self.rxd_low,
            pin::TXD => self.txd_low,
            pin::T2 => self.t2_low,
            _ => false,
        };
        let latch = self.latch.get(port).is_none_or(|latch| latch >> (pin % 8) & 1 == 1);
        let open = port == 0 || self.has_comparator && matches!(pin, 8 | 9);
        PinOutput { level: if low || !latch { PinLevel::Low } else { PinLevel::Float }, pull_up: !open }
    }
}
