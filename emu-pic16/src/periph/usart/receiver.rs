//! The receiver: asynchronous frames sampled on a line, and words clocked by CK.

use emu_core::NEVER;

use super::fifo::ReceivedWord;
use super::{ADDEN, BRGH, Pic16Usart, RX9, SREN};

/// State of the receiver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum UsartReceiver {
    /// Idle, or waiting for the falling edge of a start bit.
    Idle,
    /// Asynchronous.
    Frame(IncomingFrame),
    /// Synchronous.
    Clocked(ClockedReception),
}

emu_core::state! { enum UsartReceiver { 0 = Idle, 1 = Frame(frame), 2 = Clocked(clocked) } }

/// A frame being received (DS33023, 18.3.1, figures 18-1 to 18-3).
///
/// With BRGH = 0 the start bit is sampled at the ends of the 7th, 8th and 9th period of the generator after
/// its edge, and the other bits 16, 32, .. periods later. With BRGH = 1 the first period that ends after the
/// edge is number 1. The middle of the period after number 2, and 4, 8, .. periods later for the other bits,
/// is a rising edge that evaluates the last three samples of a clock that ticks in Q2 and Q4.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct IncomingFrame {
    /// Index of the bit on the line; 0 is the start bit.
    pub(super) bit: u8,
    /// Samples taken of this bit, and how many of them were high.
    samples: u8,
    highs: u8,
    /// Data bits received so far.
    pub(super) bits: u16,
    /// Start of a generator period in running clocks, and the number of periods that had ended since the
    /// edge.
    base: u64,
    ended: u64,
}

emu_core::state! { IncomingFrame { bit, samples, highs, bits, base, ended } if |of, _now| of.bit <= 10 && of.samples <= 3 && of.highs <= 3 }

impl IncomingFrame {
    /// Returns a frame whose edge was in the generator period that started at `base`, in running clocks.
    pub(super) const fn new(base: u64) -> IncomingFrame {
        IncomingFrame { bit: 0, samples: 0, highs: 0, bits: 0, base, ended: 0 }
    }

    /// Adds a sample with BRGH = 0; returns the majority after three samples.
    fn add_vote(&mut self, high: bool) -> Option<bool> {
        self.samples += 1;
        self.highs += u8::from(high);
        (self.samples == 3).then_some(self.highs >= 2)
    }

    /// Stores a bit and moves to the next.
    fn keep_bit(&mut self, high: bool) {
        if self.bit > 0 {
            self.bits |= u16::from(high) << (self.bit - 1);
        }
        *self = IncomingFrame { bit: self.bit + 1, samples: 0, highs: 0, ..*self };
    }

    /// Returns the running clock of the next sample, or of the vote if `quick` (BRGH = 1), for this generator
    /// period.
    fn due(&self, period: u64, quick: bool) -> u64 {
        self.sample_clock(self.bit, 7 + self.samples, period, quick)
    }

    /// Returns the running clock of the vote on bit `stop`, or on the current bit if that is later.
    fn end(&self, stop: u8, period: u64, quick: bool) -> u64 {
        self.sample_clock(self.bit.max(stop), 9, period, quick)
    }

    fn sample_clock(&self, bit: u8, sample: u8, period: u64, quick: bool) -> u64 {
        let (per_bit, first, lag) = if quick { (4, 2, period / 2) } else { (16, u64::from(sample), 0) };
        let left = (first + per_bit * u64::from(bit)).saturating_sub(self.ended);
        self.base.saturating_add(left * period).saturating_add(lag)
    }

    /// Restarts the generator at `now`; the period in progress is lost.
    pub(super) fn rebase(&mut self, now: u64, period: u64) {
        self.ended += now.saturating_sub(self.base) / period;
        self.base = now;
    }
}

/// A word clocked in by CK.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct ClockedReception {
    n: u8,
    bits: u16,
    /// True while the master's CK is in the high half of a bit.
    pub(super) high: bool,
    /// Running clock of the master's next edge of CK; `NEVER` if CK comes from outside.
    pub(super) next: u64,
}

emu_core::state! { ClockedReception { n, bits, high, next } if |of, _now| of.n <= 10 }

impl ClockedReception {
    /// Stores a bit; returns true if the word has all `of` bits.
    fn keep(&mut self, high: bool, of: u8) -> bool {
        self.bits |= u16::from(high) << self.n;
        self.n += 1;
        self.n >= of
    }
}

impl UsartReceiver {
    /// Returns a receiver that waits for the first bit of a word.
    pub(super) const fn clocked(next: u64) -> UsartReceiver {
        UsartReceiver::Clocked(ClockedReception { n: 0, bits: 0, high: false, next })
    }

    /// Returns the level that it drives onto CK as master.
    pub(super) const fn ck(&self) -> bool {
        matches!(self, UsartReceiver::Clocked(word) if word.high)
    }
}

/// Samples of the line at the last eight running clocks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct LevelHistory {
    /// Samples; the lowest bit is that of clock `at`.
    bits: u8,
    at: u64,
}

emu_core::state! { LevelHistory { bits, at } }

impl LevelHistory {
    /// History of a line that was always low.
    pub(super) const LOW: LevelHistory = LevelHistory { bits: 0, at: 0 };

    /// Records that the line was `level` up to the clock `now`.
    pub(super) fn record_level(&mut self, now: u64, level: bool) {
        let n = now.saturating_sub(self.at);
        let rest = if level { 0xFF } else { 0 };
        self.bits = if n < 8 { self.bits << n | (rest & !(0xFF << n)) } else { rest };
        self.at = now;
    }

    /// Returns the majority of the last three samples in Q2 and Q4 before `now`, an edge of the generator;
    /// they are at odd distances from it.
    fn vote(&mut self, now: u64, level: bool) -> bool {
        self.record_level(now, level);
        (self.bits & 0b10_1010).count_ones() >= 2
    }
}

impl Pic16Usart {
    /// Stores a complete word in RCREG, if there is space (DS30292, 10.2.2).
    pub(super) fn take(&mut self, received: ReceivedWord) {
        if !self.oerr {
            self.oerr = !self.fifo.push(received);
        }
    }

    /// Takes a sample or a vote in asynchronous mode.
    pub(super) fn sample(&mut self, mut frame: IncomingFrame, now: u64) {
        let nine = self.rcsta & RX9 != 0;
        let quick = self.txsta & BRGH != 0;
        let decided = if quick { Some(self.past.vote(now, self.rx_line)) } else { frame.add_vote(self.rx_line) };
        self.receiver = UsartReceiver::Frame(frame);
        let Some(high) = decided else { return };
        if frame.bit == 0 && high {
            self.receiver = UsartReceiver::Idle;
        } else if frame.bit >= 9 + u8::from(nine) {
            self.receiver = UsartReceiver::Idle;
            let ninth = nine && frame.bits & 0x100 != 0;
            if ninth || !nine || self.rcsta & ADDEN == 0 {
                self.take(ReceivedWord { byte: frame.bits as u8, ninth, bad_stop: !high });
            }
        } else {
            frame.keep_bit(high);
            self.receiver = UsartReceiver::Frame(frame);
        }
    }

    /// Samples a bit at the falling edge of CK, in synchronous mode.
    pub(super) fn bit(&mut self) {
        let nine = self.rcsta & RX9 != 0;
        let UsartReceiver::Clocked(mut word) = self.receiver else { return };
        if !word.keep(self.rx_line, 8 + u8::from(nine)) {
            self.receiver = UsartReceiver::Clocked(word);
            return;
        }
        self.take(ReceivedWord { byte: word.bits as u8, ninth: nine && word.bits & 0x100 != 0, bad_stop: false });
        if !self.slave() {
            self.rcsta &= !SREN;
        }
        self.receiver = match self.is_receiving_enabled() {
            true => UsartReceiver::Clocked(ClockedReception { n: 0, bits: 0, ..word }),
            false => UsartReceiver::Idle,
        };
    }

    /// Returns the running clock of the receiver's next step.
    pub(super) fn receiver_due(&self) -> u64 {
        match self.receiver {
            UsartReceiver::Idle => NEVER,
            UsartReceiver::Frame(frame) => frame.due(self.baud.period(), self.txsta & BRGH != 0),
            UsartReceiver::Clocked(word) => word.next,
        }
    }

    /// Returns the running clock of the receiver's next visible effect; for a frame only its end is visible.
    pub(super) fn receiver_end(&self) -> u64 {
        match self.receiver {
            UsartReceiver::Frame(frame) => {
                let stop = 9 + u8::from(self.rcsta & RX9 != 0);
                frame.end(stop, self.baud.period(), self.txsta & BRGH != 0)
            }
            _ => self.receiver_due(),
        }
    }

    /// Executes the receiver's step that is due at `t`.
    pub(super) fn receive(&mut self, t: u64) {
        let now = self.osc(t);
        match self.receiver {
            UsartReceiver::Idle => {}
            UsartReceiver::Frame(frame) => self.sample(frame, now),
            UsartReceiver::Clocked(mut word) => {
                word.high = !word.high;
                word.next = if word.high { self.fall(now) } else { self.shift(now.saturating_add(1)) };
                self.receiver = UsartReceiver::Clocked(word);
                if !word.high {
                    self.bit();
                }
            }
        }
    }
}
