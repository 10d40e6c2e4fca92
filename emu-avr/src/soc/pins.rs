//! Pins: what comes from outside, what units do to them, and who is told of them.

use emu_core::chip::Package;
use emu_core::cpu::Reset;
use emu_core::pins::{Level, PinId, Time};
use emu_core::state;

use super::Soc;
use super::with_unit;
use crate::chips::{Part, unit};
use crate::periph::comparator::Input;
use crate::periph::ports::{Change, PINS};
use crate::periph::{Device, Drive, Line, timers};

/// What comes from outside.
#[derive(Debug, Clone, Copy)]
pub enum Put {
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

state! { enum Put { 0 = Level(pin, level), 1 = Volts(pin, millivolts), 2 = Supply(millivolts) } }

/// Who listens on each pin, and the package that has the pins, where one is chosen.
#[derive(Debug)]
pub(super) struct Wiring(Vec<Vec<(usize, Line)>>, Option<&'static Package>);

impl Wiring {
    /// The wiring of a part in the package of that name.
    pub(super) fn new(part: &Part, package: Option<&str>) -> Wiring {
        let mut pins = vec![Vec::new(); PINS];
        for &(number, line, pin) in part.lines {
            if let Some(lines) = pins.get_mut(usize::from(pin)) {
                lines.push((number, line));
            }
        }
        for &(pin, number) in part.pin_changes {
            if let Some(lines) = pins.get_mut(usize::from(pin)) {
                lines.push((unit::EXTERNAL, Line::Pc(number)));
            }
        }
        Wiring(pins, package.and_then(|name| part.chip.package(name)))
    }
}

impl Soc {
    /// The chip has this pin, in the package that is chosen, or else in one of its packages.
    #[must_use]
    pub fn has_pin(&self, pin: PinId) -> bool {
        self.wiring.1.map_or_else(|| self.part.chip.has_pin(pin), |package| package.number(pin).is_some())
    }

    /// Drives a pin from outside at the cycle `at`, at once when that has passed. Drives of one cycle act in call order.
    pub fn drive(&mut self, at: u64, now: u64, pin: PinId, level: Level) {
        self.put(at, now, Put::Level(pin, level));
    }

    /// Puts something on the chip from outside at the cycle `at`, at once when that has passed.
    pub fn put(&mut self, at: u64, now: u64, put: Put) {
        self.run(now);
        let at = at.max(now);
        self.drives.add(at, put);
        self.due = self.due.min(at);
        self.run(now);
    }

    /// Carries out what comes from outside at or before the edge `t`.
    pub(super) fn run_outside(&mut self, t: u64) {
        while let Some(put) = self.drives.take(t) {
            match put {
                Put::Level(pin, level) => {
                    if let Some(volts) = self.power.volts.get_mut(usize::from(pin)) {
                        *volts = None;
                    }
                    self.drive_pin(pin, level, t);
                }
                Put::Volts(pin, millivolts) => {
                    if let Some(volts) = self.power.volts.get_mut(usize::from(pin)) {
                        *volts = Some(millivolts);
                    }
                    // Where the input switches between the levels that the data sheet promises is taken for the middle.
                    self.drive_pin(pin, Level::of(2 * u64::from(millivolts) >= self.power.supply.into()), t);
                    self.tell_voltage(pin, t);
                }
                Put::Supply(millivolts) => self.set_supply(millivolts, t),
            }
        }
    }

    fn drive_pin(&mut self, pin: PinId, level: Level, t: u64) {
        let changed = self.ports.drive(pin, level, t);
        self.edge(pin, changed, t);
    }

    /// A unit takes a pin or gives it back.
    pub(super) fn take_line(&mut self, number: usize, line: Line, drive: Drive, t: u64) {
        if number == unit::COMPARATOR {
            return self.capture_input(drive, t);
        }
        let found = self.part.lines.iter().find(|row| row.0 == number && row.1 == line);
        if let Some(&(.., pin)) = found {
            self.power.drives_pin(pin, number, drive);
            self.ports.take(pin, self.power.driver(pin));
            self.settle(pin, t);
        }
    }

    /// The comparator is the source of timer 1's captures, or gives the input back to its pin (23.2).
    fn capture_input(&mut self, drive: Drive, t: u64) {
        self.power.captures = drive;
        let number = unit::TIMER + 1;
        let pin = self.part.lines.iter().find(|row| row.0 == number && row.1 == Line::Icp);
        let high = match (drive, pin) {
            (Drive::Value(high), _) => high,
            (_, Some(&(.., pin))) => self.ports.pin(pin).high,
            _ => false,
        };
        self.tell(number, Line::Icp, high, t);
    }

    /// Settles a pin at the edge `t` after the chip changed what it does to it.
    pub(super) fn settle(&mut self, pin: PinId, t: u64) {
        let changed = self.ports.settle(pin, t);
        self.edge(pin, changed, t);
    }

    /// Settles all pins.
    pub(super) fn settle_all(&mut self, t: u64) {
        for pin in 0..self.ports.pins().len() as PinId {
            self.settle(pin, t);
        }
    }

    /// Logs the edge of a pin, if there was one, and a fight over it, and tells who listens.
    fn edge(&mut self, pin: PinId, changed: Option<Change>, t: u64) {
        if self.log.is_on() {
            let level = changed.map(|change| change.level);
            self.log.pin(Time::at(t), pin, self.ports.pin(pin).contention(), level);
        }
        if changed.is_some_and(|change| change.toggled) {
            let high = self.ports.pin(pin).high;
            let wiring = self.wiring.clone();
            for &(number, line) in wiring.0.get(usize::from(pin)).into_iter().flatten() {
                let captured = line == Line::Icp && self.power.captures != Drive::Port;
                if !captured {
                    self.tell(number, line, high, t);
                }
            }
            if pin == self.part.reset {
                self.reset_pin(high, t);
            }
        }
        if changed.is_some() && (self.part.analog.contains(&pin) || self.part.ain.contains(&pin)) {
            self.tell_voltage(pin, t);
        }
    }

    /// A line of a unit has changed.
    fn tell(&mut self, number: usize, line: Line, high: bool, t: u64) {
        with_unit!(self, number, unit => {
            unit.run(t, &mut self.out);
            unit.line(line, high, t, &mut self.out);
        });
        self.touch(number);
        self.carry_out(number);
        self.tell_trigger(number, t);
    }

    /// The levels of all lines, as units find them when they begin.
    pub(super) fn tell_all(&mut self, t: u64) {
        let wiring = self.wiring.clone();
        for (pin, lines) in wiring.0.iter().enumerate() {
            for &(number, line) in lines {
                self.tell(number, line, self.ports.pin(pin as PinId).high, t);
            }
        }
        for &pin in self.part.analog.iter().chain(&self.part.ain) {
            self.tell_voltage(pin, t);
        }
    }

    /// The voltage on a pin, as the analog units see it.
    pub(super) fn tell_voltage(&mut self, pin: PinId, t: u64) {
        let wire = self.ports.pin(pin);
        let outside = self.power.volts.get(usize::from(pin)).copied().flatten();
        let millivolts = match (wire.own, outside) {
            (Level::Float, Some(millivolts)) => millivolts,
            _ => u32::from(wire.high) * self.power.supply,
        };
        self.run_unit(unit::ADC, t);
        self.run_unit(unit::COMPARATOR, t);
        if let Some(channel) = self.part.analog.iter().position(|&analog| analog == pin) {
            self.adc.set_millivolts(channel as u8, millivolts, t);
            self.comparator.set_millivolts(Input::Adc(channel as u8), millivolts, t, &mut self.out);
        }
        for (input, of) in [Input::Ain0, Input::Ain1].into_iter().zip(self.part.ain) {
            if of == pin {
                self.comparator.set_millivolts(input, millivolts, t, &mut self.out);
            }
        }
        self.carry_out(unit::COMPARATOR);
    }

    pub(super) fn store_port(&mut self, port: usize, kind: u8, mask: u8, value: u8, t: u64) {
        let (ddr, out) = (self.ports.ddr(port), self.ports.port(port));
        let changed = match kind {
            // Writing one to PINx toggles PORTx (14.2.2), on chips that do.
            0 if self.part.toggles => self.ports.set_port(port, out ^ value & mask),
            0 => 0,
            1 => self.ports.set_ddr(port, ddr & !mask | value & mask),
            _ => self.ports.set_port(port, out & !mask | value & mask),
        };
        for bit in (0..8).filter(|bit| changed >> bit & 1 == 1) {
            let pin = (port * 8) as PinId + bit;
            if kind == 1 {
                self.tell_direction(pin, t);
            }
            self.settle(pin, t);
        }
    }

    /// Units for which DDR chooses what they are.
    fn tell_direction(&mut self, pin: PinId, t: u64) {
        let wiring = self.wiring.clone();
        let output = self.ports.is_output(pin);
        for &(number, line) in wiring.0.get(usize::from(pin)).into_iter().flatten() {
            if matches!(line, Line::Xck | Line::Ss) {
                with_unit!(self, number, unit => {
                    unit.run(t, &mut self.out);
                    unit.direction(line, output, t, &mut self.out);
                });
                self.touch(number);
                self.carry_out(number);
            }
        }
    }

    /// Pins whose digital input is switched off read 0 (24.9.5, 23.3.3).
    #[inline]
    pub(super) fn analog_only(&self, port: usize) -> u8 {
        if self.adc.digital_off() | self.comparator.digital_off() == 0 {
            return 0;
        }
        let off = |channels: u8, pins: &[PinId]| {
            let of =
                |(i, pin): (usize, &PinId)| (usize::from(pin / 8) == port && channels >> i & 1 == 1).then(|| pin % 8);
            pins.iter().enumerate().filter_map(of).fold(0, |bits, bit| bits | 1 << bit)
        };
        let off = off(self.adc.digital_off(), self.part.analog) | off(self.comparator.digital_off(), &self.part.ain);
        // An enabled pin change keeps the input on (14.3, DIEOE).
        let changes = self.part.pin_changes.iter().filter(|row| usize::from(row.0 / 8) == port);
        let on = changes.filter(|row| self.external.pin_change_on(row.1));
        off & !on.fold(0, |bits, row| bits | 1 << (row.0 % 8))
    }

    /// The reset pin, unless it is a port pin, has another level.
    fn reset_pin(&mut self, high: bool, t: u64) {
        if self.power.has_reset_pin {
            if !high {
                self.power.request(Reset::External);
            }
            self.power.low = !high;
            self.hold(t);
        }
    }

    /// The flag of the source that the converter listens to, when it is one of the unit `number`.
    pub(super) fn tell_trigger(&mut self, number: usize, t: u64) {
        if let Some(source) = self.adc.listens()
            && self.part.trigger(source).is_some_and(|(of, _)| of == number)
        {
            self.adc.trigger(source, self.flag(source, t), t);
            self.touch(unit::ADC);
        }
    }

    /// The flags of all sources, some of whose units have had no reason yet to do what was due by `t`.
    pub(super) fn tell_triggers(&mut self, t: u64) {
        self.run_unit(unit::EXTERNAL, t);
        self.run_unit(unit::COMPARATOR, t);
        for source in 1..=self.part.triggers.len() as u8 {
            self.adc.trigger(source, self.flag(source, t), t);
        }
    }

    /// Units tell of the flags that the converter listens to, and the comparator takes what the converter leaves it.
    pub(super) fn listen(&mut self, t: u64) {
        let wanted = self.adc.listens().and_then(|source| self.part.trigger(source));
        for n in 0..self.timers.len() {
            let irqs = wanted.filter(|&(number, _)| number == unit::TIMER + n).map_or(0, |(_, irq)| 1 << irq);
            self.timers[n].listen(irqs, t, &mut self.out);
            self.touch(unit::TIMER + n);
            self.carry_out(unit::TIMER + n);
        }
        self.external.listen(wanted.is_some_and(|(number, _)| number == unit::EXTERNAL), t, &mut self.out);
        self.touch(unit::EXTERNAL);
        self.carry_out(unit::EXTERNAL);
        self.comparator.select(self.adc.comparator_channel(), t, &mut self.out);
        self.comparator.keep_reference(self.adc.enabled() || self.power.bod_mv != 0, t, &mut self.out);
        self.touch(unit::COMPARATOR);
        self.carry_out(unit::COMPARATOR);
    }

    /// The flag of a trigger source as it stands at `t`.
    fn flag(&self, source: u8, t: u64) -> bool {
        let Some((number, irq)) = self.part.trigger(source) else { return false };
        match number {
            unit::COMPARATOR => self.comparator.flag(),
            unit::EXTERNAL => self.external.flag(),
            n if n < unit::USART => {
                let flags = self.timers[n].peek(timers::Reg::TIFR, t);
                self.timers[n].shape().irqs_of(flags) >> irq & 1 == 1
            }
            _ => false,
        }
    }
}
