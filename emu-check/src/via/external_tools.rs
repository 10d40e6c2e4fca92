//! Runs external compilers and the programs that they make, in a temporary folder.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use diag::{Diagnostic, Pos, Severity};

use super::codes;

/// Time limit of an external program.
const MAX_TOOL_TIME: Duration = Duration::from_secs(300);

/// Maximum number of characters of a compiler's output in a message.
const MAX_MESSAGE_CHARS: usize = 400;

/// A diagnostic without a position in a program.
pub(super) fn tool_error(code: &'static str, cause: String, hint: &str) -> Diagnostic {
    Diagnostic::new(Severity::Error, code, "", Pos::default(), cause, hint)
}

/// A temporary folder, removed when dropped.
#[derive(Debug)]
pub(super) struct ScratchFolder {
    path: PathBuf,
}

impl ScratchFolder {
    /// Creates an empty folder with a unique name.
    pub(super) fn new() -> Result<ScratchFolder, Diagnostic> {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        let mut tried = 0;
        loop {
            let name = format!("emu-via-{}-{}", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed));
            let path = std::env::temp_dir().join(name);
            tried += 1;
            match fs::create_dir(&path) {
                Ok(()) => return Ok(ScratchFolder { path }),
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists && tried < 1000 => {}
                Err(e) => return Err(file_error(&path, &e)),
            }
        }
    }

    /// The path of a file in the folder.
    pub(super) fn at(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Writes a file in the folder.
    pub(super) fn write(&self, name: &str, content: impl AsRef<[u8]>) -> Result<PathBuf, Diagnostic> {
        let path = self.at(name);
        fs::write(&path, content).map_err(|e| file_error(&path, &e))?;
        Ok(path)
    }

    /// Reads a file in the folder.
    pub(super) fn read(&self, name: &str) -> Result<Vec<u8>, Diagnostic> {
        let path = self.at(name);
        fs::read(&path).map_err(|e| file_error(&path, &e))
    }
}

impl Drop for ScratchFolder {
    fn drop(&mut self) {
        // Failing to remove the folder is not an error of the check.
        let _ = fs::remove_dir_all(&self.path);
    }
}

fn file_error(path: &Path, why: &io::Error) -> Diagnostic {
    tool_error(
        codes::NO_FILE,
        format!("{}: {why}", path.display()),
        "see that there is room and that the folder may be written",
    )
}

/// Runs a compiler in `scratch`; an exit code other than 0 is an error.
pub(super) fn run_compiler(
    tool: &str,
    package: &str,
    args: &[String],
    scratch: &ScratchFolder,
) -> Result<(), Diagnostic> {
    let said = scratch.at("said");
    let file = fs::File::create(&said).map_err(|e| file_error(&said, &e))?;
    let ended = run_to_end(Command::new(tool).args(args).current_dir(&scratch.path).stdout(Stdio::null()).stderr(file));
    match ended {
        Err(e) if e.kind() == io::ErrorKind::NotFound => {
            let cause = format!("`{tool}` is not on the PATH");
            Err(tool_error(codes::NO_TOOL, cause, &format!("install it, on Debian with apt-get install {package}")))
        }
        Err(e) => Err(tool_error(codes::TOOL_FAILED, format!("`{tool}`: {e}"), "try the same by hand")),
        Ok(true) => Ok(()),
        Ok(false) => {
            let words: String =
                String::from_utf8_lossy(&scratch.read("said")?).chars().take(MAX_MESSAGE_CHARS).collect();
            let cause = format!("`{tool}` refuses the emitted source: {}", words.trim());
            Err(tool_error(codes::TOOL_FAILED, cause, "please report this with the program"))
        }
    }
}

/// Runs a compiled program with `input` on its standard input and returns its output. Output before a crash
/// is returned, too.
pub(super) fn run_with_input(program: &Path, input: &[u8], scratch: &ScratchFolder) -> Result<Vec<u8>, Diagnostic> {
    let (input, output) = (scratch.write("input", input)?, scratch.at("answer"));
    let open = fs::File::open(&input).map_err(|e| file_error(&input, &e))?;
    let file = fs::File::create(&output).map_err(|e| file_error(&output, &e))?;
    let ended = run_to_end(Command::new(program).stdin(open).stdout(file).stderr(Stdio::null()));
    ended.map_err(|e| {
        tool_error(codes::STOPPED, format!("{}: {e}", program.display()), "please report this with the program")
    })?;
    scratch.read("answer")
}

/// Runs a command to its end; returns whether its exit code is 0.
fn run_to_end(command: &mut Command) -> io::Result<bool> {
    let mut child = command.spawn()?;
    let begun = Instant::now();
    let mut pause = Duration::from_millis(1);
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(status.success());
        }
        if begun.elapsed() > MAX_TOOL_TIME {
            child.kill()?;
            child.wait()?;
            return Err(io::Error::new(io::ErrorKind::TimedOut, "it did not end in five minutes"));
        }
        std::thread::sleep(pause);
        pause = (pause * 2).min(Duration::from_millis(50));
    }
}
