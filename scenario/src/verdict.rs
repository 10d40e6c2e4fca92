//! How a scenario ended.

use diag::{Diagnostic, Pos, Severity};

use crate::codes;

/// How a scenario ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ScenarioOutcome {
    /// All steps were done and everything was as expected.
    Passed,
    /// An expectation was not met.
    Failed,
    /// Something was still waited for at the limit.
    NoResult,
}

/// How a scenario ended, and where.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ScenarioVerdict {
    /// How.
    pub outcome: ScenarioOutcome,
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
    pub tick_text: String,
}

impl ScenarioVerdict {
    /// That of no scenario: it passes.
    #[must_use]
    pub fn without_scenario() -> ScenarioVerdict {
        let (text, why, moment) = (String::new(), String::new(), String::new());
        ScenarioVerdict {
            outcome: ScenarioOutcome::Passed,
            step: None,
            text,
            pos: Pos::default(),
            why,
            tick: 0,
            tick_text: moment,
        }
    }

    /// The complaint about a scenario that did not pass, at its step.
    #[must_use]
    pub fn to_diagnostic(&self, file: &str) -> Option<Diagnostic> {
        let (code, hint) = match self.outcome {
            ScenarioOutcome::Passed => return None,
            ScenarioOutcome::Failed => (codes::FAILED, "look at the machine at that moment"),
            ScenarioOutcome::NoResult => (codes::LIMIT, "give it a `within`, or raise the limit"),
        };
        let cause = format!("{} at {}", self.why, self.tick_text);
        Some(Diagnostic::new(Severity::Error, code, file, self.pos, cause, hint))
    }
}
