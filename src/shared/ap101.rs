//! Flags of `emu run` for AP101, and the check of the configuration in an AP101 image.

use clap::{Args, ValueEnum};
use diag::text::readable;
use diag::{Diagnostic, Pos, Severity};
use emu_ap101::config::{Ap101Config, DAMAGED};
use emu_ap101::{InputSampling, Options};
use emu_core::chip::{Chip, ChipFamily};
use emu_core::image::Image;

use crate::shared::fail::VerbFailure;

/// Characters of an Intel HEX line before its data: the colon, then length, address and type with two digits
/// per byte.
const HEX_RECORD_HEAD: u32 = 9;

/// Flags that only AP101 accepts.
#[derive(Debug, Args)]
#[group(id = "ap101")]
#[command(next_help_heading = "Only for AP101")]
pub struct Ap101Flags {
    /// When inputs are read: scan, all inputs when a program cycle begins, or live, each input when an
    /// instruction reads it. Default: the setting of the configuration in the image, otherwise scan.
    #[arg(long, value_name = "WHEN", hide_possible_values = true)]
    inputs: Option<InputReading>,
}

/// The values of `--inputs`; see [`InputSampling`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum InputReading {
    /// When a program cycle begins.
    Scan,
    /// When an instruction reads them.
    Live,
}

impl Ap101Flags {
    /// Returns what overrides the configuration in the image: the clock `hz` and the flags. Refuses the flags
    /// if `chip` is not an AP101.
    pub fn options(&self, chip: &Chip, hz: Option<u64>) -> Result<Options, VerbFailure> {
        if self.inputs.is_some() && chip.family != ChipFamily::Ap101 {
            return Err(VerbFailure::Usage(format!("--inputs is for AP101; {} is not one", chip.name)));
        }
        let inputs =
            self.inputs.map(|when| if when == InputReading::Live { InputSampling::Live } else { InputSampling::Scan });
        Ok(Options { hz, inputs })
    }
}

/// Returns the clock in Hz of an AP101 with this image, or `None` for other families.
pub fn clock_hz(chip: &Chip, image: &Image, options: &Options) -> Option<u64> {
    let config_hz = || Ap101Config::read_config(image).unwrap_or_default().hz;
    (chip.family == ChipFamily::Ap101).then(|| options.hz.unwrap_or_else(config_hz))
}

/// Returns the errors in the configuration of an AP101 image. `text` is the Intel HEX file that the image was
/// read from.
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

/// Finds the two digits of the byte at `addr` in an Intel HEX file that has addresses below 64 K only
/// (records of type 0).
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
