//! Findings of the past stay fixed: `fuzz/regressions/TARGET/*`, each within the time limit.

use emu_fuzz::{TARGETS, find_target, run, worker, workspace_root};

#[test]
fn findings_stay_fixed() {
    for target in TARGETS {
        for input in run::regressions(target.name) {
            worker::replay_input(target, &input);
        }
    }
}

/// No target executes the folder of a target that was renamed.
#[test]
fn every_folder_is_a_target() {
    for entry in std::fs::read_dir(workspace_root().join("fuzz/regressions")).into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        assert!(!entry.path().is_dir() || find_target(&name).is_ok(), "{name} is no target");
    }
}
