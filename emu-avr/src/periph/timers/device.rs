//! [`Device`] for a timer.

use emu_core::NEVER;

use super::mode::MatchAction;
use super::{AvrSignal, AvrTimer, TimerRegister, regs};
use crate::periph::{AvrLine, AvrOutbox, Device};

impl Device<AvrSignal> for AvrTimer {
    type Reg = TimerRegister;

    fn run_due(&mut self, t: u64, out: &mut AvrOutbox) {
        self.advance_to(t, out);
    }

    fn next_deadline(&self) -> u64 {
        let watched = (self.timsk | self.listened_interrupts) & !self.tifr;
        let driven = self.channels.iter().any(|channel| channel.action != MatchAction::None)
            || self.busy & regs::CONTROL_BUSY != 0;
        match (watched, driven) {
            (0, false) => NEVER,
            _ => self.next_step().t.min(self.flag_time(watched)),
        }
    }

    fn interrupt_requests(&self) -> u8 {
        match self.tifr & self.timsk {
            0 => 0,
            flags => self.shape.irqs_of(flags),
        }
    }

    fn on_interrupt_taken(&mut self, irq: u8, t: u64, out: &mut AvrOutbox) {
        self.on_setup_changed(t, out);
        if irq < 8 {
            self.tifr &= !self.shape.flags_of(1 << irq);
        }
    }

    fn read(&mut self, reg: TimerRegister, t: u64, out: &mut AvrOutbox) -> u8 {
        match reg {
            TimerRegister::TIFR if t < self.quiet_until() => self.tifr,
            TimerRegister::TIFR | TimerRegister::ASSR => {
                self.advance_to(t, out);
                self.read_register(reg, t)
            }
            TimerRegister::TCNTL | TimerRegister::ICRL => {
                self.advance_to(t, out);
                if self.shape.wide {
                    self.temp = (if reg == TimerRegister::TCNTL { self.value } else { self.icr } >> 8) as u8;
                }
                self.read_register(reg, t)
            }
            _ => self.read_register(reg, t),
        }
    }

    fn peek(&self, reg: TimerRegister, t: u64) -> u8 {
        match reg {
            TimerRegister::TIFR if t < self.quiet_until() => self.tifr,
            TimerRegister::TIFR | TimerRegister::TCNTL | TimerRegister::ICRL | TimerRegister::ASSR => {
                self.advanced_to(t).read_register(reg, t)
            }
            _ => self.read_register(reg, t),
        }
    }

    fn write(&mut self, reg: TimerRegister, value: u8, mask: u8, t: u64, out: &mut AvrOutbox) {
        self.write_register(reg, value, mask, t, out);
    }

    fn on_line_changed(&mut self, line: AvrLine, high: bool, t: u64, out: &mut AvrOutbox) {
        let (i, external) = match line {
            AvrLine::T => (0, self.shape.asynchronous),
            AvrLine::Icp => (1, false),
            _ => return,
        };
        if std::mem::replace(&mut self.line_levels[i], high) == high {
            return;
        }
        self.on_setup_changed(t, out);
        if external {
            if high {
                self.tosc.pulse(t);
                self.on_setup_changed(t, out);
            }
        } else if self.asleep.is_none() {
            let pipe = if i == 0 { &mut self.pin } else { &mut self.icp.pipe };
            pipe.change(high, t);
        }
    }

    fn reset(&mut self, _power_on: bool, t: u64, out: &mut AvrOutbox) {
        self.on_setup_changed(t, out);
        self.restart_after_sleep(t);
        self.tosc.set_external(false, t);
        self.tosc.set_stopped(false, t);
        let old = self.clone();
        *self = AvrTimer {
            prescaler: old.prescaler,
            pin: old.pin,
            icp: old.icp,
            line_levels: old.line_levels,
            listened_interrupts: old.listened_interrupts,
            tosc: old.tosc,
            cleared: self.tosc.index(t),
            ..AvrTimer::new(old.shape)
        };
        for (channel, old) in self.channels.iter_mut().zip(old.channels) {
            channel.driven = old.driven;
        }
        self.drive_outputs(t, out);
    }

    fn stop_clock(&mut self, t: u64, out: &mut AvrOutbox) {
        self.on_setup_changed(t, out);
        if self.asleep.is_none() {
            let value = self.read_register(TimerRegister::TCNTL, t);
            self.asleep = Some(t);
            self.stale_count = (u16::from(value), NEVER);
            self.due = [NEVER; 5];
            self.select_clock(t);
        }
    }

    fn restart_clock(&mut self, t: u64, out: &mut AvrOutbox) {
        self.on_setup_changed(t, out);
        self.restart_after_sleep(t);
        self.select_clock(t);
    }

    fn set_clock_hz(&mut self, hz: u64, t: u64) {
        self.on_setup_changed(t, &mut Vec::new());
        self.tosc.set_rate(hz, t);
    }

    fn steady_until(&self, reg: TimerRegister, t: u64) -> u64 {
        if reg == TimerRegister::TIFR && t < self.quiet_until() {
            return self.quiet_until();
        }
        match reg {
            TimerRegister::TIFR | TimerRegister::TCNTL | TimerRegister::ICRL | TimerRegister::ASSR => {
                self.advanced_to(t).register_steady_until(reg, t)
            }
            _ => NEVER,
        }
    }
}
