//! `emu run --cod`: verdict, exit code and JSON documents of self-checking programs.

use std::process::Command;

const DIR: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/emu-debug/tests/cod");

/// Runs a program of `emu-debug/tests/cod` with additional flags. Returns standard output, standard error,
/// and the exit code.
fn emu(name: &str, flags: &[&str]) -> (String, String, i32) {
    let [hex, cod] = ["hex", "cod"].map(|kind| format!("{DIR}/{name}.{kind}"));
    let base = ["run", &hex, "--mcu", "pic16f873", "--config", "0x3FFB", "--cod", &cod];
    let output = Command::new(env!("CARGO_BIN_EXE_emu")).args(base).args(flags).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (text(output.stdout), text(output.stderr), output.status.code().unwrap())
}

#[test]
fn programs_that_pass() {
    for name in ["assertions", "resistors", "gates", "switch", "pulses", "eeprom"] {
        let (out, err, code) = emu(name, &[]);
        assert_eq!((code, err.as_str()), (0, ""), "{name}: {out}");
        assert!(out.starts_with("verdict    passed\n") && out.contains("PASSED"), "{name}: {out}");
    }
}

#[test]
fn a_limit_before_the_verdict_is_a_failure() {
    let (out, _, code) = emu("assertions", &["--cycles", "10"]);
    assert_eq!(code, 1, "{out}");
    assert!(out.contains("verdict    failed") && out.contains("the limit was reached at cycle 10"), "{out}");
}

#[test]
fn the_document_says_it_all() {
    let (out, _, code) = emu("gates", &["--json"]);
    let document: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!((code, &document["passed"], &document["reason"]), (0, &true.into(), &"message".into()), "{out}");
    assert!(document["checked"].as_u64().unwrap() >= 21, "{out}");
}

#[test]
fn other_flags_do_not_go_with_it() {
    let (_, err, code) = emu("gates", &["--until", "pc=0"]);
    assert_eq!(code, 2, "{err}");
}

#[test]
fn a_file_without_messages_is_no_pass() {
    let hex = format!("{DIR}/gates.hex");
    let run = ["run", &hex, "--mcu", "pic16f873", "--config", "0x3FFB", "--cod", &hex];
    let output = Command::new(env!("CARGO_BIN_EXE_emu")).args(run).output().unwrap();
    assert_eq!(output.status.code(), Some(3), "{output:?}");
}
