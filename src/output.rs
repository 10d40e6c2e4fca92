//! Results out: on standard output, or to files that are there whole or not at all.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use serde::Serialize;

use crate::codes;
use crate::fail::Failure;
use crate::report::Texts;
use crate::sink::{Sink, sink};

/// Writes to standard output.
pub fn print(text: impl AsRef<[u8]>) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    out.write_all(text.as_ref()).and_then(|()| out.flush()).map_err(|error| Failure::writing("-", &error))
}

/// Writes to standard error. That nobody listens there is no reason to fail.
pub fn tell(text: &str) {
    _ = io::stderr().write_all(text.as_bytes());
}

/// Writes one JSON document to standard output.
pub fn json(document: &impl Serialize) -> Result<(), Failure> {
    let mut text = serde_json::to_string_pretty(document).map_err(|e| Failure::writing("-", &e.into()))?;
    text.push('\n');
    print(text)
}

/// Makes the folder `name` where it is not there, and sees that files can be made in it.
pub fn folder(name: &str) -> Result<(), Failure> {
    fs::create_dir_all(name).map_err(|error| {
        let cause = format!("the folder cannot be made: {}", codes::reason(&error));
        Failure::Refused(vec![codes::about_file(codes::UNWRITABLE, name, cause, "check the path")], Texts::default())
    })?;
    // Dropped, it leaves nothing behind.
    Pending::new(&Path::new(name).join("emu.tmp").to_string_lossy()).map(drop)
}

/// A file that appears under its name only when it is complete. Until then it lies beside it; dropped, it disappears.
pub struct Pending {
    /// The open file.
    file: Option<File>,
    /// Where it lies now; `None` for what is no regular file (a device, a pipe, standard error), which is written in place.
    beside: Option<PathBuf>,
    place: PathBuf,
    name: String,
}

impl Pending {
    /// Begins the file `name`.
    pub fn new(name: &str) -> Result<Pending, Failure> {
        let fail = |error: io::Error| Failure::writing(name, &error);
        let in_place = match sink(name) {
            Sink::File => None,
            Sink::Stderr => Some(stderr(name).map_err(fail)?),
            Sink::Open | Sink::Stdout => Some(File::options().append(true).open(name).map_err(fail)?),
        };
        // Through a link its target is written, and the link stays.
        let place = fs::canonicalize(name).unwrap_or_else(|_| PathBuf::from(name));
        if in_place.is_some() {
            return Ok(Pending { file: in_place, beside: None, place, name: name.to_owned() });
        }
        if place.file_name().is_none() || place.is_dir() {
            return Err(fail(io::Error::from(io::ErrorKind::IsADirectory)));
        }
        let (beside, file) = temporary(&place).map_err(fail)?;
        // From here on it disappears when anything fails.
        let pending = Pending { file: Some(file), beside: Some(beside), place, name: name.to_owned() };
        pending.keep_permissions().map_err(fail)?;
        Ok(pending)
    }

    /// Gives it the permissions of the file that it will replace.
    fn keep_permissions(&self) -> io::Result<()> {
        let (Ok(old), Some(file)) = (fs::metadata(&self.place), &self.file) else { return Ok(()) };
        if file.metadata()?.permissions() == old.permissions() {
            Ok(())
        } else {
            file.set_permissions(old.permissions())
        }
    }

    /// Another handle to write through.
    pub fn writer(&self) -> Result<Box<dyn Write>, Failure> {
        let file = self.file.as_ref().map_or(Err(io::ErrorKind::NotFound.into()), File::try_clone);
        Ok(Box::new(io::BufWriter::new(file.map_err(|e| Failure::writing(&self.name, &e))?)))
    }

    /// Puts the file into its place.
    pub fn complete(mut self) -> Result<(), Failure> {
        drop(self.file.take());
        match self.beside.take() {
            Some(beside) => fs::rename(&beside, &self.place).map_err(|error| {
                _ = fs::remove_file(&beside);
                Failure::writing(&self.name, &error)
            }),
            None => Ok(()),
        }
    }
}

impl Drop for Pending {
    fn drop(&mut self) {
        if let Some(beside) = self.beside.take() {
            _ = fs::remove_file(beside);
        }
    }
}

/// A new file in the folder of `place`. Its name does not grow with that of `place`, which may be as long as names can be.
fn temporary(place: &Path) -> io::Result<(PathBuf, File)> {
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
pub fn files(files: &[(&str, &[u8])]) -> Result<(), Failure> {
    let (printed, filed): (Vec<_>, Vec<_>) = files.iter().partition(|(name, _)| is_stdout(name));
    let mut pending = Vec::new();
    for (name, bytes) in filed {
        let file = Pending::new(name)?;
        let mut writer = file.writer()?;
        writer.write_all(bytes).and_then(|()| writer.flush()).map_err(|error| Failure::writing(name, &error))?;
        pending.push(file);
    }
    for file in pending {
        file.complete()?;
    }
    printed.iter().try_for_each(|(_, bytes)| print(bytes))
}

/// True for `-` and for the other names of standard output.
pub fn is_stdout(name: &str) -> bool {
    sink(name) == Sink::Stdout
}

/// Refuses outputs of which two would go to one place, standard output included: pairs of flag and file.
pub fn owners(outputs: &[(&str, &str)]) -> Result<(), Failure> {
    for (i, (flag, file)) in outputs.iter().enumerate() {
        let same = |other: &&(&str, &str)| same_place(file, other.1) || is_stdout(file) && is_stdout(other.1);
        if let Some((other, _)) = outputs[..i].iter().find(same) {
            let place = if is_stdout(file) { "standard output" } else { file };
            return Err(Failure::Usage(format!(
                "{other} and {flag} both write to {place}; give one of them another file"
            )));
        }
    }
    Ok(())
}

/// Refuses an output that would replace the input.
pub fn spares(input: &str, outputs: &[(&str, &str)]) -> Result<(), Failure> {
    match outputs.iter().find(|(_, file)| input != "-" && same_place(input, file)) {
        Some((flag, file)) => Err(Failure::Usage(format!("{flag} {file} would replace the input"))),
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
