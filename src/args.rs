//! The verbs of the command line, and the flags that several verbs share.

use clap::{Args, Parser, Subcommand, ValueEnum};
use emu_core::chip::Chip;
use ladder::LadderDialect;

use crate::shared::family;
use crate::verbs::{
    asm, check, chips, compile, dap, debug, diff, disasm, draw, explain, fuzz, lockstep, migrate, run, shell, sim, wave,
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

/// When messages have colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ColorChoice {
    /// Only on a terminal.
    Auto,
    /// Everywhere.
    Always,
    /// Nowhere.
    Never,
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
    /// Assemble a source to Intel HEX, for any chip.
    Asm(asm::AsmArgs),
    /// Run a ladder program on the reference evaluator, scan by scan.
    Sim(sim::SimArgs),
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
            CliVerb::Fuzz(args) => args.json,
            CliVerb::Compile(args) => args.json,
            CliVerb::Lockstep(args) => args.json,
            CliVerb::Diff(args) => args.json,
            CliVerb::Migrate(args) => args.json,
            CliVerb::Dap(_) | CliVerb::Debug(_) | CliVerb::Wave(_) | CliVerb::Draw(_) | CliVerb::Explain(_) => false,
            CliVerb::Completions(_) | CliVerb::Man(_) => false,
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
            CliVerb::Asm(_) => "asm",
            CliVerb::Sim(_) => "sim",
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

/// The flag that names the chip of an image.
#[derive(Debug, Args)]
pub struct McuFlags {
    /// The chip, such as `atmega328p` (`emu chips` lists them). Default: the chip that the file names. An ELF
    /// file of avr-gcc names it, a HEX file names it in a comment, a source by `list p=`, `.device` or the
    /// include file of the manufacturer.
    #[arg(long = "mcu", value_name = "CHIP", value_parser = family::ChipParser, hide_possible_values = true)]
    pub chip: Option<&'static Chip>,
}

/// The program and its dialect, for verbs that read a ladder program.
#[derive(Debug, Args)]
pub struct LadderFlags {
    /// The program, a .ld file; - is standard input.
    #[arg(value_name = "PROGRAM.ld")]
    pub file: String,
    /// The dialect that gives the elements their meaning: ldmicro-2.3 or ldmicro-5. Default: the dialect of
    /// the program's header (0.1: ldmicro-2.3, 0.2: ldmicro-5).
    #[arg(long, value_name = "DIALECT", value_parser = parse_dialect)]
    pub dialect: Option<LadderDialect>,
}

/// Parses the name of a dialect.
pub fn parse_dialect(name: &str) -> Result<LadderDialect, String> {
    match name {
        "ldmicro-2.3" => Ok(LadderDialect::Ldmicro23),
        "ldmicro-5" => Ok(LadderDialect::Ldmicro5),
        _ => Err("dialects are ldmicro-2.3 and ldmicro-5".to_owned()),
    }
}
