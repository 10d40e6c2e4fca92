//! The command line: its verbs and the flags of all verbs.

use clap::{Parser, Subcommand};

use crate::shared::flags::ColorChoice;
use crate::verbs::{
    asm, check, chips, compile, convert, dap, debug, diff, disasm, draw, explain, fuzz, lockstep, migrate, run, shell,
    sim, test, wave,
};

const TOUR: &str = "\
A short tour:
  emu check examples/welder.ld --mcu atmega328p     compile, run on the chip, compare every scan
  emu compile examples/welder.ld --mcu atmega328p   write welder.hex
  emu run welder.hex --mcu atmega328p --for 2s      run it for two seconds of the chip's time
  emu sim examples/welder.ld --scans 10             what the program means, scan by scan
  emu disasm welder.hex                             its instructions
  emu asm examples/and.asm --mcu ap101              assemble a source, for any chip
  emu explain HEX006                                more about the code of a message

A file named - is standard input or output.

Exit codes:
  0  ok: it ended, or reached a limit that was asked for
  1  an expectation failed, or chip and reference differ
  2  the command line makes no sense
  3  a file was refused: unreadable, malformed, or a program that the chip cannot hold
  4  the program on the chip did something impossible
  5  a limit was reached before an awaited event, or the default limit
 70  a fault of emu itself";

/// Cycle-accurate microcontroller emulators, and a ladder compiler that is checked on them, bit for bit.
#[derive(Debug, Parser)]
#[command(name = "emu", version, after_help = TOUR, max_term_width = 100, arg_required_else_help = true)]
pub struct CommandLine {
    /// Colours in messages: auto, always or never. With auto, the terminal, NO_COLOR and CLICOLOR_FORCE
    /// decide.
    #[arg(long, global = true, value_name = "WHEN", default_value = "auto", hide_possible_values = true)]
    pub color: ColorChoice,
    /// Draw warnings and notes with their source lines, as errors are drawn, instead of one line each.
    #[arg(long, global = true)]
    pub verbose: bool,
    /// What to do.
    #[command(subcommand)]
    pub verb: CliVerb,
}

/// The verbs of `emu`.
#[derive(Debug, Subcommand)]
pub enum CliVerb {
    /// Compile a ladder program, run it on the chip, compare every scan with the reference.
    Check(check::CheckArgs),
    /// Run a HEX or ELF image, or an assembly source, on an emulated chip.
    Run(Box<run::RunArgs>),
    /// Step through a program on an emulated chip, forwards and backwards.
    Debug(Box<debug::DebugArgs>),
    /// Start a debug adapter for an editor (Debug Adapter Protocol).
    Dap(dap::DapArgs),
    /// Compile a ladder program to Intel HEX.
    Compile(compile::CompileArgs),
    /// Write a ladder program in another notation.
    Convert(convert::ConvertArgs),
    /// Assemble a source to Intel HEX, for any chip.
    Asm(asm::AsmArgs),
    /// Run a ladder program on the reference evaluator, scan by scan.
    Sim(sim::SimArgs),
    /// Run the tests of a project or folder in parallel: scenarios, checks, images.
    Test(test::TestArgs),
    /// Draw a waveform (VCD), as text or as a picture.
    Wave(wave::WaveArgs),
    /// Find the first difference between two traces.
    Diff(diff::DiffArgs),
    /// Print the instructions of an image.
    Disasm(disasm::DisasmArgs),
    /// Check random ladder programs on chips of all families.
    Fuzz(fuzz::FuzzArgs),
    /// Run an image next to another simulator, up to the first instruction at which they differ.
    Lockstep(lockstep::LockstepArgs),
    /// Draw the rungs of a ladder program as text.
    Draw(draw::DrawArgs),
    /// Show what changes when the other release of LDmicro opens a ladder program.
    Migrate(migrate::MigrateArgs),
    /// List the chips.
    Chips(chips::ChipsArgs),
    /// Explain the code of a message.
    Explain(explain::ExplainArgs),
    /// Print completions for a shell.
    Completions(shell::CompletionsArgs),
    /// Print a manual page, or write all of them (roff).
    Man(shell::ManArgs),
}

impl CliVerb {
    /// Returns true when the result, including errors, must be JSON.
    pub fn json(&self) -> bool {
        match self {
            CliVerb::Run(args) => args.json,
            CliVerb::Disasm(args) => args.json,
            CliVerb::Asm(args) => args.json,
            CliVerb::Chips(args) => args.json,
            CliVerb::Check(args) => args.json,
            CliVerb::Sim(args) => args.json,
            CliVerb::Test(args) => args.json,
            CliVerb::Fuzz(args) => args.json,
            CliVerb::Compile(args) => args.json,
            CliVerb::Lockstep(args) => args.json,
            CliVerb::Diff(args) => args.json,
            CliVerb::Migrate(args) => args.json,
            CliVerb::Dap(_) | CliVerb::Debug(_) | CliVerb::Wave(_) | CliVerb::Draw(_) | CliVerb::Explain(_) => false,
            CliVerb::Convert(_) | CliVerb::Completions(_) | CliVerb::Man(_) => false,
        }
    }

    /// Returns the verb as the user types it.
    pub fn name(&self) -> &'static str {
        match self {
            CliVerb::Run(_) => "run",
            CliVerb::Debug(_) => "debug",
            CliVerb::Dap(_) => "dap",
            CliVerb::Check(_) => "check",
            CliVerb::Compile(_) => "compile",
            CliVerb::Convert(_) => "convert",
            CliVerb::Asm(_) => "asm",
            CliVerb::Sim(_) => "sim",
            CliVerb::Test(_) => "test",
            CliVerb::Fuzz(_) => "fuzz",
            CliVerb::Wave(_) => "wave",
            CliVerb::Diff(_) => "diff",
            CliVerb::Disasm(_) => "disasm",
            CliVerb::Lockstep(_) => "lockstep",
            CliVerb::Draw(_) => "draw",
            CliVerb::Migrate(_) => "migrate",
            CliVerb::Chips(_) => "chips",
            CliVerb::Explain(_) => "explain",
            CliVerb::Completions(_) => "completions",
            CliVerb::Man(_) => "man",
        }
    }
}
