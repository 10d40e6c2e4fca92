//! Ports B, C and D (data sheet 14): direction, output and pull-up of every pin, and what takes a pin over.

use emu_core::pins::{Level, Pin, PinId};

use super::map::{RXD, TXD};

/// Number of pins: three ports of eight.
pub const PINS: usize = 24;

/// Pins of each port that exist as port pins (PC7 does not).
const EXIST: [u8; 3] = [0xFF, 0x7F, 0xFF];

/// All ports.
#[derive(Debug, Clone)]
pub struct Ports {
    pins: [Pin; PINS],
    ddr: [u8; 3],
    port: [u8; 3],
    /// PUD: pull-ups disabled.
    pub pull_ups_off: bool,
    /// The transmitter has TXD and drives this level (20.6, 14.3.3).
    pub txd: Option<bool>,
    /// The receiver has RXD, which is an input then.
    pub rxd: bool,
}

impl Ports {
    /// All inputs, no pull-ups, nothing attached.
    pub fn new() -> Ports {
        let pins = [Pin::default(); PINS];
        Ports { pins, ddr: [0; 3], port: [0; 3], pull_ups_off: false, txd: None, rxd: false }
    }

    /// Registers as after reset; wires and outside drives stay until the pins are settled.
    pub fn reset(&mut self) {
        *self = Ports { pins: self.pins, ..Ports::new() };
    }

    /// All pins.
    pub fn pins(&self) -> &[Pin] {
        &self.pins
    }

    /// The pin `pin`; one that does not exist floats.
    pub fn pin(&self, pin: PinId) -> Pin {
        self.pins.get(usize::from(pin)).copied().unwrap_or_default()
    }

    /// DDRx of port 0 to 2.
    pub fn ddr(&self, port: usize) -> u8 {
        self.ddr[port]
    }

    /// PORTx of port 0 to 2.
    pub fn port(&self, port: usize) -> u8 {
        self.port[port]
    }

    /// Sets DDRx; returns the bits that changed.
    pub fn set_ddr(&mut self, port: usize, value: u8) -> u8 {
        let value = value & EXIST[port];
        std::mem::replace(&mut self.ddr[port], value) ^ value
    }

    /// Sets PORTx; returns the bits that changed.
    pub fn set_port(&mut self, port: usize, value: u8) -> u8 {
        let value = value & EXIST[port];
        std::mem::replace(&mut self.port[port], value) ^ value
    }

    /// PINx as read in the cycle `now`: the wires as they were one cycle before, behind the synchroniser (14.2.4).
    pub fn input(&self, port: usize, now: u64) -> u8 {
        let wires = &self.pins[port * 8..port * 8 + 8];
        let bits = wires.iter().enumerate().fold(0, |bits, (i, pin)| bits | u8::from(seen(pin, now)) << i);
        bits & EXIST[port]
    }

    /// True when PINx will read the same in every cycle from `now` on as long as no wire changes.
    pub fn settled(&self, port: usize, now: u64) -> bool {
        self.pins[port * 8..port * 8 + 8].iter().all(|pin| seen(pin, now) == pin.high)
    }

    /// The level that a sampler behind the synchroniser sees on `pin` in the cycle `now`.
    pub fn sample(&self, pin: PinId, now: u64) -> bool {
        seen(&self.pin(pin), now)
    }

    /// Drives a pin from outside from the cycle `at` on. Returns the new level where it changed.
    pub fn drive(&mut self, pin: PinId, outside: Level, at: u64) -> Option<Level> {
        self.change(pin, at, |pin| pin.outside = outside)
    }

    /// Works out what the chip does to `pin` from the cycle `at` on. Returns the new level where it changed.
    pub fn settle(&mut self, pin: PinId, at: u64) -> Option<Level> {
        let drivers = self.drivers(pin);
        self.change(pin, at, |pin| (pin.own, pin.pull_up) = drivers)
    }

    fn change(&mut self, pin: PinId, at: u64, change: impl FnOnce(&mut Pin)) -> Option<Level> {
        let pin = self.pins.get_mut(usize::from(pin))?;
        let before = pin.level();
        change(pin);
        pin.settle(at);
        (pin.level() != before).then(|| pin.level())
    }

    /// What the chip does to a pin: the level it drives, and its pull-up (tables 14-1 and 14-2, alternate functions 14-9).
    fn drivers(&self, pin: PinId) -> (Level, bool) {
        let (port, bit) = (usize::from(pin / 8) % 3, pin % 8);
        let output = self.ddr[port] >> bit & 1 == 1;
        let high = self.port[port] >> bit & 1 == 1;
        match (pin, self.txd) {
            (TXD, Some(line)) => (Level::of(line), false),
            (RXD, _) if self.rxd => (Level::Float, high && !self.pull_ups_off),
            _ if output => (Level::of(high), false),
            _ => (Level::Float, high && !self.pull_ups_off),
        }
    }
}

impl Default for Ports {
    fn default() -> Ports {
        Ports::new()
    }
}

fn seen(pin: &Pin, now: u64) -> bool {
    pin.at(now.saturating_sub(1))
}
