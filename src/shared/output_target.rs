//! What the name of a result stands for: an open file of this process, a device, or a file to be put into its place.

use std::fs;
use std::path::{Path, PathBuf};

/// Links that are followed one after the other; the system itself follows 40.
const MOST_LINKS: usize = 40;

/// Where a result goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutputTarget {
    /// Standard output, by whatever name.
    Stdout,
    /// Standard error, by whatever name.
    Stderr,
    /// A device, a pipe or another open file: written in place.
    InPlace,
    /// A regular file, there or not.
    File,
}

/// What `name` stands for.
pub fn output_target(name: &str) -> OutputTarget {
    if name == "-" {
        return OutputTarget::Stdout;
    }
    match descriptor(name) {
        Some(1) => OutputTarget::Stdout,
        Some(2) => OutputTarget::Stderr,
        Some(_) => OutputTarget::InPlace,
        None if same_file(name, "/dev/stdout") => OutputTarget::Stdout,
        None if same_file(name, "/dev/stderr") => OutputTarget::Stderr,
        None if fs::metadata(name).is_ok_and(|m| !m.is_file() && !m.is_dir()) => OutputTarget::InPlace,
        None => OutputTarget::File,
    }
}

/// The number of the open file that `name` stands for, as /dev/stdout, /dev/fd/1 and /proc/self/fd/1 do, links to them
/// too. To resolve such a name to the end would give the file that was opened, as if it had been named itself.
fn descriptor(name: &str) -> Option<u32> {
    let mut path = PathBuf::from(name);
    for _ in 0..MOST_LINKS {
        let number = || path.file_name()?.to_str()?.parse().ok();
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let folder = fs::canonicalize(folder).ok()?;
        if folder.ends_with("fd") && (folder.starts_with("/proc") || folder.starts_with("/dev")) {
            return number();
        }
        path = folder.join(fs::read_link(&path).ok()?);
    }
    None
}

/// True for two names of one regular file or pipe. A device may well have several writers.
#[cfg(unix)]
fn same_file(a: &str, b: &str) -> bool {
    use std::os::unix::fs::{FileTypeExt, MetadataExt};
    let (Ok(a), Ok(b)) = (fs::metadata(a), fs::metadata(b)) else { return false };
    !a.file_type().is_char_device() && (a.dev(), a.ino()) == (b.dev(), b.ino())
}

#[cfg(not(unix))]
fn same_file(_: &str, _: &str) -> bool {
    false
}
