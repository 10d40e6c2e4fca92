//! gplink's map. Of its tables the symbols by name are read; it holds the statics too, which a `.cod` does not.
//!
//! ```text
//!                               Symbols - Sorted by Name
//!                      Name    Address   Location    Storage File
//!                 ---------  ---------  ---------  --------- ---------
//!                    start   0x000001    program     extern main.asm
//! ```

use diag::Pos;

use super::super::names;
use super::super::{Faults, Found, numbered, pos_of, short};
use super::cod::of_file;

/// True for the first line of a map.
pub(in super::super) fn is(first: &str) -> bool {
    first.starts_with("gplink-")
}

/// Reads a map.
pub(in super::super) fn read(text: &str, found: &mut Found, faults: &mut Faults) {
    let mut lines = numbered(text).skip_while(|(_, line)| line.trim() != "Symbols - Sorted by Name");
    if lines.next().is_none() {
        let cause = || "the map has no table `Symbols - Sorted by Name`".to_owned();
        return faults.error("SYM009", Pos::default(), cause, "the file is cut off: link anew");
    }
    for (number, line) in lines.skip(2) {
        if line.is_empty() || faults.full() {
            return;
        }
        let words: Vec<&str> = line.split_whitespace().collect();
        let (&[name, address, location, storage], file) = (match words.as_slice() {
            [four @ .., _] if words.len() == 5 => (four, words.last().copied()),
            four => (four, None),
        }) else {
            damaged(number, line, line, "wanted a name, an address, a location, a storage and a file", faults);
            continue;
        };
        let digits = address.strip_prefix("0x").filter(|d| d.bytes().all(|b| b.is_ascii_hexdigit()));
        let Some(addr) = digits.and_then(|digits| u32::from_str_radix(digits, 16).ok()) else {
            damaged(number, line, address, "the address is no hexadecimal number of 32 bits", faults);
            continue;
        };
        let pos = pos_of(number, line, name);
        // The linker's own names, such as the `.direct` before every message, are no names of the program.
        if name.starts_with('.') {
            continue;
        }
        let names = match (storage, file) {
            ("static", Some(file)) => of_file(file, name),
            ("extern", _) | ("static", None) => names::linked(name),
            _ => {
                damaged(number, line, storage, "the storage is neither `extern` nor `static`", faults);
                continue;
            }
        };
        match location {
            "program" => super::label(addr, names, pos, found, faults),
            "data" => super::data(addr, names, pos, found, faults),
            _ => damaged(number, line, location, "the location is neither `program` nor `data`", faults),
        }
    }
}

fn damaged(number: u32, line: &str, part: &str, what: &'static str, faults: &mut Faults) {
    let cause = || format!("{what}: {:?}", short(part.trim_start()));
    faults.error("SYM009", pos_of(number, line, part), cause, "the file is cut off or damaged: link anew");
}
