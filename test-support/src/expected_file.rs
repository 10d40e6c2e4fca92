//! Files of the repository that a test compares with what it computes.

use std::fs;
use std::path::Path;

/// Asserts that the file has the contents `text`. If `EMU_BLESS` is set, writes them instead.
///
/// # Panics
/// The contents differ, or the file cannot be written.
pub fn assert_file(path: impl AsRef<Path>, text: &str) {
    let path = path.as_ref();
    if std::env::var_os("EMU_BLESS").is_some() {
        fs::write(path, text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        return;
    }
    let found = fs::read_to_string(path).unwrap_or_default();
    if found != text {
        let same = found.lines().zip(text.lines()).take_while(|(a, b)| a == b).count();
        let line = |of: &str| of.lines().nth(same).unwrap_or("(end of file)").to_owned();
        panic!(
            "{}, line {}: the file has\n{}\nbut computed is\n{}\nEMU_BLESS=1 writes the file",
            path.display(),
            same + 1,
            line(&found),
            line(text)
        );
    }
}
