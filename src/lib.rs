//! The command line: one file per verb, and what they share. `src/bin/emu.rs` runs it; `fuzz/` reaches its readers by [`fuzzing`].
//!
//! ```text
//!   args.rs    verbs and their flags          input.rs   files, images, programs in
//!   report.rs  complaints drawn for people    output.rs  results out, whole or not at all
//!   fail.rs    exit codes, ways to fail       codes.rs   the codes CLI0xx
//!   family.rs  the families of chips          sink.rs    what the name of a result stands for
//!   guess.rs   which chip a HEX file was made for   held.rs    why a chip can never go on
//!   chosen.rs  the chip that an image itself names  made_for.rs which AVR an ELF file was linked for
//!   attach.rs  devices at the pins            sources.rs the text of source lines
//!   snapshots.rs  states of machines as files     readings.rs  where silicon and data sheet differ
//!   lint.rs    what `run --lint` found              store.rs  files that keep what a memory holds
//!   avr.rs     flags of the AVR family        mcs51.rs  flags of the 8051 family
//!   pic16.rs   flags of the PIC16 family       ap101.rs  flags and configuration of AP101
//!   fuzz.rs    campaigns of random programs          machine.rs the flags of a machine, and what they come to
//!   debug.rs   the debugger by commands       dap.rs    the debugger for editors
//!   lockstep.rs beside another simulator      interrupts.rs signals that ask for the end
//!   diff.rs    the first difference of two traces   waveform.rs  waveforms drawn
//!   given.rs   what `sim` gives a program       trace.rs   what `sim` saw
//!   scenarios.rs  files of scenarios, and what is told of their end
//!   watch.rs   the panel: `sim --watch`
//! ```

#![forbid(unsafe_code)]

mod ap101;
mod args;
mod asm;
mod attach;
mod avr;
mod check;
mod chip_names;
mod chips;
mod chosen;
mod cod;
mod codes;
mod compile;
mod dap;
mod debug;
mod diff;
mod disasm;
mod draw;
mod explain;
mod fail;
mod family;
mod fuzz;
pub mod fuzzing;
mod guess;
mod image_origin;
mod input;
mod interrupts;
mod lint;
mod lockstep;
mod machine;
mod mcs51;
mod output;
mod output_target;
mod pic16;
mod readings;
mod report;
mod reset_hold;
mod run;
mod scenarios;
mod shell;
mod sim;
mod sim_inputs;
mod snapshots;
mod sources;
mod store;
mod summary;
mod trace;
mod via;
#[cfg(feature = "tui")]
mod watch;
mod wave;
mod waveform;

use std::panic;
use std::process::ExitCode;

use clap::Parser;

use args::{CliVerb, CommandLine};
use fail::{VerbFailure, exit};
use report::MessageStyle;

/// Runs the command line of this process; the exit codes are those of docs/cli.md.
#[must_use]
pub fn main() -> ExitCode {
    panic::set_hook(Box::new(|what| {
        let place = what.location().map_or(String::new(), |l| format!(" at {}:{}", l.file(), l.line()));
        let payload = what.payload();
        let text = payload.downcast_ref::<&str>().copied().or(payload.downcast_ref::<String>().map(String::as_str));
        let text = text.unwrap_or("no message");
        output::print_to_stderr(&format!(
            "internal error{place}: {text}\nThis is a fault of emu, not of your files; please report it.\n"
        ));
    }));
    ExitCode::from(panic::catch_unwind(run_command_line).unwrap_or(exit::INTERNAL))
}

fn run_command_line() -> u8 {
    let cli = match CommandLine::try_parse() {
        Ok(cli) => cli,
        Err(error) => {
            // Help and version come this way too.
            return match error.print() {
                _ if error.use_stderr() => exit::USAGE,
                Ok(()) => exit::OK,
                Err(why) => fail::report_result(
                    Err(VerbFailure::write_failed("-", &why)),
                    "help",
                    false,
                    &MessageStyle::new(args::ColorChoice::Auto, false),
                ),
            };
        }
    };
    let terminal = MessageStyle::new(cli.color, cli.verbose);
    let json = cli.verb.json();
    let name = cli.verb.name();
    fail::report_result(run_verb(cli.verb, &terminal), name, json, &terminal)
}

fn run_verb(verb: CliVerb, terminal: &MessageStyle) -> Result<u8, VerbFailure> {
    match verb {
        CliVerb::Run(args) => run::run(&args, terminal),
        CliVerb::Check(args) => check::check(&args, terminal),
        CliVerb::Fuzz(args) => fuzz::fuzz(&args, terminal),
        CliVerb::Debug(args) => debug::debug(&args, terminal),
        CliVerb::Dap(args) => dap::dap(&args, terminal),
        CliVerb::Compile(args) => compile::compile(&args, terminal),
        CliVerb::Asm(args) => asm::asm(&args, terminal),
        CliVerb::Sim(args) => sim::sim(&args, terminal),
        CliVerb::Diff(args) => diff::diff(&args),
        CliVerb::Wave(args) => waveform::wave(&args),
        CliVerb::Disasm(args) => disasm::disasm(&args, terminal),
        CliVerb::Lockstep(args) => lockstep::lockstep(&args, terminal),
        CliVerb::Draw(args) => draw::draw(&args, terminal),
        CliVerb::Chips(args) => chips::chips(&args),
        CliVerb::Explain(args) => explain::explain(&args),
        CliVerb::Completions(args) => shell::completions(&args),
        CliVerb::Man(args) => shell::man(&args),
    }
}
