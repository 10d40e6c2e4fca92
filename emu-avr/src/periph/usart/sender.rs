//! The transmit shift register.

use crate::periph::usart::frame::FrameBits;
use emu_core::NEVER;

use super::baud::BaudClock;

/// A frame being sent, and the level on the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct UsartSender {
    /// The lower eight bits of the character.
    pub(super) byte: u8,
    /// Bits that are not on the line yet, the next one lowest, and their number.
    bits: u16,
    left: u8,
    /// True while a frame is being sent.
    pub(super) active: bool,
    /// True if its first bit is on the line.
    pub(super) started: bool,
    /// The level of the line.
    pub(super) level: bool,
    /// Asynchronous mode: cycle up to which sent bits are removed from `bits`; then the cycle of the next
    /// change of the line, or of the end.
    since: u64,
    next: u64,
}

emu_core::state! {
    UsartSender { byte, bits, left, active, started, level, since, next } if |of, _now| of.left <= 13 && of.since != NEVER
}

impl UsartSender {
    /// An idle shift register, with the line high.
    pub(super) const IDLE: UsartSender =
        UsartSender { byte: 0, bits: 0, left: 0, active: false, started: false, level: true, since: 0, next: NEVER };

    /// Returns the cycle at which the line changes or the frame ends; `NEVER` in the clocked modes.
    pub(super) const fn next(&self) -> u64 {
        self.next
    }

    /// Reports whether the last bit is on the line.
    pub(super) const fn is_at_last_bit(&self) -> bool {
        self.left == 0
    }

    /// Loads a frame: the character, its bits with the first one lowest, and their number.
    pub(super) fn load(&mut self, byte: u8, FrameBits { bits, count: left }: FrameBits) {
        *self = UsartSender { byte, bits, left, active: true, level: self.level, ..UsartSender::IDLE };
    }

    /// Puts the next bit on the line; returns false if there is none.
    pub(super) fn next_bit(&mut self) -> bool {
        if self.left == 0 {
            return false;
        }
        self.level = self.bits & 1 != 0;
        self.started = true;
        self.skip_bits(1);
        true
    }

    fn skip_bits(&mut self, n: u64) {
        let n = n.min(u64::from(self.left)) as u8;
        self.bits >>= n;
        self.left -= n;
    }

    /// Returns the number of bits before the next change of the line.
    fn bits_to_change(&self) -> u64 {
        let same = if self.level { self.bits.trailing_ones() } else { self.bits.trailing_zeros() };
        u64::from(same).min(u64::from(self.left))
    }

    /// Removes the bits that have been sent up to `t` without a change of the line.
    pub(super) fn catch_up(&mut self, t: u64, baud: &BaudClock, per_bit: u64) {
        if self.next != NEVER {
            let passed = baud.divided_between(self.since, t, per_bit);
            self.skip_bits(passed.min(self.bits_to_change()));
            self.since = t;
        }
    }

    /// Schedules the next step after `t`.
    pub(super) fn schedule(&mut self, t: u64, baud: &BaudClock, per_bit: u64) {
        self.since = t;
        self.next = if self.active { baud.nth_divided(t, self.bits_to_change() + 1, per_bit) } else { NEVER };
    }

    /// Cancels the next step, because a clock line controls the bits.
    pub(super) fn unschedule(&mut self) {
        self.next = NEVER;
    }

    /// Returns the earliest end of the frame.
    pub(super) fn end(&self, baud: &BaudClock, per_bit: u64) -> u64 {
        match self.next {
            NEVER => NEVER,
            _ => baud.nth_divided(self.since, u64::from(self.left) + 1, per_bit),
        }
    }

    /// Delays everything by the cycles for which the clock was stopped.
    pub(super) fn shift(&mut self, cycles: u64) {
        self.since = self.since.saturating_add(cycles);
        self.next = self.next.saturating_add(cycles);
    }
}
