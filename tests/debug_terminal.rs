//! `emu debug` and full screens on a terminal: a Python script types keys on a pseudo terminal.

use std::fs;
use std::path::Path;
use std::process::Command;

/// Runs a script that types keys, on `emu` with these arguments.
fn typed(script: &str, arguments: &[&str]) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let state = Path::new(env!("CARGO_TARGET_TMPDIR")).join(script);
    _ = fs::remove_dir_all(&state);
    let out = Command::new("python3")
        .arg(root.join("tests/peers").join(script))
        .arg(env!("CARGO_BIN_EXE_emu"))
        .args(arguments)
        .current_dir(root.join("tests/cli/in"))
        .env("EMU_TEST_STATE", &state)
        .output()
        .expect("python3 runs");
    let messages = String::from_utf8_lossy(&out.stderr);
    assert_eq!(String::from_utf8_lossy(&out.stdout), "well\n", "{messages}");
}

#[test]
#[ignore = "needs python3"]
fn keys_typed_at_a_terminal() {
    typed("debug_pty.py", &["debug", "blink.hex", "--mcu", "atmega328p"]);
}

#[test]
#[ignore = "needs python3"]
fn keys_typed_at_the_screen_while_a_command_runs() {
    typed("tui_pty.py", &["debug", "spin.hex", "--mcu", "atmega328p", "--tui"]);
}

#[test]
#[ignore = "needs python3"]
fn screens_of_terminals_that_are_closed_or_vast() {
    typed("screen_pty.py", &["debug", "spin.hex", "--mcu", "atmega328p", "--tui"]);
    typed("screen_pty.py", &["sim", "traffic.ld", "--watch"]);
}
