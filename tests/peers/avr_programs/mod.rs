//! The programs of examples/avr, for the tests that run the committed images and for those that rebuild them.

pub mod edges;
pub mod muldiv;
pub mod table;

use std::path::{Path, PathBuf};
use std::process::Command;

/// The chip of all programs.
pub const MCU: &str = "atmega328p";

/// Returns the path of an example file.
pub fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/avr").join(name)
}

/// Returns the JSON document of `emu run` for an image.
pub fn emu(image: &Path, flags: &[&str]) -> serde_json::Value {
    let mut command = Command::new(env!("CARGO_BIN_EXE_emu"));
    command.arg("run").arg(image).args(["--mcu", MCU, "--json"]).args(flags);
    let output = command.output().unwrap_or_else(|e| panic!("emu: {e}"));
    let document = String::from_utf8_lossy(&output.stdout);
    let errors = String::from_utf8_lossy(&output.stderr);
    serde_json::from_str(&document).unwrap_or_else(|e| panic!("{} {flags:?}: {e}\n{document}{errors}", image.display()))
}

/// Returns the text that an image sends on its serial port until it ends.
pub fn sent(image: &Path, flags: &[&str]) -> String {
    let document = emu(image, flags);
    assert_eq!(document["stop"]["reason"], "halted", "{}: {document:#}", image.display());
    document["uart"].as_str().unwrap_or_default().to_owned()
}
