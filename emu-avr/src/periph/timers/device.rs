//! What the chip asks of a timer and tells it.

use emu_core::NEVER;

use super::mode::Action;
use super::{Reg, Timer, regs};
use crate::periph::{Device, Line, Outbox};

impl Device for Timer {
    type Reg = Reg;

    fn run(&mut self, t: u64, out: &mut Outbox) {
        self.advance(t, out);
    }

    fn next(&self) -> u64 {
        let watched = (self.timsk | self.listened) & !self.tifr;
        let driven =
            self.channels.iter().any(|channel| channel.action != Action::None) || self.busy & regs::CONTROL_BUSY != 0;
        match (watched, driven) {
            (0, false) => NEVER,
            _ => self.plan().t.min(self.flag_time(watched)),
        }
    }

    fn requests(&self) -> u8 {
        match self.tifr & self.timsk {
            0 => 0,
            flags => self.shape.irqs_of(flags),
        }
    }

    fn taken(&mut self, irq: u8, t: u64, out: &mut Outbox) {
        self.change(t, out);
        if irq < 8 {
            self.tifr &= !self.shape.flags_of(1 << irq);
        }
    }

    fn read(&mut self, reg: Reg, t: u64, out: &mut Outbox) -> u8 {
        match reg {
            Reg::TIFR if t < self.still() => self.tifr,
            Reg::TIFR | Reg::ASSR => {
                self.advance(t, out);
                self.look(reg, t)
            }
            Reg::TCNTL | Reg::ICRL => {
                self.advance(t, out);
                if self.shape.wide {
                    self.temp = (if reg == Reg::TCNTL { self.value } else { self.icr } >> 8) as u8;
                }
                self.look(reg, t)
            }
            _ => self.look(reg, t),
        }
    }

    fn peek(&self, reg: Reg, t: u64) -> u8 {
        match reg {
            Reg::TIFR if t < self.still() => self.tifr,
            Reg::TIFR | Reg::TCNTL | Reg::ICRL | Reg::ASSR => self.at(t).look(reg, t),
            _ => self.look(reg, t),
        }
    }

    fn write(&mut self, reg: Reg, value: u8, mask: u8, t: u64, out: &mut Outbox) {
        self.put(reg, value, mask, t, out);
    }

    fn line(&mut self, line: Line, high: bool, t: u64, out: &mut Outbox) {
        let (i, external) = match line {
            Line::T => (0, self.shape.asynchronous),
            Line::Icp => (1, false),
            _ => return,
        };
        if std::mem::replace(&mut self.raw[i], high) == high {
            return;
        }
        self.change(t, out);
        if external {
            if high {
                self.tosc.pulse(t);
                self.change(t, out);
            }
        } else if self.asleep.is_none() {
            let pipe = if i == 0 { &mut self.pin } else { &mut self.icp.pipe };
            pipe.change(high, t);
        }
    }

    fn reset(&mut self, t: u64, out: &mut Outbox) {
        self.change(t, out);
        self.resume(t);
        self.tosc.set_external(false, t);
        self.tosc.set_stopped(false, t);
        let old = self.clone();
        *self = Timer {
            prescaler: old.prescaler,
            pin: old.pin,
            icp: old.icp,
            raw: old.raw,
            listened: old.listened,
            tosc: old.tosc,
            cleared: self.tosc.index(t),
            ..Timer::new(old.shape)
        };
        for (channel, old) in self.channels.iter_mut().zip(old.channels) {
            channel.shown = old.shown;
        }
        self.show(t, out);
    }

    fn sleep(&mut self, t: u64, out: &mut Outbox) {
        self.change(t, out);
        if self.asleep.is_none() {
            let value = self.look(Reg::TCNTL, t);
            self.asleep = Some(t);
            self.stale = (u16::from(value), NEVER);
            self.due = [NEVER; 5];
            self.select(t);
        }
    }

    fn wake(&mut self, t: u64, out: &mut Outbox) {
        self.change(t, out);
        self.resume(t);
        self.select(t);
    }

    fn rate(&mut self, hz: u64, t: u64) {
        self.change(t, &mut Vec::new());
        self.tosc.set_rate(hz, t);
    }

    fn steady(&self, reg: Reg, t: u64) -> u64 {
        if reg == Reg::TIFR && t < self.still() {
            return self.still();
        }
        match reg {
            Reg::TIFR | Reg::TCNTL | Reg::ICRL | Reg::ASSR => self.at(t).keeps(reg, t),
            _ => NEVER,
        }
    }
}
