//! How a scenario ended.

use diag::{Diagnostic, Pos, Severity};

use crate::codes;

/// How a scenario ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// All steps were done and everything was as expected.
    Passed,
    /// An expectation was not met.
    Failed,
    /// Something was still waited for at the limit.
    NoResult,
}

/// How a scenario ended, and where.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Verdict {
    /// How.
    pub outcome: Outcome,
    /// The step that decided, from 1 in the order of the file; nothing where it passed.
    pub step: Option<usize>,
    /// That step in words.
    pub text: String,
    /// Its place.
    pub pos: Pos,
    /// What was found, without the moment; empty where it passed.
    pub why: String,
    /// When.
    pub tick: u64,
    /// The same in words.
    pub moment: String,
}

impl Verdict {
    /// That of no scenario: it passes.
    #[must_use]
    pub fn nothing() -> Verdict {
        let (text, why, moment) = (String::new(), String::new(), String::new());
        Verdict { outcome: Outcome::Passed, step: None, text, pos: Pos::default(), why, tick: 0, moment }
    }

    /// The complaint about a scenario that did not pass, at its step.
    #[must_use]
    pub fn complaint(&self, file: &str) -> Option<Diagnostic> {
        let (code, hint) = match self.outcome {
            Outcome::Passed => return None,
            Outcome::Failed => (codes::FAILED, "look at the machine at that moment"),
            Outcome::NoResult => (codes::LIMIT, "give it a `within`, or raise the limit"),
        };
        let cause = format!("{} at {}", self.why, self.moment);
        Some(Diagnostic::new(Severity::Error, code, file, self.pos, cause, hint))
    }
}
