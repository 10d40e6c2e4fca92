//! Reads the map of SDCC's linker: areas with their symbols.
//!
//! ```text
//!   Area                                    Addr        Size        Decimal Bytes (Attributes)
//!   --------------------------------        ----        ----        ------- ----- ------------
//!   XSEG                                00000002    0000000B =          11. bytes (REL,CON,XDATA)
//!
//!         Value  Global                              Global Defined In Module
//!         -----  --------------------------------   ------------------------
//!   D:   00000002  _far_word                          main
//! ```
//! SDCC 2 writes `  0D:0002    _far_word` without a module.

use crate::image::symbols::NumberedLine;
use crate::image::symbols::names::RankedName;
use diag::Pos;

use super::names::{self, DebugRecord, NameRank};
use super::{
    CollectedSymbols, FaultList, MemorySpace, SourceKind, TRUNCATED_CODE, numbered_lines, pos_of, report_damaged,
};

/// The linker cuts names to this many characters, so a name of this length can be incomplete.
const NAME_COLUMN_WIDTH: usize = 32;

/// Returns true if a line is the heading of a table of areas.
pub(super) fn is_heading(line: &str) -> bool {
    line.starts_with("Area ") && line.contains("Addr")
}

/// Reads a map.
pub(super) fn read_map(text: &str, found: &mut CollectedSymbols, faults: &mut FaultList) {
    let mut radix = 16;
    let mut area: Option<MapArea> = None;
    let mut seen = false;
    let mut cut = 0u32;
    for NumberedLine { number, line } in numbered_lines(text) {
        if faults.is_full() {
            return;
        }
        let line = line.trim_start_matches('\u{c}');
        if ["Files Linked", "Libraries Linked", "User Base Address", "User Global"].iter().any(|t| line.starts_with(t))
        {
            break;
        }
        if line.is_empty() || line.starts_with("ASxxxx Linker") || is_heading(line) || is_rule(line) {
            continue;
        }
        if let Some(wanted) = radix_of(line) {
            radix = wanted;
        } else if line.starts_with("[ Bank") {
        } else if let Some(next) = MapArea::read(line) {
            area = Some(next);
            seen = true;
        } else if line.matches("Value").count() > 1 {
            let cause = || "the map has its symbols in columns, with names cut to 8 or 9 characters".to_owned();
            let hint = "link with the option for wide maps (-Wl-w; sdcc sets it by default)";
            return faults.error("SYM006", Pos::new(number, 0, 0), cause, hint);
        } else if line.trim_start().starts_with("Value") {
        } else if let Some(area) = &area {
            read_symbol(number, line, area, radix, &mut cut, found, faults);
        } else {
            report_damaged(number, line, line, "a line before the first area", faults);
        }
    }
    if !seen && faults.is_empty() {
        let cause = || "the map has no area".to_owned();
        faults.error("SYM009", Pos::default(), cause, "the file is cut off: link again");
    }
    if cut > 0 {
        let cause = || {
            format!(
                "{cut} names of {NAME_COLUMN_WIDTH} characters may be cut off by the linker; lines with such names are ignored"
            )
        };
        faults.warning(
            TRUNCATED_CODE,
            Pos::default(),
            cause,
            "give the .cdb or the .rst files too, which have them whole",
        );
    }
}

/// Returns true if a line has only dashes and spaces.
fn is_rule(line: &str) -> bool {
    line.contains('-') && line.bytes().all(|b| b == b'-' || b == b' ')
}

fn radix_of(line: &str) -> Option<u32> {
    match line.split_whitespace().next()? {
        // Old versions misspell the word.
        "Hexadecimal" | "Hexidecimal" => Some(16),
        "Octal" => Some(8),
        "Decimal" => Some(10),
        _ => None,
    }
}

/// An area of the linker.
struct MapArea {
    /// Memory of the area; `None` for absolute values, for which the map does not say what they are.
    mem: Option<MemorySpace>,
}

impl MapArea {
    /// Parses the line of an area: name, address, size, attributes.
    fn read(line: &str) -> Option<Self> {
        let (head, attributes) = line.split_once(" bytes (")?;
        let attributes = attributes.strip_suffix(')')?;
        let name = head.split_whitespace().next()?;
        let has = |wanted| attributes.split(',').any(|a| a == wanted);
        let mem = if has("CODE") {
            Some(MemorySpace::Code)
        } else if has("XDATA") {
            Some(MemorySpace::Xdata)
        } else if has("BIT") {
            Some(MemorySpace::Bit)
        } else if name == "." || name.contains(".ABS.") {
            None
        } else if name.starts_with("RSEG") {
            Some(MemorySpace::Sfr)
        } else {
            Some(MemorySpace::Idata)
        };
        Some(MapArea { mem })
    }
}

/// Parses the line of a symbol: memory, value, name, module.
fn read_symbol(
    number: u32,
    line: &str,
    area: &MapArea,
    radix: u32,
    cut: &mut u32,
    found: &mut CollectedSymbols,
    faults: &mut FaultList,
) {
    // The area gives the memory too. The prefix of the value is `C:`, `D:` or `B:`, in old maps `0D:`.
    let body = match line.split_once(':') {
        Some((page, rest)) if matches!(page.trim(), "B" | "C" | "D" | "0B" | "0C" | "0D") => rest,
        _ => line,
    };
    let mut words = body.split_whitespace();
    let (Some(value), Some(name)) = (words.next(), words.next()) else {
        return report_damaged(number, line, line, "wanted a value and a name", faults);
    };
    let digits = value.bytes().all(|b| b.is_ascii_alphanumeric());
    let Some(addr) = u32::from_str_radix(value, radix).ok().filter(|_| digits) else {
        return report_damaged(number, line, value, "the value is not a number", faults);
    };
    let module = words.next();
    if words.next().is_some() {
        return report_damaged(number, line, line, "wanted a value, a name and a module", faults);
    }
    let of_linker = module.is_none() && (name.starts_with("l_") || name.starts_with("s_"));
    if of_linker || name == ".__.ABS." {
        // Lengths and starts of areas are numbers that the linker makes, not addresses of the program.
        return;
    }
    let pos = pos_of(number, line, name);
    let may_be_cut = name.chars().count() >= NAME_COLUMN_WIDTH;
    *cut += u32::from(may_be_cut);
    match (names::parse_debug_record(name), area.mem) {
        (Some(_), _) if may_be_cut => {}
        // The debugging names of absolute values are listed in addition to their plain names.
        (Some(DebugRecord::End), _) | (Some(DebugRecord::Symbol { .. }), None) => {}
        (Some(DebugRecord::CLine { file, line }), _) => found.add_line(addr, SourceKind::C, file, line, pos, faults),
        (Some(DebugRecord::AsmLine { module, line }), _) => {
            found.add_line(addr, SourceKind::Asm, &format!("{module}.asm"), line, pos, faults);
        }
        (Some(DebugRecord::Symbol { scope, name, block, .. }), Some(mem)) => {
            found.add_symbol(mem, addr, 0, names::c_names(scope, name, block), pos, faults);
        }
        (None, Some(_)) if may_be_cut && looks_like_debug(name) => {}
        (None, Some(mem)) if may_be_cut => {
            found.add_symbol(
                mem,
                addr,
                0,
                vec![RankedName { rank: NameRank::Cut, name: name.to_owned() }],
                pos,
                faults,
            );
        }
        (None, Some(mem)) => found.add_symbol(mem, addr, 0, names::linker_names(name), pos, faults),
        (None, None) => found.unplaced.push((name.to_owned(), addr)),
    }
}

/// Returns true if a name can be the start of a debugging name whose end is cut off.
fn looks_like_debug(name: &str) -> bool {
    name.starts_with("XG$") || name.starts_with(['A', 'C', 'F', 'G', 'L', 'X']) && name.contains(['$', '.'])
}
