//! Reads listings of SDCC's assembler: `.lst` before linking, `.rst` with the final addresses from the
//! linker.
//!
//! Both have the same form. In a `.rst` addresses and bytes are final. The values of symbols that are defined
//! relative to `.` are still those of the assembler and are not used.

use crate::image::symbols::NumberedLine;
use std::collections::{HashMap, HashSet};

use diag::Pos;

use super::gutter::{self, GutterRow};
use super::names::{self, DebugRecord};
use super::{CollectedSymbols, FaultList, MemorySpace, SourceKind, extension, numbered_lines, pos_of, shortened};

/// Number of lines that can follow the first line of a page: radix, title, subtitle, and a blank one.
const PAGE_HEAD_LINES: u32 = 4;

/// Reads a listing; `file` is its name.
pub(super) fn read_listing(file: &str, text: &str, found: &mut CollectedSymbols, faults: &mut FaultList) {
    let Some(width) = text.lines().find_map(|line| gutter::gutter_width(line.trim_end())) else {
        let cause = || "no line of the file is line 1 of a listing".to_owned();
        return faults.error("SYM010", Pos::default(), cause, "give a listing of sdas8051, or link again");
    };
    let mut page = ListingReader::new(file, text, width);
    let mut head = 0;
    for NumberedLine { number, line } in numbered_lines(text) {
        if line.trim_start_matches('\u{c}').starts_with("ASxxxx Assembler") {
            head = PAGE_HEAD_LINES;
            continue;
        }
        let row = gutter::split_gutter(line, width);
        if head > 0 && row.is_none() {
            if matches!(line, "Symbol Table" | "Area Table") {
                break;
            }
            head -= 1;
            continue;
        }
        match row {
            Some(row) => {
                head = 0;
                if let Err(ListingFault { part, cause }) = page.row(number, line, row, found, faults) {
                    let hint = "give the .rst that the linker writes next to it";
                    return faults.error("SYM005", pos_of(number, line, part), || cause, hint);
                }
            }
            None if line.is_empty() => {}
            None => {
                let cause = || {
                    format!("the line does not belong to a listing in hexadecimal: {:?}", shortened(line.trim_start()))
                };
                faults.error(
                    "SYM010",
                    pos_of(number, line, line.trim_start()),
                    cause,
                    "the file is damaged: build again",
                );
            }
        }
        if faults.is_full() {
            return;
        }
    }
}

/// What is known about an area.
#[derive(Clone, Copy)]
struct ListingArea {
    mem: MemorySpace,
    absolute: bool,
}

/// The state between lines.
struct ListingReader<'t> {
    file: &'t str,
    /// Whether the file is a `.lst`, whose areas must be absolute.
    unlinked: bool,
    /// Whether a compiler wrote the source, so that comments name lines of C.
    compiled: bool,
    /// Whether the present line is under the heading of special function bits.
    bits: bool,
    module: &'t str,
    public: HashSet<&'t str>,
    areas: HashMap<&'t str, ListingArea>,
    name: &'t str,
    area: ListingArea,
    /// Lines of C that wait for the address of their code.
    waiting: Vec<(&'t str, u32)>,
}

/// The reason why a listing has no final addresses.
#[derive(Debug, Clone)]
struct ListingFault<'t> {
    /// The part of the line that shows it.
    part: &'t str,
    /// The reason, for the message.
    cause: String,
}

impl<'t> ListingReader<'t> {
    fn new(file: &'t str, text: &'t str, width: usize) -> Self {
        // A name can be declared public after its label.
        let sources =
            text.lines().filter_map(|line| Some(gutter::split_gutter(line.trim_end(), width)?.source.trim_start()));
        let public = sources.filter_map(|s| s.strip_prefix(".globl")).flat_map(|s| {
            let names = s.split_once(';').map_or(s, |(names, _)| names);
            names.split([',', ' ', '\t']).filter(|name| !name.is_empty())
        });
        ListingReader {
            file,
            unlinked: extension(file) == "lst",
            compiled: false,
            bits: false,
            module: "",
            public: public.collect(),
            areas: HashMap::new(),
            name: "_CODE",
            // The assembler's area without a name has no attributes and is therefore internal RAM.
            area: ListingArea { mem: MemorySpace::Idata, absolute: false },
            waiting: Vec::new(),
        }
    }

    /// Reads one line. The error is the part of the line, and the reason, for which the listing has no final
    /// addresses.
    fn row(
        &mut self,
        number: u32,
        line: &'t str,
        row: GutterRow<'t>,
        found: &mut CollectedSymbols,
        faults: &mut FaultList,
    ) -> Result<(), ListingFault<'t>> {
        if row.relocated {
            return Err(ListingFault {
                part: line.trim_start(),
                cause: "the listing has bytes that the linker will change".to_owned(),
            });
        }
        if row.more {
            return Ok(());
        }
        let Some(addr) = row.address else {
            self.without_address(number, line, row, found, faults);
            return Ok(());
        };
        if self.unlinked && !self.area.absolute {
            let cause = format!("the area {} is not absolute, so the addresses of a .lst are not final", self.name);
            return Err(ListingFault { part: line.trim_start(), cause });
        }
        if let Some(ListingLabel { name, public: global }) = parse_label(row.source) {
            let names = self.names(name, global);
            found.add_symbol(self.area.mem, addr, 0, names, pos_of(number, line, name), faults);
        }
        if row.bytes && self.area.mem == MemorySpace::Code {
            let pos = Pos::new(number, 0, 0);
            found.add_line(addr, SourceKind::Listing, self.file, number, pos, faults);
            for (file, line) in self.waiting.drain(..) {
                found.add_line(addr, SourceKind::C, file, line, pos, faults);
            }
        }
        Ok(())
    }

    fn without_address(
        &mut self,
        number: u32,
        line: &'t str,
        row: GutterRow<'t>,
        found: &mut CollectedSymbols,
        faults: &mut FaultList,
    ) {
        let source = row.source.trim_start();
        if let Some(comment) = source.strip_prefix(';') {
            self.comment(comment);
            return;
        }
        let mut words = source.split_whitespace();
        match (words.next(), row.value) {
            (Some(".module"), _) => self.module = words.next().unwrap_or_default(),
            (Some(".optsdcc"), _) => self.compiled = true,
            (Some(".area"), _) => self.set_scope(source.trim_start_matches(".area").trim()),
            (Some(_), Some(_)) => {
                // In a data area a symbol with a literal value is an address, elsewhere a constant.
                let given = parse_equate(source).filter(|_| self.area.mem != MemorySpace::Code && self.name != "_CODE");
                if let Some(ListingEquate { name, value }) = given {
                    let mem =
                        if self.area.mem == MemorySpace::Sfr && self.bits { MemorySpace::Bit } else { self.area.mem };
                    found.add_symbol(mem, value, 0, self.names(name, false), pos_of(number, line, name), faults);
                }
            }
            _ => {}
        }
    }

    fn names(&self, name: &str, global: bool) -> Vec<names::RankedName> {
        if global || self.public.contains(name) {
            names::linker_names(name)
        } else {
            names::local_names(self.module, name)
        }
    }

    fn comment(&mut self, text: &'t str) {
        match text.trim() {
            "special function bits" => self.bits = true,
            "special function registers" => self.bits = false,
            _ => {}
        }
        // `;<tab>main.c:22: ticks++;`
        let Some(place) = text.strip_prefix('\t').filter(|_| self.compiled) else { return };
        let found = place.match_indices(':').find_map(|(at, _)| {
            let (line, _) = place.get(at + 1..)?.split_once(':')?;
            let digits = !line.is_empty() && line.bytes().all(|b| b.is_ascii_digit());
            Some((place.get(..at)?, line.parse().ok().filter(|_| digits)?))
        });
        self.waiting.extend(found);
    }

    /// Parses `NAME (ATTRIBUTES)`. The attributes are present at least where the name occurs first.
    fn set_scope(&mut self, text: &'t str) {
        let (name, attributes) = text.split_once('(').map_or((text, None), |(n, a)| (n, Some(a)));
        let name = name.split([' ', '\t', ';']).next().unwrap_or_default();
        let attributes = attributes.and_then(|a| a.split_once(')')).map(|(a, _)| a.to_ascii_uppercase());
        let known = self.areas.get(name).copied();
        let area = match (attributes, known) {
            (Some(attributes), _) => {
                let has = |wanted| attributes.split(',').any(|a| a.trim() == wanted);
                let mem = if has("CODE") {
                    MemorySpace::Code
                } else if has("XDATA") {
                    MemorySpace::Xdata
                } else if has("BIT") {
                    MemorySpace::Bit
                } else if name.starts_with("RSEG") {
                    MemorySpace::Sfr
                } else {
                    MemorySpace::Idata
                };
                ListingArea { mem, absolute: has("ABS") }
            }
            (None, Some(known)) => known,
            (None, None) => ListingArea { mem: MemorySpace::Idata, absolute: false },
        };
        self.areas.insert(name, area);
        self.waiting.clear();
        (self.name, self.area) = (name, area);
    }
}

/// A label at the start of a source line.
#[derive(Debug, Clone, Copy)]
struct ListingLabel<'a> {
    /// The name without colons.
    name: &'a str,
    /// Whether two colons make it public.
    public: bool,
}

/// The label at the start of a line, and whether two colons make it public. Labels of digits and `$` are
/// local to a few lines and give `None`.
fn parse_label(source: &str) -> Option<ListingLabel<'_>> {
    let (name, rest) = source.trim_start().split_once(':')?;
    let fits = name.bytes().all(|b| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'.' | b'$'));
    let fits = fits && !name.is_empty() && !name.starts_with(|c: char| c.is_ascii_digit());
    fits.then_some(ListingLabel { name, public: rest.starts_with(':') })
}

/// A constant that a source line defines.
#[derive(Debug, Clone, Copy)]
struct ListingEquate<'a> {
    /// The name.
    name: &'a str,
    /// The value.
    value: u32,
}

/// Parses `name = 0x80`; `None` for debugging names.
fn parse_equate(source: &str) -> Option<ListingEquate<'_>> {
    let (name, value) = source.split_once('=')?;
    let value = value.trim_start_matches('=');
    let value = value.split_once(';').map_or(value, |(value, _)| value).trim();
    let name = name.trim();
    let value = match value.strip_prefix("0x").or_else(|| value.strip_prefix("0X")) {
        Some(digits) if digits.bytes().all(|b| b.is_ascii_hexdigit()) => u32::from_str_radix(digits, 16).ok()?,
        None if value.bytes().all(|b| b.is_ascii_digit()) => value.parse().ok()?,
        _ => return None,
    };
    let plain = !matches!(names::parse_debug_record(name), Some(DebugRecord::Symbol { .. }));
    (plain && !name.is_empty() && !name.contains(char::is_whitespace)).then_some(ListingEquate { name, value })
}
