//! avr-gdb with `emu debug --gdb`: the session of emu-gdb/tests/avr.gdb, through the command line.

use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Command, Stdio};

#[test]
#[ignore = "needs gdb-avr, gcc-avr and avr-libc"]
fn avr_gdb_at_the_verb() {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("emu-gdb/tests");
    let elf = Path::new(env!("CARGO_TARGET_TMPDIR")).join("gdb-program.elf");
    let gcc = Command::new("avr-gcc")
        .args(["-mmcu=atmega328p", "-Og", "-gdwarf-4", "-o"])
        .arg(&elf)
        .arg("program.c")
        .current_dir(&tests)
        .status();
    assert!(gcc.expect("avr-gcc").success());

    let mut emu = Command::new(env!("CARGO_BIN_EXE_emu"))
        .arg("debug")
        .arg(&elf)
        .args(["--mcu", "atmega328p", "--no-start-up", "--gdb", "127.0.0.1:0"])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("emu runs");
    let mut messages = BufReader::new(emu.stderr.take().expect("its standard error"));
    let mut line = String::new();
    let address = loop {
        line.clear();
        assert_ne!(messages.read_line(&mut line).expect("text"), 0, "emu listens nowhere");
        if let Some(address) = line.trim_end().strip_prefix("listening on ") {
            break address.to_owned();
        }
    };
    let gdb = Command::new("timeout")
        .args(["100", "avr-gdb", "-nx", "-batch", "-ex", &format!("target remote {address}"), "-x", "avr.gdb"])
        .arg(&elf)
        .current_dir(&tests)
        .output()
        .expect("avr-gdb");
    let mut rest = String::new();
    messages.read_to_string(&mut rest).expect("text");
    let mut printed = String::new();
    emu.stdout.take().expect("its standard output").read_to_string(&mut printed).expect("text");
    assert_eq!(emu.wait().expect("it ends").code(), Some(0), "{rest}");
    assert_eq!((printed.as_str(), rest.lines().last()), ("", Some("the client has detached")));

    let shown = String::from_utf8_lossy(&gdb.stdout);
    let shown = shown.lines().filter(|line| !line.starts_with("Transfer rate"));
    let wrong = String::from_utf8_lossy(&gdb.stderr);
    let out = shown.chain(["== on its standard error"]).chain(wrong.lines());
    let wanted = std::fs::read_to_string(tests.join("avr.out")).expect("avr.out");
    let wanted = wanted.split("== the server").next().unwrap_or_default();
    let (out, wanted): (Vec<_>, Vec<_>) = (out.collect(), wanted.lines().collect());
    for (n, (came, wanted)) in out.iter().zip(&wanted).enumerate() {
        assert_eq!(came, wanted, "avr.out:{}", n + 1);
    }
    assert_eq!(out.len(), wanted.len());
}
