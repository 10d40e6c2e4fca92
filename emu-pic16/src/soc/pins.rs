//! Pins: drives from outside, what parts and ports do to them, and who is told when a level changes.

use emu_core::cpu::NEVER;
use emu_core::outside::Drives;
use emu_core::pins::{Level, PinId};

use super::{Soc, at, time};
use crate::chips::{LineAt, NO_PIN, Part};
use crate::periph::map::{Flag, Line, Sfr};
use crate::periph::ports::{Change, PINS, PORTB, PORTD};
use crate::periph::{Device, Drive};

/// What stands on a pin or on the supply from outside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Put {
    /// A level, or nothing.
    Level(PinId, Level),
    /// A voltage, in millivolts.
    Volts(PinId, u32),
    /// The supply, in millivolts.
    Supply(u32),
}

impl Default for Put {
    fn default() -> Put {
        Put::Supply(0)
    }
}

emu_core::state! { enum Put { 0 = Level(pin, level), 1 = Volts(pin, millivolts), 2 = Supply(millivolts) } }

/// What comes from outside, and which lines are on which pins.
#[derive(Debug, Clone)]
pub(super) struct Outside {
    /// To come, by clocks.
    pub drives: Drives<Put>,
    lines: [LineAt; LINES],
    /// Pins, a bit each, that have a line; that are analog inputs or the master clear; RB4 to RB7. All others concern nobody.
    heard: u64,
    special: u64,
    upper_b: u64,
    /// Voltages on pins, in millivolts, where a level does not say it all.
    volts: [Option<u32>; PINS],
    /// Supply, in millivolts.
    pub supply: u32,
}

emu_core::state! { Outside { drives, volts, supply } stays { lines, heard, special, upper_b } }

/// Lines there can be.
const LINES: usize = 16;

impl Outside {
    /// Nothing from outside; 5 V. `ccp1`: the pin of CCP1 where the configuration chooses it.
    pub(super) fn new(part: &Part, ccp1: Option<PinId>) -> Outside {
        let mut lines = [LineAt { line: Line::T0cki, pin: NO_PIN, over_tris: false }; LINES];
        for (place, line) in lines.iter_mut().zip(part.lines) {
            let moved = ccp1.filter(|_| line.line == Line::Ccp1);
            *place = LineAt { pin: moved.unwrap_or(line.pin), ..*line };
        }
        let set = |pins: &mut dyn Iterator<Item = PinId>| pins.fold(0, |set, pin| set | bit(pin));
        let upper_b = part.ports.get(PORTB).map_or(0, |port| set(&mut port.pins[4..].iter().copied()));
        Outside {
            drives: Drives::NONE,
            heard: set(&mut lines.iter().map(|line| line.pin)),
            special: set(&mut part.analog.iter().copied()) | bit(part.mclr),
            upper_b,
            lines,
            volts: [None; PINS],
            supply: 5_000,
        }
    }

    /// Pins that concern others than their port, a bit each.
    pub(super) fn concerned(&self) -> u64 {
        self.heard | self.special
    }

    /// The pin of a line.
    fn pin(&self, line: Line) -> Option<LineAt> {
        self.lines.into_iter().find(|at| at.line == line && at.pin != NO_PIN)
    }
}

impl Soc {
    /// Carries out what comes from outside at or before the clock `t`.
    pub(super) fn run_outside(&mut self, t: u64) {
        while let Some(put) = self.outside.drives.take(t) {
            match put {
                Put::Level(pin, level) => {
                    if let Some(volts) = self.outside.volts.get_mut(usize::from(pin)) {
                        *volts = None;
                    }
                    self.drive_pin(pin, level, t);
                }
                Put::Volts(pin, millivolts) => {
                    if let Some(volts) = self.outside.volts.get_mut(usize::from(pin)) {
                        *volts = Some(millivolts);
                    }
                    // Where the input switches between the levels that the data sheet promises is taken for the middle.
                    self.drive_pin(pin, Level::of(2 * millivolts >= self.outside.supply), t);
                    self.tell_voltage(pin, t);
                }
                Put::Supply(millivolts) => self.supplied(millivolts, t),
            }
        }
        self.carry_out();
    }

    fn drive_pin(&mut self, pin: PinId, level: Level, t: u64) {
        let changed = self.ports.drive(pin, level, t);
        self.edge(pin, changed, t);
    }

    /// INTF and RBIF, whose pins were sampled.
    pub(super) fn run_samples(&mut self, t: u64) {
        for (place, flag) in [Flag::INTF, Flag::RBIF].into_iter().enumerate() {
            if self.irq.sampled[place] <= t {
                self.irq.sampled[place] = NEVER;
                self.raise(flag, t);
                self.flag_raised(t);
            }
        }
    }

    /// A part takes a line or gives it back.
    pub(super) fn take_line(&mut self, line: Line, drive: Drive, t: u64) {
        let Some(at) = self.outside.pin(line) else { return };
        // I2C pulls low whatever TRIS says; its pins are to be inputs (DS30292, 9.2).
        let over = at.over_tris || matches!(line, Line::Sck | Line::Sdi) && self.ssp.is_i2c();
        self.ports.take(at.pin, drive, over);
        self.settle(at.pin, t);
    }

    /// Settles a pin at the clock `t` after the chip changed what it does to it.
    pub(super) fn settle(&mut self, pin: PinId, t: u64) {
        let changed = self.ports.settle(pin, t);
        self.edge(pin, changed, t);
    }

    /// Settles some pins of a port.
    fn settle_bits(&mut self, port: usize, mut bits: u8, t: u64) {
        while bits != 0 {
            let pin = self.ports.pin_of(port, bits.trailing_zeros() as usize);
            bits &= bits - 1;
            if pin != NO_PIN {
                self.settle(pin, t);
            }
        }
    }

    /// Logs the edge of a pin, if there was one, and a fight over it, and tells who listens.
    fn edge(&mut self, pin: PinId, changed: Option<Change>, t: u64) {
        if self.log.is_on() {
            self.log.pin(time(t), pin, self.ports.pin(pin).contention(), changed.map(|change| change.level));
        }
        let Some(Change { toggled, .. }) = changed else { return };
        let (high, bit) = (self.ports.pin(pin).high, bit(pin));
        if toggled && self.outside.heard & bit != 0 && !self.ports.is_analog(pin) {
            for i in 0..LINES {
                let at = self.outside.lines[i];
                if at.pin == pin {
                    self.tell(at.line, high, t);
                }
            }
        }
        if self.outside.upper_b & bit != 0 {
            self.mismatch(t);
        }
        if self.outside.special & bit != 0 {
            if toggled && pin == self.part.mclr {
                self.master_clear(high, t);
            }
            self.tell_voltage(pin, t);
        }
        self.carry_out();
    }

    /// A line has changed.
    fn tell(&mut self, line: Line, high: bool, t: u64) {
        self.touched |= match line {
            // A module that captures says so; to all others the level is nothing.
            Line::Ccp1 | Line::Ccp2 => 0,
            Line::T0cki => 1 << at::TIMER0,
            Line::T1cki => 1 << at::TIMERS,
            Line::Tx | Line::Rx => 1 << at::USART,
            Line::Sck | Line::Sdi | Line::Sdo | Line::Ss => 1 << at::SSP,
            Line::Rd | Line::Wr | Line::Cs => 1 << at::PSP,
            Line::Int | Line::C1out | Line::C2out => 0,
        };
        match line {
            Line::T0cki => self.timer0.line(line, high, t, &mut self.out),
            Line::T1cki | Line::Ccp1 | Line::Ccp2 => self.timers.line(line, high, t, &mut self.out),
            Line::Tx | Line::Rx => self.usart.line(line, high, t, &mut self.out),
            Line::Sck | Line::Sdi | Line::Sdo | Line::Ss => self.ssp.line(line, high, t, &mut self.out),
            Line::Rd | Line::Wr | Line::Cs => {
                self.psp.on_bus(self.ports.input(PORTD), t);
                self.psp.line(line, high, t, &mut self.out);
                self.psp_bus(t);
            }
            Line::Int => {
                const INTEDG: u8 = 0x40;
                if high == (self.timer0.peek(Sfr::OPTION, t) & INTEDG != 0) && !self.power.in_reset(t) {
                    self.irq.sampled[0] = if self.power.runs() { t.next_multiple_of(4) } else { t };
                }
            }
            Line::C1out | Line::C2out => {}
        }
    }

    /// The levels of all lines, as parts find them when they begin.
    pub(super) fn tell_all(&mut self, t: u64) {
        for at in self.outside.lines {
            if at.pin != NO_PIN && at.line != Line::Int {
                self.tell(at.line, self.ports.pin(at.pin).high && !self.ports.is_analog(at.pin), t);
            }
        }
        for &pin in self.part.analog {
            self.tell_voltage(pin, t);
        }
    }

    /// The voltage of an analog input, as its parts see it.
    fn tell_voltage(&mut self, pin: PinId, t: u64) {
        let Some(channel) = self.part.analog.iter().position(|&analog| analog == pin) else { return };
        let wire = self.ports.pin(pin);
        let outside = self.outside.volts.get(usize::from(pin)).copied().flatten();
        let reference = self.comparators.reference_out().filter(|_| channel == REFERENCE);
        let millivolts = match (wire.own, reference.or(outside)) {
            (Level::Float, Some(millivolts)) => millivolts,
            _ => u32::from(wire.high) * self.outside.supply,
        };
        self.touched |= 1 << at::ADC | 1 << at::COMPARATORS;
        self.adc.set_input(channel as u8, millivolts, t);
        self.comparators.set_input(channel as u8, millivolts, t, &mut self.out);
    }

    /// Writes a latch at the clock `t`, the end of an instruction cycle: its pins change in Q4.
    pub(super) fn write_port(&mut self, port: usize, reg: Sfr, value: u8, t: u64) {
        if reg == Sfr::PORTD && self.psp.on() {
            self.touched |= 1 << at::PSP;
            self.psp.write_port(value, t);
            return self.psp_bus(t);
        }
        let others = self.ports.write_latch(port, value, self.ran);
        self.settle_bits(port, others, self.ran);
    }

    /// Writes the directions of a port.
    pub(super) fn write_tris(&mut self, port: usize, reg: Sfr, value: u8, t: u64) {
        let changed = self.ports.tris(port) ^ value;
        self.ports.set_tris(port, value);
        if reg == Sfr::TRISE && self.part.psp {
            self.touched |= 1 << at::PSP;
            self.psp.write(reg, value, t, &mut self.out);
            self.psp_bus(t);
        }
        self.settle_bits(port, changed, self.ran);
        self.mismatch(t);
    }

    /// What the slave port does to port D.
    fn psp_bus(&mut self, t: u64) {
        let enabled = self.psp.on();
        let byte = self.psp.driving();
        for bit in 0..8 {
            let drive = match (enabled, byte) {
                (false, _) => Drive::Port,
                (true, None) => Drive::Float,
                (true, Some(byte)) => Drive::of(byte >> bit & 1 == 1),
            };
            let pin = self.ports.pin_of(PORTD, bit);
            self.ports.take(pin, drive, true);
            self.settle(pin, t);
        }
    }

    /// What follows from a write to a register besides what its part does.
    pub(super) fn written(&mut self, reg: Sfr, value: u8, t: u64) {
        match reg {
            Sfr::OPTION => {
                const RBPU: u8 = 0x80;
                self.ports.set_pull_ups(value & RBPU == 0);
                self.settle_bits(PORTB, 0xFF, self.ran);
            }
            Sfr::ADCON1 | Sfr::ADCON0 | Sfr::ANSEL | Sfr::CMCON => self.change_analog(t),
            Sfr::T1CON => self.timer1_crystal(value & T1OSCEN != 0),
            Sfr::SSPCON => self.clock_ssp(t),
            Sfr::CVRCON => {
                if let Some(&pin) = self.part.analog.get(REFERENCE) {
                    self.tell_voltage(pin, t);
                    self.carry_out();
                }
            }
            // As long as an output of a comparator differs from what the program has seen, its flag is set again.
            Sfr::PIR1 | Sfr::PIR2 if self.comparators.mismatch() && self.keeps(reg, Flag::CMIF) => {
                self.raise(Flag::CMIF, t)
            }
            _ => {}
        }
    }

    /// Timer 2 tells the SSP of its periods where they are its clock.
    pub(super) fn clock_ssp(&mut self, t: u64) {
        self.touched |= 1 << at::TIMERS;
        self.timers.set_timer2_listener(self.ssp.wants_timer2(), t, &mut self.out);
        self.carry_out();
    }

    /// The flag stands in this register.
    fn keeps(&self, reg: Sfr, flag: Flag) -> bool {
        self.part.flags.iter().any(|row| row.flag == flag && row.at.0 == reg)
    }

    /// The pins of timer 1's oscillator are inputs that read 0 while it is on (DS30292, 6.5); T1OSI is the pin next to T1OSO.
    fn timer1_crystal(&mut self, on: bool) {
        let Some(at) = self.outside.pin(Line::T1cki) else { return };
        let pins = [at.pin, at.pin.saturating_add(1)];
        self.ports.withhold(if on { pins.iter().fold(0, |set, &pin| set | 1 << (pin & 63)) } else { 0 });
        pins.into_iter().for_each(|pin| self.settle(pin, self.ran));
    }

    /// Which pins are analog inputs, by the converter and the comparators.
    pub(super) fn set_analog(&mut self) {
        let digital = u16::from(self.adc.digital()) & (0xFFF0 | u16::from(self.comparators.digital()));
        let analog = self.part.analog.iter().enumerate().filter(|(channel, _)| digital >> channel & 1 == 0);
        self.ports.set_analog(analog.fold(0, |pins, (_, &pin)| pins | bit(pin)));
    }

    /// The same at the clock `t`: what looks at one of these pins finds another level, if it is high.
    fn change_analog(&mut self, t: u64) {
        let before = self.ports.analog();
        self.set_analog();
        let changed = self.ports.analog() ^ before;
        for at in self.outside.lines {
            let wire = self.ports.pin(at.pin);
            if changed & bit(at.pin) != 0 && wire.high {
                self.tell(at.line, !self.ports.is_analog(at.pin), t);
            }
        }
        if changed != 0 {
            self.mismatch(t);
            self.carry_out();
        }
    }
}

/// The analog input on whose pin the reference of the comparators can be put: RA2.
const REFERENCE: usize = 2;

/// A pin in a set of pins.
fn bit(pin: PinId) -> u64 {
    1u64.checked_shl(pin.into()).unwrap_or(0)
}

/// T1OSCEN in T1CON.
const T1OSCEN: u8 = 8;
