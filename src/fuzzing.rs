//! The readers of the command line as functions without files and without output, for the fuzz targets in `fuzz/`.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use clap::Parser;

use crate::args::{ColorChoice, CommandLine};
use crate::shared::report::MessageStyle;
use crate::verbs::debug::commands;
use crate::verbs::debug::open::{DebugSubject, open_session};
use crate::verbs::debug::shell::{DebugShell, ShellFlow};
use crate::verbs::{diff, wave};

/// How long a command of the debugger runs before it is interrupted, as by Ctrl-C.
const COMMAND_TIME_LIMIT: Duration = Duration::from_millis(5);

/// Commands that read or write the file that they name. Text that nobody has looked at must not choose files.
const FILE_COMMANDS: &[&str] = &["save", "load", "source", "record"];

/// Reads a trace as `emu diff` does. Returns its number of lines, or `None` where it is refused.
#[must_use]
pub fn read_trace(bytes: &[u8]) -> Option<u64> {
    diff::lines_of(bytes).ok()
}

/// Reads a waveform as `emu wave` does and draws it, as text and as SVG. Returns the text, or `None` where it is refused.
#[must_use]
pub fn draw_wave(bytes: &[u8]) -> Option<String> {
    wave::draw_as_text(bytes).ok()
}

/// Parses the arguments of `emu` and carries out nothing. Returns whether they are accepted.
#[must_use]
pub fn parse_arguments(words: &[&str]) -> bool {
    CommandLine::try_parse_from(std::iter::once("emu").chain(words.iter().copied())).is_ok()
}

/// Carries out commands of `emu debug`, one a line, on the program that `subject` names by the flags of that verb. Commands that name
/// files are left out; one that runs for long is interrupted. Returns what they print, or `None` where the program is refused.
#[must_use]
pub fn run_debugger(subject: &[&str], lines: &str) -> Option<String> {
    #[derive(Debug, Parser)]
    #[command(no_binary_name = true)]
    struct DebuggerArguments {
        #[command(flatten)]
        subject: DebugSubject,
    }
    let arguments = DebuggerArguments::try_parse_from(subject).ok()?;
    let opened = open_session(&arguments.subject, &MessageStyle::new(ColorChoice::Never, false)).ok()?;
    let interrupt = Arc::new(AtomicBool::new(false));
    let mut shell = DebugShell::new(opened, Arc::clone(&interrupt), false);
    let (begin, begun) = channel::<()>();
    let clock = std::thread::spawn(move || {
        loop {
            match begun.recv_timeout(COMMAND_TIME_LIMIT) {
                Ok(()) => {}
                Err(RecvTimeoutError::Timeout) => interrupt.store(true, Ordering::SeqCst),
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    });
    let mut out = String::new();
    for line in lines.lines().filter(|line| !names_a_file(line)) {
        // The clock ends only with its channel.
        _ = begin.send(());
        shell.forget_interrupt();
        match shell.execute(line, &mut out) {
            ShellFlow::Quit(_) => break,
            ShellFlow::Failed(why) => out.push_str(&why),
            ShellFlow::Next | ShellFlow::PointCommands => {}
        }
    }
    drop(begin);
    _ = clock.join();
    Some(out)
}

/// Also within the commands of a breakpoint, for those are lines too.
fn names_a_file(line: &str) -> bool {
    let found = commands::split_command(line).and_then(|(word, _)| commands::find_command(word).ok());
    found.is_some_and(|command| FILE_COMMANDS.contains(&command.name))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A command that takes a file and is not listed would let a fuzzer write anywhere.
    #[test]
    fn commands_that_name_files_are_left_out() {
        let files = commands::COMMANDS.iter().filter(|command| command.syntax.contains("FILE"));
        assert_eq!(files.map(|command| command.name).collect::<Vec<_>>(), FILE_COMMANDS);
        for line in ["save x", " sav /tmp/x", "load x", "so x", "record x"] {
            assert!(names_a_file(line), "{line}");
        }
        assert!(!names_a_file("step") && !names_a_file("# save x") && !names_a_file(""));
    }
}
