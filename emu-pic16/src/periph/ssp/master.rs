//! I2C master: DS39582 sections 9.4.6 to 9.4.17, DS30292 sections 9.2.4 to 9.2.18.
//!
//! Every step either waits for the baud rate generator, which counts twice in a cycle, or for a wire to do what it has been
//! told: another device may hold it.

use emu_core::NEVER;

use super::super::map::Flag;
use super::super::{Outbox, Signal};
use super::regs::{ACKDT, ACKEN, ACKSTAT, BF, PEN, RCEN, RSEN, RW, Regs, SEN, SEQUENCES, interrupt};

/// What bits are clocked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Job {
    #[default]
    Transmit,
    Receive,
    Acknowledge,
}

emu_core::state! { enum Job { 0 = Transmit, 1 = Receive, 2 = Acknowledge } }

/// Where a sequence stands. "Waits" is for a wire, "counts" for the baud rate generator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
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
    BitFall(Job),
    /// A bit: SCL is low; counts.
    BitLow(Job),
    /// A bit: lets SCL go; waits.
    BitRise(Job),
    /// A bit: SCL is high; counts.
    BitHigh(Job),
}

emu_core::state! {
    enum Step {
        0 = Idle, 1 = StartFree, 2 = StartHigh, 3 = StartLow, 4 = AgainFall, 5 = AgainLow, 6 = AgainRise, 7 = StopFall, 8 = StopLow,
        9 = StopRise, 10 = StopHigh, 11 = StopFree, 12 = BitFall(job), 13 = BitLow(job), 14 = BitRise(job), 15 = BitHigh(job),
    }
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Master {
    step: Step,
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

emu_core::state! { Master { step, timer, sr, falls, sends_one } if |of, _now| of.falls <= 10 }

impl Master {
    pub(super) const IDLE: Master = Master { step: Step::Idle, timer: NEVER, sr: 0, falls: 0, sends_one: false };

    pub(super) fn next(&self) -> u64 {
        self.timer
    }

    /// A sequence runs: SSPBUF and SSPCON2<4:0> may not be written.
    pub(super) fn busy(&self) -> bool {
        self.step != Step::Idle
    }

    /// Start or Stop on the wires are of this part's own making, and reported when they are complete.
    pub(super) fn own_condition(&self) -> bool {
        !matches!(self.step, Step::Idle | Step::BitFall(_) | Step::BitLow(_) | Step::BitRise(_) | Step::BitHigh(_))
    }

    /// The oscillator stood for so many clocks.
    pub(super) fn shift(&mut self, clocks: u64) {
        self.timer = self.timer.saturating_add(clocks);
    }

    /// Loads the baud rate generator. It counts at the ends of Q2 and of Q4, from SSPADD<6:0> down past 0 (section 9.4.6.1).
    fn count(&mut self, step: Step, regs: &Regs, t: u64) {
        let counts = u64::from(regs.add & 0x7F) + 1;
        self.step = step;
        self.timer = t.saturating_add(t % 2 + 2 * counts);
    }

    fn wait(&mut self, step: Step) {
        self.step = step;
        self.timer = NEVER;
    }

    /// SSPCON2<4:0> was written while nothing ran. Of several sequences the lowest bit is taken, the others are dropped.
    pub(super) fn sequence(&mut self, regs: &mut Regs, t: u64, out: &mut Outbox) {
        let asked = regs.con2 & SEQUENCES;
        let asked = asked & asked.wrapping_neg();
        regs.con2 = regs.con2 & !SEQUENCES | asked;
        match asked {
            SEN if regs.pull_scl || regs.pull_sda => {
                (regs.pull_scl, regs.pull_sda) = (false, false);
                self.step = Step::StartFree;
                self.timer = t.saturating_add(2);
            }
            SEN => self.start(regs, t, out),
            RSEN => {
                regs.pull_scl = true;
                self.wait(Step::AgainFall);
            }
            PEN => {
                regs.pull_sda = true;
                self.wait(Step::StopFall);
            }
            RCEN => self.clock_bits(Job::Receive, regs),
            ACKEN => self.clock_bits(Job::Acknowledge, regs),
            _ => {}
        }
        self.look(regs, t, out);
    }

    /// SSPBUF was written while nothing ran.
    pub(super) fn load(&mut self, regs: &mut Regs, t: u64, out: &mut Outbox) {
        regs.stat |= BF | RW;
        self.sr = regs.buf;
        self.clock_bits(Job::Transmit, regs);
        self.look(regs, t, out);
    }

    fn clock_bits(&mut self, job: Job, regs: &mut Regs) {
        self.falls = 0;
        self.sends_one = false;
        regs.pull_scl = true;
        self.wait(Step::BitFall(job));
    }

    fn start(&mut self, regs: &mut Regs, t: u64, out: &mut Outbox) {
        if regs.scl && regs.sda {
            self.count(Step::StartHigh, regs, t);
        } else {
            self.collide(regs, t, out);
        }
    }

    /// The sequence ends as it should.
    fn end(&mut self, regs: &mut Regs, t: u64, out: &mut Outbox) {
        regs.con2 &= !SEQUENCES;
        self.wait(Step::Idle);
        interrupt(t, out);
    }

    /// Another master is on the bus: back to idle, lines let go (section 9.4.17).
    fn collide(&mut self, regs: &mut Regs, t: u64, out: &mut Outbox) {
        // Only a byte that is being sent has R/W set.
        if regs.stat & RW != 0 {
            regs.stat(BF | RW, false);
        }
        regs.con2 &= !SEQUENCES;
        (regs.pull_scl, regs.pull_sda) = (false, false);
        self.wait(Step::Idle);
        out.push(Signal::Flag { t, flag: Flag::BCLIF });
    }

    /// The baud rate generator has run out.
    pub(super) fn run_out(&mut self, regs: &mut Regs, t: u64, out: &mut Outbox) {
        self.timer = NEVER;
        match self.step {
            Step::StartFree => self.start(regs, t, out),
            Step::StartHigh => self.pull_start(regs, t),
            Step::StartLow => {
                regs.pull_scl = true;
                self.end(regs, t, out);
            }
            Step::AgainLow => {
                regs.pull_scl = false;
                self.wait(Step::AgainRise);
            }
            Step::StopLow => {
                regs.pull_scl = false;
                self.wait(Step::StopRise);
            }
            Step::StopHigh => {
                regs.pull_sda = false;
                self.count(Step::StopFree, regs, t);
            }
            Step::StopFree if regs.sda => self.end(regs, t, out),
            Step::StopFree => self.collide(regs, t, out),
            Step::BitLow(job) => {
                regs.pull_scl = false;
                self.wait(Step::BitRise(job));
            }
            Step::BitHigh(job) => {
                regs.pull_scl = true;
                self.wait(Step::BitFall(job));
            }
            // These wait for a wire, not for the generator.
            Step::Idle | Step::AgainFall | Step::AgainRise | Step::StopFall | Step::StopRise => {}
            Step::BitFall(_) | Step::BitRise(_) => {}
        }
        self.look(regs, t, out);
    }

    fn pull_start(&mut self, regs: &mut Regs, t: u64) {
        regs.pull_sda = true;
        self.count(Step::StartLow, regs, t);
    }

    /// Looks at the wires, which may have changed.
    pub(super) fn look(&mut self, regs: &mut Regs, t: u64, out: &mut Outbox) {
        match self.step {
            // Section 9.4.17.1: whoever pulls SDA first makes the Start, and this part joins in.
            Step::StartHigh if !regs.scl => self.collide(regs, t, out),
            Step::StartHigh if !regs.sda => self.pull_start(regs, t),
            Step::AgainFall if !regs.scl => {
                regs.pull_sda = false;
                self.count(Step::AgainLow, regs, t);
            }
            Step::AgainRise if regs.scl => self.start(regs, t, out),
            Step::StopFall if !regs.sda => self.count(Step::StopLow, regs, t),
            Step::StopRise if regs.scl => self.count(Step::StopHigh, regs, t),
            Step::StopHigh if !regs.scl => self.collide(regs, t, out),
            Step::BitFall(job) if !regs.scl => self.fallen(job, regs, t, out),
            Step::BitRise(_) | Step::BitHigh(_) if regs.scl && self.sends_one && !regs.sda => {
                self.collide(regs, t, out)
            }
            Step::BitRise(job) if regs.scl => self.count(Step::BitHigh(job), regs, t),
            // The fastest of several masters ends the high time of all.
            Step::BitHigh(job) if !regs.scl => {
                regs.pull_scl = true;
                self.fallen(job, regs, t, out);
            }
            _ => {}
        }
    }

    /// SCL is low: the bit before is over, and the next one goes out.
    fn fallen(&mut self, job: Job, regs: &mut Regs, t: u64, out: &mut Outbox) {
        let bit = self.falls;
        self.falls += 1;
        match (job, bit) {
            (Job::Transmit, 0..=7) => {
                self.put(self.sr & 0x80 != 0, regs);
                self.sr <<= 1;
            }
            (Job::Transmit, 8) => {
                self.put(true, regs);
                self.sends_one = false;
                regs.stat(BF, false);
            }
            (Job::Transmit, _) => {
                regs.con2 = regs.con2 & !ACKSTAT | if regs.sda { ACKSTAT } else { 0 };
                regs.stat(RW, false);
                return self.end(regs, t, out);
            }
            (Job::Receive, 0) => {
                self.put(true, regs);
                self.sends_one = false;
            }
            (Job::Receive, _) => {
                self.sr = self.sr << 1 | u8::from(regs.sda);
                if bit >= 8 {
                    regs.receive(self.sr);
                    return self.end(regs, t, out);
                }
            }
            (Job::Acknowledge, 0) => self.put(regs.con2 & ACKDT != 0, regs),
            (Job::Acknowledge, _) => {
                regs.pull_sda = false;
                return self.end(regs, t, out);
            }
        }
        self.count(Step::BitLow(job), regs, t);
    }

    fn put(&mut self, high: bool, regs: &mut Regs) {
        regs.pull_sda = !high;
        self.sends_one = high;
    }
}
