//! The registers, and what the chip says to the part.

use emu_core::NEVER;

use super::super::{Device, Line, Outbox};
use super::{CPOL, MSTR, Reg, SPE, SPI2X, SPIE, SPIF, Spi, WCOL};

impl Device for Spi {
    type Reg = Reg;

    fn run(&mut self, t: u64, out: &mut Outbox) {
        loop {
            let due = self.due();
            if due > t {
                return;
            }
            self.step(due, out);
        }
    }

    /// The master's clock moves a pin with every half of a bit; a slave moves one with what comes out of the synchroniser.
    fn next(&self) -> u64 {
        if self.asleep.is_some() {
            return NEVER;
        }
        let clock = if self.slave() { self.sck.next() } else { self.half };
        clock.min(self.selected)
    }

    /// 0 STC.
    fn requests(&self) -> u8 {
        u8::from(self.status & SPIF != 0 && self.has(SPIE))
    }

    fn taken(&mut self, _: u8, t: u64, out: &mut Outbox) {
        self.run(t, out);
        self.status &= !SPIF;
        self.shown &= !SPIF;
    }

    fn read(&mut self, reg: Reg, t: u64, out: &mut Outbox) -> u8 {
        self.run(t, out);
        let value = self.peek(reg, t);
        match reg {
            Reg::SPSR => self.shown = self.status & (SPIF | WCOL),
            Reg::SPDR => self.unflag(),
            Reg::SPCR => {}
        }
        value
    }

    fn peek(&self, reg: Reg, t: u64) -> u8 {
        if self.due() <= t {
            let mut then = self.clone();
            then.run(t, &mut Outbox::new());
            return then.peek(reg, t);
        }
        match reg {
            Reg::SPCR => self.control,
            Reg::SPSR => self.status,
            Reg::SPDR => self.buffer,
        }
    }

    fn write(&mut self, reg: Reg, value: u8, mask: u8, t: u64, out: &mut Outbox) {
        self.run(t, out);
        if self.asleep.is_some() {
            return;
        }
        match reg {
            Reg::SPCR => {
                let before = self.control;
                self.control = before & !mask | value & mask;
                if (before ^ self.control) & (SPE | MSTR) != 0 {
                    self.abort();
                }
            }
            Reg::SPSR => {
                let mask = mask & SPI2X;
                self.status = self.status & !mask | value & mask;
            }
            Reg::SPDR => self.load(value & mask, t),
        }
        self.watch(t);
        self.settle(t, out);
    }

    fn line(&mut self, line: Line, high: bool, t: u64, out: &mut Outbox) {
        self.run(t, out);
        match line {
            Line::Sck => {
                if self.slave() && high != self.sck.pin() {
                    self.put(high != self.has(CPOL));
                }
                match self.asleep {
                    Some(_) => self.sck.change_asleep(high),
                    None => self.sck.change(high, t),
                }
                self.settle(t, out);
            }
            Line::Mosi if self.asleep.is_some() => self.mosi.change_asleep(high),
            Line::Mosi => {
                self.mosi.level(t);
                self.mosi.change(high, t);
            }
            Line::Miso => self.miso = high,
            Line::Ss => {
                self.ss = high;
                // A slave that is no longer selected drops what it has, at once (section 19.3.1).
                if high && !self.master() {
                    self.abort();
                }
                if self.asleep.is_none() {
                    self.watch(t);
                }
                self.settle(t, out);
            }
            _ => {}
        }
    }

    fn direction(&mut self, line: Line, output: bool, t: u64, out: &mut Outbox) {
        self.run(t, out);
        if line == Line::Ss {
            self.ss_output = output;
            if self.asleep.is_none() {
                self.watch(t);
            }
        }
    }

    fn reset(&mut self, t: u64, out: &mut Outbox) {
        self.wake(t, out);
        self.run(t, out);
        let Spi { sck, mosi, miso, ss, ss_output, drives, .. } = *self;
        *self = Spi { sck, mosi, miso, ss, ss_output, drives, ..Spi::new() };
        self.settle(t, out);
    }

    fn sleep(&mut self, t: u64, out: &mut Outbox) {
        self.run(t, out);
        self.mosi.level(t);
        self.asleep = self.asleep.or(Some(t));
    }

    fn wake(&mut self, t: u64, _: &mut Outbox) {
        let Some(from) = self.asleep.take() else { return };
        self.half = self.half.saturating_add(t.saturating_sub(from));
        self.sck.wake(from, t);
        self.mosi.wake(from, t);
        self.selected = NEVER;
        self.watch(t);
    }

    fn steady(&self, reg: Reg, t: u64) -> u64 {
        let event = match reg {
            Reg::SPDR => t,
            // A read of flags that are set has a consequence.
            Reg::SPSR if self.status & (SPIF | WCOL) & !self.shown != 0 => t,
            _ if self.asleep.is_some() => NEVER,
            Reg::SPCR => self.selected,
            Reg::SPSR => self.end().min(self.selected).min(self.slave_event()),
        };
        event.max(t)
    }
}

impl Spi {
    /// When the master's byte ends at the earliest.
    fn end(&self) -> u64 {
        let halves = (u64::from(8 - self.count.min(8)) * 2).saturating_sub(2);
        self.half.saturating_add(halves.saturating_mul(self.period_half()))
    }

    fn slave_event(&self) -> u64 {
        if self.slave() { self.sck.next() } else { NEVER }
    }
}
