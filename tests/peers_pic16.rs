//! Comparisons of the PIC16 with gpsim (Debian's gpsim), with programs assembled by gpasm (gputils).
//!
//! A plain `cargo test` ignores the tests that need them; `.ci/peers` installs them and runs these tests.
//! Random tests take their seed from the variable EMU_SEED and print it.

use std::path::{Path, PathBuf};

#[path = "peers/gpsim/batch.rs"]
mod batch;
#[path = "peers/gpsim/drive.rs"]
mod drive;
#[path = "peers/gpsim/findings.rs"]
mod findings;
#[path = "peers/gpsim/instructions.rs"]
mod instructions;
#[path = "peers/gpsim/programs.rs"]
mod programs;

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
