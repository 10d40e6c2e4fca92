//! Listings: gplink's, and that of gpasm where the program is absolute.
//!
//! ```text
//!   000005   0ba4     decfsz  0x24, 0x1        loop  decfsz count,f        gplink: address, word, disassembly, source
//!   0002   0BA0           00013 loop    decfsz COUNT,f                    gpasm: address, words, line, source
//! ```
//! gplink's listing has no names. gpasm's has a table of them, which does not say what each of them is; those that stand at
//! the beginning of a line with a program address are labels.

use std::collections::BTreeMap;

use diag::Pos;

use super::super::{Faults, Found, LineKind, names, numbered, pos_of, short};

/// What gpasm writes in place of what the linker will put there.
const OPEN: [&str; 2] = ["????", "??"];

/// Which listing it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in super::super) enum Listing {
    Linker,
    Assembler,
}

/// Tells by the first two lines.
pub(in super::super) fn kind(first: &str, second: &str, bytes: &[u8]) -> Option<Listing> {
    if first.starts_with("gpasm-") && first.contains("PAGE") {
        return Some(Listing::Assembler);
    }
    // Maps begin with the same line.
    let head = String::from_utf8_lossy(bytes.get(..bytes.len().min(300))?);
    (first.starts_with("gplink-") && second.starts_with("Copyright") && head.contains("Listing File"))
        .then_some(Listing::Linker)
}

/// Reads a listing; `file` is its name.
pub(in super::super) fn read(listing: Listing, file: &str, text: &str, found: &mut Found, faults: &mut Faults) {
    match listing {
        Listing::Linker => linker(file, text, found, faults),
        Listing::Assembler => assembler(file, text, found, faults),
    }
}

/// The part of a line from one column to another, as far as there is one.
fn columns(line: &str, from: usize, to: usize) -> &str {
    line.get(from..to.min(line.len())).unwrap_or("")
}

fn hex(text: &str, digits: usize) -> Option<u32> {
    let right = text.len() == digits && text.bytes().all(|b| b.is_ascii_hexdigit());
    if right { u32::from_str_radix(text, 16).ok() } else { None }
}

fn linker(file: &str, text: &str, found: &mut Found, faults: &mut Faults) {
    let mut lines = numbered(text).skip_while(|(_, line)| !line.starts_with("-------  -----"));
    if lines.next().is_none() {
        let cause = || "no line under the heads of the columns".to_owned();
        return faults.error("SYM010", Pos::default(), cause, "the file is cut off: link anew");
    }
    for (number, line) in lines {
        if line.starts_with(' ') || line.is_empty() {
            continue;
        }
        let address = line.split(' ').next().unwrap_or("");
        match (hex(address, 6), hex(columns(line, 9, 13), 4)) {
            (Some(word), Some(_)) => super::line(word, LineKind::Listing, file, number, found),
            _ => damaged(number, line, faults),
        }
        if faults.full() {
            return;
        }
    }
}

fn damaged(number: u32, line: &str, faults: &mut Faults) {
    let cause = || format!("the line is none of a listing: {:?}", short(line));
    faults.error("SYM010", pos_of(number, line, line), cause, "the file is damaged: build anew");
}

fn assembler(file: &str, text: &str, found: &mut Found, faults: &mut Faults) {
    let mut labels: BTreeMap<&str, (u32, Pos)> = BTreeMap::new();
    let mut table: Vec<(u32, &str)> = Vec::new();
    let (mut in_table, mut used, mut lines) = (false, false, 0);
    for (number, line) in numbered(text) {
        let line = line.trim_start_matches('\u{c}');
        match line {
            "SYMBOL TABLE" => in_table = true,
            // An absolute program ends with a map of what it uses, a module of one that is to be linked does not.
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
        let Some(word) = hex(columns(line, 0, 4), 4) else { continue };
        if OPEN.iter().any(|open| columns(line, 7, 21).contains(open)) {
            let cause = || "the listing has words that the linker will change".to_owned();
            let hint = "give the .lst and the .map that gplink writes (gplink --map)";
            return faults.error("SYM005", pos_of(number, line, columns(line, 7, 21)), cause, hint);
        }
        // Directives such as `org` have an address and no words.
        if !columns(line, 7, 21).trim().is_empty() {
            super::line(word, LineKind::Listing, file, number, found);
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
        match (hex(value, 8), labels.get(name)) {
            // The directives of a line (`__config`, `org`) stand where labels do, and are no names of the table.
            (Some(value), Some(&(word, pos))) if word == value => {
                super::label(value, names::linked(name), pos, found, faults);
            }
            (Some(value), _) => found.unplaced.push((name.to_owned(), value)),
            (None, _) => damaged(number, line, faults),
        }
    }
}
