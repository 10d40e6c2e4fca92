//! Extracts the stimuli of a scenario that consists of stimuli at fixed times only.

use std::sync::Arc;

use diag::{Diagnostic, Severity};

use crate::bound_scenario::BoundScenario;
use crate::codes::NOT_TIMED;
use crate::error::ScenarioError;
use crate::play_ops::{InputWrite, PlayAction, PlayLine, PlayOp};
use crate::player::{PlayerState, ScenarioPlayer};
use crate::world::{OutputReading, ScenarioWorld};

/// A stimulus at a fixed time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum TimedStimulus {
    /// Sets the input with this identifier to its value.
    SetInput(usize),
    /// Starts to send bytes to the machine.
    Send(Vec<u8>),
}

impl BoundScenario {
    /// Checks that the scenario only does what comes from outside the machine, so that it can be repeated at
    /// the same times. `outside` says whether an input comes from outside.
    ///
    /// # Errors
    /// The steps that write a value inside the machine, take a snapshot, or switch the supply off and on.
    pub fn require_external_stimuli(&self, outside: &dyn Fn(usize) -> bool) -> Result<(), Vec<Diagnostic>> {
        let all = |puts: &[InputWrite]| puts.iter().all(|put| outside(put.input.id));
        let fits = |act: &PlayAction| match act {
            PlayAction::Write(puts) => all(puts),
            PlayAction::Ramp(values) => values.iter().all(|(_, puts)| all(puts)),
            PlayAction::Toggle(bits) => {
                bits.iter().filter_map(|bit| self.toggled_inputs.get(*bit)).flatten().all(|input| outside(input.id))
            }
            PlayAction::Power | PlayAction::Snapshot(_) => false,
            PlayAction::Send(_) | PlayAction::Check(_) | PlayAction::Log(_) => true,
        };
        let fault = |line: &PlayLine| {
            let (PlayOp::Do(act) | PlayOp::Every { act, .. }) = &line.op else { return None };
            let info = self.steps.get(line.step).filter(|_| !fits(act))?;
            let cause =
                format!("`{}` does more than drive what is outside, so the debugger cannot queue it", info.text);
            let hint = "leave the step out, or use `emu run --scenario`";
            Some(Diagnostic::new(Severity::Error, NOT_TIMED, &self.file, info.pos, cause, hint))
        };
        let faults: Vec<Diagnostic> = self.lines.iter().filter_map(fault).collect();
        if faults.is_empty() { Ok(()) } else { Err(faults) }
    }

    /// All stimuli with their ticks, in the order of execution.
    ///
    /// # Errors
    /// The first step that has no fixed time, expects something, or repeats without end.
    pub fn into_timed_stimuli(self) -> Result<Vec<(u64, TimedStimulus)>, Vec<Diagnostic>> {
        let act = |act: &PlayAction| !matches!(act, PlayAction::Check(_) | PlayAction::Snapshot(_) | PlayAction::Power);
        let fits = |op: &PlayOp| match op {
            PlayOp::At(_) | PlayOp::After(_) | PlayOp::Repeat(_) | PlayOp::RepeatEnd => true,
            PlayOp::Do(what) => act(what),
            PlayOp::Every { times, until, act: what, .. } => act(what) && (times.is_some() || until.is_some()),
            PlayOp::Wait(..) | PlayOp::ExpectBytes(..) | PlayOp::Guard { .. } => false,
        };
        if let Some(line) = self.lines.iter().find(|line| !fits(&line.op)) {
            let info = self.steps.get(line.step);
            let what = info.map_or("a step", |info| info.text.as_str());
            let cause = format!("`{what}` is not a stimulus at a fixed time");
            let pos = info.map_or(Default::default(), |info| info.pos);
            let hint = "leave the step out, or use `emu run --scenario`";
            return Err(vec![Diagnostic::new(Severity::Error, NOT_TIMED, &self.file, pos, cause, hint)]);
        }
        let file = self.file.clone();
        let mut player = ScenarioPlayer::new(Arc::new(self));
        let mut list = StimulusCollector::default();
        loop {
            match player.poll(&mut list) {
                PlayerState::WakeAt(tick) => list.now = tick,
                PlayerState::Done(verdict) => {
                    let complaint = verdict.to_diagnostic(&file);
                    return complaint.map_or(Ok(list.done), |complaint| Err(vec![complaint]));
                }
            }
        }
    }
}

/// A world that only collects stimuli.
#[derive(Default)]
struct StimulusCollector {
    now: u64,
    done: Vec<(u64, TimedStimulus)>,
}

impl ScenarioWorld for StimulusCollector {
    fn now(&self) -> u64 {
        self.now
    }

    fn set_input(&mut self, input: usize, at: u64) -> Result<(), ScenarioError> {
        self.done.push((at, TimedStimulus::SetInput(input)));
        Ok(())
    }

    fn read_output(&self, _: usize) -> OutputReading {
        OutputReading::Floating
    }

    fn send(&mut self, bytes: &[u8], at: u64) -> Result<(), ScenarioError> {
        self.done.push((at, TimedStimulus::Send(bytes.to_vec())));
        Ok(())
    }

    fn received(&self) -> &[u8] {
        &[]
    }

    fn power_cycle(&mut self) -> Result<(), ScenarioError> {
        Ok(())
    }

    fn snapshot(&mut self, _: &str) -> Result<(), ScenarioError> {
        Ok(())
    }

    fn log(&mut self, _: &str) {}

    fn describe_tick(&self, tick: u64) -> String {
        format!("tick {tick}")
    }
}
