//! Reads symbols and source lines of programs from the files that tools write beside the image: SDCC and Keil
//! for MCS-51, and gputils for mid-range PICs (in `gputils/`).
//!
//! ```text
//!   main.map   the linker's map: global names by area          map.rs
//!   main.cdb   debugging records of the compiler and linker    cdb.rs
//!   main.rst   a module's listing with final addresses         listing.rs, gutter.rs
//!   main.lst   the same before linking; accepted only if all its areas are absolute
//!   main.m51   the map of Keil's linkers                       keil/
//!   names.rs   parsing of debugging names; which address gets which name
//!   spaces.rs  the memories of both families
//! ```
//!
//! Each kind of file contains something that the others lack, so several are read together.
//! `docs/formats/sdcc.md`, `keil.md` and `gputils.md` describe what each gives and how names are chosen.

mod cdb;
mod gputils;
mod gutter;
pub(super) mod keil;
mod listing;
mod map;
pub(super) mod names;
mod spaces;

use crate::image::symbols::names::RankedName;
use std::fmt;

use diag::text::{into_printable, printable};
use diag::{Diagnostic, Pos};

use super::debug_info::cdb::{CdbTypes, read_cdb_types};
use super::faults::FaultList;
use super::{DebugInfo, Image, SourceKind, SourceLine, SymbolAt};
pub use gputils::message::{SimulatorMessage, load_messages};
use names::SymbolEntry;
pub(super) use spaces::MemorySpace;
pub use spaces::SymbolSpaces;

/// A file of symbols, read into memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SymbolFile<'b> {
    /// Name of the file, for messages. Its extension matters only where the content is ambiguous: `.lst` and
    /// `.rst` have the same form.
    pub name: &'b str,
    /// Content of the file.
    pub bytes: &'b [u8],
}

/// The contents of files of symbols.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Symbols {
    /// The symbols in the order of the memories in [`SymbolSpaces`], then by address and name. An address has
    /// one entry for each of its names; no name occurs twice in one memory.
    pub symbols: Vec<SymbolAt>,
    /// The lines by address, kind, file and line, without duplicates.
    pub lines: Vec<SourceLine>,
    /// Names with a value but no memory, by name. A map does not distinguish a register at 0x80 from a bit at
    /// 0x80 or a constant. Names that another file explains are not listed.
    pub unplaced: Vec<(String, u32)>,
    /// The chips that the files name, each after the name of its file, in the spelling of the file
    /// (`16F873`). Only `.cod` files name a chip.
    pub processors_by_file: Vec<(String, String)>,
    /// Warnings about the files.
    pub warnings: Vec<Diagnostic>,
    /// Functions, variables and types of C; empty if no file has them.
    pub debug_info: DebugInfo,
}

impl Symbols {
    /// The line, of one kind, of the code at a byte address: the nearest line that starts there or before. Of
    /// several lines that start at the same address it is the last one, because the others made no code.
    #[must_use]
    pub fn line_at(&self, kind: SourceKind, addr: u32) -> Option<&SourceLine> {
        let end = self.lines.partition_point(|line| line.addr <= addr);
        self.lines.get(..end)?.iter().rev().find(|line| line.kind == kind)
    }
}

/// Reads the symbol files of one program together. Their formats are recognised by content: SDCC's `.map`,
/// `.cdb`, `.rst` and `.lst`, Keil's `.m51`, or the `.cod`, `.map` and `.lst` of gputils.
///
/// # Errors
/// All faults of all files (codes in [`super::SYMBOL_CODES`]), file by file in the order of their positions,
/// at most [`super::MAX_REPORTED`] per file. If there are none, the names on which the files disagree.
pub fn load_symbols(files: &[SymbolFile], spaces: SymbolSpaces) -> Result<Symbols, Vec<Diagnostic>> {
    let mut found = CollectedSymbols::default();
    let (mut refused, mut warnings) = (Vec::new(), Vec::new());
    for (index, file) in files.iter().enumerate() {
        let mut faults = FaultList::new(file.name, MORE_CODE);
        found.file_index = index;
        read(file, spaces, &mut found, &mut faults);
        match faults.finish(Image::default()) {
            Ok(loaded) => warnings.extend(loaded.warnings),
            Err(all) => refused.extend(all),
        }
    }
    // Disagreements of files with faults would only follow from those faults.
    if refused.is_empty() {
        warnings.retain(|warning| !(found.is_complete && warning.code == TRUNCATED_CODE));
        let symbols = names::resolve_names(&found.entries, files, &mut refused);
        if refused.is_empty() {
            return Ok(found.into_symbols(symbols, warnings));
        }
    }
    Err(refused)
}

/// Code of the note that counts the faults that are not listed.
const MORE_CODE: &str = "SYM012";
/// Code of the warning about names that are cut off. It is dropped if another file has the complete names.
const TRUNCATED_CODE: &str = "SYM011";

/// What the readers have found.
#[derive(Default)]
pub(super) struct CollectedSymbols {
    /// Index of the file that is being read.
    file_index: usize,
    /// Whether a file with complete long names was read.
    is_complete: bool,
    pub entries: Vec<SymbolEntry>,
    pub lines: Vec<SourceLine>,
    pub unplaced: Vec<(String, u32)>,
    processors: Vec<(String, String)>,
    cdb_types: CdbTypes,
}

impl CollectedSymbols {
    /// Adds an address with its names. A register of several bytes is given as one number with one byte per
    /// address, lowest first. Each byte gets its own entry; `name.0` is the low byte.
    fn add_symbol(
        &mut self,
        mem: MemorySpace,
        addr: u32,
        size: u32,
        names: Vec<names::RankedName>,
        pos: Pos,
        faults: &mut FaultList,
    ) {
        let file = self.file_index;
        if let Some(RankedName { name, .. }) = names.iter().find(|RankedName { name, .. }| too_long(name)) {
            return long_name(name, pos, faults);
        }
        if mem == MemorySpace::Sfr && addr > 0xFF {
            let bytes = addr.to_le_bytes();
            let used = 4 - addr.leading_zeros() as usize / 8;
            for (at, &byte) in bytes.iter().enumerate().take(used) {
                let names = names
                    .iter()
                    .map(|RankedName { rank, name }| RankedName { rank: *rank, name: format!("{name}.{at}") })
                    .collect();
                self.entries.push(SymbolEntry {
                    mem: direct_space(byte.into()),
                    addr: byte.into(),
                    size: 1,
                    names,
                    pos,
                    file,
                });
            }
            return;
        }
        if addr > mem.last_address() {
            let cause =
                || format!("the address 0x{addr:X} is beyond the last of its memory, 0x{:X}", mem.last_address());
            let hint = "code banks are not emulated: link the program without them";
            return faults.error("SYM004", pos, cause, hint);
        }
        let mem = if mem == MemorySpace::Sfr { direct_space(addr) } else { mem };
        self.entries.push(SymbolEntry { mem, addr, size, names, pos, file });
    }

    fn add_line(&mut self, addr: u32, kind: SourceKind, file: &str, line: u32, pos: Pos, faults: &mut FaultList) {
        if addr > MemorySpace::Code.last_address() {
            let cause = || {
                format!(
                    "the address 0x{addr:X} is beyond the last of its memory, 0x{:X}",
                    MemorySpace::Code.last_address()
                )
            };
            let hint = "code banks are not emulated: link the program without them";
            return faults.error("SYM004", pos, cause, hint);
        }
        if too_long(file) {
            return long_name(file, pos, faults);
        }
        self.lines.push(SourceLine { addr, kind, file: printable(file).into(), line, len: 0 });
    }

    fn into_symbols(mut self, symbols: Vec<SymbolAt>, warnings: Vec<Diagnostic>) -> Symbols {
        self.unplaced = self.unplaced.into_iter().map(|(name, value)| (into_printable(name), value)).collect();
        self.lines.sort_unstable();
        self.lines.dedup();
        let known: std::collections::HashSet<&str> =
            symbols.iter().map(|s| s.name.strip_suffix(".0").unwrap_or(&s.name)).collect();
        self.unplaced.retain(|(name, _)| !known.contains(name.as_str()));
        self.unplaced.sort_unstable();
        self.unplaced.dedup();
        let bit = |name: &str| symbols.iter().find(|s| s.space == MemorySpace::Bit.name() && s.name == name);
        let debug_info = self.cdb_types.with_bit_addresses(|name| bit(name).map(|symbol| symbol.addr));
        let processors_by_file = self.processors;
        Symbols { symbols, lines: self.lines, unplaced: self.unplaced, processors_by_file, warnings, debug_info }
    }
}

/// Maximum length in characters of a name with its module and function, and of a file name. Module and
/// function are put before every name of a module, so a long one could turn a small file into gigabytes.
const MAX_NAME: usize = 1024;

/// Returns true if a name exceeds [`MAX_NAME`].
pub(super) fn too_long(name: &str) -> bool {
    name.len() > MAX_NAME && name.chars().count() > MAX_NAME
}

fn long_name(name: &str, pos: Pos, faults: &mut FaultList) {
    let cause = || {
        format!(
            "a name of {} characters, of which {MAX_NAME} are the most: {:?}..",
            name.chars().count(),
            shortened(name)
        )
    };
    faults.error("SYM018", pos, cause, "the file is damaged, or no tool wrote it: build again");
}

/// The memory of a direct address; below 0x80 it is internal RAM.
fn direct_space(addr: u32) -> MemorySpace {
    if addr < 0x80 { MemorySpace::Idata } else { MemorySpace::Sfr }
}

fn read(file: &SymbolFile, spaces: SymbolSpaces, found: &mut CollectedSymbols, faults: &mut FaultList) {
    if spaces == SymbolSpaces::PIC16 {
        return read_gputils(file, found, faults);
    }
    let text = String::from_utf8_lossy(file.bytes);
    if text.trim().is_empty() {
        return report_empty(faults);
    }
    match guess_format(file, &text) {
        Some(SymbolFormat::Map) => map::read_map(&text, found, faults),
        Some(SymbolFormat::Keil) => {
            found.is_complete = true;
            keil::m51::read_m51(&text, found, faults);
        }
        Some(SymbolFormat::Cdb) => {
            found.is_complete = true;
            cdb::read_cdb(&text, found, faults);
            found.cdb_types = read_cdb_types(&text);
        }
        Some(SymbolFormat::Listing) => {
            found.is_complete = true;
            listing::read_listing(file.name, &text, found, faults);
        }
        None => {
            let cause = || {
                format!("{}, wanted an SDCC .map, .cdb, .rst or .lst, or a .m51 of Keil", describe_content(file.bytes))
            };
            faults.error(
                "SYM001",
                Pos::default(),
                cause,
                "give the linker's map (.map, .m51), the .cdb of a --debug build or a .rst",
            );
        }
    }
}

enum SymbolFormat {
    Map,
    Keil,
    Cdb,
    Listing,
}

/// Guesses the format of a file by its first lines, and if they are ambiguous by its extension.
fn guess_format(file: &SymbolFile, text: &str) -> Option<SymbolFormat> {
    if file.bytes.contains(&0) || file.bytes.starts_with(b":") {
        return None;
    }
    let mut heads = text.lines().filter(|line| !line.trim().is_empty()).take(8);
    let first = heads.next()?.trim_start_matches('\u{c}');
    if first.starts_with("ASxxxx Linker") {
        return Some(SymbolFormat::Map);
    }
    if keil::m51::is_m51_map(first) {
        return Some(SymbolFormat::Keil);
    }
    if first.starts_with("ASxxxx Assembler") || gutter::gutter_width(first).is_some() {
        return Some(SymbolFormat::Listing);
    }
    if matches!(first.as_bytes(), [b'M' | b'F' | b'S' | b'T' | b'L', b':', ..]) {
        return Some(SymbolFormat::Cdb);
    }
    match extension(file.name).as_str() {
        "map" if heads.any(map::is_heading) => Some(SymbolFormat::Map),
        "cdb" => Some(SymbolFormat::Cdb),
        "rst" | "lst" => Some(SymbolFormat::Listing),
        _ => None,
    }
}

fn read_gputils(file: &SymbolFile, found: &mut CollectedSymbols, faults: &mut FaultList) {
    if gputils::cod::is_cod_file(file.bytes) {
        found
            .processors
            .extend(gputils::cod::processor_name(file.bytes).map(|chip| (file.name.to_owned(), into_printable(chip))));
        return gputils::cod::read_cod(file.bytes, found, faults);
    }
    let text = String::from_utf8_lossy(file.bytes);
    if text.trim().is_empty() {
        return report_empty(faults);
    }
    let mut heads = text.lines().map(|line| line.trim_start_matches('\u{c}'));
    let (first, second) = (heads.next().unwrap_or(""), heads.next().unwrap_or(""));
    match gputils::listing::guess_listing(first, second, file.bytes) {
        _ if file.bytes.contains(&0) || file.bytes.starts_with(b":") => {
            report_unknown_format(file, "a .cod, .map or .lst of gputils", faults)
        }
        Some(listing) => gputils::listing::read_listing(listing, file.name, &text, found, faults),
        None if gputils::map::is_map_file(first) => gputils::map::read_map(&text, found, faults),
        None => report_unknown_format(file, "a .cod, .map or .lst of gputils", faults),
    }
}

fn report_unknown_format(file: &SymbolFile, wanted: &str, faults: &mut FaultList) {
    let cause = || format!("{}, wanted {wanted}", describe_content(file.bytes));
    faults.error(
        "SYM001",
        Pos::default(),
        cause,
        "give the files that the linker writes with the image: .cod, .map (--map), .lst",
    );
}

fn report_empty(faults: &mut FaultList) {
    let cause = || "there is nothing but white space in the file".to_owned();
    faults.error("SYM002", Pos::default(), cause, "look at the messages of the tool that wrote it");
}

fn describe_content(bytes: &[u8]) -> &'static str {
    match bytes {
        [0x7F, b'E', b'L', b'F', ..] => "the file is an ELF image, which has its own symbols",
        [b':', ..] => "the file is an Intel HEX image, which has no symbols",
        _ if bytes.contains(&0) => "the file is binary",
        _ => "the kind of the file is unknown",
    }
}

fn extension(name: &str) -> String {
    name.rsplit_once('.').map_or("", |(_, extension)| extension).to_ascii_lowercase()
}

/// A line of a text with its number.
#[derive(Debug, Clone, Copy)]
struct NumberedLine<'a> {
    /// The number, from 1.
    number: u32,
    /// The text without line end and trailing spaces.
    line: &'a str,
}

/// The lines of a text with their numbers, from 1, without line ends and trailing spaces.
fn numbered_lines(text: &str) -> impl Iterator<Item = NumberedLine<'_>> {
    (1..).zip(text.lines()).map(|(number, line)| NumberedLine { number, line: line.trim_end() })
}

/// The position of `part`, which must be a slice of `line`, in the line.
fn pos_of(number: u32, line: &str, part: &str) -> Pos {
    let before = (part.as_ptr() as usize).saturating_sub(line.as_ptr() as usize);
    let column = line.get(..before).map_or(0, |text| text.chars().count());
    Pos::new(number, column as u32 + 1, part.chars().count().max(1) as u32)
}

/// At most 60 characters of a text, for messages.
fn shortened(text: &str) -> String {
    text.chars().take(60).collect()
}

/// Reports what is wrong with `part` of a line of a map: the file is damaged.
fn report_damaged(number: u32, line: &str, part: &str, what: impl fmt::Display, faults: &mut FaultList) {
    let cause = || format!("{what}: {:?}", shortened(part.trim_start()));
    faults.error("SYM009", pos_of(number, line, part), cause, "the file is cut off or damaged: link again");
}
