//! The ports (DS30292, chapter 3): latches, TRIS, and pins that the chip and the outside can drive.
//!
//! The latch drives a pin if its TRIS bit is 0, or a peripheral that overrides it does. An open drain pin is
//! only pulled low. An analog input reads 0 regardless of its level. A pin that nothing drives keeps its
//! charge.

use emu_core::PinOutput;
use emu_core::pins::{PinId, PinLevel, PinState};

use super::Pic16Drive;
use crate::chips::{NO_PIN, Pic16Part, PortPins};

/// Largest number of pins on a chip.
pub const PIN_COUNT: usize = 48;

/// Override of a pin by a peripheral.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct PinDriver {
    drive: Pic16Drive,
    /// True if the override is independent of TRIS.
    over_tris: bool,
}

emu_core::state! { PinDriver { drive, over_tris } }

/// Result of a change of a pin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PinChange {
    /// New level of the pin.
    pub level: PinLevel,
    /// True if the pin reads differently than before; a pin that starts to float does not.
    pub toggled: bool,
}

/// Latches, directions, and the pins.
#[derive(Debug, Clone)]
pub struct Pic16Ports {
    ports: &'static [PortPins],
    latch: [u8; 5],
    tris: [u8; 5],
    taken: [PinDriver; PIN_COUNT],
    /// Mask of the pins that are analog inputs and read 0.
    analog: u64,
    /// Mask of the pins that the configuration assigns to other functions: they read 0.
    withheld: u64,
    /// Mask of the pins that a peripheral uses completely.
    taken_whole: u64,
    /// True if the pull-ups of port B are on.
    pull_ups: bool,
    pins: [PinState; PIN_COUNT],
    /// Mask of the high pins of each port, then mask of the pins that a program can read.
    high: [u8; 5],
    seen: [u8; 5],
    /// Port and bit of every pin; port 7 if it belongs to none.
    at: [(u8, u8); PIN_COUNT],
    /// Mask of the pins on which others than the port depend.
    concerned: u64,
    /// Mask of each port's plain pins: outputs that follow the latch and on which nothing else depends. Then
    /// a mask of the ports for which it must be computed again.
    plain: [u8; 5],
    stale: u8,
}

emu_core::state! {
    Pic16Ports { latch, tris, taken, analog, taken_whole, pull_ups, pins, high, seen }
    stays { ports, withheld, at, concerned, plain, stale }, then |ports: &mut Pic16Ports| ports.stale = 0xFF
}

/// Index of port B in the list of ports.
pub const PORTB: usize = 1;
/// Index of port D in the list of ports.
pub const PORTD: usize = 3;

impl Pic16Ports {
    /// Returns the ports after reset, with all latches 0. `withheld` is a mask of the pins that the
    /// configuration assigns to other functions.
    #[must_use]
    pub fn new(part: &Pic16Part, withheld: u64) -> Pic16Ports {
        let mut at = [(7, 0); PIN_COUNT];
        for (number, port) in part.ports.iter().enumerate() {
            for (bit, &pin) in port.pins.iter().enumerate() {
                if let Some(place) = at.get_mut(usize::from(pin)) {
                    *place = (number as u8, bit as u8);
                }
            }
        }
        let mut ports = Pic16Ports {
            ports: part.ports,
            latch: [0; 5],
            tris: [0xFF; 5],
            taken: [PinDriver::default(); PIN_COUNT],
            analog: 0,
            withheld,
            taken_whole: 0,
            pull_ups: false,
            pins: [PinState::default(); PIN_COUNT],
            high: [0; 5],
            seen: [0; 5],
            at,
            concerned: u64::MAX,
            plain: [0; 5],
            stale: 0xFF,
        };
        ports.update_plain_pins();
        // Nothing pulls the reset pin low unless it is driven from outside.
        if let Some(pin) = ports.pins.get_mut(usize::from(part.mclr)) {
            *pin = PinState::new_charged();
        }
        ports
    }

    /// Makes all pins inputs without overrides and pull-ups; latches and outside drives do not change. The
    /// caller must update the pins.
    pub fn reset(&mut self) {
        self.stale = 0xFF;
        self.tris = [0xFF; 5];
        self.taken = [PinDriver::default(); PIN_COUNT];
        self.pull_ups = false;
    }

    /// Returns the index of the first port for which `is` holds.
    #[must_use]
    pub fn port(&self, is: impl Fn(&PortPins) -> bool) -> Option<usize> {
        self.ports.iter().position(is)
    }

    /// Returns the mask of the existing pins of a port.
    #[must_use]
    pub fn mask(&self, port: usize) -> u8 {
        self.bits(port, |pin| pin != NO_PIN)
    }

    /// Returns the mask of the bits of a port whose pins satisfy `is`.
    fn bits(&self, port: usize, is: impl Fn(PinId) -> bool) -> u8 {
        let pins = self.ports.get(port).map_or([NO_PIN; 8], |port| port.pins);
        pins.iter().enumerate().fold(0, |byte, (bit, &pin)| byte | u8::from(is(pin)) << bit)
    }

    /// Returns the pin of a bit of a port.
    #[must_use]
    pub fn pin_of(&self, port: usize, bit: usize) -> PinId {
        self.ports.get(port).and_then(|port| port.pins.get(bit)).copied().unwrap_or(NO_PIN)
    }

    /// Returns the latch of a port.
    #[must_use]
    pub fn latch(&self, port: usize) -> u8 {
        self.latch.get(port).copied().unwrap_or(0)
    }

    /// Returns the directions of a port: ones are inputs. Bits without a pin read 0.
    #[must_use]
    pub fn tris(&self, port: usize) -> u8 {
        let inputs = self.ports.get(port).map_or(0, |port| port.inputs);
        (self.tris.get(port).copied().unwrap_or(0) | inputs) & self.mask(port)
    }

    /// Sets the mask of the pins on which others than the port depend.
    pub fn set_peripheral_pins(&mut self, pins: u64) {
        if self.concerned != pins {
            self.concerned = pins;
            self.stale = 0xFF;
        }
    }

    /// Writes a latch at the clock `t`, and updates its plain pins. Returns the changed bits of the other
    /// pins, which the caller must update.
    pub fn write_latch(&mut self, port: usize, value: u8, t: u64) -> u8 {
        let (Some(latch), Some(row)) = (self.latch.get_mut(port), self.ports.get(port)) else { return 0 };
        let changed = std::mem::replace(latch, value) ^ value;
        if self.stale >> port & 1 == 1 {
            self.plain[port] = self.bits(port, |pin| self.is_plain(pin));
            self.stale &= !(1 << port);
        }
        let mut plain = changed & self.plain[port];
        self.high[port] = self.high[port] & !plain | value & plain;
        while plain != 0 {
            let bit = plain.trailing_zeros() as usize;
            plain &= plain - 1;
            if let Some(pin) = self.pins.get_mut(usize::from(row.pins[bit])) {
                pin.driven = PinLevel::from_bit(value >> bit & 1 == 1);
                pin.settle(t);
            }
        }
        changed & !self.plain[port]
    }

    /// Reports whether a pin is an output that only follows its latch.
    fn is_plain(&self, pin: PinId) -> bool {
        let driven = self.driven_level(pin).level != PinLevel::Float && self.pin(pin).external == PinLevel::Float;
        let taken = self.taken.get(usize::from(pin)).is_none_or(|taken| taken.drive != Pic16Drive::Port);
        let open = self
            .at
            .get(usize::from(pin))
            .is_none_or(|&(port, bit)| self.ports.get(usize::from(port)).is_none_or(|row| row.open >> bit & 1 == 1));
        driven && !taken && !open && self.concerned.checked_shr(pin.into()).unwrap_or(0) & 1 == 0
    }

    /// Writes the directions; the caller must update the pins.
    pub fn set_tris(&mut self, port: usize, value: u8) {
        if let Some(tris) = self.tris.get_mut(port) {
            *tris = value;
            self.stale |= 1 << port;
        }
    }

    /// Sets or removes the override of a pin; the caller must update the pin.
    pub fn set_driver(&mut self, pin: PinId, drive: Pic16Drive, over_tris: bool) {
        if let Some(taken) = self.taken.get_mut(usize::from(pin)) {
            *taken = PinDriver { drive, over_tris };
            self.stale = 0xFF;
        }
    }

    /// Switches the pull-ups of port B; the caller must update its pins.
    pub fn set_pull_ups(&mut self, on: bool) {
        self.pull_ups = on;
    }

    /// Sets the mask of the pins that are analog inputs.
    pub fn set_analog(&mut self, pins: u64) {
        self.analog = pins;
        self.update_plain_pins();
    }

    /// Recomputes which pins a program can read.
    fn update_plain_pins(&mut self) {
        for port in 0..self.seen.len() {
            let seen = self.bits(port, |pin| pin != NO_PIN && !self.is_analog(pin) && !self.is_withheld(pin));
            self.seen[port] = seen;
        }
    }

    /// Returns the mask of the pins that are analog inputs.
    #[must_use]
    pub fn analog(&self) -> u64 {
        self.analog
    }

    /// Reports whether a pin is an analog input.
    #[must_use]
    pub fn is_analog(&self, pin: PinId) -> bool {
        self.analog.checked_shr(pin.into()).unwrap_or(0) & 1 == 1
    }

    /// Sets the mask of the pins that a peripheral uses completely: they read 0 and are not driven. The
    /// caller must update them.
    pub fn reserve_pins(&mut self, pins: u64) {
        self.taken_whole = pins;
        self.stale = 0xFF;
        self.update_plain_pins();
    }

    fn is_withheld(&self, pin: PinId) -> bool {
        (self.withheld | self.taken_whole).checked_shr(pin.into()).unwrap_or(0) & 1 == 1
    }

    /// Returns the read value of a port: the levels of its pins; 0 for analog inputs, for pins with other
    /// functions by configuration, and for bits without a pin.
    #[must_use]
    #[inline]
    pub fn input(&self, port: usize) -> u8 {
        self.high.get(port).zip(self.seen.get(port)).map_or(0, |(high, seen)| high & seen)
    }

    /// Returns the bits of a port that are analog inputs.
    #[must_use]
    pub fn analog_bits(&self, port: usize) -> u8 {
        self.bits(port, |pin| pin != NO_PIN && self.is_analog(pin))
    }

    /// Returns the states of all pins.
    #[must_use]
    pub fn pins(&self) -> &[PinState] {
        &self.pins
    }

    /// Returns the state of a pin; a pin that does not exist floats.
    #[must_use]
    pub fn pin(&self, pin: PinId) -> PinState {
        self.pins.get(usize::from(pin)).copied().unwrap_or_default()
    }

    /// Drives a pin from outside from the clock `t` on; returns what changed.
    pub fn drive(&mut self, pin: PinId, level: PinLevel, t: u64) -> Option<PinChange> {
        let before = self.pin(pin);
        self.pins.get_mut(usize::from(pin))?.external = level;
        self.stale = 0xFF;
        self.settle_from(pin, before, t)
    }

    /// Updates a pin at the clock `t` after a change of what drives it; returns what changed.
    pub fn update_level(&mut self, pin: PinId, t: u64) -> Option<PinChange> {
        self.settle_from(pin, self.pin(pin), t)
    }

    fn settle_from(&mut self, pin: PinId, before: PinState, t: u64) -> Option<PinChange> {
        let PinOutput { level: own, pull_up } = self.driven_level(pin);
        let wire = self.pins.get_mut(usize::from(pin))?;
        (wire.driven, wire.pull_up) = (own, pull_up);
        wire.settle(t);
        let (after, high) = (wire.level(), wire.reads_high);
        let (port, bit) = self.at[usize::from(pin)];
        if let Some(levels) = self.high.get_mut(usize::from(port)) {
            *levels = *levels & !(1 << bit) | u8::from(high) << bit;
        }
        let toggled = before.reads_high != high;
        (before.level() != after || toggled).then_some(PinChange { level: after, toggled })
    }

    /// Computes how the chip drives a pin: the level, and whether the pull-up is on.
    fn driven_level(&self, pin: PinId) -> PinOutput {
        let (port, bit) = self.at.get(usize::from(pin)).map_or((7, 0), |&(port, bit)| (usize::from(port), bit));
        let Some(row) = self.ports.get(port).filter(|_| !self.is_withheld(pin)) else {
            return PinOutput { level: PinLevel::Float, pull_up: false };
        };
        let taken = self.taken.get(usize::from(pin)).copied().unwrap_or_default();
        let input = (self.tris[port] | row.inputs) >> bit & 1 == 1;
        let wanted = match taken.drive {
            Pic16Drive::Port => PinLevel::from_bit(self.latch[port] >> bit & 1 == 1),
            Pic16Drive::Low => PinLevel::Low,
            Pic16Drive::High => PinLevel::High,
            Pic16Drive::Float => PinLevel::Float,
            Pic16Drive::Open if input => PinLevel::Float,
            Pic16Drive::Open => PinLevel::Low,
        };
        let holds_back = input && !(taken.over_tris && taken.drive != Pic16Drive::Port);
        let open = row.open >> bit & 1 == 1;
        let level = if holds_back || open && wanted == PinLevel::High { PinLevel::Float } else { wanted };
        PinOutput { level, pull_up: port == PORTB && self.pull_ups && input }
    }
}
