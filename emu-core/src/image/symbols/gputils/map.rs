//! Reads gplink's map. Only its table of symbols by name is read. Unlike a `.cod`, it also has the statics.
//!
//! ```text
//!                               Symbols - Sorted by Name
//!                      Name    Address   Location    Storage File
//!                 ---------  ---------  ---------  --------- ---------
//!                    start   0x000001    program     extern main.asm
//! ```

use crate::image::symbols::NumberedLine;
use diag::Pos;

use super::super::names;
use super::super::{CollectedSymbols, FaultList, numbered_lines, pos_of, report_damaged};
use super::cod::names_in_file;

/// Returns true if a line is the first line of a map.
pub(in super::super) fn is_map_file(first: &str) -> bool {
    first.starts_with("gplink-")
}

/// Reads a map.
pub(in super::super) fn read_map(text: &str, found: &mut CollectedSymbols, faults: &mut FaultList) {
    let mut lines =
        numbered_lines(text).skip_while(|NumberedLine { line, .. }| line.trim() != "Symbols - Sorted by Name");
    if lines.next().is_none() {
        let cause = || "the map has no table `Symbols - Sorted by Name`".to_owned();
        return faults.error("SYM009", Pos::default(), cause, "the file is cut off: link again");
    }
    for NumberedLine { number, line } in lines.skip(2) {
        if line.is_empty() || faults.is_full() {
            return;
        }
        let words: Vec<&str> = line.split_whitespace().collect();
        let (&[name, address, location, storage], file) = (match words.as_slice() {
            [four @ .., _] if words.len() == 5 => (four, words.last().copied()),
            four => (four, None),
        }) else {
            report_damaged(number, line, line, "wanted a name, an address, a location, a storage and a file", faults);
            continue;
        };
        let digits = address.strip_prefix("0x").filter(|d| d.bytes().all(|b| b.is_ascii_hexdigit()));
        let Some(addr) = digits.and_then(|digits| u32::from_str_radix(digits, 16).ok()) else {
            report_damaged(number, line, address, "the address is not a hexadecimal number of 32 bits", faults);
            continue;
        };
        let pos = pos_of(number, line, name);
        // Names that the linker makes, such as the `.direct` before every message, are not names of the
        // program.
        if name.starts_with('.') {
            continue;
        }
        let names = match (storage, file) {
            ("static", Some(file)) => names_in_file(file, name),
            ("extern", _) | ("static", None) => names::linker_names(name),
            _ => {
                report_damaged(number, line, storage, "the storage is neither `extern` nor `static`", faults);
                continue;
            }
        };
        match location {
            "program" => super::add_label(addr, names, pos, found, faults),
            "data" => super::add_data_symbol(addr, names, pos, found, faults),
            _ => report_damaged(number, line, location, "the location is neither `program` nor `data`", faults),
        }
    }
}
