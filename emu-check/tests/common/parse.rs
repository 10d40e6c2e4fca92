//! Parses programs from text, for the integration tests.

use ladder::LadderProgram;

/// Parses a complete `.ld` text; diagnostics fail the test.
pub fn parse(file: &str, text: &str) -> LadderProgram {
    match ladder::parse(file, text) {
        Ok(parsed) => parsed.program,
        Err(faults) => panic!("{}", faults.iter().map(|d| format!("{d}\n")).collect::<String>()),
    }
}
