//! `emu disasm`: prints the instructions of an image.

mod config;
mod listing;
mod pieces;
#[cfg(test)]
mod tests;
mod text;

use clap::Args;
use emu_avr::chips::ATMEGA328P;
use emu_core::chip::Chip;
use emu_core::image::Image;
use emu_core::table::DisassembledInstruction;
use emu_debug::{AddressNames, ProgramSource};
use serde_json::{Value, json};

use crate::shared::fail::{VerbFailure, exit};
use crate::shared::flags::McuFlags;
use crate::shared::report::{FileTexts, MessageStyle, report_diagnostics};
use crate::shared::{input, output};
use listing::SourceLineListing;
use pieces::{CodePiece, ProgramMemory};
use text::{AssemblableText, labels_at};

const EXAMPLES: &str = "\
Examples:
  emu disasm blink.hex
  emu disasm blink.elf --from main --to 0x120
  emu disasm blink.elf --source --from main.c:12
  emu disasm app.ihx --mcu at89s52 --symbols app.cdb
  emu disasm - --json < blink.hex";

/// Flags of `emu disasm`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct DisasmArgs {
    /// A HEX or ELF file; for the 8051 family also an absolute object file (OMF-51); or an assembly source,
    /// by its name (.asm, .s, .a51, .src). - is standard input.
    #[arg(value_name = "IMAGE")]
    image: String,
    #[command(flatten)]
    mcu: McuFlags,
    /// Symbol files: for the 8051 family a .map, .cdb or .rst file of SDCC or a .m51 of Keil, for the PIC16
    /// family a .cod, .lst or .map file of gputils. Repeatable.
    #[arg(long, value_name = "FILE")]
    symbols: Vec<String>,
    /// First address: a number in bytes (on PIC16 words: 0x80, 128), a symbol of the program (main,
    /// main+0x10) or a source line (main.c:12).
    #[arg(long, value_name = "ADDRESS")]
    from: Option<String>,
    /// Address after the last one, written as for --from.
    #[arg(long, value_name = "ADDRESS")]
    to: Option<String>,
    /// Show the source line of each instruction: file and line, and its text if the file is found (where it
    /// was compiled, next to the image, or in the current folder). The lines come from the debugging
    /// information (DWARF, stabs) of an ELF file, or from --symbols.
    #[arg(long)]
    source: bool,
    /// One JSON document: addresses in bytes (on PIC16 words), words as numbers, text, labels, names of
    /// operands, and with --source the lines and their texts.
    #[arg(long)]
    pub json: bool,
}

/// Prints the instructions of an image. The default chip is the ATmega328P.
pub fn disasm(args: &DisasmArgs, style: &MessageStyle) -> Result<u8, VerbFailure> {
    let chip = args.mcu.choose_chip_or(&args.image, Some(&ATMEGA328P))?.chip;
    let image = input::read_image_with_symbols(&args.image, &args.symbols, chip, style)?;
    let names = AddressNames { chip, symbols: &image.symbols };
    let source = ProgramSource { names, lines: &image.lines };
    let range = range(args, &source);
    let pieces = range.map(|(from, to)| ProgramMemory::new(chip, &image).pieces(from, to));
    let mut listing = args.source.then(|| SourceLineListing::new(args, &image.lines, style));
    report_diagnostics(style, image.lines.warnings(), FileTexts::NONE);
    let pieces = pieces?;
    let whole = args.from.is_none() && args.to.is_none();
    if args.json {
        let list: Vec<Value> = pieces.iter().filter_map(|piece| document(piece, &source, listing.as_mut())).collect();
        let mut document = json!({ "schema": 1, "mcu": chip.name, "instructions": list });
        if whole {
            document["memories"] = json!(memories(chip, &image));
        }
        output::print_json(&document)?;
    } else {
        let mut text = AssemblableText::new(&source);
        text.program(&pieces, listing);
        if whole {
            text.memories(&image);
        }
        output::print(text.finish())?;
    }
    Ok(exit::OK)
}

/// Returns the range of program words to print: the first, and the one after the last.
fn range(args: &DisasmArgs, source: &ProgramSource<'_>) -> Result<(u32, u32), VerbFailure> {
    let chip = source.names.chip;
    let first = |text: &str| source.parse_words(text).map(|words| words.into_iter().min().unwrap_or(0));
    let from = args.from.as_ref().map_or(Ok(0), |text| {
        first(text).map_err(|why| VerbFailure::invalid_flag_value("--from <ADDRESS>", text, &why))
    })?;
    let to = args.to.as_ref().map_or(Ok(chip.flash_bytes / chip.word_bytes), |text| {
        let end = if text.contains(':') { first(text) } else { source.names.parse_program_end(text) };
        end.map_err(|why| VerbFailure::invalid_flag_value("--to <ADDRESS>", text, &why))
    })?;
    if from >= to {
        let (from, to) = (chip.code_address(from), chip.code_address(to));
        return Err(VerbFailure::Usage(format!("--from 0x{from:x} is not before --to 0x{to:x}")));
    }
    Ok((from, to))
}

/// Returns the contents of all memories other than program memory.
fn memories(chip: &Chip, image: &Image) -> Vec<Value> {
    let others = image.segments.iter().filter(|segment| segment.space != chip.code_space);
    let others = others.map(|segment| {
        let size =
            chip.hex_spaces.iter().find(|space| space.name == segment.space).map_or(1, |space| space.word.max(1));
        let words = segment.bytes.chunks(size as usize);
        let words = words.map(|word| word.iter().rev().fold(0, |high, &low| high << 8 | u32::from(low)));
        let words: Vec<u32> = words.collect();
        json!({ "memory": segment.space, "addr": segment.addr / size, "words": words })
    });
    others.collect()
}

fn document(
    piece: &CodePiece,
    source: &ProgramSource<'_>,
    listing: Option<&mut SourceLineListing<'_>>,
) -> Option<Value> {
    let CodePiece::Instruction(at, words, DisassembledInstruction { text, operands, .. }) = piece else { return None };
    let names = &source.names;
    let mut entry = json!({ "addr": names.chip.code_address(*at), "words": words, "text": text });
    let labels: Vec<&str> = labels_at(names, *at, words.len()).map(|symbol| symbol.name.as_str()).collect();
    if !labels.is_empty() {
        entry["labels"] = json!(labels);
    }
    let meant = source.describe_operands(operands);
    if !meant.is_empty() {
        entry["names"] = json!(meant);
    }
    if let Some((line, text)) =
        listing.and_then(|listing| listing.line_at(*at, source).map(|(line, text)| (line, text.map(str::to_owned))))
    {
        entry["line"] = json!(line);
        if let Some(text) = text {
            entry["source"] = json!(text);
        }
    }
    Some(entry)
}
