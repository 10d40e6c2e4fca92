//! `emu debug` at a terminal: keys typed at a pseudo terminal, which Python has in its library.

use std::fs;
use std::path::Path;
use std::process::Command;

#[test]
#[ignore = "needs python3"]
fn keys_typed_at_a_terminal() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let state = Path::new(env!("CARGO_TARGET_TMPDIR")).join("debug-terminal");
    _ = fs::remove_dir_all(&state);
    let out = Command::new("python3")
        .arg(root.join("tests/peers/debug_pty.py"))
        .arg(env!("CARGO_BIN_EXE_emu"))
        .args(["debug", "blink.hex", "--mcu", "atmega328p"])
        .current_dir(root.join("tests/cli/in"))
        .env("EMU_TEST_STATE", &state)
        .output()
        .expect("python3 runs");
    let told = String::from_utf8_lossy(&out.stderr);
    assert_eq!(String::from_utf8_lossy(&out.stdout), "well\n", "{told}");
}
