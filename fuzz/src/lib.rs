//! Fuzz targets: functions of bytes that must end without a panic, within [`MAX_SECONDS`] and
//! [`MAX_MEMORY_BYTES`], for all inputs.
//!
//! ```text
//!   targets/         the functions                      target_table.rs  one row per target
//!   seeds.rs         initial inputs, from the tree      text_seeds.rs    short initial texts, and words
//!   omf51.rs         initial object files               mutate.rs        makes inputs from seeds
//!   machines.rs      chips and machines for targets     run.rs           the driver: processes, findings
//!   worker.rs        the code in these processes        main.rs          the command line
//! ```
//!
//! The same functions run under libFuzzer (`libfuzzer/`, with coverage, for hours) and under the driver of
//! this crate (without coverage, for the minute in CI). docs/security.md has the measured numbers.

#![forbid(unsafe_code)]

mod error;
mod machines;
mod mutate;
pub mod omf51;
pub mod run;
mod seeds;
mod target_table;
mod targets;
mod text_seeds;
pub mod worker;

use std::path::PathBuf;

pub use error::FuzzError;
pub use mutate::Mutator;
pub use target_table::{FuzzTarget, TARGETS, find_target};

/// Maximum time of one execution in seconds; a longer one counts as a hang.
pub const MAX_SECONDS: u64 = 10;

/// Maximum memory of a process that executes a target, in bytes.
pub const MAX_MEMORY_BYTES: u64 = 1536 << 20;

/// The folder of the workspace.
#[must_use]
pub fn workspace_root() -> PathBuf {
    let own = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    own.parent().map_or(own.clone(), PathBuf::from)
}
