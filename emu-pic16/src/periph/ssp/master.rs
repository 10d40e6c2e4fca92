//! I2C master: DS39582 sections 9.4.6 to 9.4.17, DS30292 sections 9.2.4 to 9.2.18.
//!
//! Every step either waits for the baud rate generator, which counts twice per cycle, or for a line to reach
//! a level, because another device may hold it.

use emu_core::NEVER;

use super::super::map::InterruptFlag;
use super::super::{Pic16Outbox, Pic16Signal};
use super::regs::{ACKDT, ACKEN, ACKSTAT, BF, PEN, RCEN, RSEN, RW, SEN, SEQUENCES, SspRegisters, raise_sspif};

/// Purpose of the bits that are clocked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum ByteTransfer {
    #[default]
    Transmit,
    Receive,
    Acknowledge,
}

emu_core::state! { enum ByteTransfer { 0 = Transmit, 1 = Receive, 2 = Acknowledge } }

/// Step of a sequence. "Waits" means for a line, "counts" for the baud rate generator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum MasterStep {
    Idle,
    /// Start: releases the lines that it still held, and checks them at the next count.
    StartFree,
    /// Start: both lines are high; counts.
    StartHigh,
    /// Start: pulls SDA low; counts.
    StartLow,
    /// Repeated Start: pulls SCL low; waits.
    AgainFall,
    /// Repeated Start: releases SDA; counts.
    AgainLow,
    /// Repeated Start: releases SCL; waits.
    AgainRise,
    /// Stop: pulls SDA low; waits.
    StopFall,
    /// Stop: both lines are low; counts.
    StopLow,
    /// Stop: releases SCL; waits.
    StopRise,
    /// Stop: SCL is high; counts.
    StopHigh,
    /// Stop: releases SDA; counts.
    StopFree,
    /// Bit: pulls SCL low; waits.
    BitFall(ByteTransfer),
    /// Bit: SCL is low; counts.
    BitLow(ByteTransfer),
    /// Bit: releases SCL; waits.
    BitRise(ByteTransfer),
    /// Bit: SCL is high; counts.
    BitHigh(ByteTransfer),
}

emu_core::state! {
    enum MasterStep {
        0 = Idle, 1 = StartFree, 2 = StartHigh, 3 = StartLow, 4 = AgainFall, 5 = AgainLow, 6 = AgainRise, 7 = StopFall, 8 = StopLow,
        9 = StopRise, 10 = StopHigh, 11 = StopFree, 12 = BitFall(job), 13 = BitLow(job), 14 = BitRise(job), 15 = BitHigh(job),
    }
}

/// The I2C master.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct I2cMaster {
    step: MasterStep,
    /// Clock at which the baud rate generator times out; `NEVER` while it is held.
    timer: u64,
    /// Shift register SSPSR.
    sr: u8,
    /// Number of falling edges of SCL in this byte, including the one before its first bit and the one after
    /// its acknowledge.
    falls: u8,
    /// True if SDA was released to send a 1; a device that pulls it low causes a collision.
    sends_one: bool,
}

emu_core::state! { I2cMaster { step, timer, sr, falls, sends_one } if |of, _now| of.falls <= 10 }

impl I2cMaster {
    /// A master without a sequence in progress.
    pub(super) const IDLE: I2cMaster =
        I2cMaster { step: MasterStep::Idle, timer: NEVER, sr: 0, falls: 0, sends_one: false };

    /// Returns the clock at which the baud rate generator times out.
    pub(super) fn next(&self) -> u64 {
        self.timer
    }

    /// Reports whether a sequence is running: then SSPBUF and SSPCON2<4:0> must not be written.
    pub(super) fn is_busy(&self) -> bool {
        self.step != MasterStep::Idle
    }

    /// Reports whether a Start or Stop on the bus is caused by this master, which reports it when it is
    /// complete.
    pub(super) fn own_condition(&self) -> bool {
        !matches!(
            self.step,
            MasterStep::Idle
                | MasterStep::BitFall(_)
                | MasterStep::BitLow(_)
                | MasterStep::BitRise(_)
                | MasterStep::BitHigh(_)
        )
    }

    /// Delays the timer by the clocks for which the oscillator was stopped.
    pub(super) fn shift(&mut self, clocks: u64) {
        self.timer = self.timer.saturating_add(clocks);
    }

    /// Loads the baud rate generator. It counts at the ends of Q2 and Q4, from SSPADD<6:0> down past 0
    /// (section 9.4.6.1).
    fn schedule_step(&mut self, step: MasterStep, regs: &SspRegisters, t: u64) {
        let counts = u64::from(regs.add & 0x7F) + 1;
        self.step = step;
        self.timer = t.saturating_add(t % 2 + 2 * counts);
    }

    fn wait_for_line(&mut self, step: MasterStep) {
        self.step = step;
        self.timer = NEVER;
    }

    /// Handles a write of SSPCON2<4:0> while idle. Of several sequences the lowest bit is executed, the
    /// others are dropped.
    pub(super) fn sequence(&mut self, regs: &mut SspRegisters, t: u64, out: &mut Pic16Outbox) {
        let asked = regs.con2 & SEQUENCES;
        let asked = asked & asked.wrapping_neg();
        regs.con2 = regs.con2 & !SEQUENCES | asked;
        match asked {
            SEN if regs.pull_scl || regs.pull_sda => {
                (regs.pull_scl, regs.pull_sda) = (false, false);
                self.step = MasterStep::StartFree;
                self.timer = t.saturating_add(2);
            }
            SEN => self.start(regs, t, out),
            RSEN => {
                regs.pull_scl = true;
                self.wait_for_line(MasterStep::AgainFall);
            }
            PEN => {
                regs.pull_sda = true;
                self.wait_for_line(MasterStep::StopFall);
            }
            RCEN => self.clock_bits(ByteTransfer::Receive, regs),
            ACKEN => self.clock_bits(ByteTransfer::Acknowledge, regs),
            _ => {}
        }
        self.on_line_changed(regs, t, out);
    }

    /// Handles a write of SSPBUF while idle.
    pub(super) fn load(&mut self, regs: &mut SspRegisters, t: u64, out: &mut Pic16Outbox) {
        regs.stat |= BF | RW;
        self.sr = regs.buf;
        self.clock_bits(ByteTransfer::Transmit, regs);
        self.on_line_changed(regs, t, out);
    }

    fn clock_bits(&mut self, job: ByteTransfer, regs: &mut SspRegisters) {
        self.falls = 0;
        self.sends_one = false;
        regs.pull_scl = true;
        self.wait_for_line(MasterStep::BitFall(job));
    }

    fn start(&mut self, regs: &mut SspRegisters, t: u64, out: &mut Pic16Outbox) {
        if regs.scl && regs.sda {
            self.schedule_step(MasterStep::StartHigh, regs, t);
        } else {
            self.collide(regs, t, out);
        }
    }

    /// Ends the sequence normally.
    fn end(&mut self, regs: &mut SspRegisters, t: u64, out: &mut Pic16Outbox) {
        regs.con2 &= !SEQUENCES;
        self.wait_for_line(MasterStep::Idle);
        raise_sspif(t, out);
    }

    /// Handles a collision with another master: returns to idle and releases the lines (section 9.4.17).
    fn collide(&mut self, regs: &mut SspRegisters, t: u64, out: &mut Pic16Outbox) {
        // R/W is set only while a byte is being sent.
        if regs.stat & RW != 0 {
            regs.set_stat_bits(BF | RW, false);
        }
        regs.con2 &= !SEQUENCES;
        (regs.pull_scl, regs.pull_sda) = (false, false);
        self.wait_for_line(MasterStep::Idle);
        out.push(Pic16Signal::Flag { t, flag: InterruptFlag::BCLIF });
    }

    /// Handles the time-out of the baud rate generator.
    pub(super) fn on_baud_timeout(&mut self, regs: &mut SspRegisters, t: u64, out: &mut Pic16Outbox) {
        self.timer = NEVER;
        match self.step {
            MasterStep::StartFree => self.start(regs, t, out),
            MasterStep::StartHigh => self.pull_start(regs, t),
            MasterStep::StartLow => {
                regs.pull_scl = true;
                self.end(regs, t, out);
            }
            MasterStep::AgainLow => {
                regs.pull_scl = false;
                self.wait_for_line(MasterStep::AgainRise);
            }
            MasterStep::StopLow => {
                regs.pull_scl = false;
                self.wait_for_line(MasterStep::StopRise);
            }
            MasterStep::StopHigh => {
                regs.pull_sda = false;
                self.schedule_step(MasterStep::StopFree, regs, t);
            }
            MasterStep::StopFree if regs.sda => self.end(regs, t, out),
            MasterStep::StopFree => self.collide(regs, t, out),
            MasterStep::BitLow(job) => {
                regs.pull_scl = false;
                self.wait_for_line(MasterStep::BitRise(job));
            }
            MasterStep::BitHigh(job) => {
                regs.pull_scl = true;
                self.wait_for_line(MasterStep::BitFall(job));
            }
            // These steps wait for a line, not for the generator.
            MasterStep::Idle
            | MasterStep::AgainFall
            | MasterStep::AgainRise
            | MasterStep::StopFall
            | MasterStep::StopRise => {}
            MasterStep::BitFall(_) | MasterStep::BitRise(_) => {}
        }
        self.on_line_changed(regs, t, out);
    }

    fn pull_start(&mut self, regs: &mut SspRegisters, t: u64) {
        regs.pull_sda = true;
        self.schedule_step(MasterStep::StartLow, regs, t);
    }

    /// Checks the lines, which may have changed.
    pub(super) fn on_line_changed(&mut self, regs: &mut SspRegisters, t: u64, out: &mut Pic16Outbox) {
        match self.step {
            // Section 9.4.17.1: the first device that pulls SDA low makes the Start, and this master joins
            // it.
            MasterStep::StartHigh if !regs.scl => self.collide(regs, t, out),
            MasterStep::StartHigh if !regs.sda => self.pull_start(regs, t),
            MasterStep::AgainFall if !regs.scl => {
                regs.pull_sda = false;
                self.schedule_step(MasterStep::AgainLow, regs, t);
            }
            MasterStep::AgainRise if regs.scl => self.start(regs, t, out),
            MasterStep::StopFall if !regs.sda => self.schedule_step(MasterStep::StopLow, regs, t),
            MasterStep::StopRise if regs.scl => self.schedule_step(MasterStep::StopHigh, regs, t),
            MasterStep::StopHigh if !regs.scl => self.collide(regs, t, out),
            MasterStep::BitFall(job) if !regs.scl => self.fallen(job, regs, t, out),
            MasterStep::BitRise(_) | MasterStep::BitHigh(_) if regs.scl && self.sends_one && !regs.sda => {
                self.collide(regs, t, out)
            }
            MasterStep::BitRise(job) if regs.scl => self.schedule_step(MasterStep::BitHigh(job), regs, t),
            // The fastest of several masters ends the high time for all.
            MasterStep::BitHigh(job) if !regs.scl => {
                regs.pull_scl = true;
                self.fallen(job, regs, t, out);
            }
            _ => {}
        }
    }

    /// Handles a falling edge of SCL: the previous bit is over, and the next one is put on SDA.
    fn fallen(&mut self, job: ByteTransfer, regs: &mut SspRegisters, t: u64, out: &mut Pic16Outbox) {
        let bit = self.falls;
        self.falls += 1;
        match (job, bit) {
            (ByteTransfer::Transmit, 0..=7) => {
                self.put_bit(self.sr & 0x80 != 0, regs);
                self.sr <<= 1;
            }
            (ByteTransfer::Transmit, 8) => {
                self.put_bit(true, regs);
                self.sends_one = false;
                regs.set_stat_bits(BF, false);
            }
            (ByteTransfer::Transmit, _) => {
                regs.con2 = regs.con2 & !ACKSTAT | if regs.sda { ACKSTAT } else { 0 };
                regs.set_stat_bits(RW, false);
                return self.end(regs, t, out);
            }
            (ByteTransfer::Receive, 0) => {
                self.put_bit(true, regs);
                self.sends_one = false;
            }
            (ByteTransfer::Receive, _) => {
                self.sr = self.sr << 1 | u8::from(regs.sda);
                if bit >= 8 {
                    regs.receive(self.sr);
                    return self.end(regs, t, out);
                }
            }
            (ByteTransfer::Acknowledge, 0) => self.put_bit(regs.con2 & ACKDT != 0, regs),
            (ByteTransfer::Acknowledge, _) => {
                regs.pull_sda = false;
                return self.end(regs, t, out);
            }
        }
        self.schedule_step(MasterStep::BitLow(job), regs, t);
    }

    fn put_bit(&mut self, high: bool, regs: &mut SspRegisters) {
        regs.pull_sda = !high;
        self.sends_one = high;
    }
}
