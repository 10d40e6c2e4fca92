//! I2C master: DS39582 sections 9.4.6 to 9.4.17, DS30292 sections 9.2.4 to 9.2.18.
//!
//! Every step either waits for the baud rate generator, which counts twice in a cycle, or for a wire to do what it has been
//! told: another device may hold it.

use emu_core::NEVER;

use super::super::map::InterruptFlag;
use super::super::{Pic16Outbox, Pic16Signal};
use super::regs::{ACKDT, ACKEN, ACKSTAT, BF, PEN, RCEN, RSEN, RW, SEN, SEQUENCES, SspRegisters, raise_sspif};

/// What bits are clocked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum ByteTransfer {
    #[default]
    Transmit,
    Receive,
    Acknowledge,
}

emu_core::state! { enum ByteTransfer { 0 = Transmit, 1 = Receive, 2 = Acknowledge } }

/// Where a sequence stands. "Waits" is for a wire, "counts" for the baud rate generator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum MasterStep {
    Idle,
    /// Start: lets the lines go that it still held, and looks at them at the next count.
    StartFree,
    /// Start: both lines are high; counts.
    StartHigh,
    /// Start: pulls SDA; counts.
    StartLow,
    /// Repeated Start: pulls SCL; waits.
    AgainFall,
    /// Repeated Start: lets SDA go; counts.
    AgainLow,
    /// Repeated Start: lets SCL go; waits.
    AgainRise,
    /// Stop: pulls SDA; waits.
    StopFall,
    /// Stop: both lines are low; counts.
    StopLow,
    /// Stop: lets SCL go; waits.
    StopRise,
    /// Stop: SCL is high; counts.
    StopHigh,
    /// Stop: lets SDA go; counts.
    StopFree,
    /// A bit: pulls SCL; waits.
    BitFall(ByteTransfer),
    /// A bit: SCL is low; counts.
    BitLow(ByteTransfer),
    /// A bit: lets SCL go; waits.
    BitRise(ByteTransfer),
    /// A bit: SCL is high; counts.
    BitHigh(ByteTransfer),
}

emu_core::state! {
    enum MasterStep {
        0 = Idle, 1 = StartFree, 2 = StartHigh, 3 = StartLow, 4 = AgainFall, 5 = AgainLow, 6 = AgainRise, 7 = StopFall, 8 = StopLow,
        9 = StopRise, 10 = StopHigh, 11 = StopFree, 12 = BitFall(job), 13 = BitLow(job), 14 = BitRise(job), 15 = BitHigh(job),
    }
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct I2cMaster {
    step: MasterStep,
    /// When the baud rate generator runs out; `NEVER` while it is held.
    timer: u64,
    /// SSPSR.
    sr: u8,
    /// Times that SCL has fallen in this byte, the one before its first bit and the one behind its
    /// acknowledge included.
    falls: u8,
    /// SDA was let go to send a 1: who pulls it collides.
    sends_one: bool,
}

emu_core::state! { I2cMaster { step, timer, sr, falls, sends_one } if |of, _now| of.falls <= 10 }

impl I2cMaster {
    pub(super) const IDLE: I2cMaster =
        I2cMaster { step: MasterStep::Idle, timer: NEVER, sr: 0, falls: 0, sends_one: false };

    pub(super) fn next(&self) -> u64 {
        self.timer
    }

    /// A sequence runs: SSPBUF and SSPCON2<4:0> may not be written.
    pub(super) fn is_busy(&self) -> bool {
        self.step != MasterStep::Idle
    }

    /// Start or Stop on the wires are of this part's own making, and reported when they are complete.
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

    /// The oscillator stood for so many clocks.
    pub(super) fn shift(&mut self, clocks: u64) {
        self.timer = self.timer.saturating_add(clocks);
    }

    /// Loads the baud rate generator. It counts at the ends of Q2 and of Q4, from SSPADD<6:0> down past 0 (section 9.4.6.1).
    fn schedule_step(&mut self, step: MasterStep, regs: &SspRegisters, t: u64) {
        let counts = u64::from(regs.add & 0x7F) + 1;
        self.step = step;
        self.timer = t.saturating_add(t % 2 + 2 * counts);
    }

    fn wait_for_line(&mut self, step: MasterStep) {
        self.step = step;
        self.timer = NEVER;
    }

    /// SSPCON2<4:0> was written while nothing ran. Of several sequences the lowest bit is taken, the others are dropped.
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

    /// SSPBUF was written while nothing ran.
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

    /// The sequence ends as it should.
    fn end(&mut self, regs: &mut SspRegisters, t: u64, out: &mut Pic16Outbox) {
        regs.con2 &= !SEQUENCES;
        self.wait_for_line(MasterStep::Idle);
        raise_sspif(t, out);
    }

    /// Another master is on the bus: back to idle, lines let go (section 9.4.17).
    fn collide(&mut self, regs: &mut SspRegisters, t: u64, out: &mut Pic16Outbox) {
        // Only a byte that is being sent has R/W set.
        if regs.stat & RW != 0 {
            regs.set_stat_bits(BF | RW, false);
        }
        regs.con2 &= !SEQUENCES;
        (regs.pull_scl, regs.pull_sda) = (false, false);
        self.wait_for_line(MasterStep::Idle);
        out.push(Pic16Signal::Flag { t, flag: InterruptFlag::BCLIF });
    }

    /// The baud rate generator has run out.
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
            // These wait for a wire, not for the generator.
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

    /// Looks at the wires, which may have changed.
    pub(super) fn on_line_changed(&mut self, regs: &mut SspRegisters, t: u64, out: &mut Pic16Outbox) {
        match self.step {
            // Section 9.4.17.1: whoever pulls SDA first makes the Start, and this part joins in.
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
            // The fastest of several masters ends the high time of all.
            MasterStep::BitHigh(job) if !regs.scl => {
                regs.pull_scl = true;
                self.fallen(job, regs, t, out);
            }
            _ => {}
        }
    }

    /// SCL is low: the bit before is over, and the next one goes out.
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
