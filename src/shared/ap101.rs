//! The flags of `emu run` that belong to AP101, and what its images must be.

use clap::{Args, ValueEnum};
use diag::text::readable;
use diag::{Diagnostic, Pos, Severity};
use emu_ap101::config::{Ap101Config, DAMAGED};
use emu_ap101::{InputSampling, Options};
use emu_core::chip::{Chip, ChipFamily};
use emu_core::image::Image;

use crate::shared::fail::VerbFailure;

/// Bytes of a line of Intel HEX before its data: the colon, and length, address and type in two digits a byte.
const HEX_RECORD_HEAD: u32 = 9;

/// The flags.
#[derive(Debug, Args)]
#[group(id = "ap101")]
#[command(next_help_heading = "Only for AP101")]
pub struct Ap101Flags {
    /// When inputs are read: scan, all at once as a program cycle begins, or live, each as an instruction reads it. Default: as
    /// the configuration in the image says, else scan.
    #[arg(long, value_name = "WHEN", hide_possible_values = true)]
    inputs: Option<InputReading>,
}

/// See [`InputSampling`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum InputReading {
    /// As a program cycle begins.
    Scan,
    /// As they are read.
    Live,
}

impl Ap101Flags {
    /// What is otherwise than the image says, with a clock of `hz` where one was asked for; refuses flags that are not for the chip.
    pub fn options(&self, chip: &Chip, hz: Option<u64>) -> Result<Options, VerbFailure> {
        if self.inputs.is_some() && chip.family != ChipFamily::Ap101 {
            return Err(VerbFailure::Usage(format!("--inputs is for AP101; {} is none", chip.name)));
        }
        let inputs =
            self.inputs.map(|when| if when == InputReading::Live { InputSampling::Live } else { InputSampling::Scan });
        Ok(Options { hz, inputs })
    }
}

/// The clock of a machine with that image, if it is an AP101.
pub fn clock_hz(chip: &Chip, image: &Image, options: &Options) -> Option<u64> {
    let own = || Ap101Config::read_config(image).unwrap_or_default().hz;
    (chip.family == ChipFamily::Ap101).then(|| options.hz.unwrap_or_else(own))
}

/// What is wrong with the configuration in an image, which came from the lines of Intel HEX in `text`.
pub fn configuration_faults(file: &str, text: &[u8], chip: &Chip, image: &Image) -> Vec<Diagnostic> {
    if chip.family != ChipFamily::Ap101 {
        return Vec::new();
    }
    let damages = Ap101Config::read_config(image).err().unwrap_or_default();
    let fault = |damage: emu_ap101::config::ConfigDamage| {
        let cause = format!("at {:04X}h: {}", damage.addr, damage.cause);
        Diagnostic::new(
            Severity::Error,
            DAMAGED,
            file,
            position_in_hex(text, damage.addr).unwrap_or_default(),
            cause,
            damage.hint,
        )
    };
    damages.into_iter().map(fault).collect()
}

/// The digits of the byte at an address below 64 K, where they stand in a file of Intel HEX without other addresses.
fn position_in_hex(text: &[u8], addr: u32) -> Option<Pos> {
    (1..).zip(readable(text).lines()).find_map(|(number, line)| {
        let indent = (line.len() - line.trim_start().len()) as u32;
        let line = line.trim_start();
        let field = |from: usize, to: usize| u32::from_str_radix(line.get(from..to)?, 16).ok();
        let (len, start, kind) = (field(1, 3)?, field(3, 7)?, field(7, 9)?);
        let within = addr.checked_sub(start).filter(|&within| kind == 0 && within < len)?;
        Some(Pos::new(number, indent + HEX_RECORD_HEAD + 1 + 2 * within, 2))
    })
}
