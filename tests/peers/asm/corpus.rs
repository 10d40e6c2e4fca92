//! Our own sources in the style of each assembler, which use the complete instruction table of its family and
//! our list of directives.
//!
//! The header of a file names its chip, and the messages that its assembler may print:
//!
//! ```text
//! ; chip: pic16f873
//! ; reports: 203 302
//! ; linked
//! ```
//!
//! The last line marks sources for gplink.

use emu_core::table::FoundRow;
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};

use emu_core::Chip;
use emu_core::table::find_row;
use emu_test_support::test_folder;

use crate::judges::{Cells, Judge, home};
use crate::ours;

/// A source of the corpus.
pub struct Source {
    pub judge: Judge,
    pub name: String,
    pub text: String,
    pub chip: &'static Chip,
    /// Numbers of the messages that the assembler may print.
    pub expected_codes: Vec<String>,
}

/// Returns the sources of an assembler, in the order of their names.
pub fn sources(judge: Judge) -> Vec<Source> {
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(home(judge)).expect("a corpus").map(|entry| entry.expect("a file").path()).collect();
    files.sort();
    let is_source = |f: &PathBuf| f.extension().is_some_and(|e| e == "asm" || e.eq_ignore_ascii_case("s"));
    files
        .into_iter()
        .filter(is_source)
        .map(|path| {
            let name = path.file_name().expect("a name").to_string_lossy().into_owned();
            let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{name}: {e}"));
            let head = |key: &str| text.lines().find_map(|l| l.strip_prefix("; ")?.strip_prefix(key)).map(str::trim);
            let chip = judge.chip(head("chip:").unwrap_or_else(|| panic!("{name} names no chip")));
            let expected_codes = head("reports:").unwrap_or("").split_whitespace().map(str::to_owned).collect();
            Source { judge, name, text, chip, expected_codes }
        })
        .collect()
}

impl Source {
    /// Returns the assembler's output. It must exist, and the assembler must print only messages that the
    /// header lists.
    fn judged(&self) -> Cells {
        // Tests that run in parallel assemble the same source, each in its own folder.
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let what = format!("{}/{}", self.judge.name(), self.name);
        let own = test_folder!(&format!("asm-{}/{what}", NUMBER.fetch_add(1, Ordering::Relaxed)));
        let verdict = self.judge.assemble(&home(self.judge), &self.name, self.chip, &own);
        let expected = |line: &&String| {
            self.expected_codes.iter().any(|n| line.contains(&format!("[{n}]")) || line.contains(&format!("[{n:0>3}]")))
        };
        let complaints: Vec<_> = verdict.said.iter().filter(|line| !expected(line)).collect();
        assert!(complaints.is_empty(), "{what}: {complaints:#?}");
        for n in &self.expected_codes {
            assert!(verdict.said.iter().any(|line| line.contains(&format!("[{n}]"))), "{what}: nothing about {n}");
        }
        verdict.cells.unwrap_or_else(|| panic!("{what}: nothing was written"))
    }
}

/// Returns the differences between two sets of cells. A cell that only one of them has counts as erased in
/// the other.
pub fn differences(chip: &Chip, theirs: &Cells, ours: &Cells) -> Vec<String> {
    let erased = |&(space, addr): &(&str, u32)| match space == chip.code_space {
        true => (chip.isa.erased_word >> (8 * (addr % chip.word_bytes))) as u8,
        false => 0xFF,
    };
    let all: BTreeSet<_> = theirs.keys().chain(ours.keys()).collect();
    let shown = |byte: Option<&u8>| byte.map_or("none".to_owned(), |b| format!("{b:02x}"));
    all.into_iter()
        .filter(|&cell| {
            let of = |cells: &Cells| cells.get(cell).copied().unwrap_or_else(|| erased(cell));
            of(theirs) != of(ours)
        })
        .map(|cell| {
            let (space, addr) = cell;
            let at = chip.code_address(addr / chip.word_bytes);
            format!("{space} {at:#06x}: theirs {}, ours {}", shown(theirs.get(cell)), shown(ours.get(cell)))
        })
        .collect()
}

#[test]
#[ignore = "needs as31, sdcc, gputils, binutils-avr and avr-libc: .ci/peers installs them"]
fn every_source_gives_the_bytes_of_its_assembler() {
    let mut wrong = Vec::new();
    for judge in Judge::ALL {
        let (mut files, mut bytes) = (0, 0);
        for source in sources(judge) {
            let theirs = source.judged();
            files += 1;
            bytes += theirs.len();
            let what = format!("{}/{} on {}", judge.name(), source.name, source.chip.name);
            match ours::cells(&source) {
                Ok(ours) => {
                    let differ = differences(source.chip, &theirs, &ours);
                    if !differ.is_empty() {
                        let shown = &differ[..differ.len().min(12)];
                        wrong.push(format!("{what}: {} bytes differ:\n  {}", differ.len(), shown.join("\n  ")));
                    }
                }
                Err(faults) => wrong.push(format!("{what}: refused:\n{faults}")),
            }
        }
        println!("{}: {files} sources, {bytes} bytes", judge.name());
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Returns the table rows in a program from address 0, decoded as an unbroken sequence of instructions where
/// it has bytes.
fn rows_in(chip: &Chip, cells: &Cells) -> BTreeSet<usize> {
    let bytes: Vec<(u32, u8)> =
        cells.iter().filter(|((s, _), _)| *s == chip.code_space).map(|((_, a), b)| (*a, *b)).collect();
    let step = chip.word_bytes;
    let word = |addr: u32| {
        let cell = |a: u32| cells.get(&(chip.code_space, a)).copied().map(u16::from);
        if step == 2 { Some(cell(addr)? | cell(addr + 1)? << 8) } else { cell(addr) }
    };
    let mut found = BTreeSet::new();
    let mut at = 0;
    let end = bytes.last().map_or(0, |b| b.0 + 1);
    while at < end {
        let words: Vec<u16> = (0..3).map_while(|i| word(at + i * step)).collect();
        at += step
            * match find_row(chip.isa.rows, chip.isa.word_bits, &words) {
                Some(FoundRow { index: row, .. }) if !words.is_empty() => {
                    found.insert(row);
                    chip.isa.rows[row].len()
                }
                _ => 1,
            };
    }
    found
}

/// Every row of every table has a line in the corpora of its family.
#[test]
#[ignore = "needs as31, sdcc, gputils, binutils-avr and avr-libc: .ci/peers installs them"]
fn every_row_has_a_line() {
    for judge in Judge::ALL {
        let mut found = BTreeSet::new();
        let all = sources(judge);
        for source in all.iter().filter(|s| s.name.starts_with("instructions")) {
            found.extend(rows_in(source.chip, &source.judged()));
        }
        let rows = all.first().expect("a source").chip.isa.rows;
        let missing: Vec<_> = (0..rows.len()).filter(|i| !found.contains(i)).map(|i| rows[i].name).collect();
        assert!(missing.is_empty(), "{}: no line for {missing:?}", judge.name());
        println!("{}: {} rows", judge.name(), found.len());
    }
}
