//! `emu disasm`: the instructions of an image.

mod listing;
mod pieces;
#[cfg(test)]
mod tests;
mod text;

use clap::Args;
use emu_core::chip::Chip;
use emu_core::image::Image;
use emu_core::table::Line;
use emu_debug::{Names, Source};
use serde_json::{Value, json};

use crate::fail::{Failure, exit};
<<<<<<< HEAD
use crate::report::{Terminal, Texts, report};
use crate::sources::Sources;
=======
use crate::report::{Terminal, report};
>>>>>>> w-names
use crate::{family, input, output};
use listing::Listing;
use pieces::{Code, Piece};
use text::{Text, labels};

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
    /// First address: bytes (on PIC16 words), as a number (0x80, 128), a symbol of the program (main, main+0x10) or a source
    /// line (main.c:12).
    #[arg(long, value_name = "ADDRESS")]
    from: Option<String>,
    /// Address after the last, as --from.
    #[arg(long, value_name = "ADDRESS")]
    to: Option<String>,
    /// Show the source lines that the instructions were made of: file and line, and its text where the file is found (where it
    /// was compiled, beside the image, or here). From the debugging information (DWARF) of an ELF file, or from --symbols.
    #[arg(long)]
    source: bool,
    /// One JSON document: addresses in bytes (on PIC16 words), words as numbers, text, labels, names of operands, and with
    /// --source lines and their texts.
    #[arg(long)]
    pub json: bool,
}

type Chosen = &'static Chip;

/// Prints the instructions of an image.
pub fn disasm(args: &DisasmArgs, terminal: &Terminal) -> Result<u8, Failure> {
    let image = input::image_with_symbols(&args.image, &args.symbols, args.chip, terminal)?;
    let names = Names { chip: args.chip, symbols: &image.symbols };
    let source = Source { names, lines: &image.lines };
    let range = range(args, &source);
    let pieces = range.map(|(from, to)| Code::new(args.chip, &image).pieces(from, to));
    let mut listing = args.source.then(|| Listing::new(args, &image.lines, terminal));
    report(terminal, image.lines.warnings(), Texts::NONE);
    let pieces = pieces?;
    let whole = args.from.is_none() && args.to.is_none();
    if args.json {
        let list: Vec<Value> = pieces.iter().filter_map(|piece| document(piece, &source, listing.as_mut())).collect();
        let mut document = json!({ "schema": 1, "mcu": args.chip.name, "instructions": list });
        if whole {
            document["memories"] = json!(memories(args.chip, &image));
        }
        output::json(&document)?;
    } else {
        let mut text = Text::new(&source);
        text.program(&pieces, listing);
        if whole {
            text.memories(&image);
        }
        output::print(text.finish())?;
    }
    Ok(exit::OK)
}

/// The program words that are asked for: from the first, to the one after the last.
fn range(args: &DisasmArgs, source: &Source<'_>) -> Result<(u32, u32), Failure> {
    let first = |text: &str| source.words(text).map(|words| words.into_iter().min().unwrap_or(0));
    let from = args
        .from
        .as_ref()
        .map_or(Ok(0), |text| first(text).map_err(|why| Failure::value("--from <ADDRESS>", text, &why)))?;
    let to = args.to.as_ref().map_or(Ok(args.chip.flash / args.chip.word_bytes), |text| {
        let end = if text.contains(':') { first(text) } else { source.names.program_end(text) };
        end.map_err(|why| Failure::value("--to <ADDRESS>", text, &why))
    })?;
    if from >= to {
        let (from, to) = (args.chip.code_address(from), args.chip.code_address(to));
        return Err(Failure::Usage(format!("--from 0x{from:x} is not before --to 0x{to:x}")));
    }
    Ok((from, to))
}

<<<<<<< HEAD
/// Source lines between the instructions.
struct Listing<'a> {
    sources: Sources<'a>,
    /// The line of the instruction before.
    last: Option<String>,
}

impl<'a> Listing<'a> {
    fn new(args: &DisasmArgs, lines: &'a Lines, terminal: &Terminal) -> Listing<'a> {
        if lines.all().is_empty() && lines.warnings().is_empty() {
            let hint = "give an ELF file that was compiled with -gdwarf-4, or files of symbols with --symbols";
            let none = about_file(NO_LINES, &args.image, "there are no source lines".to_owned(), hint);
            report(terminal, &[Diagnostic { severity: Severity::Warning, ..none }], Texts::NONE);
        }
        let files = std::iter::once(&args.image).chain(&args.symbols).map(String::as_str);
        Listing { sources: Sources::new(lines, files), last: None }
    }

    /// Line and text at a program word.
    fn at(&mut self, word: u32, source: &Source<'_>) -> Option<(String, Option<&str>)> {
        let line = source.line_at(word)?;
        Some((format!("{}:{}", line.file, line.line), self.sources.text(line)))
    }

    /// Line and text at a program word, where they are others than at the one before: `; main.c:12: x = 1;`.
    fn heading(&mut self, word: u32, source: &Source<'_>) -> Option<String> {
        let (line, text) = self.at(word, source).map(|(line, text)| (Some(line), text)).unwrap_or_default();
        let heading = line.as_ref().map(|line| match text {
            Some(text) => format!("; {line}: {text}\n"),
            None => format!("; {line}\n"),
        });
        let new = line != self.last;
        self.last = line;
        heading.filter(|_| new)
    }
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
                pieces.push(Piece::Instruction(at as u32, shown, instruction));
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

fn line(piece: &Piece, source: &Source<'_>, listing: Option<&mut Listing<'_>>) -> String {
    let names = &source.names;
    let (chip, size) = (names.chip, names.chip.word_bytes);
    match piece {
        Piece::Erased(from, to) => {
            let (from, to) = (chip.code_address(*from), chip.code_address(*to));
            let unit = if chip.width(chip.code) == 1 { "bytes" } else { "words" };
            format!("; {from:04X} to {:04X} erased, {} {unit}\n", to - 1, to - from)
        }
        Piece::Instruction(at, words, Line { text, operands, .. }) => {
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
            out.push_str(&listing.and_then(|listing| listing.heading(*at, source)).unwrap_or_default());
            let meant = source.operands(operands).join(", ");
            let text = if meant.is_empty() { text.clone() } else { format!("{text:<20} ; {meant}") };
            out.push_str(&format!("{start:04X}  {:<9}  {text}\n", hex.join(" ")));
            out
        }
    }
=======
/// What the image fills besides program memory.
fn memories(chip: &Chip, image: &Image) -> Vec<Value> {
    let others = image.segments.iter().filter(|segment| segment.space != chip.code);
    let others = others.map(|segment| {
        let size = chip.hex.iter().find(|space| space.name == segment.space).map_or(1, |space| space.word.max(1));
        let words = segment.bytes.chunks(size as usize);
        let words = words.map(|word| word.iter().rev().fold(0, |high, &low| high << 8 | u32::from(low)));
        let words: Vec<u32> = words.collect();
        json!({ "memory": segment.space, "addr": segment.addr / size, "words": words })
    });
    others.collect()
>>>>>>> w-names
}

fn document(piece: &Piece, source: &Source<'_>, listing: Option<&mut Listing<'_>>) -> Option<Value> {
    let Piece::Instruction(at, words, Line { text, operands, .. }) = piece else { return None };
    let names = &source.names;
    let mut entry = json!({ "addr": names.chip.code_address(*at), "words": words, "text": text });
    let labels: Vec<&str> = labels(names, *at, words.len()).map(|(_, name)| name).collect();
    if !labels.is_empty() {
        entry["labels"] = json!(labels);
    }
    let meant = source.operands(operands);
    if !meant.is_empty() {
        entry["names"] = json!(meant);
    }
    if let Some((line, text)) =
        listing.and_then(|listing| listing.at(*at, source).map(|(line, text)| (line, text.map(str::to_owned))))
    {
        entry["line"] = json!(line);
        if let Some(text) = text {
            entry["source"] = json!(text);
        }
    }
    Some(entry)
}
