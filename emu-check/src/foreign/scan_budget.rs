//! How long to look at an image in whose memory nothing can be written: what it does is reached by time alone.

use ladder::{Element, LadderOperand, LadderProgram};

/// Most scans of a check that is not told how many.
pub const MAX_SCANS: u64 = 200_000;

/// Scans besides the long run.
const SHORT_SCANS: u64 = 4_000;

/// Scans of a long run: four times as long as the longest counter takes if all timers together make its steps, within limits.
pub(crate) fn long_run_scans(program: &LadderProgram) -> usize {
    let (mut times, mut count) = (1u64, 1u64);
    for (_, element, _) in program.elements() {
        match element {
            Element::Timer { delay: LadderOperand::Const { value, .. }, .. } => {
                let delay = u64::try_from(*value).unwrap_or(0);
                times = times.saturating_add(delay.div_ceil(program.settings.cycle_us.max(1)));
            }
            Element::Counter { max: LadderOperand::Const { value, .. }, .. } => {
                count = count.max(value.unsigned_abs().saturating_add(1));
            }
            // Nothing else takes more than one scan to come to its end.
            _ => {}
        }
    }
    times.saturating_mul(count).saturating_mul(4).clamp(16_000, 100_000) as usize
}

/// How many scans there are to be.
pub(crate) struct ScanBudget {
    pub scans: u64,
    /// Scans without anything new that end a check that is not told how many.
    max_scans_without_news: Option<u64>,
}

impl ScanBudget {
    pub(super) fn new(requested: Option<u64>, patience: u64) -> ScanBudget {
        let least = patience + SHORT_SCANS;
        ScanBudget { scans: requested.unwrap_or(least), max_scans_without_news: requested.is_none().then_some(least) }
    }

    /// A scan is done; `new` says that it reached something for the first time.
    pub(super) fn note_scan(&mut self, scan: u64, new: bool) {
        if let Some(quiet) = self.max_scans_without_news.filter(|_| new) {
            self.scans = self.scans.max(scan + quiet).min(MAX_SCANS);
        }
    }
}
