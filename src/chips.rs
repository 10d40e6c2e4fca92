//! `emu chips`: the chips and what they have.

use clap::Args;
use emu_core::chip::{Chip, PinDef};
use serde_json::{Value, json};

use crate::fail::{Failure, exit};
use crate::{family, output};

const EXAMPLES: &str = "\
Examples:
  emu chips
  emu chips --json | jq '.chips[0].pins[].name'";

/// Flags of `emu chips`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct ChipsArgs {
    /// One JSON document with memories, pins and vectors.
    #[arg(long)]
    pub json: bool,
}

/// Lists the chips.
pub fn chips(args: &ChipsArgs) -> Result<u8, Failure> {
    if args.json {
        output::json(&json!({ "schema": 1, "chips": family::chips().map(document).collect::<Vec<_>>() }))?;
    } else {
        let width = family::chips().map(|c| c.name.len()).max().unwrap_or(0);
        let lines = family::chips().map(|c| format!("{:width$}  {}\n", c.name, c.title));
        output::print(lines.collect::<String>())?;
    }
    Ok(exit::OK)
}

fn document(chip: &Chip) -> Value {
    let pins = chip.pins.iter().filter(|p| p.dip != 0);
    json!({
        "name": chip.name,
        "family": family::name(chip.family),
        "title": chip.title,
        "source": chip.source,
        "flash": chip.on_chip,
        "ram": { "start": chip.ram_start, unit(chip, chip.ram): chip.ram_len },
        "eeprom": chip.eeprom,
        "max_hz": chip.max_hz,
        "default_hz": chip.default_hz,
        "pins": pins.map(pin).collect::<Vec<_>>(),
        "vectors": chip.vectors,
        "spaces": chip.spaces.iter().map(|row| space(chip, row)).collect::<Vec<_>>(),
    })
}

/// A pin, with its number where there is a package that gives it one.
fn pin(pin: &PinDef) -> Value {
    match pin.dip {
        Chip::NO_PACKAGE => json!({ "name": pin.name, "note": pin.note }),
        dip => json!({ "name": pin.name, "dip": dip, "note": pin.note }),
    }
}

/// In what a memory is measured.
fn unit(chip: &Chip, space: &str) -> &'static str {
    if family::is_of_bits(chip, space) { "bits" } else { "bytes" }
}

fn space(chip: &Chip, &(name, addresses, width): &(&str, u32, u32)) -> Value {
    let mut space = json!({ "name": name, unit(chip, name): addresses * width });
    if width > 1 {
        space["bytes_per_address"] = json!(width);
    }
    space
}
