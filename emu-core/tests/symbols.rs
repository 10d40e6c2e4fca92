//! Symbols and lines of programs that SDCC 4.2.0 built from the sources in `symbols/`, and damaged files.

#[path = "symbols/damage.rs"]
mod damage;
#[path = "symbols/sdcc.rs"]
mod sdcc;

use std::collections::BTreeSet;

use diag::Diagnostic;
use emu_core::image::{SYMBOL_CODES, SourceKind, SymbolFile, SymbolSpaces, Symbols, load_symbols};

const DIR: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/symbols");

fn bytes(name: &str) -> Vec<u8> {
    std::fs::read(format!("{DIR}/{name}")).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// Reads the rows of a table: `columns` texts separated by bars; lines that begin with `#` are comments.
fn table(name: &str, columns: usize) -> Vec<Vec<String>> {
    let text = String::from_utf8(bytes(name)).unwrap();
    let lines = text.lines().filter(|line| !line.is_empty() && !line.starts_with('#'));
    let rows: Vec<Vec<String>> =
        lines.map(|line| line.splitn(columns, '|').map(|cell| cell.trim().to_owned()).collect()).collect();
    for row in &rows {
        assert_eq!(row.len(), columns, "{name}: {row:?}");
    }
    rows
}

fn load(files: &[(String, Vec<u8>)]) -> Result<Symbols, Vec<Diagnostic>> {
    let files: Vec<SymbolFile> = files.iter().map(|(name, bytes)| SymbolFile { name, bytes }).collect();
    load_symbols(&files, SymbolSpaces::MCS51)
}

/// Loads files of the folder; `names` are separated by spaces.
fn load_named(names: &str) -> Result<Symbols, Vec<Diagnostic>> {
    load(&names.split(' ').map(|name| (name.to_owned(), bytes(name))).collect::<Vec<_>>())
}

fn good(names: &str) -> Symbols {
    load_named(names).unwrap_or_else(|e| panic!("{names}: {e:#?}"))
}

#[test]
fn symbols_are_where_the_linker_put_them() {
    for row in table("symbols.txt", 5) {
        let [files, space, name, addr, size] = row.as_slice() else { unreachable!() };
        let symbols = good(files);
        let found: Vec<String> = symbols
            .symbols
            .iter()
            .filter(|s| s.space == space && s.name == *name)
            .map(|s| format!("{:04X} {}", s.addr, s.size))
            .collect();
        let wanted = if addr == "-" { vec![] } else { vec![format!("{addr} {size}")] };
        assert_eq!(found, wanted, "{row:?}");
    }
}

#[test]
fn lines_are_where_their_code_is() {
    for row in table("lines.txt", 4) {
        let [files, kind, addr, line] = row.as_slice() else { unreachable!() };
        let kind = match kind.as_str() {
            "C" => SourceKind::C,
            "asm" => SourceKind::Asm,
            _ => SourceKind::Listing,
        };
        let addr = u32::from_str_radix(addr, 16).unwrap();
        let symbols = good(files);
        let found = symbols.line_at(kind, addr).map_or_else(|| "-".to_owned(), |l| format!("{}:{}", l.file, l.line));
        assert_eq!(found, *line, "{row:?}");
    }
}

/// A name that a map cannot place is listed as unplaced, unless another file explains it.
#[test]
fn values_without_a_memory_are_not_guessed() {
    let unplaced = |files| good(files).unplaced;
    let pair = |name: &str, value| (name.to_owned(), value);
    let alone = [
        pair("_AUXR", 0x8E),
        pair("_LAMP", 0x97),
        pair("_P1", 0x90),
        pair("_RELOAD", 0xCCCA),
        pair("__XPAGE", 0xA0),
        pair("_door", 0x4000),
        pair("_fixed", 0x30),
        pair("_fixed_bit", 0x18),
    ];
    assert_eq!(unplaced("small/main.map"), alone);
    assert_eq!(unplaced("small/main.map small/main.cdb"), [pair("__XPAGE", 0xA0)]);
    assert_eq!(unplaced("small/main.rst small/main.map"), [pair("__XPAGE", 0xA0)]);
    assert_eq!(unplaced("small/main.cdb"), [pair("table", 0x600)]);
}

#[test]
fn the_order_of_files_does_not_matter() {
    let one = good("small/main.map small/main.cdb small/main.rst small/sensor.rst small/nudge.rst");
    let other = good("small/nudge.rst small/sensor.rst small/main.rst small/main.cdb small/main.map");
    assert_eq!(one, other);
    let names: BTreeSet<_> = one.symbols.iter().map(|s| (s.space, &s.name)).collect();
    assert_eq!(names.len(), one.symbols.len());
    assert!(one.lines.is_sorted() && one.lines.len() > 100);
}

/// Listings have the lines of C in comments, debugging records have them from the linker.
#[test]
fn listings_and_records_agree_on_lines_of_c() {
    let lines_of_c = |files: &str| {
        let lines = good(files).lines.into_iter().filter(|l| l.kind == SourceKind::C);
        lines.map(|l| (l.addr, l.file, l.line)).collect::<Vec<_>>()
    };
    let wanted = lines_of_c("small/main.cdb");
    assert!(wanted.len() > 30);
    assert_eq!(lines_of_c("small/main.rst small/sensor.rst"), wanted);
    assert_eq!(lines_of_c("small/main.map"), wanted);
}

/// Every code of SDCC's files occurs in a case of a table.
#[test]
fn every_code_has_a_case() {
    let rows = table("faults.txt", 3);
    let given: BTreeSet<&str> = rows.iter().filter_map(|row| row[2].split_whitespace().nth(1)).collect();
    // Codes from SYM013 on are for files of other tools; `gputils.rs` and `keil.rs` have their cases.
    let codes = SYMBOL_CODES.iter().map(|row| row.code).filter(|code| *code < "SYM013");
    let missing: Vec<&str> = codes.filter(|code| !given.contains(code)).collect();
    // The note needs a hundred other faults; `damage.rs` has its case.
    assert_eq!(missing, ["SYM012"]);
    let docs = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/formats/sdcc.md");
    let docs = std::fs::read_to_string(docs).unwrap_or_else(|e| panic!("{docs}: {e}"));
    assert!(SYMBOL_CODES.is_sorted_by(|a, b| a.code < b.code));
    for row in SYMBOL_CODES.iter().filter(|row| row.code < "SYM013") {
        assert!(docs.contains(row.code) && row.explain.len() > 60, "{}", row.code);
    }
}
