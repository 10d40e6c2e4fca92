//! Inputs of a timer: the pin T and the capture pin, through synchroniser, edge detector and noise canceller (figures 16-3 and
//! 17-1).

use emu_core::NEVER;
use emu_core::state;
use emu_core::state::{SnapshotDamaged, SnapshotState, StateTape};

/// Cycles from a change of a pin to the edge at which it acts: 2.5 to 3.5 by 17.1, and 3 for what changes with an edge.
pub(super) const DETECT_CYCLES: u64 = 3;
/// Equal samples that the noise canceller wants, and the cycles by which it is later (16.6.2).
pub(super) const FILTER_SAMPLES: u64 = 4;

/// Changes of a line that are still on their way. No more than one counts in a cycle, and they go up and down in turn.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct SamplePipe {
    times: [u64; 8],
    len: usize,
    /// The level after all of them.
    level: bool,
}

impl SnapshotState for SamplePipe {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        // What stands behind the last change is left over from older ones.
        tape.pass_index(&mut self.len, self.times.len() + 1)?;
        self.level.pass_state(tape)?;
        self.times.iter_mut().take(self.len).try_for_each(|time| time.pass_state(tape))
    }
}

impl SamplePipe {
    /// The line changes at `t`; what it did before within the same cycle is not seen.
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

    /// The cycle of the change `i`, the oldest being 0.
    fn at(&self, i: usize) -> Option<u64> {
        self.times.get(..self.len).and_then(|times| times.get(i)).copied()
    }

    /// The level after the change `i`.
    const fn level(&self, i: usize) -> bool {
        self.level == ((self.len - i) % 2 == 1)
    }

    fn pop(&mut self) {
        if self.len > 0 {
            self.times.rotate_left(1);
            self.len -= 1;
        }
    }

    /// Moves everything that is on its way by the time for which the clock stood.
    pub(super) fn shift(&mut self, by: u64) {
        self.times.iter_mut().for_each(|t| *t = t.saturating_add(by));
    }

    /// When the oldest change acts.
    pub(super) fn due(&self) -> u64 {
        self.at(0).map_or(NEVER, |t| t.saturating_add(DETECT_CYCLES))
    }

    /// Takes the oldest change: true when it is a rising one.
    pub(super) fn take(&mut self) -> bool {
        let rising = self.len > 0 && self.level(0);
        self.pop();
        rising
    }
}

/// An edge that comes out of the capture pin's edge detector.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct CaptureEdge {
    pub rising: bool,
    /// It comes by way of the noise canceller.
    pub filtered: bool,
}

/// The capture pin. Both ways, with the noise canceller and without, are followed all the time.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct CapturePin {
    pub pipe: SamplePipe,
    /// Changes that have been told on the direct way.
    told: usize,
    /// What the noise canceller gives.
    quiet: bool,
}

state! { CapturePin { pipe, told, quiet } if |icp, _now| icp.told <= icp.pipe.len }

impl CapturePin {
    /// When something comes out next.
    pub(super) fn due(&self) -> u64 {
        self.unfiltered_cycle().min(self.filtered_cycle())
    }

    fn unfiltered_cycle(&self) -> u64 {
        self.pipe.at(self.told).map_or(NEVER, |t| t.saturating_add(DETECT_CYCLES))
    }

    fn filtered_cycle(&self) -> u64 {
        self.pipe.at(0).map_or(NEVER, |t| t.saturating_add(DETECT_CYCLES + FILTER_SAMPLES))
    }

    /// What comes out at [`Icp::due`], if it is an edge.
    pub(super) fn take(&mut self) -> Option<CaptureEdge> {
        if self.unfiltered_cycle() <= self.filtered_cycle() {
            let rising = self.pipe.at(self.told).map(|_| self.pipe.level(self.told))?;
            self.told += 1;
            return Some(CaptureEdge { rising, filtered: false });
        }
        let start = self.pipe.at(0)?;
        let long = self.pipe.at(1).is_none_or(|end| end >= start.saturating_add(FILTER_SAMPLES));
        self.told = self.told.saturating_sub(1);
        let rising = self.pipe.take();
        let edge = long && rising != self.quiet;
        if edge {
            self.quiet = rising;
        }
        edge.then_some(CaptureEdge { rising, filtered: true })
    }
}
