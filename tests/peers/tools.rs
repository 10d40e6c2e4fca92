//! Paths of files of the repository.

use std::path::{Path, PathBuf};

/// Returns the path of a file of the repository.
pub fn source(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}
