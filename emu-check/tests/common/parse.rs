//! Programs from text.

use ladder::LadderProgram;

/// A whole `.ld` text; its faults fail the test.
pub fn parse(file: &str, text: &str) -> LadderProgram {
    match ladder::parse(file, text) {
        Ok(parsed) => parsed.program,
        Err(faults) => panic!("{}", faults.iter().map(|d| format!("{d}\n")).collect::<String>()),
    }
}
