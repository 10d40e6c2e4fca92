//! `emu disasm`: the instructions of an image.

use clap::Args;
use emu_core::chip::Chip;
use emu_core::image::Image;
use emu_debug::Names;
use serde_json::{Value, json};

use crate::fail::{Failure, exit};
use crate::report::Terminal;
use crate::{family, input, output};

const EXAMPLES: &str = "\
Examples:
  emu disasm blink.hex
  emu disasm blink.elf --from main --to 0x120
  emu disasm app.ihx --mcu at89s52 --symbols app.cdb
  emu disasm - --json < blink.hex";

/// Erased bytes in a row from which on they are no longer printed.
const ERASED: usize = 8;

/// Flags of `emu disasm`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct DisasmArgs {
    /// A HEX or ELF file; - is standard input.
    #[arg(value_name = "IMAGE")]
    image: String,
    /// The chip, which decides what the words mean and how far they reach.
    #[arg(long = "mcu", value_name = "CHIP", value_parser = family::chip, default_value = "atmega328p")]
    chip: Chosen,
    /// Names for addresses: for the 8051 family a .map, .cdb or .rst file of SDCC, for the PIC16 family a .cod, .lst or .map
    /// file of gputils. Repeatable.
    #[arg(long, value_name = "FILE")]
    symbols: Vec<String>,
    /// First address: bytes (on PIC16 words), as a number (0x80, 128) or a symbol of the program.
    #[arg(long, value_name = "ADDRESS")]
    from: Option<String>,
    /// Address after the last, as --from.
    #[arg(long, value_name = "ADDRESS")]
    to: Option<String>,
    /// One JSON document: addresses in bytes (on PIC16 words), words as numbers, text, labels.
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
    let image = input::image_with_symbols(&args.image, &args.symbols, args.chip, terminal)?;
    let names = Names { chip: args.chip, symbols: &image.symbols };
    let from = args
        .from
        .as_ref()
        .map_or(Ok(0), |text| names.program_word(text).map_err(|why| Failure::value("--from <ADDRESS>", text, &why)))?;
    let to = args.to.as_ref().map_or(Ok(args.chip.flash / args.chip.word_bytes), |text| {
        names.program_end(text).map_err(|why| Failure::value("--to <ADDRESS>", text, &why))
    })?;
    if from >= to {
        let (from, to) = (args.chip.code_address(from), args.chip.code_address(to));
        return Err(Failure::Usage(format!("--from 0x{from:x} is not before --to 0x{to:x}")));
    }
    let pieces = Code::new(args.chip, &image).pieces(from, to);
    if args.json {
        let list: Vec<Value> = pieces.iter().filter_map(|piece| document(piece, &names)).collect();
        output::json(&json!({ "schema": 1, "mcu": args.chip.name, "instructions": list }))?;
    } else {
        output::print(pieces.iter().map(|piece| line(piece, &names)).collect::<String>())?;
    }
    Ok(exit::OK)
}

/// Program memory.
struct Code {
    chip: Chosen,
    words: Vec<u16>,
    /// For each word: the image has something there.
    filled: Vec<bool>,
}

impl Code {
    fn new(chip: Chosen, image: &Image) -> Code {
        let size = chip.word_bytes as usize;
        let erased = chip.isa.erased.to_le_bytes();
        let mut bytes: Vec<u8> = erased.iter().copied().take(size).cycle().take(chip.flash as usize).collect();
        image.fill(chip.code, &mut bytes);
        let words = bytes.chunks(size).map(|word| word.iter().rev().fold(0, |high, &low| high << 8 | u16::from(low)));
        let mut code = Code { chip, words: words.collect(), filled: vec![false; bytes.len() / size] };
        for (addr, _) in image.bytes_in(chip.code) {
            if let Some(word) = code.filled.get_mut(addr as usize / size) {
                *word = true;
            }
        }
        code
    }

    /// Instructions and erased stretches from one word to another.
    fn pieces(&self, from: u32, to: u32) -> Vec<Piece> {
        let mut pieces = Vec::new();
        let mut at = from as usize;
        let to = (to as usize).min(self.words.len());
        while at < to {
            let erased = self.erased(at, to);
            if erased > 0 {
                pieces.push(Piece::Erased(at as u32, (at + erased) as u32));
                at += erased;
            } else {
                let here = self.words.get(at..).unwrap_or_default();
                let instruction = (self.chip.isa.disassemble)(here, at as u32);
                let len = instruction.len.max(1);
                let shown = here.get(..len).unwrap_or(here).to_vec();
                pieces.push(Piece::Instruction(at as u32, shown, instruction.text));
                at += len;
            }
        }
        pieces
    }

    /// Number of words from `at` on that hold no program. What reads as erased may be meant where it stands alone.
    fn erased(&self, at: usize, to: usize) -> usize {
        let count = |end: &dyn Fn(usize) -> bool| (at..to).take_while(|&i| end(i)).count();
        let erased = count(&|i| self.words.get(i) == Some(&self.chip.isa.erased));
        if erased * self.chip.word_bytes as usize >= ERASED {
            return erased;
        }
        let empty = count(&|i| self.filled.get(i) == Some(&false));
        if at + empty == to { empty } else { 0 }
    }
}

fn labels<'a>(names: &Names<'a>, word: u32, len: usize) -> impl Iterator<Item = (u32, &'a str)> {
    let (code, size) = (names.chip.code, names.chip.word_bytes);
    let (start, end) = (word * size, (word + len as u32) * size);
    let here = names.symbols.iter().filter(move |s| s.space == code && (start..end).contains(&s.addr));
    here.map(|s| (s.addr, s.name.as_str()))
}

fn line(piece: &Piece, names: &Names<'_>) -> String {
    let (chip, size) = (names.chip, names.chip.word_bytes);
    match piece {
        Piece::Erased(from, to) => {
            let (from, to) = (chip.code_address(*from), chip.code_address(*to));
            let unit = if chip.width(chip.code) == 1 { "bytes" } else { "words" };
            format!("; {from:04X} to {:04X} erased, {} {unit}\n", to - 1, to - from)
        }
        Piece::Instruction(at, words, text) => {
            let mut out = String::new();
            let start = chip.code_address(*at);
            for (addr, name) in labels(names, *at, words.len()) {
                match addr - at * size {
                    0 => out.push_str(&format!("{name}:\n")),
                    within => out.push_str(&format!("{name} = {start:04X} + {within}\n")),
                }
            }
            let digits = size as usize * 2;
            let hex: Vec<String> = words.iter().map(|word| format!("{word:0digits$X}")).collect();
            out.push_str(&format!("{start:04X}  {:<9}  {text}\n", hex.join(" ")));
            out
        }
    }
}

fn document(piece: &Piece, names: &Names<'_>) -> Option<Value> {
    let Piece::Instruction(at, words, text) = piece else { return None };
    let mut entry = json!({ "addr": names.chip.code_address(*at), "words": words, "text": text });
    let labels: Vec<&str> = labels(names, *at, words.len()).map(|(_, name)| name).collect();
    if !labels.is_empty() {
        entry["labels"] = json!(labels);
    }
    Some(entry)
}
