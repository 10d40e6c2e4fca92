//! Helpers that the tests of this crate share: programs from text.

pub mod model;
#[path = "../../../../tests/ladder/parse.rs"]
mod shared;

use ladder::LadderProgram;
use ladder_eval::Evaluator;

pub use shared::parse;

/// Parses rungs under a standard head: dialect 2.3, a cycle of 10 ms.
pub fn rungs(text: &str) -> LadderProgram {
    parse(
        "test.ld",
        &format!("LDmicro0.1\nCYCLE=10000\nCRYSTAL=4000000\nBAUD=2400\n\nIO LIST\nEND\n\nPROGRAM\n{text}\n"),
    )
}

/// Creates the evaluator of a program; panics if the program is refused.
pub fn evaluator(program: &LadderProgram) -> Evaluator {
    Evaluator::new(program).unwrap_or_else(|refusal| panic!("{}: {refusal}", program.file))
}

/// Index of a symbol; panics if it does not exist.
pub fn index(eval: &Evaluator, name: &str) -> usize {
    eval.index(name).unwrap_or_else(|| panic!("no symbol `{name}`"))
}
