//! The verdict of a scenario.

use diag::{Diagnostic, Pos, Severity};

use crate::codes;

/// The outcome of a scenario.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ScenarioOutcome {
    /// All steps were executed and all expectations were met.
    Passed,
    /// An expectation was not met.
    Failed,
    /// The scenario still waited for something at the limit.
    NoResult,
}

/// The outcome of a scenario, with the step and the reason.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ScenarioVerdict {
    /// The outcome.
    pub outcome: ScenarioOutcome,
    /// The step that decided the outcome, from 1 in file order; `None` if the scenario passed.
    pub step: Option<usize>,
    /// Description of that step.
    pub text: String,
    /// Position of that step.
    pub pos: Pos,
    /// The reason, without the time; empty if the scenario passed.
    pub why: String,
    /// The tick at which the scenario ended.
    pub tick: u64,
    /// That tick as text.
    pub tick_text: String,
}

impl ScenarioVerdict {
    /// The verdict of a run without a scenario: passed.
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

    /// The diagnostic of a scenario that did not pass, at the deciding step.
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
