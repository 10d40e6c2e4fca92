//! Runs programs of other projects: a folder for the files of a test, exit codes, seeds.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Returns the path of a folder for the files of a test, which exists then. Tests with different names do not
/// share a folder.
///
/// A macro, because Cargo tells only the test itself where its folders are.
#[macro_export]
macro_rules! test_folder {
    ($name:expr) => {
        $crate::peers::create_folder(env!("CARGO_TARGET_TMPDIR"), $name.as_ref())
    };
}

/// Returns the path of an empty folder for the files of a test, like [`test_folder!`].
#[macro_export]
macro_rules! empty_test_folder {
    ($name:expr) => {
        $crate::peers::create_empty_folder(env!("CARGO_TARGET_TMPDIR"), $name.as_ref())
    };
}

/// Creates a folder and its parents where they do not exist.
///
/// # Panics
/// If the folder cannot be created.
#[must_use]
pub fn create_folder(parent: &str, name: &str) -> PathBuf {
    let folder = Path::new(parent).join(name);
    std::fs::create_dir_all(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    folder
}

/// Creates a folder and its parents. If it exists, its contents are deleted.
///
/// # Panics
/// If the folder cannot be created.
#[must_use]
pub fn create_empty_folder(parent: &str, name: &str) -> PathBuf {
    let _ = std::fs::remove_dir_all(Path::new(parent).join(name));
    create_folder(parent, name)
}

/// Runs a program in a folder and returns its output.
///
/// # Panics
/// If the program does not start, or its exit code is not 0; the message has its standard error.
pub fn run_tool(program: impl AsRef<Path>, args: &[&str], folder: &Path) -> Output {
    let program = program.as_ref();
    let output = Command::new(program).args(args).current_dir(folder).output();
    let output = output.unwrap_or_else(|e| panic!("{}: {e}", program.display()));
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{} {args:?}: {}\n{errors}", program.display(), output.status);
    output
}

/// Runs a program like [`run_tool`] and returns its standard output as text.
pub fn tool_text(program: impl AsRef<Path>, args: &[&str], folder: &Path) -> String {
    String::from_utf8_lossy(&run_tool(program, args, folder).stdout).into_owned()
}

/// Returns the seed of a random test: the variable `EMU_SEED`, decimal or hexadecimal after `0x`, or 1.
///
/// # Panics
/// If the variable is no number.
#[must_use]
pub fn random_seed() -> u64 {
    let given = std::env::var("EMU_SEED").ok();
    given.map_or(1, |text| {
        let digits = text.strip_prefix("0x").map(|hex| u64::from_str_radix(hex, 16));
        digits.unwrap_or_else(|| text.parse()).unwrap_or_else(|e| panic!("EMU_SEED {text}: {e}"))
    })
}
