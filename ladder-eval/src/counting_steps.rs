//! Timers, and the stages of shift registers.

use crate::flat_program::{FlatProgram, ScanState, ValueSource};

impl ScanState {
    /// Copies every stage to the next one; the value of the last stage is lost and stage 0 keeps its own.
    pub(crate) fn shift_stages(&mut self, code: &FlatProgram, stages: &[u32]) {
        for pair in stages.windows(2).rev() {
            self.store(code, pair[1], self.read_symbol(pair[0]).into());
        }
    }

    /// Counts one scan of a timer if its preset is not reached; returns whether it has counted.
    pub(crate) fn count_scan(&mut self, code: &FlatProgram, var: u32, preset: ValueSource) -> bool {
        let n = self.read_symbol(var);
        let runs = n < self.read_value(preset);
        if runs {
            self.store(code, var, i64::from(n) + 1);
        }
        runs
    }

    /// A retentive timer, which counts the scans in which `counts` holds: whether it has expired.
    pub(crate) fn count_scans_of(&mut self, code: &FlatProgram, var: u32, preset: ValueSource, counts: bool) -> bool {
        let runs = self.read_symbol(var) < self.read_value(preset);
        if runs & counts {
            self.count_scan(code, var, preset);
        }
        !runs
    }
}
