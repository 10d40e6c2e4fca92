//! The programs of examples/avr, for the tests that run what is committed and for those that build it anew.

pub mod edges;
pub mod muldiv;
pub mod table;

use std::path::{Path, PathBuf};
use std::process::Command;

/// The chip of all programs.
pub const MCU: &str = "atmega328p";

/// A file of the examples.
pub fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/avr").join(name)
}

/// What `emu run` tells of an image, as its JSON document.
pub fn emu(image: &Path, flags: &[&str]) -> serde_json::Value {
    let mut command = Command::new(env!("CARGO_BIN_EXE_emu"));
    command.arg("run").arg(image).args(["--mcu", MCU, "--json"]).args(flags);
    let output = command.output().unwrap_or_else(|e| panic!("emu: {e}"));
    let document = String::from_utf8_lossy(&output.stdout);
    let errors = String::from_utf8_lossy(&output.stderr);
    serde_json::from_str(&document).unwrap_or_else(|e| panic!("{} {flags:?}: {e}\n{document}{errors}", image.display()))
}

/// What an image sends by its serial port until it ends by itself.
pub fn sent(image: &Path, flags: &[&str]) -> String {
    let document = emu(image, flags);
    assert_eq!(document["stop"]["reason"], "halted", "{}: {document:#}", image.display());
    document["uart"].as_str().unwrap_or_default().to_owned()
}
