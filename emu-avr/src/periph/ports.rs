//! The ports (section 14): direction, output and pull-up of every pin, and what takes a pin over.

use emu_core::pins::{PinId, PinLevel, PinState};
use emu_core::state;

use super::AvrDrive;

/// Most ports of a chip, of eight pins each.
pub(crate) const PORT_COUNT: usize = 7;

/// Most pins.
pub(crate) const PIN_COUNT: usize = PORT_COUNT * 8;

/// All ports.
#[derive(Debug, Clone)]
pub(crate) struct AvrPorts {
    pins: [PinState; PIN_COUNT],
    /// What units do to the pins.
    over: [AvrDrive; PIN_COUNT],
    ddr: [u8; PORT_COUNT],
    port: [u8; PORT_COUNT],
    /// The bits that there are.
    existing_bits: &'static [u8],
    /// The reset pin, which has a pull-up of its own, where it is one.
    reset: Option<PinId>,
    /// PUD: pull-ups disabled.
    pub pull_ups_off: bool,
    /// A reset is going on: all pins are inputs without pull-ups.
    pub held_in_reset: bool,
}

state! {
    AvrPorts { pins, over, ddr, port, pull_ups_off, held_in_reset } stays { existing_bits, reset }
}

impl AvrPorts {
    /// All inputs, no pull-ups, nothing attached; `exist` are the bits of each port that there are, `reset` the
    /// reset pin, where it is one.
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

    /// Registers as after reset; wires and outside drives stay until the pins are settled.
    pub(crate) fn reset(&mut self) {
        *self = AvrPorts {
            pins: self.pins,
            held_in_reset: self.held_in_reset,
            ..AvrPorts::new(self.existing_bits, self.reset)
        };
    }

    /// The pins that the chip's list has.
    pub(crate) fn pins(&self) -> &[PinState] {
        &self.pins[..(self.existing_bits.len() * 8).min(PIN_COUNT)]
    }

    /// The pin `pin`; one that does not exist floats.
    pub(crate) fn pin(&self, pin: PinId) -> PinState {
        self.pins.get(usize::from(pin)).copied().unwrap_or_default()
    }

    /// DDRx.
    pub(crate) fn ddr(&self, port: usize) -> u8 {
        self.ddr[port % PORT_COUNT]
    }

    /// PORTx.
    pub(crate) fn port(&self, port: usize) -> u8 {
        self.port[port % PORT_COUNT]
    }

    /// DDR makes a pin an output.
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

    /// What a unit does to a pin from now on, until it is settled.
    pub(crate) fn set_driver(&mut self, pin: PinId, drive: AvrDrive) {
        if let Some(over) = self.over.get_mut(usize::from(pin)) {
            *over = drive;
        }
    }

    /// PINx as read in the cycle `now`: the wires as they were one cycle before, behind the synchroniser (14.2.4). The reset pin
    /// reads 0.
    pub(crate) fn input(&self, port: usize, now: u64) -> u8 {
        let wires = self.port_pins(port);
        let bits =
            wires.iter().enumerate().fold(0, |bits, (i, pin)| bits | u8::from(synchronized_level(pin, now)) << i);
        let reset = self.reset.filter(|pin| usize::from(pin / 8) == port).map_or(0, |pin| 1 << (pin % 8));
        bits & self.existing_bits.get(port).copied().unwrap_or(0) & !reset
    }

    /// True when PINx will read the same in every cycle from `now` on as long as no wire changes.
    pub(crate) fn is_stable(&self, port: usize, now: u64) -> bool {
        self.port_pins(port).iter().all(|pin| synchronized_level(pin, now) == pin.reads_high)
    }

    fn port_pins(&self, port: usize) -> &[PinState] {
        let first = port % PORT_COUNT * 8;
        &self.pins[first..first + 8]
    }

    /// Drives a pin from outside from the cycle `at` on. Returns the new level where it changed.
    pub(crate) fn drive(&mut self, pin: PinId, outside: PinLevel, at: u64) -> Option<PinChange> {
        self.update_pin(pin, at, |pin| pin.external = outside)
    }

    /// Works out what the chip does to `pin` from the cycle `at` on. Returns the new level where it changed.
    pub(crate) fn update_level(&mut self, pin: PinId, at: u64) -> Option<PinChange> {
        let drivers = self.driven_level(pin);
        self.update_pin(pin, at, |pin| (pin.driven, pin.pull_up) = drivers)
    }

    fn update_pin(&mut self, pin: PinId, at: u64, change: impl FnOnce(&mut PinState)) -> Option<PinChange> {
        let pin = self.pins.get_mut(usize::from(pin))?;
        let before = pin.level();
        change(pin);
        let toggled = pin.settle(at);
        (toggled || pin.level() != before).then(|| PinChange { level: pin.level(), toggled })
    }

    /// What the chip does to a pin: the level it drives, and its pull-up (table 14-1, figure 14-5).
    fn driven_level(&self, pin: PinId) -> (PinLevel, bool) {
        if self.reset == Some(pin) {
            return (PinLevel::Float, true);
        }
        if self.held_in_reset {
            return (PinLevel::Float, false);
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
            Some(level) => (PinLevel::from_bit(level), false),
            None => (PinLevel::Float, high && !self.pull_ups_off),
        }
    }
}

/// What has become of a pin.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PinChange {
    /// Its level, [`Level::Float`] where nothing holds it.
    pub level: PinLevel,
    /// The wire has another level than before.
    pub toggled: bool,
}

fn synchronized_level(pin: &PinState, now: u64) -> bool {
    pin.was_high_at(now.saturating_sub(1))
}
