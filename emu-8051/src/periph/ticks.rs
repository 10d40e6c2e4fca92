//! [`Ticks`]: what a clock source of the serial port will count, in closed form.

use emu_core::NEVER;

/// The ticks of a source, as they come if no register is written and no pin changes. Ticks are numbered from
/// 1. Times are in cycles, or in states (6 x cycle + 0 for S1 to 5 for S6) if `in_states`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ticks {
    /// Number of ticks before `next`.
    pub count: u64,
    /// The time of the next tick; [`NEVER`] if there is none.
    pub next: u64,
    /// The time from one further tick to the next; [`NEVER`] if there is only one more.
    pub period: u64,
    /// Whether times are in states.
    pub in_states: bool,
}

impl Ticks {
    /// Every state of the oscillator.
    pub const STATES: Ticks = Ticks { count: 0, next: 0, period: 1, in_states: true };

    /// Number of ticks up to and including `time`.
    #[must_use]
    pub const fn count_at(&self, time: u64) -> u64 {
        if time < self.next || self.next == NEVER {
            self.count
        } else {
            self.count.saturating_add(1).saturating_add((time - self.next) / self.period)
        }
    }

    /// The time of tick number `k`; [`NEVER`] if it does not come or is one of those before `next`.
    #[must_use]
    pub const fn time_of(&self, k: u64) -> u64 {
        match k.checked_sub(self.count) {
            None | Some(0) => NEVER,
            Some(ahead) => self.next.saturating_add((ahead - 1).saturating_mul(self.period)),
        }
    }

    /// Whether the ticks from cycle `t` on, as `later` foresees them there, are those that this foresaw.
    #[must_use]
    pub fn continues_as(&self, later: &Ticks, t: u64) -> bool {
        let next = later.count.saturating_add(1);
        self.count_by_cycle(t) == later.count
            && self.time_of(next) == later.time_of(next)
            && (later.next == NEVER || self.period == later.period)
    }

    /// Number of ticks up to S5P2 of cycle `t`.
    #[must_use]
    pub const fn count_by_cycle(&self, t: u64) -> u64 {
        self.count_at(if self.in_states { t.saturating_mul(6).saturating_add(4) } else { t })
    }

    /// The cycle at whose S5P2 tick number `k` has come, as [`Ticks::time_of`].
    #[must_use]
    pub const fn cycle_of(&self, k: u64) -> u64 {
        match self.time_of(k) {
            NEVER => NEVER,
            state if self.in_states => state.saturating_add(1) / 6,
            cycle => cycle,
        }
    }
}
