//! Results out: on standard output, or to files that are there whole or not at all.

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

/// Writes to standard error. That nobody listens there is no reason to fail.
pub fn print_to_stderr(text: &str) {
    _ = io::stderr().write_all(text.as_bytes());
}

/// Writes one JSON document to standard output.
pub fn print_json(document: &impl Serialize) -> Result<(), VerbFailure> {
    let mut text = serde_json::to_string_pretty(document).map_err(|e| VerbFailure::write_failed("-", &e.into()))?;
    text.push('\n');
    print(text)
}

/// Makes the folder `name` where it is not there, and sees that files can be made in it.
pub fn ensure_writable_folder(name: &str) -> Result<(), VerbFailure> {
    fs::create_dir_all(name).map_err(|error| {
        let cause = format!("the folder cannot be made: {}", codes::system_message(&error));
        VerbFailure::Refused(
            vec![codes::file_error(codes::UNWRITABLE, name, cause, "check the path")],
            FileTexts::default(),
        )
    })?;
    // Dropped, it leaves nothing behind.
    PendingFile::new(&Path::new(name).join("emu.tmp").to_string_lossy()).map(drop)
}

/// A file that appears under its name only when it is complete. Until then it lies beside it; dropped, it disappears.
pub struct PendingFile {
    /// The open file.
    file: Option<File>,
    /// Where it lies now; `None` for what is no regular file (a device, a pipe, standard error), which is written in place.
    temporary_path: Option<PathBuf>,
    target_path: PathBuf,
    name: String,
}

impl PendingFile {
    /// Begins the file `name`.
    pub fn new(name: &str) -> Result<PendingFile, VerbFailure> {
        let fail = |error: io::Error| VerbFailure::write_failed(name, &error);
        let in_place = match output_target(name) {
            OutputTarget::File => None,
            OutputTarget::Stderr => Some(stderr(name).map_err(fail)?),
            OutputTarget::InPlace | OutputTarget::Stdout => {
                Some(File::options().append(true).open(name).map_err(fail)?)
            }
        };
        // Through a link its target is written, and the link stays.
        let place = fs::canonicalize(name).unwrap_or_else(|_| PathBuf::from(name));
        if in_place.is_some() {
            return Ok(PendingFile { file: in_place, temporary_path: None, target_path: place, name: name.to_owned() });
        }
        if place.file_name().is_none() || place.is_dir() {
            return Err(fail(io::Error::from(io::ErrorKind::IsADirectory)));
        }
        let (beside, file) = create_temporary(&place).map_err(fail)?;
        // From here on it disappears when anything fails.
        let pending =
            PendingFile { file: Some(file), temporary_path: Some(beside), target_path: place, name: name.to_owned() };
        pending.keep_permissions().map_err(fail)?;
        Ok(pending)
    }

    /// Gives it the permissions of the file that it will replace.
    fn keep_permissions(&self) -> io::Result<()> {
        let (Ok(old), Some(file)) = (fs::metadata(&self.target_path), &self.file) else { return Ok(()) };
        if file.metadata()?.permissions() == old.permissions() {
            Ok(())
        } else {
            file.set_permissions(old.permissions())
        }
    }

    /// Another handle to write through.
    pub fn writer(&self) -> Result<Box<dyn Write>, VerbFailure> {
        let file = self.file.as_ref().map_or(Err(io::ErrorKind::NotFound.into()), File::try_clone);
        Ok(Box::new(io::BufWriter::new(file.map_err(|e| VerbFailure::write_failed(&self.name, &e))?)))
    }

    /// Puts the file into its place.
    pub fn complete(mut self) -> Result<(), VerbFailure> {
        drop(self.file.take());
        match self.temporary_path.take() {
            Some(beside) => fs::rename(&beside, &self.target_path).map_err(|error| {
                _ = fs::remove_file(&beside);
                VerbFailure::write_failed(&self.name, &error)
            }),
            None => Ok(()),
        }
    }
}

impl Drop for PendingFile {
    fn drop(&mut self) {
        if let Some(beside) = self.temporary_path.take() {
            _ = fs::remove_file(beside);
        }
    }
}

/// A new file in the folder of `place`. Its name does not grow with that of `place`, which may be as long as names can be.
fn create_temporary(place: &Path) -> io::Result<(PathBuf, File)> {
    static NUMBER: AtomicU32 = AtomicU32::new(0);
    loop {
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let beside = place.with_file_name(format!(".emu-{}-{number}.tmp", std::process::id()));
        match File::options().write(true).create_new(true).open(&beside) {
            // Left behind by a process that had this number before.
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists && number < u32::MAX => {}
            result => return result.map(|file| (beside, file)),
        }
    }
}

/// Standard error as a file. It shares the place of the messages, so that neither writes over the other.
#[cfg(unix)]
fn stderr(_: &str) -> io::Result<File> {
    use std::os::fd::AsFd;
    io::stderr().as_fd().try_clone_to_owned().map(File::from)
}

#[cfg(not(unix))]
fn stderr(name: &str) -> io::Result<File> {
    File::options().append(true).open(name)
}

/// Writes several files, all of them or none; standard output comes last.
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

/// True for `-` and for the other names of standard output.
pub fn is_stdout(name: &str) -> bool {
    output_target(name) == OutputTarget::Stdout
}

/// Refuses outputs of which two would go to one place, standard output included: pairs of flag and file.
pub fn check_distinct_outputs(outputs: &[(&str, &str)]) -> Result<(), VerbFailure> {
    for (i, (flag, file)) in outputs.iter().enumerate() {
        let same = |other: &&(&str, &str)| same_place(file, other.1) || is_stdout(file) && is_stdout(other.1);
        if let Some((other, _)) = outputs[..i].iter().find(same) {
            let place = if is_stdout(file) { "standard output" } else { file };
            return Err(VerbFailure::Usage(format!(
                "{other} and {flag} both write to {place}; give one of them another file"
            )));
        }
    }
    Ok(())
}

/// Refuses an output that would replace the input.
pub fn check_input_not_overwritten(input: &str, outputs: &[(&str, &str)]) -> Result<(), VerbFailure> {
    match outputs.iter().find(|(_, file)| input != "-" && same_place(input, file)) {
        Some((flag, file)) => Err(VerbFailure::Usage(format!("{flag} {file} would replace the input"))),
        None => Ok(()),
    }
}

/// True for two names of one file.
pub fn same_place(a: &str, b: &str) -> bool {
    let whole = |file: &str| {
        let path = Path::new(file);
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let beside = || Some(fs::canonicalize(folder).ok()?.join(path.file_name()?));
        fs::canonicalize(path).ok().or_else(beside).unwrap_or_else(|| path.to_owned())
    };
    a == b || a != "-" && b != "-" && whole(a) == whole(b)
}
