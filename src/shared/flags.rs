//! Flags that several verbs share.

use clap::{Args, ValueEnum};
use emu_core::chip::Chip;
use ladder::LadderDialect;

use crate::shared::family;
use crate::shared::usage_error::UsageError;

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
pub fn parse_dialect(name: &str) -> Result<LadderDialect, UsageError> {
    match name {
        "ldmicro-2.3" => Ok(LadderDialect::Ldmicro23),
        "ldmicro-5" => Ok(LadderDialect::Ldmicro5),
        _ => Err(UsageError::malformed("dialects are ldmicro-2.3 and ldmicro-5")),
    }
}
