//! Fuzz targets: functions of bytes that must end, without a panic, within [`MAX_SECONDS`] and [`MAX_MEMORY_BYTES`], whatever the bytes are.
//!
//! ```text
//!   targets/     the functions               table.rs    one row a target: function, seeds, words, longest input
//!   seeds.rs     inputs to begin with, from the tree     texts.rs    short ones and words
//!   omf51.rs     object files to begin with
//!   mutate.rs    inputs made of seeds, the same for the same seed and number
//!   machine.rs   chips and machines for the targets
//!   run.rs       the driver: a process for each target, limits, findings      worker.rs   what runs in that process
//! ```
//!
//! The same functions run under libFuzzer (`libfuzzer/`, with coverage, for hours) and under the driver of this crate (without
//! coverage, for the minute in CI). docs/security.md has the figures.

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

/// Longest time of one execution, in seconds: one that takes longer is taken for endless.
pub const MAX_SECONDS: u64 = 10;

/// Most memory of a process that executes a target, in bytes.
pub const MAX_MEMORY_BYTES: u64 = 1536 << 20;

/// The folder of the workspace.
#[must_use]
pub fn workspace_root() -> PathBuf {
    let own = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    own.parent().map_or(own.clone(), PathBuf::from)
}
