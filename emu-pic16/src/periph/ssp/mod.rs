//! Synchronous serial port: SSP and MSSP (DS39582 chapter 9, DS30292 chapter 9, DS33023 chapters 15 to 17; the basic SSP:
//! DS39598 chapter 10 of the 16F818/819, DS30487 chapter 10 of the 16F87/88).
//!
//! In I2C the part pulls SCL and SDA low or leaves them open ([`Drive::Low`], [`Drive::Open`]), and what they are comes back by
//! [`Device::line`], at the same clock where it is the part's own doing. So that it sees its wires in time
//! [`Device::run`] must be called at every clock that [`Device::next`] names, not later.

mod master;
mod regs;
mod slave;
mod spi;

use emu_core::NEVER;

use super::map::{Line, Sfr};
use super::{Device, Drive, Outbox};
use master::Master;
use regs::{BF, CKE, CKP, Mode, P, RW, Regs, S, SEQUENCES, SMP, UA, WCOL, interrupt};
use slave::Slave;
use spi::Spi;

/// The port.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ssp {
    regs: Regs,
    spi: Spi,
    slave: Slave,
    master: Master,
    /// Since when the oscillator stands.
    asleep: Option<u64>,
}

emu_core::state! { Ssp { regs, spi, slave, master, asleep } if |of, now| of.asleep.is_none_or(|since| since <= now + 4) }

impl Ssp {
    /// A port after power-up: an MSSP, or the basic SSP without SSPCON2, I2C master and general call.
    #[must_use]
    pub fn new(master: bool) -> Ssp {
        Ssp { regs: Regs::new(master), spi: Spi::IDLE, slave: Slave::IDLE, master: Master::IDLE, asleep: None }
    }

    /// The MSSP of the 16F87XA, where SEN makes a slave stretch the clock after every byte that it receives (DS39582 section
    /// 9.4.4; DS30292 register 9-3 has SEN for the master only).
    #[must_use]
    pub fn with_stretch(mut self, stretch: bool) -> Ssp {
        self.regs.stretch = stretch;
        self
    }

    /// SS raised within a byte leaves what was shifted in SSPSR ([`Readings::ss_keeps_bits`](crate::Readings)).
    #[must_use]
    pub fn with_kept_bits(mut self, keeps: bool) -> Ssp {
        self.regs.keeps_bits = keeps;
        self
    }

    /// Reset (DS39582 table 14-6): all registers 0 but SSPBUF, which is unknown after power-up (0 here) and kept otherwise.
    pub fn reset(&mut self, power_on: bool, t: u64, out: &mut Outbox) {
        self.set_mode(0);
        let regs = &mut self.regs;
        (regs.con2, regs.add, regs.stat) = (0, 0, 0);
        if power_on {
            regs.buf = 0;
        }
        self.asleep = None;
        self.settle(t, out);
    }

    /// Periods of timer 2 clock the port: SPI master, SSPM 0011.
    #[must_use]
    pub fn wants_timer2(&self) -> bool {
        self.regs.mode() == Mode::SpiMaster(None)
    }

    /// A byte is on its way out, and its next half bit begins with a period of timer 2.
    #[must_use]
    pub fn waits_for_timer2(&self) -> bool {
        self.wants_timer2() && self.spi.shifting()
    }

    /// A period of timer 2 has ended at `t`: half a bit of SPI. It comes before a write at the same clock.
    pub fn timer2(&mut self, t: u64, out: &mut Outbox) {
        self.run(t, out);
        if self.waits_for_timer2() && self.asleep.is_none() {
            self.spi.half(&self.regs, t);
            self.settle(t, out);
        }
    }

    /// The port is on in a mode of I2C: what it drives reaches SCL and SDA whatever TRIS says.
    #[must_use]
    pub fn is_i2c(&self) -> bool {
        self.regs.mode().i2c()
    }

    /// Says what the lines are driven with, where that has changed.
    fn settle(&mut self, t: u64, out: &mut Outbox) {
        let regs = &self.regs;
        let wire = |pull| if pull { Drive::Low } else { Drive::Open };
        let (sck, sdi, sdo) = match regs.mode() {
            Mode::Off => (Drive::Port, Drive::Port, Drive::Port),
            Mode::SpiMaster(_) => {
                (Drive::of(self.spi.active != (regs.con & CKP != 0)), Drive::Port, Drive::of(self.spi.sdo))
            }
            Mode::SpiSlave { select } if select && regs.ss => (Drive::Port, Drive::Port, Drive::Float),
            Mode::SpiSlave { .. } => (Drive::Port, Drive::Port, Drive::of(self.spi.sdo)),
            _ => (wire(regs.pull_scl), wire(regs.pull_sda), Drive::Port),
        };
        self.regs.settle(sck, sdi, sdo, t, out);
    }

    /// SSPCON is written. Another mode begins from rest.
    fn set_mode(&mut self, con: u8) {
        let before = self.regs.mode();
        self.regs.con = con;
        let mode = self.regs.mode();
        if mode != before {
            self.spi = Spi::IDLE;
            self.slave = Slave::IDLE;
            self.master = Master::IDLE;
            if !(before.i2c() && mode.i2c()) {
                self.regs.stat(S | P, false);
            }
            // R/W says that what fills SSPBUF was to be sent.
            if self.regs.stat & RW != 0 {
                self.regs.stat(BF, false);
            }
            self.regs.stat(RW | UA, false);
            (self.regs.pull_scl, self.regs.pull_sda) = (false, false);
        }
        if let Mode::Slave { .. } = mode {
            self.slave.hold(&mut self.regs);
        }
    }

    /// SSPBUF is written.
    fn write_buf(&mut self, value: u8, t: u64, out: &mut Outbox) {
        let mode = self.regs.mode();
        let busy = match mode {
            Mode::Off | Mode::Firmware => false,
            Mode::SpiMaster(_) | Mode::SpiSlave { .. } => self.spi.busy(),
            Mode::Slave { .. } => self.slave.busy(),
            Mode::Master => self.master.busy(),
        };
        if busy {
            self.regs.con |= WCOL;
            return;
        }
        self.regs.buf = value;
        match mode {
            Mode::Off | Mode::Firmware => {}
            Mode::SpiMaster(_) | Mode::SpiSlave { .. } => self.spi.load(&self.regs, t),
            Mode::Slave { .. } => self.slave.load(&mut self.regs),
            Mode::Master => self.master.load(&mut self.regs, t, out),
        }
    }

    /// SSPCON2 is written.
    fn write_con2(&mut self, value: u8, t: u64, out: &mut Outbox) {
        if !self.regs.master {
            return;
        }
        let master = self.regs.mode() == Mode::Master;
        if master && self.master.busy() {
            self.regs.con2 = self.regs.con2 & SEQUENCES | value & !SEQUENCES;
            return;
        }
        self.regs.con2 = value;
        if master {
            self.master.sequence(&mut self.regs, t, out);
        }
    }

    /// SDA changes while SCL is high.
    fn condition(&mut self, start: bool, t: u64, out: &mut Outbox) {
        self.regs.stat(S, start);
        self.regs.stat(P, !start);
        let notice = match self.regs.mode() {
            Mode::Slave { notice, .. } => {
                if start {
                    self.slave.start(&mut self.regs);
                } else {
                    self.slave.stop(&mut self.regs);
                }
                notice
            }
            Mode::Master => !self.master.own_condition(),
            _ => true,
        };
        if notice {
            interrupt(t, out);
        }
    }

    /// SCK or SCL changes.
    fn clock(&mut self, t: u64, out: &mut Outbox) {
        match self.regs.mode() {
            Mode::SpiSlave { select } if !(select && self.regs.ss) => {
                self.spi.clock(&mut self.regs, t, self.asleep.is_some(), out);
            }
            Mode::Slave { .. } if self.regs.scl => self.slave.rise(&mut self.regs),
            Mode::Slave { ten, .. } => self.slave.fall(&mut self.regs, ten, t, out),
            _ => {}
        }
    }
}

impl Device for Ssp {
    fn run(&mut self, t: u64, out: &mut Outbox) {
        loop {
            let due = self.next();
            if due > t || due == NEVER {
                return;
            }
            if self.master.next() == due {
                self.master.run_out(&mut self.regs, due, out);
            } else {
                self.spi.step(&mut self.regs, due, out);
            }
            self.settle(due, out);
        }
    }

    fn next(&self) -> u64 {
        if self.asleep.is_some() { NEVER } else { self.spi.next().min(self.master.next()) }
    }

    fn read(&mut self, reg: Sfr, t: u64, _: &mut Outbox) -> u8 {
        let value = self.peek(reg, t);
        if reg == Sfr::SSPBUF {
            self.regs.stat(BF, false);
        }
        value
    }

    fn peek(&self, reg: Sfr, _: u64) -> u8 {
        let regs = &self.regs;
        match reg {
            Sfr::SSPBUF => regs.buf,
            Sfr::SSPCON => regs.con,
            Sfr::SSPCON2 => regs.con2,
            Sfr::SSPADD => regs.add,
            Sfr::SSPSTAT => regs.stat,
            _ => 0,
        }
    }

    fn write(&mut self, reg: Sfr, value: u8, t: u64, out: &mut Outbox) {
        self.run(t, out);
        match reg {
            Sfr::SSPBUF => self.write_buf(value, t, out),
            Sfr::SSPCON => self.set_mode(value),
            Sfr::SSPCON2 => self.write_con2(value, t, out),
            Sfr::SSPADD => {
                self.regs.add = value;
                if let Mode::Slave { .. } = self.regs.mode() {
                    self.slave.address(&mut self.regs);
                }
            }
            Sfr::SSPSTAT => self.regs.stat = self.regs.stat & !(SMP | CKE) | value & (SMP | CKE),
            _ => {}
        }
        self.settle(t, out);
    }

    fn line(&mut self, line: Line, high: bool, t: u64, out: &mut Outbox) {
        let level = match line {
            Line::Sck => &mut self.regs.scl,
            Line::Sdi => &mut self.regs.sda,
            Line::Ss => &mut self.regs.ss,
            _ => return,
        };
        if std::mem::replace(level, high) == high {
            return;
        }
        let mode = self.regs.mode();
        match line {
            Line::Sck => self.clock(t, out),
            Line::Sdi if mode.i2c() && self.regs.scl => self.condition(!high, t, out),
            Line::Ss if mode == (Mode::SpiSlave { select: true }) => {
                self.spi.restart(&self.regs);
                if !high {
                    self.spi.present(&self.regs);
                }
            }
            _ => {}
        }
        if mode == Mode::Master && self.asleep.is_none() {
            self.master.look(&mut self.regs, t, out);
        }
        self.settle(t, out);
    }

    fn sleep(&mut self, t: u64, out: &mut Outbox) {
        self.asleep = Some(t);
        self.spi.sleep(&mut self.regs, t, out);
    }

    fn wake(&mut self, t: u64, out: &mut Outbox) {
        let Some(since) = self.asleep.take() else { return };
        let stood = t.saturating_sub(since);
        self.spi.shift(stood);
        self.master.shift(stood);
        if self.regs.mode() == Mode::Master {
            // Wires are not looked at while the clock stands.
            self.master.look(&mut self.regs, t, out);
        }
        self.settle(t, out);
    }

    fn steady(&self, reg: Sfr, t: u64) -> u64 {
        match reg {
            Sfr::SSPADD => NEVER,
            Sfr::SSPBUF if self.regs.stat & BF != 0 => t,
            _ if self.waits_for_timer2() => t,
            _ => self.next(),
        }
    }
}
