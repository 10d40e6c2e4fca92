//! `emu debug`: runs a machine under the debugger, controlled by commands.

mod about;
mod back;
mod blocks;
mod calls;
mod code;
mod command_error;
pub mod commands;
mod data;
mod declared;
mod displays;
mod examine;
mod files;
mod frames;
mod gdb;
mod info;
mod ladder;
mod names;
mod numbers;
pub mod open;
mod point_table;
mod points;
mod record;
mod repl;
mod rungs;
mod running;
mod scenario;
mod settings;
pub mod shell;
mod steps;
mod stop;
mod terminal;
mod texts;
#[cfg(feature = "tui")]
mod tui;
mod types;

use std::io::IsTerminal;
use std::sync::Arc;

use clap::Args;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

use crate::shared::fail::VerbFailure;
use crate::shared::report::MessageStyle;
use gdb::GdbArgs;
use open::{DebugSubject, open_session};
#[cfg(feature = "tui")]
use repl::run_scripts;
use repl::{CommandScript, SessionSignals, converse};
use shell::DebugShell;

const EXAMPLES: &str = "\
Examples:
  emu debug blink.elf --mcu atmega328p
  emu debug examples/blinker.ld --mcu atmega328p
  emu debug app.ihx --mcu at89s52 --symbols app.cdb -x script.txt
  emu debug blink.hex --mcu atmega328p --ex 'watch PB5' --ex continue --batch
  emu debug welder.ld --mcu atmega328p --scenario welder.toml    applies its inputs and prints how it ends
  emu debug blink.elf --mcu atmega328p --gdb :1234    then: avr-gdb blink.elf -ex 'target remote :1234'

`help` at the prompt lists the commands; docs/debug.md describes them with examples.

Exit codes: 0 success; 1 an assertion or another command of a script or a pipe failed; 2 a usage error; 3 a
file was refused; 4 a script ended where the program had stopped in a fault; 5 a signal (Ctrl-C) stopped a
script.";

/// Flags of `emu debug`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct DebugArgs {
    /// Execute the commands of a file first, up to the first that fails. Repeatable.
    #[arg(short = 'x', long = "command", value_name = "FILE")]
    files: Vec<String>,
    /// Execute a command, after those of -x. Repeatable.
    #[arg(long = "ex", value_name = "COMMAND")]
    commands: Vec<String>,
    /// Exit after -x and --ex, or without them after standard input; the first command that fails ends the
    /// session with exit code 1, and commands are not repeated in the output.
    #[arg(long)]
    batch: bool,
    #[command(flatten)]
    gdb: GdbArgs,
    /// A full screen: code, registers, pins, a waveform, the rung with its power flow; ? lists the keys. -x
    /// and --ex are executed first.
    #[cfg(feature = "tui")]
    #[arg(long = "tui", id = "full", conflicts_with_all = ["batch", "addr"])]
    full: bool,
    #[cfg(feature = "tui")]
    #[command(flatten)]
    played: crate::shared::full_screen::ScriptedKeys,
    #[command(flatten)]
    subject: DebugSubject,
}

/// Opens a session and runs it as a gdb server, on a full screen or as a command line. Returns the exit code.
pub fn debug(args: &DebugArgs, style: &MessageStyle) -> Result<u8, VerbFailure> {
    let listener = args.gdb.listener()?;
    let opened = open_session(&args.subject, style)?;
    if let Some(listener) = listener {
        return args.gdb.serve(opened, &listener);
    }
    let user = !args.batch && std::io::stdin().is_terminal();
    #[cfg(feature = "tui")]
    let user = user && !args.full;
    let user = user.then(terminal::LineEditor::new);
    let signals = SessionSignals::default();
    listen_for_signals(&signals, user.is_some());
    if let Some(user) = &user {
        user.restore_on_signal(&signals.at_prompt);
    }
    let color = style.color && std::io::stdout().is_terminal();
    // On a full screen, the output of commands has the colours of the screen.
    #[cfg(feature = "tui")]
    let color = color && !args.full;
    let mut shell = DebugShell::new(opened, Arc::clone(&signals.interrupt), color);
    let script = CommandScript { files: &args.files, commands: &args.commands, batch: args.batch };
    #[cfg(feature = "tui")]
    if args.full {
        let mut script_output = String::new();
        if let Some(code) = run_scripts(&mut shell, &script, &mut script_output)? {
            return Ok(code);
        }
        let file = args.subject.file.rsplit('/').next().unwrap_or(&args.subject.file);
        let title = format!("{file} on {}", shell.session.machine().chip().name);
        return tui::show(shell, &title, signals.interrupt, &script_output, &args.played, style);
    }
    converse(&mut shell, &script, user, &signals)
}

/// Registers the signal handlers: Ctrl-C stops a running command; SIGTERM and SIGHUP stop it too and end the
/// session. A second signal ends the program by its default action if the first has not been handled; only
/// Ctrl-C at a terminal can be repeated without that. If the system refuses a handler, the signal keeps its
/// default action.
fn listen_for_signals(signals: &SessionSignals, user: bool) {
    if !user {
        _ = signal_hook::flag::register_conditional_default(SIGINT, Arc::clone(&signals.interrupt));
    }
    _ = signal_hook::flag::register(SIGINT, Arc::clone(&signals.interrupt));
    _ = signal_hook::flag::register_conditional_default(SIGINT, Arc::clone(&signals.at_pipe));
    for signal in [SIGTERM, SIGHUP] {
        _ = signal_hook::flag::register_conditional_default(signal, Arc::clone(&signals.at_pipe));
        _ = signal_hook::flag::register_conditional_default(signal, Arc::clone(&signals.leave));
        _ = signal_hook::flag::register(signal, Arc::clone(&signals.leave));
        _ = signal_hook::flag::register(signal, Arc::clone(&signals.interrupt));
    }
}
