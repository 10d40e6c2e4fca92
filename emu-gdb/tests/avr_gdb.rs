//! Runs avr-gdb on a program compiled by avr-gcc: its output for the commands in `avr.gdb` must be `avr.out`.
//! `EMU_BLESS=1` updates the file.

mod machine;

use std::path::Path;
use std::process::Command;

use emu_core::image::{SourceLines, load_elf};

/// The program must not depend on the machine that builds it: the name of its folder is left out.
#[test]
#[ignore = "needs gdb-avr, gcc-avr and avr-libc"]
fn avr_gdb() {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let elf = folder.join("program.elf");
    let gcc = Command::new("avr-gcc")
        .args(["-mmcu=atmega328p", "-Og", "-gdwarf-4", "-o"])
        .arg(&elf)
        .arg("program.c")
        .current_dir(&tests)
        .status();
    assert!(gcc.expect("avr-gcc").success());

    let chip = machine::chip("atmega328p");
    let bytes = std::fs::read(&elf).expect("what avr-gcc wrote");
    let mut image = load_elf("program.elf", &bytes, chip.elf_spaces, chip.elf_machine).expect("an ELF file").image;
    image.lines = SourceLines::from_elf("program.elf", bytes);
    let (address, server) = machine::serving(chip, image, false, |_| {});
    // The time limit of 100 s is for a gdb that hangs; its output up to then is printed.
    let gdb = Command::new("timeout")
        .args(["100", "avr-gdb"])
        .args(["-nx", "-batch", "-ex", &format!("target remote {address}"), "-x", "avr.gdb"])
        .arg(&elf)
        .current_dir(&tests)
        .output()
        .expect("avr-gdb");
    let ended = server.join().expect("no panic");
    let shown = String::from_utf8_lossy(&gdb.stdout);
    let wrong = String::from_utf8_lossy(&gdb.stderr);
    // The transfer rate is not reproducible.
    let mut out: String = shown
        .lines()
        .filter(|line| !line.starts_with("Transfer rate"))
        .fold(String::new(), |all, line| all + line + "\n");
    out += &format!("== on its standard error\n{wrong}== the server\n{ended}\n");
    let file = tests.join("avr.out");
    if std::env::var_os("EMU_BLESS").is_some() {
        return std::fs::write(file, out).expect("written");
    }
    let wanted = std::fs::read_to_string(file).expect("avr.out");
    for (n, (came, wanted)) in out.lines().zip(wanted.lines()).enumerate() {
        assert_eq!(came, wanted, "avr.out:{}\n{out}", n + 1);
    }
    assert_eq!(out, wanted);
}
