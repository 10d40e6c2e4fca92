//! Reads scenario and waveform files, and reports the verdict of a scenario.

use diag::Diagnostic;
use scenario::{Scenario, ScenarioOutcome, ScenarioStep, ScenarioVerdict, StepAction, Waveform};

use crate::shared::fail::{VerbFailure, exit};
use crate::shared::report::{FileTexts, MessageStyle, report_diagnostics};
use crate::shared::{input, output};

/// A parsed scenario and its text.
pub struct ScenarioFile {
    /// The scenario.
    pub scenario: Scenario,
    text: Vec<u8>,
}

/// The outcome of a played scenario.
pub struct PlayedScenario<'a> {
    /// Number of steps in the file.
    pub steps: usize,
    /// The verdict.
    pub verdict: &'a ScenarioVerdict,
}

/// Reads a scenario file.
pub fn read_scenario(file: &str) -> Result<ScenarioFile, VerbFailure> {
    let bytes = input::read_bytes(file)?;
    match scenario::parse_bytes(file, &bytes) {
        Ok(scenario) => Ok(ScenarioFile { scenario, text: bytes }),
        Err(faults) => Err(VerbFailure::Refused(faults, FileTexts::one(file, bytes))),
    }
}

/// A parsed waveform and its text.
pub struct WaveStimulus {
    waveform: Waveform,
    file: String,
    text: Vec<u8>,
}

/// Reads a waveform file.
pub fn read_waveform(file: &str) -> Result<WaveStimulus, VerbFailure> {
    let text = input::read_bytes(file)?;
    match scenario::read_vcd(file, &text) {
        Ok(waveform) => Ok(WaveStimulus { waveform, file: file.to_owned(), text }),
        Err(fault) => Err(VerbFailure::Refused(vec![fault], FileTexts::one(file, text))),
    }
}

impl WaveStimulus {
    /// Returns true if the waveform has a wire of this name.
    pub fn has_wire(&self, wire: &str) -> bool {
        self.waveform.wires.iter().any(|name| name == wire)
    }

    /// Returns the stimuli of the wires that `wanted` accepts, and warnings.
    pub fn scenario(&self, wanted: &mut dyn FnMut(&str) -> bool) -> Result<(Scenario, Vec<Diagnostic>), VerbFailure> {
        self.waveform.to_scenario(wanted).map_err(|faults| self.binding_failure(faults))
    }

    /// Returns the failure that the waveform does not fit the machine.
    pub fn binding_failure(&self, faults: Vec<Diagnostic>) -> VerbFailure {
        VerbFailure::Refused(faults, FileTexts::one(&self.file, self.text.clone()))
    }
}

/// Returns the exit code of a verdict.
pub fn verdict_exit_code(outcome: ScenarioOutcome) -> u8 {
    match outcome {
        ScenarioOutcome::Passed => exit::OK,
        ScenarioOutcome::Failed => exit::FAILED,
        ScenarioOutcome::NoResult => exit::LIMIT,
    }
}

impl ScenarioFile {
    /// Returns the failure that the scenario does not fit the machine.
    pub fn binding_failure(&self, faults: Vec<Diagnostic>) -> VerbFailure {
        VerbFailure::Refused(faults, self.texts())
    }

    /// Returns its text, for drawing diagnostics.
    pub fn texts(&self) -> FileTexts {
        FileTexts::one(&self.scenario.file, self.text.clone())
    }

    /// Returns its number of steps; steps inside a repetition count once.
    pub fn steps(&self) -> usize {
        fn count(steps: &[ScenarioStep]) -> usize {
            let inner = |step: &ScenarioStep| match &step.action {
                StepAction::Repeat(_, steps) => count(steps),
                _ => 0,
            };
            steps.iter().map(|step| 1 + inner(step)).sum()
        }
        count(&self.scenario.steps)
    }

    /// Returns the verdict as one line of text.
    pub fn verdict_line(&self, played: &PlayedScenario<'_>) -> String {
        let PlayedScenario { steps, verdict } = played;
        let file = &self.scenario.file;
        match (verdict.outcome, verdict.step) {
            (ScenarioOutcome::Passed, _) => format!("{file}: passed, {steps} step(s), up to {}\n", verdict.tick_text),
            (outcome, step) => {
                let step =
                    step.map_or_else(String::new, |step| format!(" in step {step} of {steps}, `{}`", verdict.text));
                format!("{file}: {}{step}, at {}\n", emu_check::outcome_name(outcome), verdict.tick_text)
            }
        }
    }

    /// Returns the verdict as JSON.
    pub fn verdict_json(&self, verdict: &ScenarioVerdict) -> serde_json::Value {
        serde_json::json!({
            "file": self.scenario.file,
            "verdict": emu_check::outcome_name(verdict.outcome),
            "steps": self.steps(),
            "step": verdict.step,
            "why": (!verdict.why.is_empty()).then_some(&verdict.why),
        })
    }

    /// Reports the verdict next to the result of a run, and returns the exit code.
    ///
    /// The exit code `of_run` counts if it is a fault of the program, if the scenario passed, or if the run
    /// failed before the scenario ended.
    pub fn report_beside_run(
        &self,
        verdict: &ScenarioVerdict,
        (of_run, printed): (u8, bool),
        style: &MessageStyle,
    ) -> Result<u8, VerbFailure> {
        let code = self.report_verdict(&PlayedScenario { steps: self.steps(), verdict }, printed, style)?;
        let failed = of_run == exit::FAULT || of_run == exit::FAILED && code == exit::LIMIT;
        Ok(if failed || code == exit::OK { of_run } else { code })
    }

    /// Reports the verdict and returns the exit code. The verdict goes to standard output, or to standard
    /// error if `printed` says that standard output has another result.
    pub fn report_verdict(
        &self,
        played: &PlayedScenario<'_>,
        printed: bool,
        style: &MessageStyle,
    ) -> Result<u8, VerbFailure> {
        if let Some(complaint) = played.verdict.to_diagnostic(&self.scenario.file) {
            report_diagnostics(style, &[complaint], &self.texts());
        }
        let line = self.verdict_line(played);
        if printed {
            output::print_to_stderr(&line);
        } else {
            output::print(line)?;
        }
        Ok(verdict_exit_code(played.verdict.outcome))
    }
}
