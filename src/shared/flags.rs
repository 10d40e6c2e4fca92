//! Flags that several verbs share.

use clap::{Args, ValueEnum};
use emu_core::chip::Chip;
use ladder::{LadderDialect, Notation, ReadOptions};

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
    /// The program: .ld (LDmicro), .il (Instruction List) or .grid (CSLadder); - is standard input.
    #[arg(value_name = "PROGRAM.ld")]
    pub file: String,
    #[command(flatten)]
    pub read: ReadFlags,
}

/// How a program is read.
#[derive(Debug, Args)]
pub struct ReadFlags {
    /// The dialect that gives the elements of LDmicro their meaning: ldmicro-2.3 or ldmicro-5. Default: the
    /// dialect of the program's header (0.1: ldmicro-2.3, 0.2: ldmicro-5).
    #[arg(long, value_name = "DIALECT", value_parser = parse_dialect)]
    pub dialect: Option<LadderDialect>,
    /// The notation of the program: ld (LDmicro), il (Instruction List), plcopen (PLCopen XML), openplc (the
    /// .ld of OpenPLC Editor 4), rockwell (neutral text, L5X) or grid (CSLadder). Default: the one that the
    /// content or the extension shows.
    #[arg(long = "format", value_name = "NOTATION", value_parser = parse_notation)]
    notation: Option<Notation>,
    /// Time of a scan in milliseconds, in place of CYCLE= and of the interval of a task. Default where a
    /// program has neither: 10.
    #[arg(long, value_name = "MS", value_parser = parse_cycle)]
    cycle: Option<CycleTime>,
}

/// Time of a scan in microseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CycleTime(u64);

impl ReadFlags {
    /// Returns the options for the reader.
    pub fn options(&self) -> ReadOptions {
        ReadOptions { dialect: self.dialect, notation: self.notation, cycle_us: self.cycle.map(|cycle| cycle.0) }
    }

    /// Returns true if no flag is given.
    pub fn is_empty(&self) -> bool {
        self.options() == ReadOptions::default()
    }
}

/// Parses the name of a notation.
pub fn parse_notation(name: &str) -> Result<Notation, String> {
    let found = Notation::ALL.iter().find(|(_, known)| *known == name);
    found.map(|(notation, _)| *notation).ok_or_else(|| {
        let names: Vec<&str> = Notation::ALL.iter().map(|(_, known)| *known).collect();
        format!("notations are {}", names.join(", "))
    })
}

/// Parses a time in milliseconds, with up to three decimals.
fn parse_cycle(text: &str) -> Result<CycleTime, String> {
    let wrong = || "give milliseconds from 0.001 to 1000000, such as 10 or 0.5".to_owned();
    let (whole, decimals) = text.split_once('.').unwrap_or((text, "0"));
    let is_number = |part: &str| !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit());
    if !is_number(whole) || !is_number(decimals) || decimals.len() > 3 {
        return Err(wrong());
    }
    let micros: u64 = format!("{decimals:0<3}").parse().map_err(|_| wrong())?;
    let ms: u64 = whole.parse().map_err(|_| wrong())?;
    let cycle_us = ms.checked_mul(1_000).map(|ms| ms + micros);
    cycle_us.filter(|us| (1..=1_000_000_000).contains(us)).map(CycleTime).ok_or_else(wrong)
}

/// Parses the name of a dialect.
pub fn parse_dialect(name: &str) -> Result<LadderDialect, UsageError> {
    match name {
        "ldmicro-2.3" => Ok(LadderDialect::Ldmicro23),
        "ldmicro-5" => Ok(LadderDialect::Ldmicro5),
        "iec" => {
            Err(UsageError::malformed("iec is the dialect of every program in Instruction List; give --format il"))
        }
        _ => Err(UsageError::malformed("dialects are ldmicro-2.3 and ldmicro-5")),
    }
}
