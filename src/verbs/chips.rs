//! `emu chips`: lists the chips and their properties.

use clap::Args;
use diag::align_columns;
use emu_core::ChipPin;
use emu_core::chip::{Chip, ChipPackage, ChipSpace, PinDef};
use emu_core::pins::PinId;
use serde_json::{Value, json};

use crate::shared::fail::{VerbFailure, exit};
use crate::shared::{family, output};

const EXAMPLES: &str = "\
Examples:
  emu chips
  emu chips atmega328p
  emu chips --json | jq '.chips[0].pins[].name'";

/// Flags of `emu chips`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct ChipsArgs {
    /// Show only this chip, with its pins and their numbers in each package.
    #[arg(value_name = "CHIP", value_parser = family::parse_chip)]
    pub chip: Option<&'static Chip>,
    /// One JSON document with memories, packages, pins and vectors.
    #[arg(long)]
    pub json: bool,
}

/// Lists all chips, or one chip with its pins.
pub fn chips(args: &ChipsArgs) -> Result<u8, VerbFailure> {
    if args.json {
        let wanted = |chip: &&Chip| args.chip.is_none_or(|only| only.name == chip.name);
        output::print_json(
            &json!({ "schema": 1, "chips": family::chips().filter(wanted).map(document).collect::<Vec<_>>() }),
        )?;
    } else if let Some(chip) = args.chip {
        output::print(table(chip))?;
    } else {
        let width = family::chips().map(|c| c.name.len()).max().unwrap_or(0);
        let lines = family::chips().map(|c| format!("{:width$}  {}\n", c.name, c.title));
        output::print(lines.collect::<String>())?;
    }
    Ok(exit::OK)
}

/// Returns the title of a chip, and a table of its pins with their numbers.
fn table(chip: &Chip) -> String {
    let names: Vec<&str> = chip.packages.iter().map(|package| package.name).collect();
    // A row without packages has the pin numbers of one package, which it does not name.
    let numbers = |id: PinId, def: &PinDef| -> Vec<Option<u8>> {
        match chip.packages {
            [] => Some(def.dip).filter(|&dip| dip != Chip::NO_PACKAGE).map(Some).into_iter().collect(),
            packages => packages.iter().map(|package| package.pin_number(id)).collect(),
        }
    };
    let mut rows: Vec<Vec<String>> = Vec::new();
    if !names.is_empty() {
        rows.push(["pin"].iter().chain(&names).map(|&name| name.to_owned()).collect());
    }
    for ChipPin { id, def } in chip.present_pins() {
        let shown = |number: Option<u8>| number.map_or("-".to_owned(), |number| number.to_string());
        let numbers = numbers(id, def).into_iter().map(shown);
        rows.push(std::iter::once(def.name.to_owned()).chain(numbers).chain([def.note.to_owned()]).collect());
    }
    let last = rows.iter().map(Vec::len).max().unwrap_or(0).saturating_sub(1);
    format!("{}  {}\n{}", chip.name, chip.title, align_columns(&rows, |column| column > 0 && column < last))
}

/// Returns a package as JSON: its name, and the numbers of its pins by pin name.
fn package(chip: &Chip, package: &ChipPackage) -> Value {
    let number = |pin: ChipPin| package.pin_number(pin.id).map(|number| (pin.def.name.to_owned(), json!(number)));
    let pins: serde_json::Map<String, Value> = chip.present_pins().filter_map(number).collect();
    json!({ "name": package.name, "pins": pins })
}

fn document(chip: &Chip) -> Value {
    let pins = chip.present_pins().map(|pin| pin.def);
    json!({
        "name": chip.name,
        "family": chip.family_traits().id,
        "title": chip.title,
        "source": chip.data_sheet,
        "flash": chip.on_chip_flash_bytes,
        "ram": { "start": chip.ram_start, unit(chip, chip.ram_space): chip.ram_len },
        "eeprom": chip.eeprom_bytes,
        "max_hz": chip.max_hz,
        "default_hz": chip.default_hz,
        "pins": pins.map(pin).collect::<Vec<_>>(),
        "packages": chip.packages.iter().map(|of| package(chip, of)).collect::<Vec<_>>(),
        "vectors": chip.vectors,
        "spaces": chip.spaces.iter().map(|row| space(chip, row)).collect::<Vec<_>>(),
    })
}

/// Returns a pin as JSON, with its number if a package gives it one.
fn pin(pin: &PinDef) -> Value {
    match pin.dip {
        0 | Chip::NO_PACKAGE => json!({ "name": pin.name, "note": pin.note }),
        dip => json!({ "name": pin.name, "dip": dip, "note": pin.note }),
    }
}

/// Returns the unit of a memory's size.
fn unit(chip: &Chip, space: &str) -> &'static str {
    if family::is_of_bits(chip, space) { "bits" } else { "bytes" }
}

fn space(chip: &Chip, &ChipSpace { name, size, width }: &ChipSpace) -> Value {
    let mut space = json!({ "name": name, unit(chip, name): size * width });
    if width > 1 {
        space["bytes_per_address"] = json!(width);
    }
    space
}
