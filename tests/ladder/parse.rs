//! Parses programs from text, for the tests of several crates.

use ladder::LadderProgram;

/// The program as one of release 2.3 if its header says so and that release has all that it uses.
fn parse_as_release_23(file: &str, text: &str) -> Option<LadderProgram> {
    let options = ladder::ParseOptions { dialect: Some(ladder::LadderDialect::Ldmicro23) };
    let program = ladder::parse_with(file, text, options).ok()?.program;
    let is_sound = !ladder::check(&program).iter().any(|found| found.is_error());
    (is_sound && program.format == ladder::LdFormat::V01).then_some(program)
}

/// Parses a complete `.ld` text; diagnostics fail the test.
pub fn parse(file: &str, text: &str) -> LadderProgram {
    if let Some(program) = parse_as_release_23(file, text) {
        return program;
    }
    match ladder::parse(file, text) {
        Ok(parsed) => parsed.program,
        Err(faults) => panic!("{}", faults.iter().map(|d| format!("{d}\n")).collect::<String>()),
    }
}
