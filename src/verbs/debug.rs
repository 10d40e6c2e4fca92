//! `emu debug`: a machine under the debugger, by commands.

mod about;
mod back;
mod blocks;
mod calls;
mod code;
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
  emu debug welder.ld --mcu atmega328p --scenario welder.toml    its inputs come by themselves; how it ends is told
  emu debug blink.elf --mcu atmega328p --gdb :1234    then: avr-gdb blink.elf -ex 'target remote :1234'

`help` at the prompt lists the commands; docs/debug.md has them with examples.

Exit codes: 0; 1 an assertion or another command of a script or a pipe failed; 2 the command line makes no sense; 3 a file was
refused; 4 a script ended where the program had stopped in a fault; 5 a signal (Ctrl-C) stopped a script.";

/// Flags of `emu debug`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct DebugArgs {
    #[command(flatten)]
    subject: DebugSubject,
    /// Carry out the commands of a file first, up to the first that fails. Repeatable.
    #[arg(short = 'x', long = "command", value_name = "FILE")]
    files: Vec<String>,
    /// Carry out a command, after those of -x. Repeatable.
    #[arg(long = "ex", value_name = "COMMAND")]
    commands: Vec<String>,
    /// Leave after -x and --ex, or without them after standard input; the first command that fails ends it with exit code 1, and
    /// commands are not repeated in the output.
    #[arg(long)]
    batch: bool,
    #[command(flatten)]
    gdb: GdbArgs,
    /// A full screen: code, registers, pins, a waveform, the rung with power flow; ? tells the keys. -x and --ex are carried out first.
    #[cfg(feature = "tui")]
    #[arg(long = "tui", id = "full", conflicts_with_all = ["batch", "addr"])]
    full: bool,
    #[cfg(feature = "tui")]
    #[command(flatten)]
    played: crate::shared::full_screen::ScriptedKeys,
}

/// Opens a session and talks with its user.
pub fn debug(args: &DebugArgs, terminal: &MessageStyle) -> Result<u8, VerbFailure> {
    let listener = args.gdb.listener()?;
    let opened = open_session(&args.subject, terminal)?;
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
    let color = terminal.color && std::io::stdout().is_terminal();
    // What commands say on a full screen has the colours of the screen.
    #[cfg(feature = "tui")]
    let color = color && !args.full;
    let mut shell = DebugShell::new(opened, Arc::clone(&signals.interrupt), color);
    let script = CommandScript { files: &args.files, commands: &args.commands, batch: args.batch };
    #[cfg(feature = "tui")]
    if args.full {
        let mut told = String::new();
        if let Some(code) = run_scripts(&mut shell, &script, &mut told)? {
            return Ok(code);
        }
        let file = args.subject.file.rsplit('/').next().unwrap_or(&args.subject.file);
        let title = format!("{file} on {}", shell.session.machine().chip().name);
        return tui::show(shell, &title, signals.interrupt, &told, &args.played, terminal);
    }
    converse(&mut shell, &script, user, &signals)
}

/// Ctrl-C stops a running command; being told to end stops it too, and leaves behind it. Where the system refuses, signals do what
/// they always do, and for the second that comes where the first has not helped; a user may press Ctrl-C as often as they like.
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
