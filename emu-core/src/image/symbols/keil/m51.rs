//! Reads the symbol table of the map that Keil's linkers (`.m51`, `.map`), and Intel's RL51 before them,
//! write beside a program.
//!
//! ```text
//!   BL51:  VALUE           TYPE          NAME     LX51: VALUE       REP       CLASS    TYPE      SYMBOL NAME
//!          -------         MODULE        MAIN           ---         MODULE    ---      ---       MAIN
//!          C:0183H         PUBLIC        tick           01000183H   PUBLIC    CODE     ---       tick
//!          B:00B0H.4       PUBLIC        Key            000000B0H.4 SFRSYM    DATA     BIT       Key
//!          -------         PROC          MAIN           01000183H   BLOCK     CODE     ---       LVL=0
//!          C:012EH         LINE#         85             01000183H   LINE      CODE     ---       #85
//!          -------         ENDPROC       MAIN           ---         BLOCKEND  ---      ---       LVL=0
//!          -------         ENDMOD        MAIN
//! ```
//! A page begins with the name of the linker. A line that is too long continues in the next one after `>>`.
//! The object file of each module is listed before the table, under INPUT MODULES INCLUDED. A line that
//! begins in the first column ends the table. There is always such a line, at least the size of the program.
//! LX51 ends a module where the next one begins.

use std::collections::HashMap;

use diag::Pos;

use super::{ScopeTracker, bit_address};
use crate::image::symbols::{
    CollectedSymbols, FaultList, MemorySpace, NumberedLine, numbered_lines, pos_of, report_damaged,
};

/// Returns true if a line is the first line of such a map.
pub(in crate::image::symbols) fn is_m51_map(first: &str) -> bool {
    is_page(first.trim_start_matches('\u{c}').trim_start())
}

fn is_page(line: &str) -> bool {
    ["LINKER/LOCATER", "RELOCATOR AND LINKER"].iter().any(|name| line.contains(name))
        && !line.starts_with(|c: char| c.is_ascii_digit())
}

/// The section of the map that a line belongs to.
#[derive(Clone, Copy, PartialEq, Eq)]
enum MapSection {
    Other,
    Modules,
    Symbols,
}

/// Reads a map.
pub(in crate::image::symbols) fn read_m51(text: &str, found: &mut CollectedSymbols, faults: &mut FaultList) {
    let lines = join_continuations(text);
    let mut part = MapSection::Other;
    let mut stems: HashMap<String, String> = HashMap::new();
    let (mut scopes, mut seen, mut rows, mut names) = (ScopeTracker::default(), false, 0u32, None);
    let (mut marked, mut message) = (false, false);
    for MapLine { number, text: line } in &lines {
        if faults.is_full() {
            return;
        }
        let line = line.trim_start_matches('\u{c}').trim_end();
        if line.is_empty() || is_page(line) {
            continue;
        }
        // Messages of the linker can be between any lines, followed by lines such as
        // `    SEGMENT: ?PR?RAMP?PUMP`.
        if line.starts_with("***") {
            message = true;
            continue;
        }
        message &= split_word(line).is_some_and(|FirstWord { word: first, .. }| first.ends_with(':'));
        if message {
            continue;
        }
        if !line.starts_with([' ', '\t']) {
            part = match line {
                _ if line.starts_with("INPUT MODULES INCLUDED") => MapSection::Modules,
                _ if line.starts_with("SYMBOL TABLE OF MODULE") => MapSection::Symbols,
                _ => MapSection::Other,
            };
            seen |= part == MapSection::Symbols;
            continue;
        }
        match part {
            MapSection::Other => {}
            MapSection::Modules => stems.extend(module_and_file(line).map(|found| (found.module, found.stem))),
            MapSection::Symbols => {
                if line.trim_start().starts_with("VALUE") {
                    names = line.find("SYMBOL NAME");
                } else if let Some(row) = MapRow::read(line, names) {
                    rows += 1;
                    marked |= row.class.is_none();
                    row.apply(*number, line, &stems, &mut scopes, found, faults);
                } else if !is_rule(line) {
                    report_damaged(
                        *number,
                        line,
                        line.trim_start(),
                        "the line does not belong to a table of symbols",
                        faults,
                    );
                }
            }
        }
    }
    let open = scopes.open_module().filter(|_| marked).map(str::to_owned);
    if part == MapSection::Symbols || open.is_some() {
        let last = lines.last().map_or(0, |MapLine { number, .. }| *number);
        let cause = || match &open {
            Some(module) => format!("the map ends within its table of symbols: module {module} has no ENDMOD"),
            None => "the map ends within its table of symbols".to_owned(),
        };
        faults.warning(
            "SYM009",
            Pos::new(last, 1, 1),
            cause,
            "names and lines are missing: link again, or get the map again",
        );
    }
    scopes.finish(found, faults);
    if (!seen || rows == 0) && faults.is_empty() {
        let cause = || "the map has no table of symbols".to_owned();
        let hint = "link without NOSYMBOLS, NOPUBLICS and NOLINES, and compile with DEBUG";
        faults.error("SYM016", Pos::default(), cause, hint);
    }
}

/// A line of a map with its continuation lines.
#[derive(Debug, Clone)]
struct MapLine {
    /// The number of its first line, from 1.
    number: u32,
    /// The text.
    text: String,
}

/// The lines, joined with their continuation lines.
fn join_continuations(text: &str) -> Vec<MapLine> {
    let mut lines: Vec<MapLine> = Vec::new();
    for NumberedLine { number, line } in numbered_lines(text) {
        match (line.strip_prefix(">>"), lines.last_mut()) {
            (Some(more), Some(last)) => last.text.push_str(more.trim_start()),
            _ => lines.push(MapLine { number, text: line.to_owned() }),
        }
    }
    lines
}

fn is_rule(line: &str) -> bool {
    line.bytes().all(|byte| matches!(byte, b'-' | b'=' | b' ' | b'\t'))
}

/// A module of a map that is not from a library.
#[derive(Debug, Clone)]
struct MapModule {
    /// The name of the module.
    module: String,
    /// The name of its file without extension.
    stem: String,
}

/// Parses `.\Objects\main.obj (MAIN)` into the name of the module and the stem of its file. A module of a
/// library gives `None`.
fn module_and_file(line: &str) -> Option<MapModule> {
    let (path, module) = line.trim().strip_suffix(')')?.rsplit_once(" (")?;
    let file = path.rsplit(['\\', '/']).next()?;
    let (stem, extension) = file.rsplit_once('.').unwrap_or((file, ""));
    let own = !extension.eq_ignore_ascii_case("lib") && !stem.is_empty();
    own.then(|| MapModule { module: module.to_owned(), stem: stem.to_owned() })
}

/// A line of the table.
struct MapRow<'t> {
    value: &'t str,
    kind: &'t str,
    /// Class and type, which only LX51 writes.
    class: Option<(&'t str, &'t str)>,
    name: &'t str,
}

impl<'t> MapRow<'t> {
    /// Splits a line; `names` is the column in which names begin, if LX51 has given it.
    fn read(line: &'t str, names: Option<usize>) -> Option<MapRow<'t>> {
        const BL51: &[&str] =
            &["MODULE", "ENDMOD", "PROC", "ENDPROC", "DO", "ENDDO", "SYMBOL", "PUBLIC", "LINE#", "SEGMENT", "EXTRN"];
        let FirstWord { word: value, rest } = split_word(line)?;
        // `*DEL*:00000000H`, `*SFR* 0000009EH`: LX51 marks what it removed, and in other tables also
        // registers.
        if value.starts_with('*') {
            return Some(MapRow { value: "---", kind: "", class: Some(("", "")), name: rest.trim() });
        }
        let FirstWord { word: kind, rest } = split_word(rest)?;
        let scope = value.bytes().all(|byte| byte == b'-');
        // In LX51's table a value has no memory prefix, and a rule has fewer than seven dashes.
        let lx51 = if scope { value.len() < 7 } else { !value.contains(':') };
        if !lx51 {
            return BL51.contains(&kind).then(|| MapRow { value, kind, class: None, name: rest.trim() });
        }
        let FirstWord { word: class, rest } = split_word(rest)?;
        let FirstWord { word: kind_of, rest } = split_word(rest)?;
        let known = scope || value.starts_with(|c: char| c.is_ascii_hexdigit() || c == 'R');
        // A type can have two words.
        let name = names.and_then(|at| line.get(at..)).unwrap_or(rest);
        known.then(|| MapRow { value, kind, class: Some((class, kind_of)), name: name.trim() })
    }

    fn apply(
        &self,
        number: u32,
        line: &str,
        stems: &HashMap<String, String>,
        scopes: &mut ScopeTracker,
        found: &mut CollectedSymbols,
        faults: &mut FaultList,
    ) {
        let pos = pos_of(number, line, if self.name.is_empty() { self.value } else { self.name });
        match self.kind {
            "MODULE" => {
                let stem = stems.get(self.name).map(String::as_str);
                return scopes.module(self.name, stem, found, faults);
            }
            "ENDMOD" => return scopes.end_module(),
            "PROC" => return scopes.function(self.name),
            "ENDPROC" => return scopes.end_function(),
            "DO" => return scopes.block(),
            "ENDDO" => return scopes.end_block(),
            "BLOCK" | "BLOCKEND" => {
                let level: usize = self.name.strip_prefix("LVL=").and_then(|n| n.parse().ok()).unwrap_or(0);
                scopes.leave_blocks(level.saturating_sub(1));
                return match (self.kind, level, self.parse_value()) {
                    // The outermost block is a function.
                    ("BLOCK", 0, Some(Ok(SymbolPlace::At(MemorySpace::Code, addr)))) => scopes.function_at(addr),
                    ("BLOCKEND", 0, _) => scopes.end_function(),
                    ("BLOCK", 1.., _) => scopes.block(),
                    _ => {}
                };
            }
            _ => {}
        }
        let place = match self.parse_value() {
            Some(Ok(place)) => place,
            // A register, an external name, or a memory that the chip lacks.
            None => return,
            Some(Err(what)) => return report_damaged(number, line, self.value, what, faults),
        };
        match (self.kind, place) {
            ("LINE#" | "LINE", SymbolPlace::At(MemorySpace::Code, addr)) => {
                match self.name.strip_prefix('#').unwrap_or(self.name).parse() {
                    Ok(line) => scopes.line(addr, line, pos),
                    Err(_) => report_damaged(number, line, self.name, "the number of a line is invalid", faults),
                }
            }
            ("PUBLIC" | "SFRSYM", SymbolPlace::At(mem, addr)) => {
                scopes.public(mem, addr, self.name, pos, found, faults)
            }
            ("SYMBOL", SymbolPlace::At(mem, addr)) => scopes.local(mem, addr, self.name, pos, found, faults),
            ("PUBLIC" | "SYMBOL", SymbolPlace::Number(value)) => found.unplaced.push((self.name.to_owned(), value)),
            _ => {}
        }
    }

    /// Parses the value; `None` if it is not an address or number.
    fn parse_value(&self) -> Option<Result<SymbolPlace, M51ValueError>> {
        if self.value.bytes().all(|byte| byte == b'-') {
            return None;
        }
        let (memory, digits) = match self.class {
            Some((class, kind)) => {
                // A register that holds a variable.
                if self.value.starts_with('R') {
                    return None;
                }
                let memory = match (class, kind) {
                    _ if matches!(self.kind, "LINE" | "BLOCK") => "C",
                    ("NUMBER", _) | ("---", _) => "N",
                    (_, "BIT") | ("BIT", _) => "B",
                    ("CODE" | "CONST" | "ECODE", _) => "C",
                    ("DATA", _) => "D",
                    ("IDATA", _) => "I",
                    ("XDATA" | "PDATA", _) => "X",
                    _ => return None,
                };
                (memory, self.value)
            }
            None => self.value.split_once(':')?,
        };
        Some(parse_place(memory, digits, self.class.is_some()))
    }
}

/// The meaning of a value.
enum SymbolPlace {
    At(MemorySpace, u32),
    Number(u32),
}

/// Error: a value of the table is no address and no number.
#[derive(Debug, Clone, Copy, thiserror::Error)]
enum M51ValueError {
    /// The digits are not hexadecimal, or the H after them is missing.
    #[error("the value is not a hexadecimal number with an H")]
    NotHexadecimal,
    /// What follows the point is not a number.
    #[error("the number of a bit is invalid")]
    BadBitNumber,
    /// The address is not one of a bit.
    #[error("no bit of the chip has this address")]
    NoSuchBit,
    /// The address is in a bank of code memory.
    #[error("the name is in a bank of code, and banks are not emulated")]
    CodeBank,
    /// The letter of the memory is not one of the linkers.
    #[error("the memory is unknown; wanted C, D, I, X, B or N")]
    UnknownMemory,
    /// An address of data memory is above FFh.
    #[error("the address is beyond internal RAM")]
    BeyondInternalRam,
}

/// Parses `0183H` in `C`, `00B0H.4` in `B`. LX51 writes the number of the memory above the 24 bits of the
/// address.
fn parse_place(memory: &str, digits: &str, long: bool) -> Result<SymbolPlace, M51ValueError> {
    let (digits, bit) = match digits.split_once('.') {
        Some((digits, bit)) => (digits, Some(bit.parse::<u32>().map_err(|_| M51ValueError::BadBitNumber)?)),
        None => (digits, None),
    };
    let digits = digits.strip_suffix('H').ok_or(M51ValueError::NotHexadecimal)?;
    if digits.is_empty() || !digits.bytes().all(|byte| byte.is_ascii_hexdigit()) {
        return Err(M51ValueError::NotHexadecimal);
    }
    let number = u32::from_str_radix(digits, 16).map_err(|_| M51ValueError::NotHexadecimal)?;
    let number = if long { number & 0xFF_FFFF } else { number };
    let mem = match memory {
        "N" => return Ok(SymbolPlace::Number(number)),
        "C" => MemorySpace::Code,
        "D" => MemorySpace::Sfr,
        "I" => MemorySpace::Idata,
        "X" => MemorySpace::Xdata,
        "B" => {
            let bit = bit_address(number, bit.unwrap_or(0)).ok_or(M51ValueError::NoSuchBit)?;
            return Ok(SymbolPlace::At(MemorySpace::Bit, bit));
        }
        // `B1`: a code bank.
        _ if memory.strip_prefix('B').is_some_and(|bank| bank.parse::<u32>().is_ok()) => {
            return Err(M51ValueError::CodeBank);
        }
        _ => return Err(M51ValueError::UnknownMemory),
    };
    if mem == MemorySpace::Sfr && number > 0xFF {
        return Err(M51ValueError::BeyondInternalRam);
    }
    Ok(SymbolPlace::At(mem, number))
}

/// The first word of a text and what follows.
#[derive(Debug, Clone, Copy)]
struct FirstWord<'a> {
    /// The word, at least one character.
    word: &'a str,
    /// The text after the word, with its spaces.
    rest: &'a str,
}

/// The first word of a text, and the rest after it.
fn split_word(text: &str) -> Option<FirstWord<'_>> {
    let text = text.trim_start();
    let end = text.find([' ', '\t']).unwrap_or(text.len());
    let (word, rest) = text.split_at(end);
    (!word.is_empty()).then_some(FirstWord { word, rest })
}
