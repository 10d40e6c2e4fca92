//! The command line of `emu`: verbs in `verbs/`, and the modules that several verbs use in `shared/`.
//!
//! `src/bin/emu.rs` is the program around this library. `fuzz/` reaches the readers through [`fuzzing`].
//!
//! ```text
//!   args.rs     the verbs and the flags that several of them share
//!   verbs/      one file or folder per verb: its flags and its implementation
//!   shared/     what several verbs use: input files, results, chips, messages, exit codes
//!   fuzzing.rs  the readers of the command line for the fuzz targets
//! ```

#![forbid(unsafe_code)]

mod args;
pub mod fuzzing;
mod shared;
mod verbs;

use std::panic;
use std::process::ExitCode;

use clap::Parser;

use args::{CliVerb, CommandLine};
use shared::fail::{self, VerbFailure, exit};
use shared::flags::ColorChoice;
use shared::output;
use shared::report::MessageStyle;
use verbs::{
    asm, check, chips, compile, convert, dap, debug, diff, disasm, draw, explain, fuzz, lockstep, migrate, run, shell,
    sim, test, wave,
};

/// Runs the command line of this process. `docs/cli.md` lists the exit codes.
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
            // clap reports `--help` and `--version` as errors too.
            return match error.print() {
                _ if error.use_stderr() => exit::USAGE,
                Ok(()) => exit::OK,
                Err(why) => fail::report_result(
                    Err(VerbFailure::write_failed("-", &why)),
                    "help",
                    false,
                    &MessageStyle::new(ColorChoice::Auto, false),
                ),
            };
        }
    };
    let style = MessageStyle::new(cli.color, cli.verbose);
    let json = cli.verb.json();
    let name = cli.verb.name();
    fail::report_result(run_verb(cli.verb, &style), name, json, &style)
}

fn run_verb(verb: CliVerb, style: &MessageStyle) -> Result<u8, VerbFailure> {
    match verb {
        CliVerb::Run(args) => run::run(&args, style),
        CliVerb::Check(args) => check::check(&args, style),
        CliVerb::Fuzz(args) => fuzz::fuzz(&args, style),
        CliVerb::Debug(args) => debug::debug(&args, style),
        CliVerb::Dap(args) => dap::dap(&args, style),
        CliVerb::Compile(args) => compile::compile(&args, style),
        CliVerb::Convert(args) => convert::convert(&args, style),
        CliVerb::Asm(args) => asm::asm(&args, style),
        CliVerb::Sim(args) => sim::sim(&args, style),
        CliVerb::Test(args) => test::test(&args, style),
        CliVerb::Diff(args) => diff::diff(&args),
        CliVerb::Wave(args) => wave::wave(&args),
        CliVerb::Disasm(args) => disasm::disasm(&args, style),
        CliVerb::Lockstep(args) => lockstep::lockstep(&args, style),
        CliVerb::Draw(args) => draw::draw(&args, style),
        CliVerb::Migrate(args) => migrate::migrate(&args, style),
        CliVerb::Chips(args) => chips::chips(&args),
        CliVerb::Explain(args) => explain::explain(&args),
        CliVerb::Completions(args) => shell::completions(&args),
        CliVerb::Man(args) => shell::man(&args),
    }
}
