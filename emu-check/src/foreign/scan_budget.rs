//! How many scans to run an image in whose memory nothing can be written, so that states are reached by time
//! alone.

use ladder::{Element, LadderOperand, LadderProgram, ProgramElement};

/// Maximum number of scans of a check without an explicit number of scans.
pub const MAX_SCANS: u64 = 200_000;

/// Number of scans in addition to the long run.
const SHORT_SCANS: u64 = 4_000;

/// Number of scans of a long run: four times the time that the longest counter needs if all timers in
/// sequence make one of its steps, clamped to 16,000 to 100,000.
pub(crate) fn long_run_scans(program: &LadderProgram) -> usize {
    let (mut times, mut count) = (1u64, 1u64);
    for ProgramElement { element, .. } in program.elements() {
        match element {
            Element::Timer { delay: LadderOperand::Const { value, .. }, .. } => {
                let delay = u64::try_from(*value).unwrap_or(0);
                times = times.saturating_add(delay.div_ceil(program.settings.cycle_us.max(1)));
            }
            Element::Counter { max: LadderOperand::Const { value, .. }, .. } => {
                count = count.max(value.unsigned_abs().saturating_add(1));
            }
            // All other elements reach their end within one scan.
            _ => {}
        }
    }
    times.saturating_mul(count).saturating_mul(4).clamp(16_000, 100_000) as usize
}

/// The number of scans of a check, which grows while the check reaches new states.
pub(crate) struct ScanBudget {
    /// Number of scans to run, as known so far.
    pub scans: u64,
    /// Without an explicit number of scans, the check ends after this many scans without a new state.
    max_scans_without_news: Option<u64>,
}

impl ScanBudget {
    /// A budget for a requested number of scans, or by default for a long run of `long_run_scans` scans.
    pub(super) fn new(requested: Option<u64>, long_run_scans: u64) -> ScanBudget {
        let default_scans = long_run_scans + SHORT_SCANS;
        ScanBudget {
            scans: requested.unwrap_or(default_scans),
            max_scans_without_news: requested.is_none().then_some(default_scans),
        }
    }

    /// Records that scan `scan` is done; `new` is true if it reached a coverage goal for the first time.
    pub(super) fn note_scan(&mut self, scan: u64, new: bool) {
        if let Some(scans_without_news) = self.max_scans_without_news.filter(|_| new) {
            self.scans = self.scans.max(scan + scans_without_news).min(MAX_SCANS);
        }
    }
}
