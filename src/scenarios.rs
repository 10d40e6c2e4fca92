//! Files of scenarios and of waveforms, and what is told of the end of a scenario.

use diag::Diagnostic;
use scenario::{Outcome, Scenario, Step, Verb, Verdict, Waveform};

use crate::fail::{Failure, exit};
use crate::report::{Terminal, Texts, report};
use crate::{input, output};

/// A scenario that was read, and its text.
pub struct File {
    /// The scenario.
    pub scenario: Scenario,
    text: Vec<u8>,
}

/// How one ended.
pub struct Played<'a> {
    /// Steps of the file.
    pub steps: usize,
    /// The verdict.
    pub verdict: &'a Verdict,
}

/// Reads a scenario.
pub fn read(file: &str) -> Result<File, Failure> {
    let bytes = input::bytes(file)?;
    match scenario::parse_bytes(file, &bytes) {
        Ok(scenario) => Ok(File { scenario, text: bytes }),
        Err(faults) => Err(Failure::Refused(faults, Texts::one(file, bytes))),
    }
}

/// A waveform that was read, and its text.
pub struct Wave {
    waveform: Waveform,
    file: String,
    text: Vec<u8>,
}

/// Reads a waveform.
pub fn waveform(file: &str) -> Result<Wave, Failure> {
    let text = input::bytes(file)?;
    match scenario::read_vcd(file, &text) {
        Ok(waveform) => Ok(Wave { waveform, file: file.to_owned(), text }),
        Err(fault) => Err(Failure::Refused(vec![fault], Texts::one(file, text))),
    }
}

impl Wave {
    /// It has a wire of this name.
    pub fn has(&self, wire: &str) -> bool {
        self.waveform.wires.iter().any(|name| name == wire)
    }

    /// The stimuli of the wires that are `wanted`, and warnings.
    pub fn scenario(&self, wanted: &mut dyn FnMut(&str) -> bool) -> Result<(Scenario, Vec<Diagnostic>), Failure> {
        self.waveform.scenario(wanted).map_err(|faults| self.refused(faults))
    }

    /// The failure that the waveform does not fit the machine.
    pub fn refused(&self, faults: Vec<Diagnostic>) -> Failure {
        Failure::Refused(faults, Texts::one(&self.file, self.text.clone()))
    }
}

/// The exit code of a verdict.
pub fn code(outcome: Outcome) -> u8 {
    match outcome {
        Outcome::Passed => exit::OK,
        Outcome::Failed => exit::FAILED,
        Outcome::NoResult => exit::LIMIT,
    }
}

impl File {
    /// The failure that the scenario does not fit the machine.
    pub fn refused(&self, faults: Vec<Diagnostic>) -> Failure {
        Failure::Refused(faults, self.texts())
    }

    /// Its text, for drawing.
    pub fn texts(&self) -> Texts {
        Texts::one(&self.scenario.file, self.text.clone())
    }

    /// Its steps, those of repetitions once.
    pub fn steps(&self) -> usize {
        fn count(steps: &[Step]) -> usize {
            let inner = |step: &Step| match &step.verb {
                Verb::Repeat(_, steps) => count(steps),
                _ => 0,
            };
            steps.iter().map(|step| 1 + inner(step)).sum()
        }
        count(&self.scenario.steps)
    }

    /// The verdict in a line.
    pub fn line(&self, played: &Played<'_>) -> String {
        let Played { steps, verdict } = played;
        let file = &self.scenario.file;
        match (verdict.outcome, verdict.step) {
            (Outcome::Passed, _) => format!("{file}: passed, {steps} step(s), up to {}\n", verdict.moment),
            (outcome, step) => {
                let step =
                    step.map_or_else(String::new, |step| format!(" in step {step} of {steps}, `{}`", verdict.text));
                format!("{file}: {}{step}, at {}\n", emu_check::word(outcome), verdict.moment)
            }
        }
    }

    /// The verdict in a document.
    pub fn document(&self, verdict: &Verdict) -> serde_json::Value {
        serde_json::json!({
            "file": self.scenario.file,
            "verdict": emu_check::word(verdict.outcome),
            "steps": self.steps(),
            "step": verdict.step,
            "why": (!verdict.why.is_empty()).then_some(&verdict.why),
        })
    }

    /// Tells the verdict beside that of a run, `of_run`, which counts where it is a fault of the program, where the
    /// scenario has passed, and where the run has failed before the scenario was over.
    pub fn judged(&self, verdict: &Verdict, (of_run, printed): (u8, bool), terminal: &Terminal) -> Result<u8, Failure> {
        let code = self.tell(&Played { steps: self.steps(), verdict }, printed, terminal)?;
        let failed = of_run == exit::FAULT || of_run == exit::FAILED && code == exit::LIMIT;
        Ok(if failed || code == exit::OK { of_run } else { code })
    }

    /// Tells the verdict: as the result, or where something else is the result, to the user. Gives the exit code.
    pub fn tell(&self, played: &Played<'_>, printed: bool, terminal: &Terminal) -> Result<u8, Failure> {
        if let Some(complaint) = played.verdict.complaint(&self.scenario.file) {
            report(terminal, &[complaint], &self.texts());
        }
        let line = self.line(played);
        if printed {
            output::tell(&line);
        } else {
            output::print(line)?;
        }
        Ok(code(played.verdict.outcome))
    }
}
