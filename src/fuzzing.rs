//! Entry points for the fuzz targets in `fuzz/`: the readers of the command line as functions that write no
//! files and print nothing.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use clap::Parser;
use emu_core::chip::Chip;
use emu_core::cpu::RamInit;
use emu_core::image::Image;

use crate::args::CommandLine;
pub use crate::shared::family::MachineVisitor;
use crate::shared::family::{self, MachineSetup};
use crate::shared::flags::ColorChoice;
use crate::shared::report::MessageStyle;
use crate::verbs::debug::commands;
use crate::verbs::debug::open::{DebugSubject, open_session};
use crate::verbs::debug::shell::{DebugShell, ShellFlow};
use crate::verbs::{diff, wave};

/// Time after which a debugger command is interrupted, as by Ctrl-C.
const COMMAND_TIME_LIMIT: Duration = Duration::from_millis(5);

/// Debugger commands that read or write the file that they name. Generated text must not choose files.
const FILE_COMMANDS: &[&str] = &["save", "load", "source", "record"];

/// Runs a job on a machine of `chip` after power-up, with `image` in its memories and zeros in RAM.
pub fn visit_machine<V: MachineVisitor>(chip: &'static Chip, image: &Image, visitor: V) -> V::Output {
    family::visit_machine(chip, image, &MachineSetup::new(chip, image, RamInit::Zero), visitor)
}

/// Reads a trace as `emu diff` does. Returns its number of lines, or `None` if the trace is refused.
#[must_use]
pub fn read_trace(bytes: &[u8]) -> Option<u64> {
    diff::lines_of(bytes).ok()
}

/// Reads a waveform as `emu wave` does and draws it as text and as SVG. Returns the text, or `None` if the
/// waveform is refused.
#[must_use]
pub fn draw_wave(bytes: &[u8]) -> Option<String> {
    wave::draw_as_text(bytes).ok()
}

/// Parses the arguments of `emu` without executing them. Returns true if they are accepted.
#[must_use]
pub fn parse_arguments(words: &[&str]) -> bool {
    CommandLine::try_parse_from(std::iter::once("emu").chain(words.iter().copied())).is_ok()
}

/// Executes commands of `emu debug`, one per line, on the program that the flags in `subject` name.
///
/// Commands that name files are skipped, and a command that takes longer than 5 ms is interrupted. Returns
/// what the commands print, or `None` if the program is refused.
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
        // The timer thread ends only when its channel closes, so this send cannot fail.
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

/// Returns true if a command line names a file. Each line of a breakpoint's command list passes through here
/// as well.
fn names_a_file(line: &str) -> bool {
    let found = commands::split_command(line).and_then(|line| commands::find_command(line.word).ok());
    found.is_some_and(|command| FILE_COMMANDS.contains(&command.name))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A command that takes a file and is not in the list would let a fuzzer write to any path.
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
