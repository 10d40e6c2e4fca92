//! The ports (section 14): direction, output and pull-up of every pin, and the overrides by peripherals.

use emu_core::pins::{PinId, PinLevel, PinState};
use emu_core::{PinOutput, state};

use super::AvrDrive;

/// Largest number of ports on a chip, of eight pins each.
pub(crate) const PORT_COUNT: usize = 7;

/// Largest number of pins on a chip.
pub(crate) const PIN_COUNT: usize = PORT_COUNT * 8;

/// All ports of the chip.
#[derive(Debug, Clone)]
pub(crate) struct AvrPorts {
    pins: [PinState; PIN_COUNT],
    /// Overrides of the pins by peripherals.
    over: [AvrDrive; PIN_COUNT],
    ddr: [u8; PORT_COUNT],
    port: [u8; PORT_COUNT],
    /// Mask of the existing bits of each port.
    existing_bits: &'static [u8],
    /// Reset pin, which has its own pull-up; None if the pin is a port pin.
    reset: Option<PinId>,
    /// PUD: pull-ups disabled.
    pub pull_ups_off: bool,
    /// True during a reset: all pins are inputs without pull-ups.
    pub held_in_reset: bool,
}

state! {
    AvrPorts { pins, over, ddr, port, pull_ups_off, held_in_reset } stays { existing_bits, reset }
}

impl AvrPorts {
    /// Returns ports with all pins as inputs without pull-ups and nothing attached. `exist` has the existing
    /// bits of each port; `reset` is the reset pin, unless it is a port pin.
    pub(crate) fn new(exist: &'static [u8], reset: Option<PinId>) -> AvrPorts {
        AvrPorts {
            pins: [PinState::default(); PIN_COUNT],
            over: [AvrDrive::Port; PIN_COUNT],
            ddr: [0; PORT_COUNT],
            port: [0; PORT_COUNT],
            existing_bits: exist,
            reset,
            pull_ups_off: false,
            held_in_reset: false,
        }
    }

    /// Resets the registers. The levels of the pins do not change until they are updated.
    pub(crate) fn reset(&mut self) {
        *self = AvrPorts {
            pins: self.pins,
            held_in_reset: self.held_in_reset,
            ..AvrPorts::new(self.existing_bits, self.reset)
        };
    }

    /// Returns the pins in the chip's list.
    pub(crate) fn pins(&self) -> &[PinState] {
        &self.pins[..(self.existing_bits.len() * 8).min(PIN_COUNT)]
    }

    /// Returns the state of `pin`; a pin that does not exist floats.
    pub(crate) fn pin(&self, pin: PinId) -> PinState {
        self.pins.get(usize::from(pin)).copied().unwrap_or_default()
    }

    /// Returns DDRx.
    pub(crate) fn ddr(&self, port: usize) -> u8 {
        self.ddr[port % PORT_COUNT]
    }

    /// Returns PORTx.
    pub(crate) fn port(&self, port: usize) -> u8 {
        self.port[port % PORT_COUNT]
    }

    /// Reports whether DDR makes a pin an output.
    pub(crate) fn is_output(&self, pin: PinId) -> bool {
        self.ddr(usize::from(pin / 8)) >> (pin % 8) & 1 == 1
    }

    /// Sets DDRx; returns the bits that changed.
    pub(crate) fn set_ddr(&mut self, port: usize, value: u8) -> u8 {
        let value = value & self.existing_bits.get(port).copied().unwrap_or(0);
        std::mem::replace(&mut self.ddr[port % PORT_COUNT], value) ^ value
    }

    /// Sets PORTx; returns the bits that changed.
    pub(crate) fn set_port(&mut self, port: usize, value: u8) -> u8 {
        let value = value & self.existing_bits.get(port).copied().unwrap_or(0);
        std::mem::replace(&mut self.port[port % PORT_COUNT], value) ^ value
    }

    /// Sets the override of a pin. It takes effect at the next [`Self::update_level`].
    pub(crate) fn set_driver(&mut self, pin: PinId, drive: AvrDrive) {
        if let Some(over) = self.over.get_mut(usize::from(pin)) {
            *over = drive;
        }
    }

    /// Returns PINx as read in the cycle `now`: the levels one cycle before, because of the synchronizer
    /// (14.2.4). The reset pin reads 0.
    pub(crate) fn input(&self, port: usize, now: u64) -> u8 {
        let wires = self.port_pins(port);
        let bits =
            wires.iter().enumerate().fold(0, |bits, (i, pin)| bits | u8::from(synchronized_level(pin, now)) << i);
        let reset = self.reset.filter(|pin| usize::from(pin / 8) == port).map_or(0, |pin| 1 << (pin % 8));
        bits & self.existing_bits.get(port).copied().unwrap_or(0) & !reset
    }

    /// Reports whether PINx reads the same in every cycle from `now` on, if no pin changes.
    pub(crate) fn is_stable(&self, port: usize, now: u64) -> bool {
        self.port_pins(port).iter().all(|pin| synchronized_level(pin, now) == pin.reads_high)
    }

    fn port_pins(&self, port: usize) -> &[PinState] {
        let first = port % PORT_COUNT * 8;
        &self.pins[first..first + 8]
    }

    /// Drives a pin from outside from the cycle `at` on. Returns the new level if it changed.
    pub(crate) fn drive(&mut self, pin: PinId, outside: PinLevel, at: u64) -> Option<PinChange> {
        self.update_pin(pin, at, |pin| pin.external = outside)
    }

    /// Computes how the chip drives `pin` from the cycle `at` on. Returns the new level if it changed.
    pub(crate) fn update_level(&mut self, pin: PinId, at: u64) -> Option<PinChange> {
        let drivers = self.driven_level(pin);
        self.update_pin(pin, at, |pin| PinOutput { level: pin.driven, pull_up: pin.pull_up } = drivers)
    }

    fn update_pin(&mut self, pin: PinId, at: u64, change: impl FnOnce(&mut PinState)) -> Option<PinChange> {
        let pin = self.pins.get_mut(usize::from(pin))?;
        let before = pin.level();
        change(pin);
        let toggled = pin.settle(at);
        (toggled || pin.level() != before).then(|| PinChange { level: pin.level(), toggled })
    }

    /// Computes how the chip drives a pin: the level, or floating, and the pull-up (table 14-1, figure 14-5).
    fn driven_level(&self, pin: PinId) -> PinOutput {
        if self.reset == Some(pin) {
            return PinOutput { level: PinLevel::Float, pull_up: true };
        }
        if self.held_in_reset {
            return PinOutput { level: PinLevel::Float, pull_up: false };
        }
        let high = self.port(usize::from(pin / 8)) >> (pin % 8) & 1 == 1;
        let over = self.over.get(usize::from(pin)).copied().unwrap_or_default();
        let output = match over {
            AvrDrive::Output(level) => Some(level),
            AvrDrive::Input => None,
            AvrDrive::Value(level) => self.is_output(pin).then_some(level),
            AvrDrive::Port => self.is_output(pin).then_some(high),
        };
        match output {
            Some(level) => PinOutput { level: PinLevel::from_bit(level), pull_up: false },
            None => PinOutput { level: PinLevel::Float, pull_up: high && !self.pull_ups_off },
        }
    }
}

/// Result of a change of a pin.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PinChange {
    /// New level; [`PinLevel::Float`] if nothing drives the pin.
    pub level: PinLevel,
    /// True if the logic level on the wire changed.
    pub toggled: bool,
}

fn synchronized_level(pin: &PinState, now: u64) -> bool {
    pin.was_high_at(now.saturating_sub(1))
}
