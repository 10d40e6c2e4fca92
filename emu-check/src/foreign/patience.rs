//! How long to look at an image in whose memory nothing can be written: what it does is reached by time alone.

use ladder::{Element, Operand, Program};

/// Most scans of a check that is not told how many.
pub const MOST: u64 = 200_000;

/// Scans besides the long run.
const SHORT: u64 = 4_000;

/// Scans of a long run: four times as long as the longest counter takes if all timers together make its steps, within limits.
pub(crate) fn patience(program: &Program) -> usize {
    let (mut times, mut count) = (1u64, 1u64);
    for (_, element, _) in program.elements() {
        match element {
            Element::Timer { delay: Operand::Const { value, .. }, .. } => {
                let delay = u64::try_from(*value).unwrap_or(0);
                times = times.saturating_add(delay.div_ceil(program.settings.cycle_us.max(1)));
            }
            Element::Counter { max: Operand::Const { value, .. }, .. } => {
                count = count.max(value.unsigned_abs().saturating_add(1));
            }
            _ => {}
        }
    }
    times.saturating_mul(count).saturating_mul(4).clamp(16_000, 100_000) as usize
}

/// How many scans there are to be.
pub(crate) struct Budget {
    pub scans: u64,
    /// Scans without anything new that end a check that is not told how many.
    quiet: Option<u64>,
}

impl Budget {
    pub(super) fn new(asked: Option<u64>, patience: u64) -> Budget {
        let least = patience + SHORT;
        Budget { scans: asked.unwrap_or(least), quiet: asked.is_none().then_some(least) }
    }

    /// A scan is done; `new` says that it reached something for the first time.
    pub(super) fn seen(&mut self, scan: u64, new: bool) {
        if let Some(quiet) = self.quiet.filter(|_| new) {
            self.scans = self.scans.max(scan + quiet).min(MOST);
        }
    }
}
