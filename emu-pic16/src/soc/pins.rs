//! Pins: inputs from outside, overrides by peripherals and ports, and notification of the listening
//! peripherals.

use emu_core::cpu::NEVER;
use emu_core::external_io::{DriveQueue, OutsideInput};
use emu_core::pins::{PinId, PinLevel};

use super::{Pic16Soc, to_cycle_time, unit_index};
use crate::chips::{NO_PIN, PeripheralPin, Pic16Part};
use crate::periph::map::{InterruptFlag, Pic16Line, Sfr};
use crate::periph::ports::{PIN_COUNT, PORTB, PORTD, PinChange};
use crate::periph::{Device, Pic16Drive, SignalReceiver};

/// Inputs from outside, and the lines on each pin.
#[derive(Debug, Clone)]
pub(super) struct PinInputs {
    /// Queued inputs, by clock.
    pub drives: DriveQueue<OutsideInput>,
    lines: [PeripheralPin; LINE_COUNT],
    /// Masks of pins: those with a line; analog inputs and the master clear; RB4 to RB7. Nothing but the port
    /// depends on other pins.
    heard: u64,
    special: u64,
    upper_b: u64,
    /// Voltages on pins in millivolts, for pins driven by a voltage instead of a level.
    volts: [Option<u32>; PIN_COUNT],
    /// Supply voltage in millivolts.
    pub supply: u32,
}

emu_core::state! { PinInputs { drives, volts, supply } stays { lines, heard, special, upper_b } }

/// Largest number of lines on a chip.
const LINE_COUNT: usize = 16;

impl PinInputs {
    /// Returns the state without inputs, at 5 V. `ccp1` is the pin of CCP1 if the configuration selects it.
    pub(super) fn new(part: &Pic16Part, ccp1: Option<PinId>) -> PinInputs {
        let mut lines = [PeripheralPin { line: Pic16Line::T0cki, pin: NO_PIN, over_tris: false }; LINE_COUNT];
        for (place, line) in lines.iter_mut().zip(part.lines) {
            let moved = ccp1.filter(|_| line.line == Pic16Line::Ccp1);
            *place = PeripheralPin { pin: moved.unwrap_or(line.pin), ..*line };
        }
        let set = |pins: &mut dyn Iterator<Item = PinId>| pins.fold(0, |set, pin| set | bit(pin));
        let upper_b = part.ports.get(PORTB).map_or(0, |port| set(&mut port.pins[4..].iter().copied()));
        PinInputs {
            drives: DriveQueue::NONE,
            heard: set(&mut lines.iter().map(|line| line.pin)),
            special: set(&mut part.analog.iter().copied()) | bit(part.mclr),
            upper_b,
            lines,
            volts: [None; PIN_COUNT],
            supply: 5_000,
        }
    }

    /// Returns the mask of the pins on which others than their port depend.
    pub(super) fn peripheral_pins(&self) -> u64 {
        self.heard | self.special
    }

    /// Returns the pin of a line.
    fn pin(&self, line: Pic16Line) -> Option<PeripheralPin> {
        self.lines.into_iter().find(|at| at.line == line && at.pin != NO_PIN)
    }
}

impl Pic16Soc {
    /// Applies the queued inputs that are due at or before the clock `t`.
    pub(super) fn apply_inputs(&mut self, t: u64) {
        while let Some(put) = self.pin_inputs.drives.pop_due(t) {
            match put {
                OutsideInput::Level(pin, level) => {
                    if let Some(volts) = self.pin_inputs.volts.get_mut(usize::from(pin)) {
                        *volts = None;
                    }
                    self.drive_pin(pin, level, t);
                }
                OutsideInput::Volts(pin, millivolts) => {
                    if let Some(volts) = self.pin_inputs.volts.get_mut(usize::from(pin)) {
                        *volts = Some(millivolts);
                    }
                    // The switching threshold between the levels guaranteed by the data sheet is assumed to
                    // be half the supply.
                    self.drive_pin(pin, PinLevel::from_bit(2 * millivolts >= self.pin_inputs.supply), t);
                    self.notify_voltage(pin, t);
                }
                OutsideInput::Supply(millivolts) => self.set_supply(millivolts, t),
            }
        }
        self.apply_signals(());
    }

    fn drive_pin(&mut self, pin: PinId, level: PinLevel, t: u64) {
        let changed = self.ports.drive(pin, level, t);
        self.on_pin_edge(pin, changed, t);
    }

    /// Sets INTF and RBIF after their pins were sampled.
    pub(super) fn run_samples(&mut self, t: u64) {
        for (place, flag) in [InterruptFlag::INTF, InterruptFlag::RBIF].into_iter().enumerate() {
            if self.irq.sampled[place] <= t {
                self.irq.sampled[place] = NEVER;
                self.raise(flag, t);
                self.flag_raised(t);
            }
        }
    }

    /// Sets or removes the override of a line.
    pub(super) fn set_line_driver(&mut self, line: Pic16Line, drive: Pic16Drive, t: u64) {
        let Some(at) = self.pin_inputs.pin(line) else { return };
        // I2C pulls low regardless of TRIS; the data sheet requires its pins to be inputs (DS30292, 9.2).
        let over = at.over_tris || matches!(line, Pic16Line::Sck | Pic16Line::Sdi) && self.ssp.is_i2c();
        self.ports.set_driver(at.pin, drive, over);
        self.update_pin(at.pin, t);
    }

    /// Updates a pin at the clock `t` after the chip has changed how it drives it.
    pub(super) fn update_pin(&mut self, pin: PinId, t: u64) {
        let changed = self.ports.update_level(pin, t);
        self.on_pin_edge(pin, changed, t);
    }

    /// Updates several pins of a port.
    fn update_pins(&mut self, port: usize, mut bits: u8, t: u64) {
        while bits != 0 {
            let pin = self.ports.pin_of(port, bits.trailing_zeros() as usize);
            bits &= bits - 1;
            if pin != NO_PIN {
                self.update_pin(pin, t);
            }
        }
    }

    /// Logs the edge of a pin, if there was one, and contention on it, and notifies the listening
    /// peripherals.
    fn on_pin_edge(&mut self, pin: PinId, changed: Option<PinChange>, t: u64) {
        if self.log.is_enabled() {
            self.log.record_pin(
                to_cycle_time(t),
                pin,
                self.ports.pin(pin).has_contention(),
                changed.map(|change| change.level),
            );
        }
        let Some(PinChange { toggled, .. }) = changed else { return };
        let (high, bit) = (self.ports.pin(pin).reads_high, bit(pin));
        if toggled && self.pin_inputs.heard & bit != 0 && !self.ports.is_analog(pin) {
            for i in 0..LINE_COUNT {
                let at = self.pin_inputs.lines[i];
                if at.pin == pin {
                    self.notify_line(at.line, high, t);
                }
            }
        }
        if self.pin_inputs.upper_b & bit != 0 {
            self.on_port_b_mismatch(t);
        }
        if self.pin_inputs.special & bit != 0 {
            if toggled && pin == self.part.mclr {
                self.master_clear(high, t);
            }
            self.notify_voltage(pin, t);
        }
        self.apply_signals(());
    }

    /// Notifies a peripheral of a change of one of its lines.
    fn notify_line(&mut self, line: Pic16Line, high: bool, t: u64) {
        self.schedule.touched |= match line {
            // A capture sends a flag; otherwise the level has no effect on the deadlines.
            Pic16Line::Ccp1 | Pic16Line::Ccp2 => 0,
            Pic16Line::T0cki => 1 << unit_index::TIMER0,
            Pic16Line::T1cki => 1 << unit_index::TIMERS,
            Pic16Line::Tx | Pic16Line::Rx => 1 << unit_index::USART,
            Pic16Line::Sck | Pic16Line::Sdi | Pic16Line::Sdo | Pic16Line::Ss => 1 << unit_index::SSP,
            Pic16Line::Rd | Pic16Line::Wr | Pic16Line::Cs => 1 << unit_index::PSP,
            Pic16Line::Int | Pic16Line::C1out | Pic16Line::C2out => 0,
        };
        match line {
            Pic16Line::T0cki => self.timer0.on_line_changed(line, high, t, &mut self.out),
            Pic16Line::T1cki | Pic16Line::Ccp1 | Pic16Line::Ccp2 => {
                self.timers.on_line_changed(line, high, t, &mut self.out)
            }
            Pic16Line::Tx | Pic16Line::Rx => self.usart.on_line_changed(line, high, t, &mut self.out),
            Pic16Line::Sck | Pic16Line::Sdi | Pic16Line::Sdo | Pic16Line::Ss => {
                self.ssp.on_line_changed(line, high, t, &mut self.out)
            }
            Pic16Line::Rd | Pic16Line::Wr | Pic16Line::Cs => {
                self.psp.set_bus_levels(self.ports.input(PORTD), t);
                self.psp.on_line_changed(line, high, t, &mut self.out);
                self.psp_bus(t);
            }
            Pic16Line::Int => {
                const INTEDG: u8 = 0x40;
                if high == (self.timer0.peek(Sfr::OPTION, t) & INTEDG != 0) && !self.power.in_reset(t) {
                    self.irq.sampled[0] = if self.power.is_running() { t.next_multiple_of(4) } else { t };
                }
            }
            Pic16Line::C1out | Pic16Line::C2out => {}
        }
    }

    /// Notifies all peripherals of the levels of their lines, after a reset.
    pub(super) fn notify_all_lines(&mut self, t: u64) {
        for at in self.pin_inputs.lines {
            if at.pin != NO_PIN && at.line != Pic16Line::Int {
                self.notify_line(at.line, self.ports.pin(at.pin).reads_high && !self.ports.is_analog(at.pin), t);
            }
        }
        for &pin in self.part.analog {
            self.notify_voltage(pin, t);
        }
    }

    /// Passes the voltage of an analog input to its peripherals.
    fn notify_voltage(&mut self, pin: PinId, t: u64) {
        let Some(channel) = self.part.analog.iter().position(|&analog| analog == pin) else { return };
        let wire = self.ports.pin(pin);
        let outside = self.pin_inputs.volts.get(usize::from(pin)).copied().flatten();
        let reference = self.comparators.reference_out().filter(|_| channel == REFERENCE_INPUT);
        let millivolts = match (wire.driven, reference.or(outside)) {
            (PinLevel::Float, Some(millivolts)) => millivolts,
            _ => u32::from(wire.reads_high) * self.pin_inputs.supply,
        };
        self.schedule.touched |= 1 << unit_index::ADC | 1 << unit_index::COMPARATORS;
        self.adc.set_input(channel as u8, millivolts, t);
        self.comparators.set_input(channel as u8, millivolts, t, &mut self.out);
    }

    /// Writes a latch at the clock `t`, the end of an instruction cycle; its pins change in Q4.
    pub(super) fn write_port(&mut self, port: usize, reg: Sfr, value: u8, t: u64) {
        if reg == Sfr::PORTD && self.psp.is_enabled() {
            self.schedule.touch(unit_index::PSP);
            self.psp.write_port(value, t);
            return self.psp_bus(t);
        }
        let others = self.ports.write_latch(port, value, self.run_to_clock);
        self.update_pins(port, others, self.run_to_clock);
    }

    /// Writes the directions of a port.
    pub(super) fn write_tris(&mut self, port: usize, reg: Sfr, value: u8, t: u64) {
        let changed = self.ports.tris(port) ^ value;
        self.ports.set_tris(port, value);
        if reg == Sfr::TRISE && self.part.psp {
            self.schedule.touch(unit_index::PSP);
            self.psp.write(reg, value, 0xFF, t, &mut self.out);
            self.psp_bus(t);
        }
        self.update_pins(port, changed, self.run_to_clock);
        self.on_port_b_mismatch(t);
    }

    /// Updates port D after a change of the slave port.
    fn psp_bus(&mut self, t: u64) {
        let enabled = self.psp.is_enabled();
        let byte = self.psp.driven_byte();
        for bit in 0..8 {
            let drive = match (enabled, byte) {
                (false, _) => Pic16Drive::Port,
                (true, None) => Pic16Drive::Float,
                (true, Some(byte)) => Pic16Drive::from_bit(byte >> bit & 1 == 1),
            };
            let pin = self.ports.pin_of(PORTD, bit);
            self.ports.set_driver(pin, drive, true);
            self.update_pin(pin, t);
        }
    }

    /// Handles the effects of a register write outside the register's own peripheral.
    pub(super) fn on_register_written(&mut self, reg: Sfr, value: u8, t: u64) {
        match reg {
            Sfr::OPTION => {
                const RBPU: u8 = 0x80;
                self.ports.set_pull_ups(value & RBPU == 0);
                self.update_pins(PORTB, 0xFF, self.run_to_clock);
            }
            Sfr::ADCON1 | Sfr::ADCON0 | Sfr::ANSEL | Sfr::CMCON => self.change_analog(t),
            Sfr::T1CON => self.timer1_crystal(value & T1OSCEN != 0),
            Sfr::SSPCON => self.clock_ssp(t),
            Sfr::CVRCON => {
                if let Some(&pin) = self.part.analog.get(REFERENCE_INPUT) {
                    self.notify_voltage(pin, t);
                    self.apply_signals(());
                }
            }
            // While an output of a comparator differs from the value that the program has read, its flag is
            // set again.
            Sfr::PIR1 | Sfr::PIR2 if self.comparators.has_mismatch() && self.keeps_flag(reg, InterruptFlag::CMIF) => {
                self.raise(InterruptFlag::CMIF, t)
            }
            _ => {}
        }
    }

    /// Makes timer 2 signal its periods to the SSP if they are its clock.
    pub(super) fn clock_ssp(&mut self, t: u64) {
        self.schedule.touch(unit_index::TIMERS);
        self.timers.set_timer2_listener(self.ssp.wants_timer2(), t, &mut self.out);
        self.apply_signals(());
    }

    /// Reports whether the flag is in this register.
    fn keeps_flag(&self, reg: Sfr, flag: InterruptFlag) -> bool {
        self.part.flags.iter().any(|row| row.flag == flag && row.at.sfr == reg)
    }

    /// Reserves the pins of timer 1's oscillator, which are inputs that read 0 while it is on (DS30292, 6.5).
    /// T1OSI is the pin after T1OSO.
    fn timer1_crystal(&mut self, on: bool) {
        let Some(at) = self.pin_inputs.pin(Pic16Line::T1cki) else { return };
        let pins = [at.pin, at.pin.saturating_add(1)];
        self.ports.reserve_pins(if on { pins.iter().fold(0, |set, &pin| set | 1 << (pin & 63)) } else { 0 });
        pins.into_iter().for_each(|pin| self.update_pin(pin, self.run_to_clock));
    }

    /// Selects the analog input pins, by converter and comparators.
    pub(super) fn set_analog(&mut self) {
        let digital = u16::from(self.adc.digital_pins()) & (0xFFF0 | u16::from(self.comparators.digital_pins()));
        let analog = self.part.analog.iter().enumerate().filter(|(channel, _)| digital >> channel & 1 == 0);
        self.ports.set_analog(analog.fold(0, |pins, (_, &pin)| pins | bit(pin)));
    }

    /// Updates the analog input pins at the clock `t`, and notifies the peripherals on pins whose read level
    /// changes.
    fn change_analog(&mut self, t: u64) {
        let before = self.ports.analog();
        self.set_analog();
        let changed = self.ports.analog() ^ before;
        for at in self.pin_inputs.lines {
            let wire = self.ports.pin(at.pin);
            if changed & bit(at.pin) != 0 && wire.reads_high {
                self.notify_line(at.line, !self.ports.is_analog(at.pin), t);
            }
        }
        if changed != 0 {
            self.on_port_b_mismatch(t);
            self.apply_signals(());
        }
    }
}

/// Analog input on whose pin the reference of the comparators can be output: RA2.
const REFERENCE_INPUT: usize = 2;

/// Returns the mask of a pin.
fn bit(pin: PinId) -> u64 {
    1u64.checked_shl(pin.into()).unwrap_or(0)
}

/// Mask of T1OSCEN in T1CON.
const T1OSCEN: u8 = 8;
