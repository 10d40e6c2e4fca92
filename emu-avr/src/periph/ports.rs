//! The ports (section 14): direction, output and pull-up of every pin, and what takes a pin over.

use emu_core::pins::{Level, Pin, PinId};
use emu_core::state;

use super::Drive;

/// Most ports of a chip, of eight pins each.
pub(crate) const PORTS: usize = 7;

/// Most pins.
pub(crate) const PINS: usize = PORTS * 8;

/// All ports.
#[derive(Debug, Clone)]
pub(crate) struct Ports {
    pins: [Pin; PINS],
    /// What units do to the pins.
    over: [Drive; PINS],
    ddr: [u8; PORTS],
    port: [u8; PORTS],
    /// The bits that there are.
    exist: &'static [u8],
    /// The reset pin, which has a pull-up of its own, where it is one.
    reset: Option<PinId>,
    /// PUD: pull-ups disabled.
    pub pull_ups_off: bool,
    /// A reset is going on: all pins are inputs without pull-ups.
    pub held: bool,
}

state! {
    Ports { pins, over, ddr, port, pull_ups_off, held } stays { exist, reset }
}

impl Ports {
    /// All inputs, no pull-ups, nothing attached; `exist` are the bits of each port that there are, `reset` the
    /// reset pin, where it is one.
    pub(crate) fn new(exist: &'static [u8], reset: Option<PinId>) -> Ports {
        Ports {
            pins: [Pin::default(); PINS],
            over: [Drive::Port; PINS],
            ddr: [0; PORTS],
            port: [0; PORTS],
            exist,
            reset,
            pull_ups_off: false,
            held: false,
        }
    }

    /// Registers as after reset; wires and outside drives stay until the pins are settled.
    pub(crate) fn reset(&mut self) {
        *self = Ports { pins: self.pins, held: self.held, ..Ports::new(self.exist, self.reset) };
    }

    /// The pins that the chip's list has.
    pub(crate) fn pins(&self) -> &[Pin] {
        &self.pins[..(self.exist.len() * 8).min(PINS)]
    }

    /// The pin `pin`; one that does not exist floats.
    pub(crate) fn pin(&self, pin: PinId) -> Pin {
        self.pins.get(usize::from(pin)).copied().unwrap_or_default()
    }

    /// DDRx.
    pub(crate) fn ddr(&self, port: usize) -> u8 {
        self.ddr[port % PORTS]
    }

    /// PORTx.
    pub(crate) fn port(&self, port: usize) -> u8 {
        self.port[port % PORTS]
    }

    /// DDR makes a pin an output.
    pub(crate) fn is_output(&self, pin: PinId) -> bool {
        self.ddr(usize::from(pin / 8)) >> (pin % 8) & 1 == 1
    }

    /// Sets DDRx; returns the bits that changed.
    pub(crate) fn set_ddr(&mut self, port: usize, value: u8) -> u8 {
        let value = value & self.exist.get(port).copied().unwrap_or(0);
        std::mem::replace(&mut self.ddr[port % PORTS], value) ^ value
    }

    /// Sets PORTx; returns the bits that changed.
    pub(crate) fn set_port(&mut self, port: usize, value: u8) -> u8 {
        let value = value & self.exist.get(port).copied().unwrap_or(0);
        std::mem::replace(&mut self.port[port % PORTS], value) ^ value
    }

    /// What a unit does to a pin from now on, until it is settled.
    pub(crate) fn take(&mut self, pin: PinId, drive: Drive) {
        if let Some(over) = self.over.get_mut(usize::from(pin)) {
            *over = drive;
        }
    }

    /// PINx as read in the cycle `now`: the wires as they were one cycle before, behind the synchroniser (14.2.4). The reset pin
    /// reads 0.
    pub(crate) fn input(&self, port: usize, now: u64) -> u8 {
        let wires = self.wires(port);
        let bits = wires.iter().enumerate().fold(0, |bits, (i, pin)| bits | u8::from(seen(pin, now)) << i);
        let reset = self.reset.filter(|pin| usize::from(pin / 8) == port).map_or(0, |pin| 1 << (pin % 8));
        bits & self.exist.get(port).copied().unwrap_or(0) & !reset
    }

    /// True when PINx will read the same in every cycle from `now` on as long as no wire changes.
    pub(crate) fn settled(&self, port: usize, now: u64) -> bool {
        self.wires(port).iter().all(|pin| seen(pin, now) == pin.high)
    }

    fn wires(&self, port: usize) -> &[Pin] {
        let first = port % PORTS * 8;
        &self.pins[first..first + 8]
    }

    /// Drives a pin from outside from the cycle `at` on. Returns the new level where it changed.
    pub(crate) fn drive(&mut self, pin: PinId, outside: Level, at: u64) -> Option<Change> {
        self.change(pin, at, |pin| pin.outside = outside)
    }

    /// Works out what the chip does to `pin` from the cycle `at` on. Returns the new level where it changed.
    pub(crate) fn settle(&mut self, pin: PinId, at: u64) -> Option<Change> {
        let drivers = self.drivers(pin);
        self.change(pin, at, |pin| (pin.own, pin.pull_up) = drivers)
    }

    fn change(&mut self, pin: PinId, at: u64, change: impl FnOnce(&mut Pin)) -> Option<Change> {
        let pin = self.pins.get_mut(usize::from(pin))?;
        let before = pin.level();
        change(pin);
        let toggled = pin.settle(at);
        (toggled || pin.level() != before).then(|| Change { level: pin.level(), toggled })
    }

    /// What the chip does to a pin: the level it drives, and its pull-up (table 14-1, figure 14-5).
    fn drivers(&self, pin: PinId) -> (Level, bool) {
        if self.reset == Some(pin) {
            return (Level::Float, true);
        }
        if self.held {
            return (Level::Float, false);
        }
        let high = self.port(usize::from(pin / 8)) >> (pin % 8) & 1 == 1;
        let over = self.over.get(usize::from(pin)).copied().unwrap_or_default();
        let output = match over {
            Drive::Output(level) => Some(level),
            Drive::Input => None,
            Drive::Value(level) => self.is_output(pin).then_some(level),
            Drive::Port => self.is_output(pin).then_some(high),
        };
        match output {
            Some(level) => (Level::of(level), false),
            None => (Level::Float, high && !self.pull_ups_off),
        }
    }
}

/// What has become of a pin.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Change {
    /// Its level, [`Level::Float`] where nothing holds it.
    pub level: Level,
    /// The wire has another level than before.
    pub toggled: bool,
}

fn seen(pin: &Pin, now: u64) -> bool {
    pin.at(now.saturating_sub(1))
}
