//! Classifies the name of a result file: an open file of this process, a device, or a regular file that is
//! replaced.

use std::fs;
use std::path::{Path, PathBuf};

/// Maximum number of symbolic links that are followed in sequence; Linux itself follows 40.
const MOST_LINKS: usize = 40;

/// Where a result goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutputTarget {
    /// Standard output, under any name.
    Stdout,
    /// Standard error, under any name.
    Stderr,
    /// A device, a pipe or another open file: written in place.
    InPlace,
    /// A regular file, which may exist or not.
    File,
}

/// Classifies the target `name`.
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

/// Returns the file descriptor that `name` refers to, such as /dev/stdout, /dev/fd/1 and /proc/self/fd/1,
/// also through links. A full resolution of such a name would give the underlying file instead of the
/// descriptor.
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

/// Returns true if two names refer to one regular file or pipe. Devices are excluded, because several writers
/// may share one.
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
