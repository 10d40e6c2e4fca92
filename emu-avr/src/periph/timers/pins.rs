//! Inputs of a timer: the pin T and the capture pin with synchronizer, edge detector and noise canceler
//! (figures 16-3 and 17-1).

use emu_core::NEVER;
use emu_core::state;
use emu_core::state::{SnapshotDamaged, SnapshotState, StateTape};

/// Cycles from a change of a pin to the edge at which it takes effect: 2.5 to 3.5 by 17.1, and 3 for a change
/// at an edge.
pub(super) const DETECT_CYCLES: u64 = 3;
/// Number of equal samples that the noise canceler needs, and the cycles by which it delays the signal
/// (16.6.2).
pub(super) const FILTER_SAMPLES: u64 = 4;

/// Pending changes of a line. At most one per cycle counts; rising and falling changes alternate.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct SamplePipe {
    times: [u64; 8],
    len: usize,
    /// Level after all pending changes.
    level: bool,
}

impl SnapshotState for SamplePipe {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        // Entries after the last pending change are left over from older ones.
        tape.pass_index(&mut self.len, self.times.len() + 1)?;
        self.level.pass_state(tape)?;
        self.times.iter_mut().take(self.len).try_for_each(|time| time.pass_state(tape))
    }
}

impl SamplePipe {
    /// Changes the line at `t`. A second change in the same cycle cancels the first.
    pub(super) fn change(&mut self, high: bool, t: u64) {
        if high == self.level {
            return;
        }
        self.level = high;
        if self.at(self.len.wrapping_sub(1)) == Some(t) {
            self.len -= 1;
            return;
        }
        if self.len == self.times.len() {
            self.pop();
        }
        if let Some(slot) = self.times.get_mut(self.len) {
            *slot = t;
            self.len += 1;
        }
    }

    /// Returns the cycle of the change `i`; 0 is the oldest.
    fn at(&self, i: usize) -> Option<u64> {
        self.times.get(..self.len).and_then(|times| times.get(i)).copied()
    }

    /// Returns the level after the change `i`.
    const fn level(&self, i: usize) -> bool {
        self.level == ((self.len - i) % 2 == 1)
    }

    fn pop(&mut self) {
        if self.len > 0 {
            self.times.rotate_left(1);
            self.len -= 1;
        }
    }

    /// Delays all pending changes by the time for which the clock was stopped.
    pub(super) fn shift(&mut self, by: u64) {
        self.times.iter_mut().for_each(|t| *t = t.saturating_add(by));
    }

    /// Returns the cycle at which the oldest change takes effect.
    pub(super) fn due(&self) -> u64 {
        self.at(0).map_or(NEVER, |t| t.saturating_add(DETECT_CYCLES))
    }

    /// Removes the oldest change; returns true if it is rising.
    pub(super) fn take(&mut self) -> bool {
        let rising = self.len > 0 && self.level(0);
        self.pop();
        rising
    }
}

/// An edge that leaves the edge detector of the capture pin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct CaptureEdge {
    pub rising: bool,
    /// True if the edge comes from the noise canceler.
    pub filtered: bool,
}

/// The capture pin. Both paths, with and without noise canceler, are tracked all the time.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct CapturePin {
    pub pipe: SamplePipe,
    /// Number of pending changes already reported on the direct path.
    consumed: usize,
    /// Output of the noise canceler.
    quiet: bool,
}

state! { CapturePin { pipe, consumed, quiet } if |icp, _now| icp.consumed <= icp.pipe.len }

impl CapturePin {
    /// Returns the cycle of the next output of either path.
    pub(super) fn due(&self) -> u64 {
        self.unfiltered_cycle().min(self.filtered_cycle())
    }

    fn unfiltered_cycle(&self) -> u64 {
        self.pipe.at(self.consumed).map_or(NEVER, |t| t.saturating_add(DETECT_CYCLES))
    }

    fn filtered_cycle(&self) -> u64 {
        self.pipe.at(0).map_or(NEVER, |t| t.saturating_add(DETECT_CYCLES + FILTER_SAMPLES))
    }

    /// Removes the output that is due at [`Self::due`]; returns it if it is an edge.
    pub(super) fn take(&mut self) -> Option<CaptureEdge> {
        if self.unfiltered_cycle() <= self.filtered_cycle() {
            let rising = self.pipe.at(self.consumed).map(|_| self.pipe.level(self.consumed))?;
            self.consumed += 1;
            return Some(CaptureEdge { rising, filtered: false });
        }
        let start = self.pipe.at(0)?;
        let long = self.pipe.at(1).is_none_or(|end| end >= start.saturating_add(FILTER_SAMPLES));
        self.consumed = self.consumed.saturating_sub(1);
        let rising = self.pipe.take();
        let edge = long && rising != self.quiet;
        if edge {
            self.quiet = rising;
        }
        edge.then_some(CaptureEdge { rising, filtered: true })
    }
}
