//! Files that are rejected, compared with `faults.txt`, and files with random damage.

use diag::Severity;
use emu_core::image::{MAX_REPORTED, SYMBOL_CODES};
use emu_core::rng::Rng;

use crate::{bytes, load, table};

/// Makes the content of a file from a cell of the table. `⏎` is a line break, `→` a tab, `↡` a form feed, `␀`
/// the byte 0, and `·` a space that must not be trimmed. `@` starts the name of a file in the folder.
fn content(cell: &str) -> Vec<u8> {
    match cell.strip_prefix('@') {
        Some(name) => bytes(name),
        None => {
            let text = cell.replace('⏎', "\n").replace('→', "\t").replace('↡', "\u{c}").replace('␀', "\0");
            text.replace('·', " ").into_bytes()
        }
    }
}

#[test]
fn faults_have_a_place_and_a_cause() {
    let mut wrong = Vec::new();
    for row in table("faults.txt", 3) {
        // Several files are separated by `+`, several expected diagnostics by `==`.
        let names = row[0].split(" + ").map(str::trim);
        let files: Vec<(String, Vec<u8>)> =
            names.zip(row[1].split(" + ")).map(|(name, cell)| (name.to_owned(), content(cell.trim()))).collect();
        let found = match load(&files) {
            Ok(symbols) => symbols.warnings,
            Err(faults) => faults,
        };
        let found: Vec<String> = found
            .iter()
            .map(|d| format!("{}:{}:{} {} {}", d.file, d.pos.line, d.pos.column, d.code, d.cause))
            .collect();
        let wanted: Vec<&str> = row[2].split(" == ").filter(|w| *w != "ok").collect();
        if found != wanted {
            wrong.push((row[..2].to_vec(), found));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn the_list_of_faults_has_an_end() {
    let text = format!("M:a\n{}", "S:x\n".repeat(MAX_REPORTED + 5));
    let found = load(&[("a.cdb".to_owned(), text.into_bytes())]).unwrap_err();
    assert_eq!(found.len(), MAX_REPORTED + 1);
    let last = found.last().unwrap();
    assert_eq!(
        (last.code, last.severity, last.cause.as_str()),
        ("SYM012", Severity::Note, "1 more faults are not shown")
    );
}

const FILES: &[&str] =
    &["small/main.map", "small/main.cdb", "small/main.rst", "small/nudge.rst", "small/nudge.lst", "absolute.lst"];

/// Any input must give symbols within their memories, or faults with known codes and positions in the file.
#[test]
fn damaged_files_are_answered() {
    let seed = 0x5DCC_0001;
    let mut rng = Rng::new(seed);
    let (mut taken, mut refused) = (0, 0);
    for turn in 0..1500 {
        let name = FILES[turn % FILES.len()];
        let file = damage(bytes(name), &mut rng);
        let lines = file.split(|&b| b == b'\n').count() as u32;
        match load(&[(name.to_owned(), file)]) {
            Ok(symbols) => {
                taken += 1;
                for s in symbols.symbols {
                    let end = if matches!(s.space, "code" | "xdata") { 0xFFFF } else { 0xFF };
                    assert!(s.addr <= end, "seed {seed:#x} turn {turn}: {s:?}");
                }
            }
            Err(faults) => {
                refused += 1;
                assert!(!faults.is_empty());
                for d in faults {
                    let known = SYMBOL_CODES.iter().any(|row| row.code == d.code);
                    assert!(known && d.pos.line <= lines && !d.hint.is_empty(), "seed {seed:#x} turn {turn}: {d:?}");
                }
            }
        }
    }
    assert!(taken > 100 && refused > 100, "{taken} taken, {refused} refused");
}

fn damage(mut file: Vec<u8>, rng: &mut Rng) -> Vec<u8> {
    let at = |rng: &mut Rng, len: usize| rng.below(len.max(1) as u64) as usize;
    for _ in 0..=rng.below(4) {
        let here = at(rng, file.len());
        match rng.below(6) {
            0 => file.truncate(here),
            1 => file.insert(here.min(file.len()), rng.below(256) as u8),
            2 if here < file.len() => drop(file.remove(here)),
            3 => {
                let end = (here + at(rng, 60)).min(file.len());
                let part = file.get(here..end).map_or_else(Vec::new, <[u8]>::to_vec);
                let into = at(rng, file.len() + 1).min(file.len());
                file.splice(into..into, part);
            }
            _ => {
                if let Some(byte) = file.get_mut(here) {
                    *byte = b"\n $:(){}0FZ,.\x80\xC3;"[at(rng, 15)];
                }
            }
        }
    }
    file
}
