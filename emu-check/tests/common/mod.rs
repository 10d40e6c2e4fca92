//! Loads programs from files, for the integration tests.

use std::fs;
use std::path::{Path, PathBuf};

use ladder::LadderProgram;

#[path = "../../../tests/ladder/parse.rs"]
mod parse;

pub use parse::parse;

/// A program from a file.
pub fn read(path: &Path) -> LadderProgram {
    let text = fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    parse(&path.display().to_string(), &text)
}

/// A path relative to the folder of this crate.
pub fn beside(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// The programs in a folder relative to this crate, sorted; empty if there is no such folder.
pub fn folder(path: &str) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(beside(path)) else { return Vec::new() };
    let mut paths: Vec<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path())).collect();
    paths.retain(|path| path.extension().is_some_and(|e| e == "ld"));
    paths.sort();
    paths
}
