//! `emu asm`: assembles a source to an image for a chip.

use std::path::PathBuf;

use clap::Args;
use diag::{Diagnostic, Severity};
use emu_asm::{AssembleOptions, AssembledProgram, NamedText};
use emu_core::chip::{Chip, ChipFamily};
use emu_core::image::{HexSegment, Image, write_hex, write_hex_aligned};
use serde_json::json;

use crate::shared::assembly::{assemble, report_warnings};
use crate::shared::codes::{NOT_IN_HEX, file_error};
use crate::shared::fail::{VerbFailure, exit};
use crate::shared::flags::McuFlags;
use crate::shared::output::RequestedOutput;
use crate::shared::report::MessageStyle;
use crate::shared::usage_error::UsageError;
use crate::shared::{input, output};
use crate::verbs::compile::default_image_name;

const EXAMPLES: &str = "\
Examples:
  emu asm blink.asm --mcu at89s52
  emu asm blink.asm --mcu pic16f873 -o out.hex --listing out.lst
  emu asm app.s --mcu atmega328p -D F_CPU=8000000 -I include -o -
  emu run examples/and-or-not.asm --mcu ap101 --set I1=1 --for 1ms   (assembled on the fly)";

/// The memory space that `--eeprom` writes.
const EEPROM: &str = "eeprom";

/// Flags of `emu asm`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct AsmArgs {
    /// The source, in the syntax of the chip's usual assembler (as31 and sdas8051, gpasm, avr-as;
    /// docs/formats/asm.md); - is standard input.
    #[arg(value_name = "FILE.asm")]
    file: String,
    #[command(flatten)]
    mcu: McuFlags,
    /// The Intel HEX file; - is standard output. Default: the name of the source with .hex, in the current
    /// folder (standard output for a source from standard input).
    #[arg(short, long, value_name = "FILE")]
    output: Option<String>,
    /// Write a listing: addresses and words next to the source, and the symbols below it; - is standard
    /// output.
    #[arg(long, value_name = "FILE")]
    listing: Option<String>,
    /// Write the EEPROM contents of an AVR source as Intel HEX from address 0. `emu run --eeprom` reads the
    /// file if its name ends in .eep or .hex.
    #[arg(long, value_name = "FILE.eep")]
    eeprom: Option<String>,
    /// Define a name before the first line: NAME (1) or NAME=VALUE. Repeatable.
    #[arg(short = 'D', long = "define", value_name = "NAME=VALUE", value_parser = parse_define)]
    defines: Vec<NamedText>,
    /// Search this folder for include files, after the folder of the including file. Repeatable.
    #[arg(short = 'I', long = "include", value_name = "FOLDER")]
    folders: Vec<PathBuf>,
    /// Treat undefined names of an 8051 source as external, as sdas8051 -g does: their value is 0, and a
    /// warning lists them. Without it only names that `.globl` or `extrn` declares are external.
    #[arg(short = 'g', long)]
    undefined_global: bool,
    /// One JSON document on standard output: size of every memory in use, symbols, warnings.
    #[arg(long)]
    pub json: bool,
}

fn parse_define(text: &str) -> Result<NamedText, UsageError> {
    let (name, value) = text.split_once('=').unwrap_or((text, "1"));
    let starts = name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_' || c == '.');
    if starts && name.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | '$')) {
        Ok(NamedText { name: name.to_owned(), text: value.to_owned() })
    } else {
        Err(UsageError::malformed("write NAME or NAME=VALUE, as in F_CPU=8000000"))
    }
}

/// Assembles a source. If any step fails, no file is written.
pub fn asm(args: &AsmArgs, style: &MessageStyle) -> Result<u8, VerbFailure> {
    let chip = args.mcu.choose_chip(&args.file)?.chip;
    if args.undefined_global && chip.family != ChipFamily::Mcs51 {
        return Err(VerbFailure::Usage(format!(
            "--undefined-global is for sources of the 8051, not for the {}",
            chip.name
        )));
    }
    if args.eeprom.is_some() && chip.eeprom_bytes == 0 {
        return Err(VerbFailure::Usage(format!("--eeprom is for chips with an EEPROM; {} has none", chip.name)));
    }
    let hex = args.output.clone().unwrap_or_else(|| default_image_name(&args.file));
    let mut outputs = vec![RequestedOutput::new("--output", &hex)];
    outputs.extend(RequestedOutput::to_file("--listing", args.listing.as_deref()));
    outputs.extend(RequestedOutput::to_file("--eeprom", args.eeprom.as_deref()));
    let printed = RequestedOutput::printed("--json", args.json);
    let all: Vec<_> = printed.into_iter().chain(outputs.iter().copied()).collect();
    output::check_distinct_outputs(&all)?;
    output::check_input_not_overwritten(&args.file, &all)?;
    let options = AssembleOptions {
        defines: args.defines.clone(),
        undefined_global: args.undefined_global,
        ..AssembleOptions::default()
    };
    let mut assembled = assemble(&args.file, &input::read_bytes(&args.file)?, chip, options, &args.folders)?;
    for (included, _) in assembled.texts.all() {
        output::check_input_not_overwritten(included, &all)?;
    }
    let mut texts = vec![(hex.as_str(), hex_of(&assembled, chip))];
    texts.extend(args.listing.as_deref().map(|file| (file, assembled.listing.to_string())));
    texts.extend(args.eeprom.as_deref().map(|file| (file, eeprom_of(&assembled.image))));
    let files: Vec<(&str, &[u8])> = texts.iter().map(|(file, text)| (*file, text.as_bytes())).collect();
    output::write_files(&files)?;
    warn_unwritten_memories(&mut assembled, chip, args);
    if args.json {
        output::print_json(&document(&assembled, chip))?;
    } else {
        report_warnings(style, assembled);
    }
    Ok(exit::OK)
}

/// Returns the image as Intel HEX, with each memory at its address range in the file.
fn hex_of(assembled: &AssembledProgram, chip: &Chip) -> String {
    let placed = assembled.image.segments.iter().filter_map(|segment| {
        let window = chip.hex_spaces.iter().find(|window| window.name == segment.space)?;
        Some(HexSegment { addr: window.start + segment.addr, bytes: &segment.bytes })
    });
    let placed: Vec<_> = placed.collect();
    // The bytes equal those of the file that the family's usual assembler writes.
    match chip.family {
        ChipFamily::Pic16 => write_hex_aligned(&placed, !assembled.is_inhx8m),
        _ => write_hex(&placed),
    }
}

/// Returns the EEPROM contents of the image as a separate Intel HEX file.
fn eeprom_of(image: &Image) -> String {
    let segments = image.segments.iter().filter(|segment| segment.space == EEPROM);
    write_hex(&segments.map(|segment| HexSegment { addr: segment.addr, bytes: &segment.bytes }).collect::<Vec<_>>())
}

/// Warns of memories that the source fills but no file holds: the Intel HEX file of an AVR holds only its
/// flash.
fn warn_unwritten_memories(assembled: &mut AssembledProgram, chip: &Chip, args: &AsmArgs) {
    let written = |space: &str| {
        chip.hex_spaces.iter().any(|window| window.name == space) || space == EEPROM && args.eeprom.is_some()
    };
    let mut missing: Vec<&str> = assembled.image.segments.iter().map(|segment| segment.space).collect();
    missing.dedup();
    missing.retain(|space| !written(space));
    assembled.warnings.extend(missing.into_iter().map(|space| {
        let cause = format!("the HEX file does not contain what the source gives for the memory {space}");
        let hint =
            if space == EEPROM { "--eeprom FILE.eep writes it" } else { "`emu run` of the source itself takes it" };
        Diagnostic { severity: Severity::Warning, ..file_error(NOT_IN_HEX, &args.file, cause, hint) }
    }));
}

fn document(assembled: &AssembledProgram, chip: &Chip) -> serde_json::Value {
    let size = |name: &str| -> usize {
        assembled.image.segments.iter().filter(|s| s.space == name).map(|s| s.bytes.len()).sum()
    };
    let memories =
        chip.hex_spaces.iter().map(|window| (window.name, size(window.name))).filter(|(_, bytes)| *bytes > 0);
    let memories: Vec<_> = memories.map(|(name, bytes)| json!({ "name": name, "bytes": bytes })).collect();
    let symbols = assembled.image.symbols.iter();
    let symbols: Vec<_> =
        symbols.map(|s| json!({ "name": s.name, "memory": s.space, "addr": s.addr, "size": s.size })).collect();
    let warnings: &[Diagnostic] = &assembled.warnings;
    json!({ "schema": 1, "chip": chip.name, "memories": memories, "symbols": symbols, "warnings": warnings })
}
