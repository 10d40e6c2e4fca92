//! Shared helpers of these tests: programs from files and from a few rungs, and reports.

use emu_check::{CheckOptions, CheckReport, check};
use ladder::LadderProgram;

#[path = "../common/mod.rs"]
mod files;

pub use files::{beside, folder, parse, read};

/// A program with these rungs under a standard header: dialect 2.3, a cycle of 1 ms at 1 MHz.
pub fn rungs(file: &str, text: &str) -> LadderProgram {
    parse(file, &format!("LDmicro0.1\nCYCLE=1000\nCRYSTAL=1000000\nIO LIST\nEND\nPROGRAM\n{text}\n"))
}

/// Runs a check that must produce a report.
pub fn report(program: &LadderProgram, options: &CheckOptions) -> CheckReport {
    check(program, options, &mut |_, _| {})
        .unwrap_or_else(|faults| panic!("{}", faults.iter().map(|d| format!("{d}\n")).collect::<String>()))
}
