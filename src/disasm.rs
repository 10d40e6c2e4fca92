//! `emu disasm`: the instructions of an image.

use clap::Args;
use emu_avr::isa;
use emu_core::chip::Chip;
use emu_debug::Names;
use serde_json::{Value, json};

use crate::args;
use crate::fail::{Failure, exit};
use crate::report::Terminal;
use crate::{input, output};

const EXAMPLES: &str = "\
Examples:
  emu disasm blink.hex
  emu disasm blink.elf --from main --to 0x120
  emu disasm - --json < blink.hex";

/// Erased words in a row from which on they are no longer printed.
const ERASED: usize = 4;

/// Flags of `emu disasm`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct DisasmArgs {
    /// A HEX or ELF file; - is standard input.
    #[arg(value_name = "IMAGE")]
    image: String,
    /// The chip, which decides what the words mean and how far they reach.
    #[arg(long = "mcu", value_name = "CHIP", value_parser = args::chip, default_value = "atmega328p")]
    chip: Chosen,
    /// First address: bytes, as a number (0x80, 128) or a symbol of an ELF file.
    #[arg(long, value_name = "ADDRESS")]
    from: Option<String>,
    /// Address after the last, as --from.
    #[arg(long, value_name = "ADDRESS")]
    to: Option<String>,
    /// One JSON document: addresses in bytes, words as numbers, text, labels.
    #[arg(long)]
    pub json: bool,
}

type Chosen = &'static Chip;

/// A stretch of program memory.
enum Piece {
    /// An instruction: word address, its words, its text.
    Instruction(u32, Vec<u16>, String),
    /// Erased words: first and after the last.
    Erased(u32, u32),
}

/// Prints the instructions of an image.
pub fn disasm(args: &DisasmArgs, terminal: &Terminal) -> Result<u8, Failure> {
    let image = input::image(&args.image, args.chip, terminal)?;
    let names = Names { chip: args.chip, symbols: &image.symbols };
    let from = args
        .from
        .as_ref()
        .map_or(Ok(0), |text| names.program_word(text).map_err(|why| Failure::value("--from <ADDRESS>", text, &why)))?;
    let to = args.to.as_ref().map_or(Ok(args.chip.flash / args.chip.word_bytes), |text| {
        names.program_end(text).map_err(|why| Failure::value("--to <ADDRESS>", text, &why))
    })?;
    if from >= to {
        return Err(Failure::Usage(format!("--from 0x{:x} is not before --to 0x{:x}", from * 2, to * 2)));
    }
    let mut flash = vec![0xFF; args.chip.flash as usize];
    image.fill("flash", &mut flash);
    let words: Vec<u16> = flash.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect();
    let pieces = pieces(&words, from, to);
    if args.json {
        let list: Vec<Value> = pieces.iter().filter_map(|piece| document(piece, &names)).collect();
        output::json(&json!({ "schema": 1, "mcu": args.chip.name, "instructions": list }))?;
    } else {
        output::print(pieces.iter().map(|piece| line(piece, &names)).collect::<String>())?;
    }
    Ok(exit::OK)
}

fn pieces(words: &[u16], from: u32, to: u32) -> Vec<Piece> {
    let mut pieces = Vec::new();
    let mut at = from as usize;
    let to = (to as usize).min(words.len());
    while let Some(rest) = words.get(at..to).filter(|rest| !rest.is_empty()) {
        let erased = rest.iter().take_while(|&&word| word == 0xFFFF).count();
        if erased >= ERASED || erased == rest.len() {
            pieces.push(Piece::Erased(at as u32, (at + erased) as u32));
            at += erased;
        } else {
            let here = words.get(at..).unwrap_or_default();
            let instruction = isa::disassemble(here, at as u32);
            let len = instruction.len.max(1);
            let shown = here.get(..len).unwrap_or(here).to_vec();
            pieces.push(Piece::Instruction(at as u32, shown, instruction.text));
            at += len;
        }
    }
    pieces
}

fn labels<'a>(names: &Names<'a>, word: u32, len: usize) -> impl Iterator<Item = (u32, &'a str)> {
    let (start, end) = (word * 2, (word + len as u32) * 2);
    let here = names.symbols.iter().filter(move |s| s.space == "flash" && (start..end).contains(&s.addr));
    here.map(|s| (s.addr, s.name.as_str()))
}

fn line(piece: &Piece, names: &Names<'_>) -> String {
    match piece {
        Piece::Erased(from, to) => {
            format!("; {:04X} to {:04X} erased, {} bytes\n", from * 2, to * 2 - 1, (to - from) * 2)
        }
        Piece::Instruction(at, words, text) => {
            let mut out = String::new();
            for (addr, name) in labels(names, *at, words.len()) {
                match addr - at * 2 {
                    0 => out.push_str(&format!("{name}:\n")),
                    within => out.push_str(&format!("{name} = {:04X} + {within}\n", at * 2)),
                }
            }
            let hex: Vec<String> = words.iter().map(|word| format!("{word:04X}")).collect();
            out.push_str(&format!("{:04X}  {:<9}  {text}\n", at * 2, hex.join(" ")));
            out
        }
    }
}

fn document(piece: &Piece, names: &Names<'_>) -> Option<Value> {
    let Piece::Instruction(at, words, text) = piece else { return None };
    let mut entry = json!({ "addr": at * 2, "words": words, "text": text });
    let labels: Vec<&str> = labels(names, *at, words.len()).map(|(_, name)| name).collect();
    if !labels.is_empty() {
        entry["labels"] = json!(labels);
    }
    Some(entry)
}
