//! An input pin with synchronizer and edge detection.

use emu_core::NEVER;
use emu_core::state;

/// Cycles from the change of a pin to the clock edge at which its peripheral reacts: one flip-flop samples
/// the pin, a second one holds the previous level. Section 20.3.2 gives two clocks for XCK; using the same
/// delay for the other pins is a decision of the model.
const SYNC_DELAY: u64 = 2;

/// A pin after two flip-flops in series. They sample the level that the pin had in the cycle before the edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct SynchronizedPin {
    /// Level of the pin.
    high: bool,
    /// Level of the second flip-flop.
    seen: bool,
    /// Times at which pending changes reach the second flip-flop, the earlier one first.
    due: [u64; 2],
}

state! { SynchronizedPin { high, seen, due } if |edges, _now| edges.due[0] <= edges.due[1] }

impl SynchronizedPin {
    /// Returns a pin whose level has been constant for a long time.
    pub(super) const fn new(high: bool) -> SynchronizedPin {
        SynchronizedPin { high, seen: high, due: [NEVER; 2] }
    }

    /// Returns the level of the pin.
    pub(super) const fn pin_level(&self) -> bool {
        self.high
    }

    /// Returns the level of the second flip-flop.
    pub(super) const fn synchronized_level(&self) -> bool {
        self.seen
    }

    /// Returns the time at which the next change reaches the second flip-flop.
    pub(super) const fn next(&self) -> u64 {
        self.due[0]
    }

    /// Changes the pin at `t`. Call [`Self::pop`] first for changes due at `t`.
    pub(super) fn change(&mut self, high: bool, t: u64) {
        if std::mem::replace(&mut self.high, high) == high {
            return;
        }
        let due = t.saturating_add(SYNC_DELAY);
        // Two changes in one cycle cancel out.
        match self.due.iter().position(|&at| at == due || at == NEVER) {
            Some(place) => self.due[place] = if self.due[place] == due { NEVER } else { due },
            None => self.due[1] = due,
        }
    }

    /// Changes the pin while the clock is stopped.
    pub(super) fn set_level_while_stopped(&mut self, high: bool) {
        self.high = high;
    }

    /// Applies the change that is due at `t`; returns the new level of the second flip-flop, or None if
    /// nothing is due.
    pub(super) fn pop(&mut self, t: u64) -> Option<bool> {
        if self.due[0] > t {
            return None;
        }
        self.due = [self.due[1], NEVER];
        self.seen = !self.seen;
        Some(self.seen)
    }

    /// Returns the level of the second flip-flop at `t`, after all changes due by then.
    pub(super) fn level(&mut self, t: u64) -> bool {
        while self.pop(t).is_some() {}
        self.seen
    }

    /// Restarts the clock at `to` after a stop at `from`.
    pub(super) fn wake(&mut self, from: u64, to: u64) {
        let mut sampled = self.seen;
        for due in &mut self.due {
            // A change at `from` or later was not sampled before the clock stopped.
            if *due < from.saturating_add(SYNC_DELAY) {
                *due = due.saturating_add(to.saturating_sub(from));
                sampled = !sampled;
            } else {
                *due = NEVER;
            }
        }
        let pin = std::mem::replace(&mut self.high, sampled);
        self.change(pin, to);
    }
}
