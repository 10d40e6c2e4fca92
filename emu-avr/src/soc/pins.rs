//! Pins: inputs from outside, overrides by units, and notification of the units that listen.

use emu_core::chip::ChipPackage;
use emu_core::cpu::ResetCause;
use emu_core::external_io::OutsideInput;
use emu_core::pins::{CycleTime, PinId, PinLevel};

use super::AvrSoc;

use crate::chips::{AdcTrigger, AvrPart, unit_index};
use crate::periph::comparator::ComparatorInput;
use crate::periph::ports::{PIN_COUNT, PinChange};
use crate::periph::{AvrDrive, AvrLine, Device, SignalReceiver, timers};

/// The unit lines on each pin, and the package, if one is selected.
#[derive(Debug)]
pub(super) struct PinLines(Vec<Vec<(usize, AvrLine)>>, Option<&'static ChipPackage>);

impl PinLines {
    /// Returns the lines of a part in the package of that name.
    pub(super) fn new(part: &AvrPart, package: Option<&str>) -> PinLines {
        let mut pins = vec![Vec::new(); PIN_COUNT];
        for &(number, line, pin) in part.peripheral_pins {
            if let Some(lines) = pins.get_mut(usize::from(pin)) {
                lines.push((number, line));
            }
        }
        for &(pin, number) in part.pin_changes {
            if let Some(lines) = pins.get_mut(usize::from(pin)) {
                lines.push((unit_index::EXTERNAL, AvrLine::Pc(number)));
            }
        }
        PinLines(pins, package.and_then(|name| part.chip.package(name)))
    }
}

impl AvrSoc {
    /// Reports whether the chip has this pin: in the selected package, or else in any of its packages.
    #[must_use]
    pub fn has_pin(&self, pin: PinId) -> bool {
        self.wiring.1.map_or_else(|| self.part.chip.has_pin(pin), |package| package.pin_number(pin).is_some())
    }

    /// Applies the queued inputs that are due at or before the edge `t`.
    pub(super) fn apply_inputs(&mut self, t: u64) {
        while let Some(put) = self.drives.pop_due(t) {
            match put {
                OutsideInput::Level(pin, level) => {
                    if let Some(volts) = self.power.volts.get_mut(usize::from(pin)) {
                        *volts = None;
                    }
                    self.drive_pin(pin, level, t);
                }
                OutsideInput::Volts(pin, millivolts) => {
                    if let Some(volts) = self.power.volts.get_mut(usize::from(pin)) {
                        *volts = Some(millivolts);
                    }
                    // The switching threshold between the levels guaranteed by the data sheet is assumed to
                    // be half the supply.
                    self.drive_pin(pin, PinLevel::from_bit(2 * u64::from(millivolts) >= self.power.supply.into()), t);
                    self.notify_voltage(pin, t);
                }
                OutsideInput::Supply(millivolts) => self.set_supply(millivolts, t),
            }
        }
    }

    fn drive_pin(&mut self, pin: PinId, level: PinLevel, t: u64) {
        let changed = self.ports.drive(pin, level, t);
        self.on_pin_edge(pin, changed, t);
    }

    /// Sets or removes the override of a pin by a unit.
    pub(super) fn set_line_driver(&mut self, number: usize, line: AvrLine, drive: AvrDrive, t: u64) {
        if number == unit_index::COMPARATOR {
            return self.capture_input(drive, t);
        }
        let found = self.part.peripheral_pins.iter().find(|row| row.0 == number && row.1 == line);
        if let Some(&(.., pin)) = found {
            self.power.drives_pin(pin, number, drive);
            self.ports.set_driver(pin, self.power.driver(pin));
            self.update_pin(pin, t);
        }
    }

    /// Connects the capture input of timer 1 to the comparator, or back to its pin (23.2).
    fn capture_input(&mut self, drive: AvrDrive, t: u64) {
        self.power.capture_driver = drive;
        let number = unit_index::TIMER + 1;
        let pin = self.part.peripheral_pins.iter().find(|row| row.0 == number && row.1 == AvrLine::Icp);
        let high = match (drive, pin) {
            (AvrDrive::Value(high), _) => high,
            (_, Some(&(.., pin))) => self.ports.pin(pin).reads_high,
            _ => false,
        };
        self.notify_line(number, AvrLine::Icp, high, t);
    }

    /// Updates a pin at the edge `t` after the chip has changed how it drives it.
    pub(super) fn update_pin(&mut self, pin: PinId, t: u64) {
        let changed = self.ports.update_level(pin, t);
        self.on_pin_edge(pin, changed, t);
    }

    /// Updates all pins.
    pub(super) fn update_all_pins(&mut self, t: u64) {
        for pin in 0..self.ports.pins().len() as PinId {
            self.update_pin(pin, t);
        }
    }

    /// Logs the edge of a pin, if there was one, and contention on it, and notifies the listening units.
    fn on_pin_edge(&mut self, pin: PinId, changed: Option<PinChange>, t: u64) {
        if self.log.is_enabled() {
            let level = changed.map(|change| change.level);
            self.log.record_pin(CycleTime::at(t), pin, self.ports.pin(pin).has_contention(), level);
        }
        if changed.is_some_and(|change| change.toggled) {
            let high = self.ports.pin(pin).reads_high;
            let wiring = self.wiring.clone();
            for &(number, line) in wiring.0.get(usize::from(pin)).into_iter().flatten() {
                let captured = line == AvrLine::Icp && self.power.capture_driver != AvrDrive::Port;
                if !captured {
                    self.notify_line(number, line, high, t);
                }
            }
            if pin == self.part.reset_pin {
                self.reset_pin(high, t);
            }
        }
        if changed.is_some() && (self.part.analog_pins.contains(&pin) || self.part.comparator_pins.contains(&pin)) {
            self.notify_voltage(pin, t);
        }
    }

    /// Notifies a unit of a change of one of its lines.
    fn notify_line(&mut self, number: usize, line: AvrLine, high: bool, t: u64) {
        with_unit!(self, number, unit => {
            unit.run_due(t, &mut self.out);
            unit.on_line_changed(line, high, t, &mut self.out);
        });
        self.schedule.touch(number);
        self.apply_signals(number);
        self.notify_trigger(number, t);
    }

    /// Notifies all units of the levels of their lines, after a reset.
    pub(super) fn notify_all_lines(&mut self, t: u64) {
        let wiring = self.wiring.clone();
        for (pin, lines) in wiring.0.iter().enumerate() {
            for &(number, line) in lines {
                self.notify_line(number, line, self.ports.pin(pin as PinId).reads_high, t);
            }
        }
        for &pin in self.part.analog_pins.iter().chain(&self.part.comparator_pins) {
            self.notify_voltage(pin, t);
        }
    }

    /// Passes the voltage on a pin to the analog units.
    pub(super) fn notify_voltage(&mut self, pin: PinId, t: u64) {
        let wire = self.ports.pin(pin);
        let outside = self.power.volts.get(usize::from(pin)).copied().flatten();
        let millivolts = match (wire.driven, outside) {
            (PinLevel::Float, Some(millivolts)) => millivolts,
            _ => u32::from(wire.reads_high) * self.power.supply,
        };
        self.run_unit(unit_index::ADC, t);
        self.run_unit(unit_index::COMPARATOR, t);
        if let Some(channel) = self.part.analog_pins.iter().position(|&analog| analog == pin) {
            self.adc.set_millivolts(channel as u8, millivolts, t);
            self.comparator.set_millivolts(ComparatorInput::Adc(channel as u8), millivolts, t, &mut self.out);
        }
        for (input, of) in [ComparatorInput::Ain0, ComparatorInput::Ain1].into_iter().zip(self.part.comparator_pins) {
            if of == pin {
                self.comparator.set_millivolts(input, millivolts, t, &mut self.out);
            }
        }
        self.apply_signals(unit_index::COMPARATOR);
    }

    /// Writes the bits in `mask` of a port register at the edge `t`; `kind` is 0 for PINx, 1 for DDRx, 2 for
    /// PORTx.
    pub(super) fn write_port(&mut self, port: usize, kind: u8, mask: u8, value: u8, t: u64) {
        let (ddr, out) = (self.ports.ddr(port), self.ports.port(port));
        let changed = match kind {
            // On chips that support it, writing one to PINx toggles PORTx (14.2.2).
            0 if self.part.pin_writes_toggle => self.ports.set_port(port, out ^ value & mask),
            0 => 0,
            1 => self.ports.set_ddr(port, ddr & !mask | value & mask),
            _ => self.ports.set_port(port, out & !mask | value & mask),
        };
        for bit in (0..8).filter(|bit| changed >> bit & 1 == 1) {
            let pin = (port * 8) as PinId + bit;
            if kind == 1 {
                self.notify_direction(pin, t);
            }
            self.update_pin(pin, t);
        }
    }

    /// Notifies the units whose role depends on DDR.
    fn notify_direction(&mut self, pin: PinId, t: u64) {
        let wiring = self.wiring.clone();
        let output = self.ports.is_output(pin);
        for &(number, line) in wiring.0.get(usize::from(pin)).into_iter().flatten() {
            if matches!(line, AvrLine::Xck | AvrLine::Ss) {
                with_unit!(self, number, unit => {
                    unit.run_due(t, &mut self.out);
                    unit.on_direction_changed(line, output, t, &mut self.out);
                });
                self.schedule.touch(number);
                self.apply_signals(number);
            }
        }
    }

    /// Returns the pins of a port whose digital input is off; they read 0 (24.9.5, 23.3.3).
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
        let off = off(self.adc.digital_off(), self.part.analog_pins)
            | off(self.comparator.digital_off(), &self.part.comparator_pins);
        // An enabled pin change interrupt keeps the input on (14.3, DIEOE).
        let changes = self.part.pin_changes.iter().filter(|row| usize::from(row.0 / 8) == port);
        let on = changes.filter(|row| self.external.pin_change_on(row.1));
        off & !on.fold(0, |bits, row| bits | 1 << (row.0 % 8))
    }

    /// Handles a level change of the reset pin, unless it is a port pin.
    fn reset_pin(&mut self, high: bool, t: u64) {
        if self.power.has_reset_pin {
            if !high {
                self.power.request(ResetCause::External);
            }
            self.power.reset_pin_low = !high;
            self.hold_in_reset(t);
        }
    }

    /// Passes the flag of the converter's trigger source to it, if the source belongs to the unit `number`.
    pub(super) fn notify_trigger(&mut self, number: usize, t: u64) {
        if let Some(source) = self.adc.listened_trigger()
            && self.part.adc_trigger(source).is_some_and(|AdcTrigger { unit: of, .. }| of == number)
        {
            self.adc.trigger(source, self.trigger_flag(source, t), t);
            self.schedule.touch(unit_index::ADC);
        }
    }

    /// Passes the flags of all trigger sources to the converter, after executing what is due by `t` in their
    /// units.
    pub(super) fn notify_triggers(&mut self, t: u64) {
        self.run_unit(unit_index::EXTERNAL, t);
        self.run_unit(unit_index::COMPARATOR, t);
        for source in 1..=self.part.adc_triggers.len() as u8 {
            self.adc.trigger(source, self.trigger_flag(source, t), t);
        }
    }

    /// Selects the unit that signals the converter's trigger, and updates the comparator's channel and
    /// reference.
    pub(super) fn update_trigger_listeners(&mut self, t: u64) {
        let wanted = self.adc.listened_trigger().and_then(|source| self.part.adc_trigger(source));
        for n in 0..self.timers.len() {
            let irqs = wanted
                .filter(|&AdcTrigger { unit: number, .. }| number == unit_index::TIMER + n)
                .map_or(0, |AdcTrigger { interrupt: irq, .. }| 1 << irq);
            self.timers[n].set_listened_interrupts(irqs, t, &mut self.out);
            self.schedule.touch(unit_index::TIMER + n);
            self.apply_signals(unit_index::TIMER + n);
        }
        self.external.set_flag_listener(
            wanted.is_some_and(|AdcTrigger { unit: number, .. }| number == unit_index::EXTERNAL),
            t,
            &mut self.out,
        );
        self.schedule.touch(unit_index::EXTERNAL);
        self.apply_signals(unit_index::EXTERNAL);
        self.comparator.select(self.adc.comparator_channel(), t, &mut self.out);
        self.comparator.hold_reference_on(self.adc.enabled() || self.power.bod_mv != 0, t, &mut self.out);
        self.schedule.touch(unit_index::COMPARATOR);
        self.apply_signals(unit_index::COMPARATOR);
    }

    /// Returns the flag of a trigger source at `t`.
    fn trigger_flag(&self, source: u8, t: u64) -> bool {
        let Some(AdcTrigger { unit: number, interrupt: irq }) = self.part.adc_trigger(source) else { return false };
        match number {
            unit_index::COMPARATOR => self.comparator.flag(),
            unit_index::EXTERNAL => self.external.flag(),
            n if n < unit_index::USART => {
                let flags = self.timers[n].peek(timers::TimerRegister::TIFR, t);
                self.timers[n].shape().irqs_of(flags) >> irq & 1 == 1
            }
            // Only these three units trigger conversions (`adc_triggers` of the rows).
            _ => false,
        }
    }
}
