//! Reads listings: that of gplink, and that of gpasm for an absolute program.
//!
//! ```text
//!   gplink: address, word, disassembly, source
//!     000005   0ba4     decfsz  0x24, 0x1        loop  decfsz count,f
//!   gpasm: address, words, line, source
//!     0002   0BA0           00013 loop    decfsz COUNT,f
//! ```
//! gplink's listing has no names. gpasm's has a table of names that does not say what each of them is. Names
//! at the start of a line with a program address are labels.

use crate::image::symbols::NumberedLine;
use std::collections::BTreeMap;

use diag::Pos;

use super::super::{CollectedSymbols, FaultList, SourceKind, names, numbered_lines, pos_of, shortened};

/// Placeholders of gpasm for values that the linker fills in.
const OPEN_ADDRESSES: [&str; 2] = ["????", "??"];

/// The tool that wrote a listing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in super::super) enum GputilsListing {
    Linker,
    Assembler,
}

/// Recognises a listing by its first two lines.
pub(in super::super) fn guess_listing(first: &str, second: &str, bytes: &[u8]) -> Option<GputilsListing> {
    if first.starts_with("gpasm-") && first.contains("PAGE") {
        return Some(GputilsListing::Assembler);
    }
    // Maps begin with the same line.
    let head = String::from_utf8_lossy(bytes.get(..bytes.len().min(300))?);
    (first.starts_with("gplink-") && second.starts_with("Copyright") && head.contains("Listing File"))
        .then_some(GputilsListing::Linker)
}

/// Reads a listing; `file` is its name.
pub(in super::super) fn read_listing(
    listing: GputilsListing,
    file: &str,
    text: &str,
    found: &mut CollectedSymbols,
    faults: &mut FaultList,
) {
    match listing {
        GputilsListing::Linker => read_linker_listing(file, text, found, faults),
        GputilsListing::Assembler => read_assembler_listing(file, text, found, faults),
    }
}

/// The part of a line from one column to another, cut at the end of the line.
fn columns(line: &str, from: usize, to: usize) -> &str {
    line.get(from..to.min(line.len())).unwrap_or("")
}

fn parse_hex(text: &str, digits: usize) -> Option<u32> {
    let right = text.len() == digits && text.bytes().all(|b| b.is_ascii_hexdigit());
    if right { u32::from_str_radix(text, 16).ok() } else { None }
}

fn read_linker_listing(file: &str, text: &str, found: &mut CollectedSymbols, faults: &mut FaultList) {
    let mut lines = numbered_lines(text).skip_while(|NumberedLine { line, .. }| !line.starts_with("-------  -----"));
    if lines.next().is_none() {
        let cause = || "no line under the heads of the columns".to_owned();
        return faults.error("SYM010", Pos::default(), cause, "the file is cut off: link again");
    }
    for NumberedLine { number, line } in lines {
        if line.starts_with(' ') || line.is_empty() {
            continue;
        }
        let address = line.split(' ').next().unwrap_or("");
        match (parse_hex(address, 6), parse_hex(columns(line, 9, 13), 4)) {
            (Some(word), Some(_)) => super::add_line(word, SourceKind::Listing, file, number, found),
            _ => report_damaged(number, line, faults),
        }
        if faults.is_full() {
            return;
        }
    }
}

fn report_damaged(number: u32, line: &str, faults: &mut FaultList) {
    let cause = || format!("the line does not belong to a listing: {:?}", shortened(line));
    faults.error("SYM010", pos_of(number, line, line), cause, "the file is damaged: build again");
}

fn read_assembler_listing(file: &str, text: &str, found: &mut CollectedSymbols, faults: &mut FaultList) {
    let mut labels: BTreeMap<&str, (u32, Pos)> = BTreeMap::new();
    let mut table: Vec<(u32, &str)> = Vec::new();
    let (mut in_table, mut used, mut lines) = (false, false, 0);
    for NumberedLine { number, line } in numbered_lines(text) {
        let line = line.trim_start_matches('\u{c}');
        match line {
            "SYMBOL TABLE" => in_table = true,
            // An absolute program ends with a memory usage map; a module that is still to be linked does not.
            _ if line.starts_with("MEMORY USAGE MAP") => used = true,
            _ => {}
        }
        if used || line.is_empty() || line.starts_with("gpasm-") {
            continue;
        }
        if in_table {
            table.push((number, line));
            continue;
        }
        let Some(word) = parse_hex(columns(line, 0, 4), 4) else { continue };
        if OPEN_ADDRESSES.iter().any(|open| columns(line, 7, 21).contains(open)) {
            let cause = || "the listing has words that the linker will change".to_owned();
            let hint = "give the .lst and the .map that gplink writes (gplink --map)";
            return faults.error("SYM005", pos_of(number, line, columns(line, 7, 21)), cause, hint);
        }
        // Directives such as `org` have an address and no words.
        if !columns(line, 7, 21).trim().is_empty() {
            super::add_line(word, SourceKind::Listing, file, number, found);
            lines += 1;
        }
        let source = columns(line, 28, line.len());
        let end = source
            .find(|c: char| !(c.is_ascii_alphanumeric() || matches!(c, '_' | '?' | '.' | '@')))
            .unwrap_or(source.len());
        if let Some(label) = source.get(..end).filter(|label| !label.is_empty()) {
            labels.insert(label, (word, pos_of(number, line, label)));
        }
    }
    if !used {
        let cause = || {
            if lines == 0 { "the listing has no code" } else { "the listing is that of a module which is to be linked" }
        };
        let hint = "give the .lst and the .map that gplink writes (gplink --map)";
        return faults.error("SYM005", Pos::default(), || cause().to_owned(), hint);
    }
    for (number, line) in table.into_iter().skip(1) {
        let mut words = line.split_whitespace();
        let (Some(name), Some(value)) = (words.next(), words.next()) else { continue };
        if (name, value) == ("LABEL", "VALUE") || line == "SYMBOL TABLE" {
            continue;
        }
        match (parse_hex(value, 8), labels.get(name)) {
            // Directives (`__config`, `org`) in the column of labels are not names of the table.
            (Some(value), Some(&(word, pos))) if word == value => {
                super::add_label(value, names::linker_names(name), pos, found, faults);
            }
            (Some(value), _) => found.unplaced.push((name.to_owned(), value)),
            (None, _) => report_damaged(number, line, faults),
        }
    }
}
