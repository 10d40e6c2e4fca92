//! [`Device`] for the SPI: registers, lines and clocks.

use emu_core::NEVER;

use super::super::{AvrLine, AvrOutbox, AvrSignal, Device};
use super::{AvrSpi, CPOL, MSTR, SPE, SPI2X, SPIE, SPIF, SpiRegister, WCOL};

impl Device<AvrSignal> for AvrSpi {
    type Reg = SpiRegister;

    fn run_due(&mut self, t: u64, out: &mut AvrOutbox) {
        loop {
            let due = self.due();
            if due > t {
                return;
            }
            self.step(due, out);
        }
    }

    /// The master changes a pin at every half bit; a slave changes one when SCK has passed the synchronizer.
    fn next_deadline(&self) -> u64 {
        if self.asleep.is_some() {
            return NEVER;
        }
        let clock = if self.is_slave() { self.sck.next() } else { self.half };
        clock.min(self.selected)
    }

    /// Interrupt 0: serial transfer complete (STC).
    fn interrupt_requests(&self) -> u8 {
        u8::from(self.status & SPIF != 0 && self.has(SPIE))
    }

    fn on_interrupt_taken(&mut self, _: u8, t: u64, out: &mut AvrOutbox) {
        self.run_due(t, out);
        self.status &= !SPIF;
        self.shown &= !SPIF;
    }

    fn read(&mut self, reg: SpiRegister, t: u64, out: &mut AvrOutbox) -> u8 {
        self.run_due(t, out);
        let value = self.peek(reg, t);
        match reg {
            SpiRegister::SPSR => self.shown = self.status & (SPIF | WCOL),
            SpiRegister::SPDR => self.clear_flag(),
            SpiRegister::SPCR => {}
        }
        value
    }

    fn peek(&self, reg: SpiRegister, t: u64) -> u8 {
        if self.due() <= t {
            let mut then = self.clone();
            then.run_due(t, &mut AvrOutbox::new());
            return then.peek(reg, t);
        }
        match reg {
            SpiRegister::SPCR => self.control,
            SpiRegister::SPSR => self.status,
            SpiRegister::SPDR => self.buffer,
        }
    }

    fn write(&mut self, reg: SpiRegister, value: u8, mask: u8, t: u64, out: &mut AvrOutbox) {
        self.run_due(t, out);
        if self.asleep.is_some() {
            return;
        }
        match reg {
            SpiRegister::SPCR => {
                let before = self.control;
                self.control = before & !mask | value & mask;
                if (before ^ self.control) & (SPE | MSTR) != 0 {
                    self.abort();
                }
            }
            SpiRegister::SPSR => {
                let mask = mask & SPI2X;
                self.status = self.status & !mask | value & mask;
            }
            SpiRegister::SPDR => self.load(value & mask, t),
        }
        self.update_synchronizers(t);
        self.drive_lines(t, out);
    }

    fn on_line_changed(&mut self, line: AvrLine, high: bool, t: u64, out: &mut AvrOutbox) {
        self.run_due(t, out);
        match line {
            AvrLine::Sck => {
                if self.is_slave() && high != self.sck.pin_level() {
                    self.put_bit(high != self.has(CPOL));
                }
                match self.asleep {
                    Some(_) => self.sck.set_level_while_stopped(high),
                    None => self.sck.change(high, t),
                }
                self.drive_lines(t, out);
            }
            AvrLine::Mosi if self.asleep.is_some() => self.mosi.set_level_while_stopped(high),
            AvrLine::Mosi => {
                self.mosi.level(t);
                self.mosi.change(high, t);
            }
            AvrLine::Miso => self.miso = high,
            AvrLine::Ss => {
                self.ss = high;
                // A slave that is no longer selected drops the current byte at once (section 19.3.1).
                if high && !self.is_master() {
                    self.abort();
                }
                if self.asleep.is_none() {
                    self.update_synchronizers(t);
                }
                self.drive_lines(t, out);
            }
            _ => {}
        }
    }

    fn on_direction_changed(&mut self, line: AvrLine, output: bool, t: u64, out: &mut AvrOutbox) {
        self.run_due(t, out);
        if line == AvrLine::Ss {
            self.ss_output = output;
            if self.asleep.is_none() {
                self.update_synchronizers(t);
            }
        }
    }

    fn reset(&mut self, _power_on: bool, t: u64, out: &mut AvrOutbox) {
        self.restart_clock(t, out);
        self.run_due(t, out);
        let AvrSpi { sck, mosi, miso, ss, ss_output, drives, .. } = *self;
        *self = AvrSpi { sck, mosi, miso, ss, ss_output, drives, ..AvrSpi::new() };
        self.drive_lines(t, out);
    }

    fn stop_clock(&mut self, t: u64, out: &mut AvrOutbox) {
        self.run_due(t, out);
        self.mosi.level(t);
        self.asleep = self.asleep.or(Some(t));
    }

    fn restart_clock(&mut self, t: u64, _: &mut AvrOutbox) {
        let Some(from) = self.asleep.take() else { return };
        self.half = self.half.saturating_add(t.saturating_sub(from));
        self.sck.wake(from, t);
        self.mosi.wake(from, t);
        self.selected = NEVER;
        self.update_synchronizers(t);
    }

    fn steady_until(&self, reg: SpiRegister, t: u64) -> u64 {
        let event = match reg {
            SpiRegister::SPDR => t,
            // A read of flags that are set has a side effect.
            SpiRegister::SPSR if self.status & (SPIF | WCOL) & !self.shown != 0 => t,
            _ if self.asleep.is_some() => NEVER,
            SpiRegister::SPCR => self.selected,
            SpiRegister::SPSR => self.end().min(self.selected).min(self.slave_event()),
        };
        event.max(t)
    }
}

impl AvrSpi {
    /// Returns the earliest end of the master's current byte.
    fn end(&self) -> u64 {
        let halves = (u64::from(8 - self.count.min(8)) * 2).saturating_sub(2);
        self.half.saturating_add(halves.saturating_mul(self.period_half()))
    }

    fn slave_event(&self) -> u64 {
        if self.is_slave() { self.sck.next() } else { NEVER }
    }
}
