//! The course of the counter in closed form, while only its clock acts on it.

use emu_core::parts::counter::TimerCounter;

/// A counter that counts up, or up and down.
#[derive(Debug, Clone, Copy)]
pub(super) struct CountingCycle {
    pub value: u16,
    /// True if it counts down; never at 0, and never with one slope.
    pub down: bool,
    pub top: u16,
    pub max: u16,
    /// True for two slopes, up and down; false for up and back to 0.
    pub dual: bool,
}

/// A counter's value and direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct CounterPosition {
    /// The value.
    pub(super) value: u16,
    /// Whether it counts down.
    pub(super) down: bool,
}

impl CountingCycle {
    /// Returns the number of steps until the counter leaves the value `x`, at least 1; None if it never
    /// reaches `x`.
    pub(super) fn steps_to_leave(&self, x: u16) -> Option<u64> {
        if !self.dual {
            return self.as_counter().steps_to_leave(x);
        }
        let [value, at, top, max] = [self.value, x, self.top, self.max].map(u64::from);
        let comes = match (self.down, value <= top) {
            (true, _) if at <= value => value - at,
            (true, _) if at <= top => value + at,
            (false, true) if value <= at && at <= top => at - value,
            (false, true) if at < value => (top - value) + (top - at),
            (false, false) if at >= value => at - value,
            (false, false) if at <= top => (max - value + 1) + at,
            _ => return None,
        };
        Some(comes + 1)
    }

    /// Returns the number of steps until the counter returns to 0. Only for one slope.
    pub(super) fn steps_to_bottom(&self) -> u64 {
        let end = if self.value <= self.top { self.top } else { self.max };
        u64::from(end - self.value) + 1
    }

    /// Returns value and direction after `steps` steps.
    pub(super) fn value_after(&self, steps: u64) -> CounterPosition {
        if !self.dual {
            return CounterPosition { value: self.as_counter().value_after(steps), down: false };
        }
        let [value, top, max] = [self.value, self.top, self.max].map(u64::from);
        // Steps until the counter reaches 0 for the first time. Its course before that can differ from the
        // later cycles.
        let first = match (self.down, value <= top) {
            (true, _) => value,
            (false, true) => 2 * top - value,
            (false, false) => max - value + 1,
        };
        let (value, down) = if steps >= first {
            let round = if top == 0 { 0 } else { (steps - first) % (2 * top) };
            if round <= top { (round, false) } else { (2 * top - round, true) }
        } else if self.down {
            (value - steps, true)
        } else if value <= top && steps > top - value {
            (first - steps, true)
        } else {
            (value + steps, false)
        };
        CounterPosition { value: value as u16, down }
    }

    const fn as_counter(&self) -> TimerCounter {
        TimerCounter { value: self.value, top: self.top, max: self.max }
    }
}
