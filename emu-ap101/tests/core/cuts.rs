//! Random programs: a machine that is saved and restored must equal one that is not.

use emu_test_support::cut_tests::search_restore_faults;

use crate::slices::plan;

/// Number of programs, unless `EMU_STATE_PROGRAMS` sets it.
const PROGRAMS: u64 = if cfg!(debug_assertions) { 10 } else { 60 };

#[test]
fn saved_and_restored() {
    search_restore_faults(&[("ap101", ())], PROGRAMS, |(), rng| plan(rng.next_u64()));
}
