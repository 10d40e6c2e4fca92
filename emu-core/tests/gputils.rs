//! Symbols, lines and messages of programs that gputils 1.4.0 built from the sources in `gputils/`, and
//! damaged files.

use emu_core::image::{
    SYMBOL_CODES, SimulatorMessage, SourceKind, SymbolFile, SymbolSpaces, Symbols, load_messages, load_symbols,
};
use emu_core::rng::Rng;
use emu_test_support::{run_tool, test_folder};

const DIR: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/gputils");

fn bytes(name: &str) -> Vec<u8> {
    std::fs::read(format!("{DIR}/{name}")).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// Reads the rows of a table: `columns` texts separated by bars; lines that begin with `#` are comments.
fn table(name: &str, columns: usize) -> Vec<Vec<String>> {
    let text = String::from_utf8(bytes(name)).unwrap();
    let lines = text.lines().filter(|line| !line.is_empty() && !line.starts_with('#'));
    let rows: Vec<Vec<String>> =
        lines.map(|line| line.splitn(columns, " | ").map(|cell| cell.trim().to_owned()).collect()).collect();
    assert!(rows.iter().all(|row| row.len() == columns), "{name}");
    rows
}

fn load(files: &[(String, Vec<u8>)]) -> Result<Symbols, Vec<String>> {
    let files: Vec<SymbolFile> = files.iter().map(|(name, bytes)| SymbolFile { name, bytes }).collect();
    let reported =
        |faults: Vec<diag::Diagnostic>| faults.iter().map(|d| format!("{} {} {}", d.file, d.code, d.cause)).collect();
    load_symbols(&files, SymbolSpaces::PIC16).map_err(reported)
}

fn good(names: &str) -> Symbols {
    let files: Vec<_> = names.split(' ').map(|name| (name.to_owned(), bytes(name))).collect();
    load(&files).unwrap_or_else(|e| panic!("{names}: {e:#?}"))
}

#[test]
fn symbols_are_where_the_linker_put_them() {
    for row in table("symbols.txt", 4) {
        let [files, space, name, addr] = row.as_slice() else { unreachable!() };
        let found = good(files).symbols;
        let found: Vec<String> =
            found.iter().filter(|s| s.space == space && s.name == *name).map(|s| format!("{:04X}", s.addr)).collect();
        let wanted = if addr == "-" { vec![] } else { vec![addr.clone()] };
        assert_eq!(found, wanted, "{row:?}");
    }
    let unplaced = good("absolute.cod").unplaced;
    assert!(unplaced.contains(&("LIMIT".to_owned(), 5)) && unplaced.contains(&("last".to_owned(), 0x7F)));
    assert_eq!(good("absolute.cod").processors_by_file, [("absolute.cod".to_owned(), "16f873".to_owned())]);
    assert!(good("main.map main.lst").processors_by_file.is_empty());
}

#[test]
fn lines_are_where_their_code_is() {
    for row in table("lines.txt", 4) {
        let [files, kind, addr, line] = row.as_slice() else { unreachable!() };
        let kind = if kind == "asm" { SourceKind::Asm } else { SourceKind::Listing };
        let found = good(files);
        let found = found.line_at(kind, u32::from_str_radix(addr, 16).unwrap());
        assert_eq!(found.map_or_else(|| "-".to_owned(), |l| format!("{}:{}", l.file, l.line)), *line, "{row:?}");
    }
}

#[test]
fn messages_are_in_their_order() {
    let message = |addr, kind, text: &str| SimulatorMessage { addr, kind, text: text.to_owned() };
    let wanted = [
        message(0x2103, 'a', "\"PASSED\""),
        message(0xA, 'e', "symbol turns=0"),
        message(0xA, 'C', "count = 7"),
        message(9, 'a', "count == 0, 'it counts down'"),
    ];
    let mut found = load_messages(&SymbolFile { name: "main.cod", bytes: &bytes("main.cod") }).unwrap();
    // Messages of one address are in the order of the source; the linker may place sections in any order.
    found.sort_by_key(|m| std::cmp::Reverse((m.addr, m.kind)));
    assert_eq!(found, wanted);
    assert_eq!(load_messages(&SymbolFile { name: "a", bytes: &bytes("absolute.cod") }), Ok(vec![]));
    assert!(load_messages(&SymbolFile { name: "a", bytes: b"hello" }).is_err());
}

/// Makes the content that a cell of `faults.txt` describes.
fn content(cell: &str) -> Vec<u8> {
    let Some(rest) = cell.strip_prefix('@') else { return cell.replace('⏎', "\n").replace('·', " ").into_bytes() };
    let (name, changes) = rest.split_once(' ').unwrap_or((rest, ""));
    let mut file = bytes(name);
    for change in changes.split(',').filter(|change| !change.is_empty()) {
        if let Some(length) = change.strip_prefix('<') {
            file.truncate(length.parse().unwrap());
        } else {
            let (at, digits) = change.split_once('=').unwrap();
            let at: usize = at.parse().unwrap();
            for (i, pair) in digits.as_bytes().chunks(2).enumerate() {
                file[at + i] = u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap();
            }
        }
    }
    file
}

#[test]
fn faults_have_a_cause() {
    let mut wrong = Vec::new();
    let mut reported = String::new();
    for row in table("faults.txt", 3) {
        let found = load(&[(row[0].clone(), content(&row[1]))]).err().unwrap_or_default();
        reported.push_str(&row[2]);
        if found != row[2].split(" == ").filter(|w| *w != "ok").collect::<Vec<_>>() {
            wrong.push((row, found));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    let docs = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/formats/gputils.md");
    let docs = std::fs::read_to_string(docs).unwrap_or_else(|e| panic!("{docs}: {e}"));
    for row in SYMBOL_CODES.iter().filter(|row| ("SYM013".."SYM016").contains(&row.code)) {
        assert!(reported.contains(row.code) && docs.contains(row.code), "{}", row.code);
    }
}

/// Any input must give symbols within their memories, or faults with known codes.
#[test]
fn damaged_files_are_answered() {
    let files = ["main.cod", "absolute.cod", "main.map", "main.lst", "absolute.lst", "module.lst"];
    let seed = 0xC0D_0001;
    let mut rng = Rng::new(seed);
    let (mut taken, mut refused) = (0, 0);
    for turn in 0..3000 {
        let name = files[turn % files.len()];
        let mut file = bytes(name);
        for _ in 0..=rng.below(4) {
            let here = rng.below(file.len().max(1) as u64) as usize;
            match rng.below(6) {
                0 => file.truncate(here),
                1 => file.truncate(here / 512 * 512),
                2 => file.insert(here, rng.below(256) as u8),
                // Damage to directories and table headers finds the most faults.
                3 if file.len() > 600 => file[400 + rng.below(112) as usize] = rng.below(12) as u8,
                _ if here < file.len() => file[here] = rng.below(256) as u8,
                _ => {}
            }
        }
        let _ = load_messages(&SymbolFile { name, bytes: &file });
        match load(&[(name.to_owned(), file)]) {
            Ok(symbols) => {
                taken += 1;
                let last = |space: &str| match space {
                    "flash" => 0x3FFF,
                    "eeprom" => 0xFF,
                    _ => 0x1FF,
                };
                for s in &symbols.symbols {
                    assert!(s.addr <= last(s.space), "seed {seed:#x} turn {turn}: {s:?}");
                }
            }
            Err(faults) => {
                refused += 1;
                for fault in &faults {
                    let known = SYMBOL_CODES.iter().any(|row| fault.contains(row.code));
                    assert!(known, "seed {seed:#x} turn {turn}: {fault}");
                }
            }
        }
    }
    assert!(taken > 300 && refused > 300, "{taken} taken, {refused} refused");
}

/// The sources, built again, give the same as the files in the folder.
#[test]
#[ignore = "needs gputils"]
fn the_files_are_those_of_gputils() {
    let folder = test_folder!("gputils");
    for name in ["absolute.asm", "main.asm", "sub.asm", "macros.inc"] {
        std::fs::copy(format!("{DIR}/{name}"), folder.join(name)).unwrap();
    }
    let run = |program: &str, args: &[&str]| run_tool(program, args, &folder);
    run("gpasm", &["absolute.asm"]);
    run("gpasm", &["-c", "main.asm"]);
    run("gpasm", &["-c", "sub.asm"]);
    run("gplink", &["--map", "-o", "main.hex", "main.o", "sub.o"]);
    for names in ["main.cod main.map main.lst", "absolute.cod absolute.lst"] {
        let fresh = names.split(' ').map(|name| (name.to_owned(), std::fs::read(folder.join(name)).unwrap()));
        assert_eq!(load(&fresh.collect::<Vec<_>>()).unwrap(), good(names));
    }
}
