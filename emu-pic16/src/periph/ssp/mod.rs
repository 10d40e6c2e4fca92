//! Synchronous serial port: SSP and MSSP (DS39582 chapter 9, DS30292 chapter 9, DS33023 chapters 15 to 17;
//! the basic SSP: DS39598 chapter 10 of the 16F818/819, DS30487 chapter 10 of the 16F87/88).
//!
//! In I2C mode the port pulls SCL and SDA low or leaves them open ([`Pic16Drive::Low`],
//! [`Pic16Drive::Open`]). The level of each line arrives by [`Device::on_line_changed`], at the same
//! clock if the port itself caused it. [`Device::run_due`] must be called at exactly the clocks that
//! [`Device::next_deadline`] returns, so that the port reads its lines in time.

mod master;
mod regs;
mod slave;
mod spi;

use emu_core::NEVER;

use super::map::{Pic16Line, Sfr};
use super::{Device, Pic16Drive, Pic16Outbox, Pic16Signal};
use master::I2cMaster;
use regs::{BF, CKE, CKP, P, RW, S, SEQUENCES, SMP, SspMode, SspRegisters, UA, WCOL, raise_sspif};
use slave::I2cSlave;
use spi::SpiShifter;

/// The synchronous serial port.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pic16Ssp {
    regs: SspRegisters,
    spi: SpiShifter,
    slave: I2cSlave,
    master: I2cMaster,
    /// Clock at which the oscillator was stopped; None while it runs.
    asleep: Option<u64>,
}

emu_core::state! { Pic16Ssp { regs, spi, slave, master, asleep } if |of, now| of.asleep.is_none_or(|since| since <= now + 4) }

impl Pic16Ssp {
    /// Returns a port after power-up: an MSSP if `master`, otherwise the basic SSP without SSPCON2, I2C
    /// master and general call.
    #[must_use]
    pub fn new(master: bool) -> Pic16Ssp {
        Pic16Ssp {
            regs: SspRegisters::new(master),
            spi: SpiShifter::IDLE,
            slave: I2cSlave::IDLE,
            master: I2cMaster::IDLE,
            asleep: None,
        }
    }

    /// Sets whether SEN makes a slave stretch the clock after every received byte, as on the MSSP of the
    /// 16F87XA (DS39582 section 9.4.4; in DS30292 register 9-3 SEN is only for the master).
    #[must_use]
    pub fn with_stretch(mut self, stretch: bool) -> Pic16Ssp {
        self.regs.stretch = stretch;
        self
    }

    /// Sets whether SS raised within a byte leaves the shifted bits in SSPSR
    /// ([`Pic16Readings::ss_keeps_bits`](crate::Pic16Readings)).
    #[must_use]
    pub fn with_kept_bits(mut self, keeps: bool) -> Pic16Ssp {
        self.regs.keeps_bits = keeps;
        self
    }

    /// Reports whether periods of timer 2 clock the port: SPI master, SSPM 0011.
    #[must_use]
    pub fn wants_timer2(&self) -> bool {
        self.regs.mode() == SspMode::SpiMaster(None)
    }

    /// Reports whether a byte is being sent whose next half bit starts with a period of timer 2.
    #[must_use]
    pub fn waits_for_timer2(&self) -> bool {
        self.wants_timer2() && self.spi.is_shifting()
    }

    /// Handles the end of a timer 2 period at `t`: half a bit of SPI. Call it before a write at the same
    /// clock.
    pub fn timer2(&mut self, t: u64, out: &mut Pic16Outbox) {
        self.run_due(t, out);
        if self.waits_for_timer2() && self.asleep.is_none() {
            self.spi.half_clock(&self.regs, t);
            self.settle(t, out);
        }
    }

    /// Reports whether the port is on in an I2C mode: then it drives SCL and SDA regardless of TRIS.
    #[must_use]
    pub fn is_i2c(&self) -> bool {
        self.regs.mode().is_i2c()
    }

    /// Sends the overrides of the lines that have changed.
    fn settle(&mut self, t: u64, out: &mut Pic16Outbox) {
        let regs = &self.regs;
        let wire = |pull| if pull { Pic16Drive::Low } else { Pic16Drive::Open };
        let (sck, sdi, sdo) = match regs.mode() {
            SspMode::Off => (Pic16Drive::Port, Pic16Drive::Port, Pic16Drive::Port),
            SspMode::SpiMaster(_) => (
                Pic16Drive::from_bit(self.spi.active != (regs.con & CKP != 0)),
                Pic16Drive::Port,
                Pic16Drive::from_bit(self.spi.sdo),
            ),
            SspMode::SpiSlave { select } if select && regs.ss => {
                (Pic16Drive::Port, Pic16Drive::Port, Pic16Drive::Float)
            }
            SspMode::SpiSlave { .. } => (Pic16Drive::Port, Pic16Drive::Port, Pic16Drive::from_bit(self.spi.sdo)),
            _ => (wire(regs.pull_scl), wire(regs.pull_sda), Pic16Drive::Port),
        };
        self.regs.settle(sck, sdi, sdo, t, out);
    }

    /// Handles a write of SSPCON. A new mode starts from idle.
    fn set_mode(&mut self, con: u8) {
        let before = self.regs.mode();
        self.regs.con = con;
        let mode = self.regs.mode();
        if mode != before {
            self.spi = SpiShifter::IDLE;
            self.slave = I2cSlave::IDLE;
            self.master = I2cMaster::IDLE;
            if !(before.is_i2c() && mode.is_i2c()) {
                self.regs.set_stat_bits(S | P, false);
            }
            // R/W means that SSPBUF held a byte to be sent.
            if self.regs.stat & RW != 0 {
                self.regs.set_stat_bits(BF, false);
            }
            self.regs.set_stat_bits(RW | UA, false);
            (self.regs.pull_scl, self.regs.pull_sda) = (false, false);
        }
        if let SspMode::Slave { .. } = mode {
            self.slave.hold_clock(&mut self.regs);
        }
    }

    /// Handles a write of SSPBUF.
    fn write_buf(&mut self, value: u8, t: u64, out: &mut Pic16Outbox) {
        let mode = self.regs.mode();
        let busy = match mode {
            SspMode::Off | SspMode::Firmware => false,
            SspMode::SpiMaster(_) | SspMode::SpiSlave { .. } => self.spi.is_busy(),
            SspMode::Slave { .. } => self.slave.is_busy(),
            SspMode::Master => self.master.is_busy(),
        };
        if busy {
            self.regs.con |= WCOL;
            return;
        }
        self.regs.buf = value;
        match mode {
            SspMode::Off | SspMode::Firmware => {}
            SspMode::SpiMaster(_) | SspMode::SpiSlave { .. } => self.spi.load(&self.regs, t),
            SspMode::Slave { .. } => self.slave.load(&mut self.regs),
            SspMode::Master => self.master.load(&mut self.regs, t, out),
        }
    }

    /// Handles a write of SSPCON2.
    fn write_con2(&mut self, value: u8, t: u64, out: &mut Pic16Outbox) {
        if !self.regs.master {
            return;
        }
        let master = self.regs.mode() == SspMode::Master;
        if master && self.master.is_busy() {
            self.regs.con2 = self.regs.con2 & SEQUENCES | value & !SEQUENCES;
            return;
        }
        self.regs.con2 = value;
        if master {
            self.master.sequence(&mut self.regs, t, out);
        }
    }

    /// Handles a change of SDA while SCL is high: Start or Stop.
    fn condition(&mut self, start: bool, t: u64, out: &mut Pic16Outbox) {
        self.regs.set_stat_bits(S, start);
        self.regs.set_stat_bits(P, !start);
        let notice = match self.regs.mode() {
            SspMode::Slave { notice, .. } => {
                if start {
                    self.slave.start(&mut self.regs);
                } else {
                    self.slave.stop(&mut self.regs);
                }
                notice
            }
            SspMode::Master => !self.master.own_condition(),
            _ => true,
        };
        if notice {
            raise_sspif(t, out);
        }
    }

    /// Handles a change of SCK or SCL.
    fn clock(&mut self, t: u64, out: &mut Pic16Outbox) {
        match self.regs.mode() {
            SspMode::SpiSlave { select } if !(select && self.regs.ss) => {
                self.spi.clock(&mut self.regs, t, self.asleep.is_some(), out);
            }
            SspMode::Slave { .. } if self.regs.scl => self.slave.rise(&mut self.regs),
            SspMode::Slave { ten, .. } => self.slave.fall(&mut self.regs, ten, t, out),
            _ => {}
        }
    }
}

impl Device<Pic16Signal> for Pic16Ssp {
    type Reg = Sfr;

    fn run_due(&mut self, t: u64, out: &mut Pic16Outbox) {
        loop {
            let due = self.next_deadline();
            if due > t || due == NEVER {
                return;
            }
            if self.master.next() == due {
                self.master.on_baud_timeout(&mut self.regs, due, out);
            } else {
                self.spi.step(&mut self.regs, due, out);
            }
            self.settle(due, out);
        }
    }

    fn next_deadline(&self) -> u64 {
        if self.asleep.is_some() { NEVER } else { self.spi.next().min(self.master.next()) }
    }

    fn read(&mut self, reg: Sfr, t: u64, _: &mut Pic16Outbox) -> u8 {
        let value = self.peek(reg, t);
        if reg == Sfr::SSPBUF {
            self.regs.set_stat_bits(BF, false);
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

    fn write(&mut self, reg: Sfr, value: u8, _mask: u8, t: u64, out: &mut Pic16Outbox) {
        self.run_due(t, out);
        match reg {
            Sfr::SSPBUF => self.write_buf(value, t, out),
            Sfr::SSPCON => self.set_mode(value),
            Sfr::SSPCON2 => self.write_con2(value, t, out),
            Sfr::SSPADD => {
                self.regs.add = value;
                if let SspMode::Slave { .. } = self.regs.mode() {
                    self.slave.address(&mut self.regs);
                }
            }
            Sfr::SSPSTAT => self.regs.stat = self.regs.stat & !(SMP | CKE) | value & (SMP | CKE),
            _ => {}
        }
        self.settle(t, out);
    }

    fn on_line_changed(&mut self, line: Pic16Line, high: bool, t: u64, out: &mut Pic16Outbox) {
        let level = match line {
            Pic16Line::Sck => &mut self.regs.scl,
            Pic16Line::Sdi => &mut self.regs.sda,
            Pic16Line::Ss => &mut self.regs.ss,
            _ => return,
        };
        if std::mem::replace(level, high) == high {
            return;
        }
        let mode = self.regs.mode();
        match line {
            Pic16Line::Sck => self.clock(t, out),
            Pic16Line::Sdi if mode.is_i2c() && self.regs.scl => self.condition(!high, t, out),
            Pic16Line::Ss if mode == (SspMode::SpiSlave { select: true }) => {
                self.spi.restart(&self.regs);
                if !high {
                    self.spi.present(&self.regs);
                }
            }
            _ => {}
        }
        if mode == SspMode::Master && self.asleep.is_none() {
            self.master.on_line_changed(&mut self.regs, t, out);
        }
        self.settle(t, out);
    }

    /// Resets the port (DS39582 table 14-6): all registers are 0 except SSPBUF, which is unknown after
    /// power-up (0 here) and otherwise unchanged.
    fn reset(&mut self, power_on: bool, t: u64, out: &mut Pic16Outbox) {
        self.set_mode(0);
        let regs = &mut self.regs;
        (regs.con2, regs.add, regs.stat) = (0, 0, 0);
        if power_on {
            regs.buf = 0;
        }
        self.asleep = None;
        self.settle(t, out);
    }

    fn stop_clock(&mut self, t: u64, out: &mut Pic16Outbox) {
        self.asleep = Some(t);
        self.spi.sleep(&mut self.regs, t, out);
    }

    fn restart_clock(&mut self, t: u64, out: &mut Pic16Outbox) {
        let Some(since) = self.asleep.take() else { return };
        let stood = t.saturating_sub(since);
        self.spi.shift(stood);
        self.master.shift(stood);
        if self.regs.mode() == SspMode::Master {
            // Lines are not checked while the clock is stopped.
            self.master.on_line_changed(&mut self.regs, t, out);
        }
        self.settle(t, out);
    }

    fn steady_until(&self, reg: Sfr, t: u64) -> u64 {
        match reg {
            Sfr::SSPADD => NEVER,
            Sfr::SSPBUF if self.regs.stat & BF != 0 => t,
            _ if self.waits_for_timer2() => t,
            _ => self.next_deadline(),
        }
    }
}
