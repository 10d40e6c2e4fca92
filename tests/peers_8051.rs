//! Comparisons of the 8051 with s51 of uCsim (Debian's sdcc-ucsim).
//!
//! A plain `cargo test` ignores them; `.ci/peers` installs the peer and runs them. Random tests take their
//! seed from the variable EMU_SEED and print it.

use std::path::{Path, PathBuf};

#[path = "peers/s51/batch.rs"]
mod batch;
#[path = "peers/s51/drive.rs"]
mod drive;
#[path = "peers/s51/findings.rs"]
mod findings;
#[path = "peers/s51/opcodes.rs"]
mod opcodes;
#[path = "peers/s51/program.rs"]
mod program;

/// Creates a separate folder for the files of a test.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    folder
}

fn seed() -> u64 {
    let given = std::env::var("EMU_SEED").ok();
    given.map_or(1, |text| {
        let digits = text.strip_prefix("0x").map(|hex| u64::from_str_radix(hex, 16));
        digits.unwrap_or_else(|| text.parse()).unwrap_or_else(|e| panic!("EMU_SEED {text}: {e}"))
    })
}
