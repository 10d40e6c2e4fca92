//! The driver detects a panic, an execution that does not end, and too much memory, and reports nothing
//! otherwise.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn emu_fuzz(arguments: &[&str]) -> Output {
    // With this limit, an execution counts as a hang after one second.
    let mut command = Command::new(env!("CARGO_BIN_EXE_emu-fuzz"));
    command.args(arguments).env("EMU_FUZZ_LIMIT", "1").output().expect("emu-fuzz runs")
}

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    _ = std::fs::remove_dir_all(&folder);
    folder
}

/// The finding of a target that always fails; the replay must find it, too.
fn finding(target: &str) -> String {
    let folder = folder(target);
    let ended = emu_fuzz(&["run", target, "--executions", "3", "--save", &folder.display().to_string()]);
    let said = String::from_utf8_lossy(&ended.stdout).into_owned();
    assert_eq!(ended.status.code(), Some(1), "{said}");
    let saved: Vec<PathBuf> =
        std::fs::read_dir(folder.join(target)).expect("a folder").flatten().map(|entry| entry.path()).collect();
    assert_eq!(saved.len(), 1, "one input, saved once: {said}");
    assert!(said.contains(&format!("replay {target} {}", saved[0].display())), "{said}");
    let again = emu_fuzz(&["replay", target, &saved[0].display().to_string()]);
    assert_eq!(again.status.code(), Some(1), "the replay finds it");
    said
}

#[test]
fn panics_are_findings() {
    assert!(finding("faulty-panic").contains("on purpose"));
}

#[test]
fn hangs_are_findings() {
    assert!(finding("faulty-hang").contains("it hangs"));
}

#[cfg(unix)]
#[test]
fn too_much_memory_is_a_finding() {
    assert!(finding("faulty-memory").contains("memory allocation"));
}

#[test]
fn nothing_is_said_where_nothing_is() {
    let folder = folder("nothing").display().to_string();
    let ended =
        emu_fuzz(&["run", "disasm-avr", "disasm-8051", "--executions", "300", "--seed", "7", "--save", &folder]);
    let said = String::from_utf8_lossy(&ended.stdout);
    assert_eq!(ended.status.code(), Some(0), "{said}");
    assert!(said.contains("600 executions of 2 targets") && said.contains("seed 7, 0 findings"), "{said}");
}

#[test]
fn usage_errors_are_reported() {
    for arguments in [&["run", "nothing"][..], &["run", "--seed"], &["run", "--seed", "x"], &["fly"], &[]] {
        let ended = emu_fuzz(arguments);
        assert_eq!(ended.status.code(), Some(2), "{arguments:?}");
        assert!(String::from_utf8_lossy(&ended.stderr).contains("emu-fuzz run"), "{arguments:?}");
    }
}
