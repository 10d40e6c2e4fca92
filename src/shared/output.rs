//! Writes results: to standard output, or to files that appear complete or not at all.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use serde::Serialize;

use crate::shared::codes;
use crate::shared::fail::VerbFailure;
use crate::shared::output_target::{OutputTarget, output_target};
use crate::shared::report::FileTexts;

/// Writes to standard output.
pub fn print(text: impl AsRef<[u8]>) -> Result<(), VerbFailure> {
    let mut out = io::stdout().lock();
    out.write_all(text.as_ref()).and_then(|()| out.flush()).map_err(|error| VerbFailure::write_failed("-", &error))
}

/// Writes to standard error. Ignores write errors, because the result does not depend on messages.
pub fn print_to_stderr(text: &str) {
    _ = io::stderr().write_all(text.as_bytes());
}

/// Writes one JSON document to standard output.
pub fn print_json(document: &impl Serialize) -> Result<(), VerbFailure> {
    let mut text = serde_json::to_string_pretty(document).map_err(|e| VerbFailure::write_failed("-", &e.into()))?;
    text.push('\n');
    print(text)
}

/// Creates the folder `name` if it does not exist, and checks that files can be created in it.
pub fn ensure_writable_folder(name: &str) -> Result<(), VerbFailure> {
    fs::create_dir_all(name).map_err(|error| {
        let cause = format!("the folder cannot be made: {}", codes::system_message(&error));
        VerbFailure::Refused(
            vec![codes::file_error(codes::UNWRITABLE, name, cause, "check the path")],
            FileTexts::default(),
        )
    })?;
    // The pending file is dropped here, which removes it.
    PendingFile::new(&Path::new(name).join("emu.tmp").to_string_lossy()).map(drop)
}

/// A file that appears under its name only when it is complete. Until then it is a temporary file in the same
/// folder; `drop` removes it.
pub struct PendingFile {
    /// The open file.
    file: Option<File>,
    /// The temporary path, or `None` for a target that is no regular file (a device, a pipe, standard error)
    /// and is written in place.
    temporary_path: Option<PathBuf>,
    target_path: PathBuf,
    name: String,
}

impl PendingFile {
    /// Opens a temporary file for the target `name`.
    pub fn new(name: &str) -> Result<PendingFile, VerbFailure> {
        let fail = |error: io::Error| VerbFailure::write_failed(name, &error);
        let in_place = match output_target(name) {
            OutputTarget::File => None,
            OutputTarget::Stderr => Some(stderr(name).map_err(fail)?),
            OutputTarget::InPlace | OutputTarget::Stdout => {
                Some(File::options().append(true).open(name).map_err(fail)?)
            }
        };
        // For a symbolic link, write its target and keep the link.
        let place = fs::canonicalize(name).unwrap_or_else(|_| PathBuf::from(name));
        if in_place.is_some() {
            return Ok(PendingFile { file: in_place, temporary_path: None, target_path: place, name: name.to_owned() });
        }
        if place.file_name().is_none() || place.is_dir() {
            return Err(fail(io::Error::from(io::ErrorKind::IsADirectory)));
        }
        let (temporary_path, file) = create_temporary(&place).map_err(fail)?;
        // From here on, `drop` removes the temporary file if a step fails.
        let pending = PendingFile {
            file: Some(file),
            temporary_path: Some(temporary_path),
            target_path: place,
            name: name.to_owned(),
        };
        pending.keep_permissions().map_err(fail)?;
        Ok(pending)
    }

    /// Copies the permissions of the file that it will replace.
    fn keep_permissions(&self) -> io::Result<()> {
        let (Ok(old), Some(file)) = (fs::metadata(&self.target_path), &self.file) else { return Ok(()) };
        if file.metadata()?.permissions() == old.permissions() {
            Ok(())
        } else {
            file.set_permissions(old.permissions())
        }
    }

    /// Returns a new buffered writer for the file.
    pub fn writer(&self) -> Result<Box<dyn Write>, VerbFailure> {
        let file = self.file.as_ref().map_or(Err(io::ErrorKind::NotFound.into()), File::try_clone);
        Ok(Box::new(io::BufWriter::new(file.map_err(|e| VerbFailure::write_failed(&self.name, &e))?)))
    }

    /// Renames the temporary file to its final name.
    pub fn complete(mut self) -> Result<(), VerbFailure> {
        drop(self.file.take());
        match self.temporary_path.take() {
            Some(temporary_path) => fs::rename(&temporary_path, &self.target_path).map_err(|error| {
                _ = fs::remove_file(&temporary_path);
                VerbFailure::write_failed(&self.name, &error)
            }),
            None => Ok(()),
        }
    }
}

impl Drop for PendingFile {
    fn drop(&mut self) {
        if let Some(temporary_path) = self.temporary_path.take() {
            _ = fs::remove_file(temporary_path);
        }
    }
}

/// Creates a temporary file in the folder of `place`. The length of its name is independent of `place`, whose
/// name may have the maximum length.
fn create_temporary(place: &Path) -> io::Result<(PathBuf, File)> {
    static NUMBER: AtomicU32 = AtomicU32::new(0);
    loop {
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let temporary_path = place.with_file_name(format!(".emu-{}-{number}.tmp", std::process::id()));
        match File::options().write(true).create_new(true).open(&temporary_path) {
            // A leftover of an earlier process with the same process ID.
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists && number < u32::MAX => {}
            result => return result.map(|file| (temporary_path, file)),
        }
    }
}

/// Returns standard error as a file. It shares the file position with the messages, so neither overwrites the
/// other.
#[cfg(unix)]
fn stderr(_: &str) -> io::Result<File> {
    use std::os::fd::AsFd;
    io::stderr().as_fd().try_clone_to_owned().map(File::from)
}

#[cfg(not(unix))]
fn stderr(name: &str) -> io::Result<File> {
    File::options().append(true).open(name)
}

/// Writes several files, all of them or none. Standard output is written last.
pub fn write_files(files: &[(&str, &[u8])]) -> Result<(), VerbFailure> {
    let (printed, filed): (Vec<_>, Vec<_>) = files.iter().partition(|(name, _)| is_stdout(name));
    let mut pending = Vec::new();
    for (name, bytes) in filed {
        let file = PendingFile::new(name)?;
        let mut writer = file.writer()?;
        writer
            .write_all(bytes)
            .and_then(|()| writer.flush())
            .map_err(|error| VerbFailure::write_failed(name, &error))?;
        pending.push(file);
    }
    for file in pending {
        file.complete()?;
    }
    printed.iter().try_for_each(|(_, bytes)| print(bytes))
}

/// Returns true for `-` and for the other names of standard output.
pub fn is_stdout(name: &str) -> bool {
    output_target(name) == OutputTarget::Stdout
}

/// A requested output: the flag that requests it, and its file, or `-` for standard output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RequestedOutput<'a> {
    /// The flag as it is typed, such as `--vcd`.
    pub flag: &'a str,
    /// Name of the file.
    pub file: &'a str,
}

impl<'a> RequestedOutput<'a> {
    /// Creates an output for a flag and a file.
    pub const fn new(flag: &'a str, file: &'a str) -> RequestedOutput<'a> {
        RequestedOutput { flag, file }
    }

    /// Returns the output of a flag that prints to standard output, if the flag is given.
    pub fn printed(flag: &'a str, given: bool) -> Option<RequestedOutput<'a>> {
        given.then_some(RequestedOutput::new(flag, "-"))
    }

    /// Returns the output of a flag with a file, if the flag is given.
    pub fn to_file(flag: &'a str, file: Option<&'a str>) -> Option<RequestedOutput<'a>> {
        file.map(|file| RequestedOutput::new(flag, file))
    }
}

/// Refuses outputs if two of them go to one place, including standard output.
pub fn check_distinct_outputs(outputs: &[RequestedOutput<'_>]) -> Result<(), VerbFailure> {
    for (i, RequestedOutput { flag, file }) in outputs.iter().enumerate() {
        let same =
            |other: &&RequestedOutput<'_>| same_place(file, other.file) || is_stdout(file) && is_stdout(other.file);
        if let Some(other) = outputs[..i].iter().find(same) {
            let place = if is_stdout(file) { "standard output" } else { file };
            return Err(VerbFailure::Usage(format!(
                "{} and {flag} both write to {place}; give one of them another file",
                other.flag
            )));
        }
    }
    Ok(())
}

/// Refuses an output that would replace the input.
pub fn check_input_not_overwritten(input: &str, outputs: &[RequestedOutput<'_>]) -> Result<(), VerbFailure> {
    match outputs.iter().find(|output| input != "-" && same_place(input, output.file)) {
        Some(RequestedOutput { flag, file }) => {
            Err(VerbFailure::Usage(format!("{flag} {file} would replace the input")))
        }
        None => Ok(()),
    }
}

/// Returns true if two names refer to one file.
pub fn same_place(a: &str, b: &str) -> bool {
    let full_path = |file: &str| {
        let path = Path::new(file);
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let in_folder = || Some(fs::canonicalize(folder).ok()?.join(path.file_name()?));
        fs::canonicalize(path).ok().or_else(in_folder).unwrap_or_else(|| path.to_owned())
    };
    a == b || a != "-" && b != "-" && full_path(a) == full_path(b)
}
