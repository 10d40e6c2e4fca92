//! Timer 2 (DS33023 section 13; DS30292 and DS39582 section 7), in closed form.
//!
//! The state is kept for one clock, `at`, at which a count of the prescaler starts.

use emu_core::NEVER;

/// T2CON<2>: the timer runs.
const TMR2ON: u8 = 1 << 2;
/// Mask of the existing bits of T2CON.
const T2CON: u8 = 0x7F;

/// Timer 2.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Timer2 {
    con: u8,
    /// PR2.
    pr: u8,
    /// Clock for which `value` and `post` are valid, with the prescaler at 0.
    at: u64,
    value: u8,
    /// Periods counted by the postscaler.
    post: u8,
    /// Clock at which the oscillator stopped; None while it runs.
    slept: Option<u64>,
}

emu_core::state! { Timer2 { con, pr, at, value, post, slept } if |of, now| of.at <= now + 4 && of.slept != Some(u64::MAX) }

/// What timer 2 did while it was brought to a clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct SettledPeriods {
    /// True if a period has ended.
    pub period_ended: bool,
    /// True if the last of them made the postscaler full.
    pub postscaler_full: bool,
}

/// What a number of counts does to timer 2.
#[derive(Debug, Clone, Copy)]
struct CountedPeriods {
    /// The number of periods that ended.
    periods: u64,
    /// TMR2 after them.
    value: u8,
}

impl Timer2 {
    /// Returns the timer after a reset at `t`.
    pub(super) fn new(t: u64) -> Timer2 {
        Timer2 { con: 0, pr: 0xFF, at: t, value: 0, post: 0, slept: None }
    }

    fn counting(&self) -> bool {
        self.con & TMR2ON != 0 && self.slept.is_none()
    }

    /// Returns the binary logarithm of the prescaler ratio: 1, 4 or 16 instruction cycles per count, or
    /// clocks per quarter of a count.
    fn scale(&self) -> u32 {
        match self.con & 3 {
            0 => 0,
            1 => 2,
            _ => 4,
        }
    }

    /// Returns the periods per flag, 1 to 16.
    fn postscale(&self) -> u8 {
        (self.con >> 3 & 0xF) + 1
    }

    fn counts(&self, t: u64) -> u64 {
        if self.counting() { t.saturating_sub(self.at) >> (2 + self.scale()) } else { 0 }
    }

    /// Returns the clock of the `n`th count after `at`.
    fn clock_of_count(&self, n: u64) -> u64 {
        if self.counting() { self.at.saturating_add(n.saturating_mul(4 << self.scale())) } else { NEVER }
    }

    /// Returns the counts up to the first end of a period. A counter above PR2 wraps first.
    fn first(&self) -> u64 {
        u64::from(self.pr.wrapping_sub(self.value)) + 1
    }

    /// Returns the counts per period.
    fn period(&self) -> u64 {
        u64::from(self.pr) + 1
    }

    /// Returns the ends of periods within `counts`, and TMR2 after them.
    fn after(&self, counts: u64) -> CountedPeriods {
        match counts.checked_sub(self.first()) {
            None => CountedPeriods { periods: 0, value: self.value.wrapping_add(counts as u8) },
            Some(beyond) => {
                CountedPeriods { periods: 1 + beyond / self.period(), value: (beyond % self.period()) as u8 }
            }
        }
    }

    /// Returns the clock of the `n`th end of a period after `at`, `n` at least 1: TMR2 goes from PR2 to 0.
    pub(super) fn period_end(&self, n: u64) -> u64 {
        self.clock_of_count(self.first().saturating_add(self.period().saturating_mul(n - 1)))
    }

    /// Returns the clock of the first end of a period after `t`.
    pub(super) fn end_after(&self, t: u64) -> u64 {
        self.period_end(self.after(self.counts(t)).periods + 1)
    }

    /// Returns the clock of the first count after `t`.
    pub(super) fn count_after(&self, t: u64) -> u64 {
        self.clock_of_count(self.counts(t) + 1)
    }

    /// Returns the clock of the next TMR2IF.
    pub(super) fn flag_clock(&self) -> u64 {
        self.period_end(u64::from(self.postscale().saturating_sub(self.post)).max(1))
    }

    /// Returns TMR2 at `t`.
    pub(super) fn value(&self, t: u64) -> u8 {
        self.after(self.counts(t)).value
    }

    /// Moves `at` to the last count at or before `t`. Returns what has happened since.
    pub(super) fn settle(&mut self, t: u64) -> SettledPeriods {
        let counts = self.counts(t);
        let CountedPeriods { periods: ends, value } = self.after(counts);
        self.post = ((u64::from(self.post) + ends) % u64::from(self.postscale())) as u8;
        self.value = value;
        if counts > 0 {
            self.at = self.clock_of_count(counts);
        }
        SettledPeriods { period_ended: ends > 0, postscaler_full: ends > 0 && self.post == 0 }
    }

    /// Returns the first clock, `at` or later, at which TMR2 with the two bits below it equals `duty` (10
    /// bits), unless a period ends before. The two bits are the Q clock, or the top bits of the prescaler
    /// (DS30292 section 8.3.2).
    pub(super) fn clock_of_duty(&self, duty: u16) -> u64 {
        let quarters = u64::from(duty.wrapping_sub(4 * u16::from(self.value)) % 1024);
        if self.con & TMR2ON == 0 {
            if quarters == 0 { self.at } else { NEVER }
        } else if self.slept.is_some() {
            NEVER
        } else {
            self.at.saturating_add(quarters << self.scale())
        }
    }

    /// Returns T2CON.
    pub(super) fn con(&self) -> u8 {
        self.con
    }

    /// Returns PR2.
    pub(super) fn pr(&self) -> u8 {
        self.pr
    }

    /// Writes T2CON, which clears prescaler and postscaler.
    pub(super) fn write_con(&mut self, con: u8, t: u64) {
        self.settle(t);
        self.con = con & T2CON;
        self.restart(t);
    }

    /// Writes TMR2, which replaces a count at `t`.
    pub(super) fn write(&mut self, value: u8, t: u64) {
        self.value = value;
        self.restart(t);
    }

    /// Writes PR2.
    pub(super) fn write_pr(&mut self, pr: u8, t: u64) {
        self.settle(t);
        self.pr = pr;
    }

    fn restart(&mut self, t: u64) {
        self.post = 0;
        self.at = t;
        // After a write during sleep, no part of a count remains.
        self.slept = self.slept.map(|_| t);
    }

    /// Stops the oscillator.
    pub(super) fn sleep(&mut self, t: u64) {
        self.settle(t);
        self.slept = self.slept.or(Some(t));
    }

    /// Restarts the oscillator: the count continues, in whole cycles.
    pub(super) fn wake(&mut self, t: u64) {
        if let Some(slept) = self.slept.take() {
            let cycles = t.div_ceil(4).saturating_sub(slept.div_ceil(4));
            self.at = self.at.saturating_add(cycles.saturating_mul(4));
        }
    }
}
