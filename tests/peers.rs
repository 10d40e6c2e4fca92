//! Judges from outside: simavr and the GNU assembler, disassembler and compiler for the AVR.
//!
//! All of it is ignored by a plain `cargo test`; `.ci/peers` installs the peers and runs it. Random tests take their seed
//! from the variable EMU_SEED and print it.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

#[path = "peers/binutils.rs"]
mod binutils;
#[path = "peers/lockstep.rs"]
mod lockstep;
#[path = "../emu-avr/tests/isa/states.rs"]
mod states;
#[path = "peers/uart.rs"]
mod uart;

fn source(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests").join(name)
}

/// A folder of its own for files that a test makes.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    folder
}

/// Runs a program to its end, which must be a good one.
fn run(program: &Path, args: &[&str], dir: &Path) -> Output {
    let output = Command::new(program).args(args).current_dir(dir).output();
    let output = output.unwrap_or_else(|e| panic!("{}: {e}", program.display()));
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{} {args:?}: {}\n{errors}", program.display(), output.status);
    output
}

/// A program around simavr's library, built by the first test that asks.
fn harness(name: &str) -> PathBuf {
    static BUILT: OnceLock<PathBuf> = OnceLock::new();
    let built = BUILT.get_or_init(|| {
        let out = folder("peers");
        run(&source("peers/build.sh"), &[&out.to_string_lossy()], &out);
        out
    });
    built.join(name)
}

fn seed() -> u64 {
    let given = std::env::var("EMU_SEED").ok();
    given.map_or(1, |text| {
        let digits = text.strip_prefix("0x").map(|hex| u64::from_str_radix(hex, 16));
        digits.unwrap_or_else(|| text.parse()).unwrap_or_else(|e| panic!("EMU_SEED {text}: {e}"))
    })
}
