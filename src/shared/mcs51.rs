//! Flags of `emu run` for the 8051 family.

use clap::{Args, ValueEnum};
use emu_8051::Options;
use emu_8051::chips::{self, Mcs51Part};
use emu_core::chip::{Chip, ChipFamily};
use emu_core::image::Image;

use crate::shared::fail::VerbFailure;
use crate::shared::output;

/// Flags that only the 8051 family accepts.
#[derive(Debug, Args)]
#[command(next_help_heading = "Only for the 8051 family")]
pub struct Mcs51Flags {
    /// Code and XDATA share one memory, as on boards that load programs into RAM.
    #[arg(long)]
    von_neumann: bool,
    /// Level of the EA pin. When it is low, the chip fetches all code from external memory, from address 0.
    /// Default: high if the chip has program memory.
    #[arg(long, value_name = "LEVEL")]
    ea: Option<EaLevel>,
    /// Run with 6 clocks per machine cycle, on chips that support it.
    #[arg(long)]
    x2: bool,
}

/// Level of the EA pin.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum EaLevel {
    /// Code comes from program memory on the chip.
    High,
    /// Code comes from external memory.
    Low,
}

impl Mcs51Flags {
    /// Returns the options of a machine of `chip`, with the readings of the manual. Refuses flags that do not
    /// apply to the chip.
    pub fn options(&self, chip: &Chip, readings: emu_8051::Mcs51Readings) -> Result<Options, VerbFailure> {
        let part = (chip.family == ChipFamily::Mcs51).then(|| chips::part(chip.name)).flatten();
        let can = |able: fn(&Mcs51Part) -> bool| part.is_some_and(able);
        let given_flags = [
            ("--von-neumann", self.von_neumann, can(|part| part.has_bus), " with an external bus"),
            ("--ea", self.ea.is_some(), can(|part| part.has_bus), " with an external bus"),
            (
                "--ea high",
                self.ea == Some(EaLevel::High),
                can(|part| part.chip.on_chip_flash_bytes > 0),
                " with program memory on the chip",
            ),
            ("--x2", self.x2, can(|part| part.has_x2), " that run at 6 clocks a machine cycle"),
        ];
        if let Some((flag, _, _, which)) = given_flags.into_iter().find(|(_, is_given, can, _)| *is_given && !can) {
            let which = if part.is_some() { which } else { "" };
            let why = format!("{flag} is for chips of the 8051 family{which}; {} is not one", chip.name);
            return Err(VerbFailure::Usage(why));
        }
        // Without program memory on the chip the pin is low, as data sheets require.
        let ea = self.ea.map_or(can(|part| part.chip.on_chip_flash_bytes > 0), |ea| ea == EaLevel::High);
        Ok(Options { von_neumann: self.von_neumann, ea, x2: self.x2, readings })
    }
}

/// Prints a warning on standard error if the program extends beyond the memory on the chip, because two ports
/// then become its bus.
pub fn warn_external_memory(chip: &Chip, image: &Image, options: &Options) {
    let Some(part) =
        chips::part(chip.name).filter(|part| chip.family == ChipFamily::Mcs51 && part.has_bus && options.ea)
    else {
        return;
    };
    let end = image.end(chip.code_space);
    if end > part.chip.on_chip_flash_bytes {
        output::print_to_stderr(&format!(
            "warning: the program ends at 0x{:04x}, beyond the {} bytes on the {}: the rest comes from outside, and P0 and P2 are its \
             bus, not ports\n",
            end - 1,
            part.chip.on_chip_flash_bytes,
            chip.name
        ));
    }
}
