//! Files of scenarios and of waveforms, and what is told of the end of a scenario.

use diag::Diagnostic;
use scenario::{Scenario, ScenarioOutcome, ScenarioStep, ScenarioVerdict, StepAction, Waveform};

use crate::shared::fail::{VerbFailure, exit};
use crate::shared::report::{FileTexts, MessageStyle, report_diagnostics};
use crate::shared::{input, output};

/// A scenario that was read, and its text.
pub struct ScenarioFile {
    /// The scenario.
    pub scenario: Scenario,
    text: Vec<u8>,
}

/// How one ended.
pub struct PlayedScenario<'a> {
    /// Steps of the file.
    pub steps: usize,
    /// The verdict.
    pub verdict: &'a ScenarioVerdict,
}

/// Reads a scenario.
pub fn read_scenario(file: &str) -> Result<ScenarioFile, VerbFailure> {
    let bytes = input::read_bytes(file)?;
    match scenario::parse_bytes(file, &bytes) {
        Ok(scenario) => Ok(ScenarioFile { scenario, text: bytes }),
        Err(faults) => Err(VerbFailure::Refused(faults, FileTexts::one(file, bytes))),
    }
}

/// A waveform that was read, and its text.
pub struct WaveStimulus {
    waveform: Waveform,
    file: String,
    text: Vec<u8>,
}

/// Reads a waveform.
pub fn read_waveform(file: &str) -> Result<WaveStimulus, VerbFailure> {
    let text = input::read_bytes(file)?;
    match scenario::read_vcd(file, &text) {
        Ok(waveform) => Ok(WaveStimulus { waveform, file: file.to_owned(), text }),
        Err(fault) => Err(VerbFailure::Refused(vec![fault], FileTexts::one(file, text))),
    }
}

impl WaveStimulus {
    /// It has a wire of this name.
    pub fn has_wire(&self, wire: &str) -> bool {
        self.waveform.wires.iter().any(|name| name == wire)
    }

    /// The stimuli of the wires that are `wanted`, and warnings.
    pub fn scenario(&self, wanted: &mut dyn FnMut(&str) -> bool) -> Result<(Scenario, Vec<Diagnostic>), VerbFailure> {
        self.waveform.to_scenario(wanted).map_err(|faults| self.binding_failure(faults))
    }

    /// The failure that the waveform does not fit the machine.
    pub fn binding_failure(&self, faults: Vec<Diagnostic>) -> VerbFailure {
        VerbFailure::Refused(faults, FileTexts::one(&self.file, self.text.clone()))
    }
}

/// The exit code of a verdict.
pub fn verdict_exit_code(outcome: ScenarioOutcome) -> u8 {
    match outcome {
        ScenarioOutcome::Passed => exit::OK,
        ScenarioOutcome::Failed => exit::FAILED,
        ScenarioOutcome::NoResult => exit::LIMIT,
    }
}

impl ScenarioFile {
    /// The failure that the scenario does not fit the machine.
    pub fn binding_failure(&self, faults: Vec<Diagnostic>) -> VerbFailure {
        VerbFailure::Refused(faults, self.texts())
    }

    /// Its text, for drawing.
    pub fn texts(&self) -> FileTexts {
        FileTexts::one(&self.scenario.file, self.text.clone())
    }

    /// Its steps, those of repetitions once.
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

    /// The verdict in a line.
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

    /// The verdict in a document.
    pub fn verdict_json(&self, verdict: &ScenarioVerdict) -> serde_json::Value {
        serde_json::json!({
            "file": self.scenario.file,
            "verdict": emu_check::outcome_name(verdict.outcome),
            "steps": self.steps(),
            "step": verdict.step,
            "why": (!verdict.why.is_empty()).then_some(&verdict.why),
        })
    }

    /// Tells the verdict beside that of a run, `of_run`, which counts where it is a fault of the program, where the
    /// scenario has passed, and where the run has failed before the scenario was over.
    pub fn report_beside_run(
        &self,
        verdict: &ScenarioVerdict,
        (of_run, printed): (u8, bool),
        terminal: &MessageStyle,
    ) -> Result<u8, VerbFailure> {
        let code = self.report_verdict(&PlayedScenario { steps: self.steps(), verdict }, printed, terminal)?;
        let failed = of_run == exit::FAULT || of_run == exit::FAILED && code == exit::LIMIT;
        Ok(if failed || code == exit::OK { of_run } else { code })
    }

    /// Tells the verdict: as the result, or where something else is the result, to the user. Gives the exit code.
    pub fn report_verdict(
        &self,
        played: &PlayedScenario<'_>,
        printed: bool,
        terminal: &MessageStyle,
    ) -> Result<u8, VerbFailure> {
        if let Some(complaint) = played.verdict.to_diagnostic(&self.scenario.file) {
            report_diagnostics(terminal, &[complaint], &self.texts());
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
