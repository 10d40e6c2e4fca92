//! A pin whose edges are looked for: synchroniser and edge detector.

use emu_core::NEVER;
use emu_core::state;

/// Cycles from the change of a pin to the edge of the clock at which what listens to it acts: one flip-flop that samples, one
/// behind it to compare with (section 20.3.2 gives two clocks for XCK; that it is the same for the other pins is a decision).
const SYNC_DELAY: u64 = 2;

/// A pin behind two flip-flops in a row. They take the pin as it was in the cycle before the edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct SynchronizedPin {
    /// The pin.
    high: bool,
    /// The second flip-flop.
    seen: bool,
    /// When changes that are under way come out, the earlier one first.
    due: [u64; 2],
}

state! { SynchronizedPin { high, seen, due } if |edges, _now| edges.due[0] <= edges.due[1] }

impl SynchronizedPin {
    /// A pin that has been so for long.
    pub(super) const fn new(high: bool) -> SynchronizedPin {
        SynchronizedPin { high, seen: high, due: [NEVER; 2] }
    }

    /// The pin itself.
    pub(super) const fn pin_level(&self) -> bool {
        self.high
    }

    /// The pin as the last flip-flop has it.
    pub(super) const fn synchronized_level(&self) -> bool {
        self.seen
    }

    /// When the next change comes out.
    pub(super) const fn next(&self) -> u64 {
        self.due[0]
    }

    /// The pin changes at `t`; what was due then has come out.
    pub(super) fn change(&mut self, high: bool, t: u64) {
        if std::mem::replace(&mut self.high, high) == high {
            return;
        }
        let due = t.saturating_add(SYNC_DELAY);
        // Of two changes in one cycle nothing is seen.
        match self.due.iter().position(|&at| at == due || at == NEVER) {
            Some(place) => self.due[place] = if self.due[place] == due { NEVER } else { due },
            None => self.due[1] = due,
        }
    }

    /// The pin changes while the clock stands.
    pub(super) fn set_level_while_stopped(&mut self, high: bool) {
        self.high = high;
    }

    /// The level that comes out at `t`, if it is another than before.
    pub(super) fn pop(&mut self, t: u64) -> Option<bool> {
        if self.due[0] > t {
            return None;
        }
        self.due = [self.due[1], NEVER];
        self.seen = !self.seen;
        Some(self.seen)
    }

    /// The level that has come out by `t`.
    pub(super) fn level(&mut self, t: u64) -> bool {
        while self.pop(t).is_some() {}
        self.seen
    }

    /// The clock stood from `from` to `to`.
    pub(super) fn wake(&mut self, from: u64, to: u64) {
        let mut sampled = self.seen;
        for due in &mut self.due {
            // A change at `from` or later has not been sampled before the clock stood.
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
