//! What the tests of this crate share.
#![allow(dead_code, reason = "each test file uses its own part")]

use std::fs;
use std::path::{Path, PathBuf};

use emu_check::{Options, Report, check};
use ladder::Program;

/// A whole `.ld` text; its faults fail the test.
pub fn parse(file: &str, text: &str) -> Program {
    match ladder::parse(file, text) {
        Ok(parsed) => parsed.program,
        Err(faults) => panic!("{}", faults.iter().map(|d| format!("{d}\n")).collect::<String>()),
    }
}

/// Rungs under a standard head: dialect 2.3, a cycle of 1 ms at 1 MHz.
pub fn rungs(file: &str, text: &str) -> Program {
    parse(file, &format!("LDmicro0.1\nCYCLE=1000\nCRYSTAL=1000000\nIO LIST\nEND\nPROGRAM\n{text}\n"))
}

/// A program from a file.
pub fn read(path: &Path) -> Program {
    let text = fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    parse(&path.display().to_string(), &text)
}

/// A folder beside this crate.
pub fn beside(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// The programs in a folder beside this crate, sorted; none where there is no such folder.
pub fn folder(path: &str) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(beside(path)) else { return Vec::new() };
    let mut paths: Vec<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path())).collect();
    paths.retain(|path| path.extension().is_some_and(|e| e == "ld"));
    paths.sort();
    paths
}

/// A check with these options that must get as far as a report.
pub fn report(program: &Program, options: &Options) -> Report {
    check(program, options, &mut |_, _| {})
        .unwrap_or_else(|faults| panic!("{}", faults.iter().map(|d| format!("{d}\n")).collect::<String>()))
}
