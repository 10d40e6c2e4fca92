//! Helpers that the tests of this crate share: programs from text.

pub mod model;

use ladder::LadderProgram;
use ladder_eval::Evaluator;

/// Parses rungs under a standard head: dialect 2.3, a cycle of 10 ms.
pub fn rungs(text: &str) -> LadderProgram {
    parse(
        "test.ld",
        &format!("LDmicro0.1\nCYCLE=10000\nCRYSTAL=4000000\nBAUD=2400\n\nIO LIST\nEND\n\nPROGRAM\n{text}\n"),
    )
}

/// The program as one of release 2.3 if its header says so and that release has all that it uses.
fn parse_as_release_23(file: &str, text: &str) -> Option<LadderProgram> {
    let options = ladder::ParseOptions { dialect: Some(ladder::LadderDialect::Ldmicro23) };
    let program = ladder::parse_with(file, text, options).ok()?.program;
    let is_sound = !ladder::check(&program).iter().any(|found| found.is_error());
    (is_sound && program.format == ladder::LdFormat::V01).then_some(program)
}

/// Parses a complete `.ld` text; panics if it has errors.
pub fn parse(file: &str, text: &str) -> LadderProgram {
    if let Some(program) = parse_as_release_23(file, text) {
        return program;
    }
    match ladder::parse(file, text) {
        Ok(parsed) => parsed.program,
        Err(faults) => panic!("{}", faults.iter().map(|d| format!("{d}\n")).collect::<String>()),
    }
}

/// Creates the evaluator of a program; panics if the program is refused.
pub fn evaluator(program: &LadderProgram) -> Evaluator {
    Evaluator::new(program).unwrap_or_else(|refusal| panic!("{}: {refusal}", program.file))
}

/// Index of a symbol; panics if it does not exist.
pub fn index(eval: &Evaluator, name: &str) -> usize {
    eval.index(name).unwrap_or_else(|| panic!("no symbol `{name}`"))
}
