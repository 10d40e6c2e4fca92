//! The ops of a bound scenario: names are identifiers, times are ticks, and steps are a flat list of ops.

use std::sync::Arc;

use diag::Pos;

use crate::model::Comparison;
use crate::world::{OutputReading, ScenarioInput};

/// A write to an input; for a toggled input, `level` is its index among those and the level written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct InputWrite {
    pub input: ScenarioInput,
    pub level: Option<(usize, bool)>,
}

/// A check of an output against an expected value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct OutputCheck {
    /// Identifier of the output.
    pub output: usize,
    pub compare: Comparison,
    /// The name as written, for messages.
    pub name: String,
    /// The expected value or comparison as written, for messages.
    pub wanted: String,
}

impl OutputCheck {
    /// True if the reading is as expected.
    pub(crate) fn is_met(&self, reading: OutputReading) -> bool {
        match (self.compare, reading) {
            (Comparison::Floating, reading) => reading == OutputReading::Floating,
            (Comparison::Equal(wanted), OutputReading::Value(value)) => value == wanted,
            (Comparison::NotEqual(other), OutputReading::Value(value)) => value != other,
            (Comparison::Within(low, high), OutputReading::Value(value)) => (low..=high).contains(&value),
            (_, OutputReading::Floating) => false,
        }
    }
}

/// Checks that must hold at the same time.
pub(crate) type OutputChecks = Arc<[OutputCheck]>;

/// A part of a line to log: text, or the value of an output.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum LogPiece {
    Text(String),
    Value(usize),
}

/// An action that takes no time.
#[derive(Debug, Clone)]
pub(crate) enum PlayAction {
    Write(Vec<InputWrite>),
    /// Inverts the toggled inputs with these indices.
    Toggle(Vec<usize>),
    /// Writes, each with its delay in ticks after the start.
    Ramp(Arc<[(u64, Vec<InputWrite>)]>),
    Send(Vec<u8>),
    Check(OutputChecks),
    Log(Vec<LogPiece>),
    Snapshot(String),
    Power,
}

impl PlayAction {
    /// True if the action is executed at its own time without effect on the steps: it only logs, or writes
    /// memory, and no step depends on that.
    pub(crate) fn is_independent(&self) -> bool {
        match self {
            PlayAction::Log(_) => true,
            PlayAction::Write(puts) => puts.iter().all(|put| !put.input.can_be_queued && put.level.is_none()),
            _ => false,
        }
    }

    /// The toggled inputs whose level the action reads or sets.
    pub(crate) fn toggled_bits(&self) -> Box<dyn Iterator<Item = usize> + '_> {
        let written_bit = |put: &InputWrite| put.level.map(|(bit, _)| bit);
        match self {
            PlayAction::Write(puts) => Box::new(puts.iter().filter_map(written_bit)),
            PlayAction::Ramp(values) => Box::new(values.iter().flat_map(|(_, puts)| puts).filter_map(written_bit)),
            PlayAction::Toggle(bits) => Box::new(bits.iter().copied()),
            _ => Box::new(std::iter::empty()),
        }
    }

    /// True if the machine can accept the action before its time.
    pub(crate) fn can_be_queued(&self, bits: &[[ScenarioInput; 2]]) -> bool {
        match self {
            PlayAction::Write(puts) => puts.iter().all(|put| put.input.can_be_queued),
            PlayAction::Toggle(which) => {
                which.iter().filter_map(|bit| bits.get(*bit)).flatten().all(|input| input.can_be_queued)
            }
            PlayAction::Ramp(_) | PlayAction::Send(_) => true,
            PlayAction::Check(_) | PlayAction::Log(_) | PlayAction::Snapshot(_) | PlayAction::Power => false,
        }
    }
}

/// An op of a bound scenario. Times are in ticks.
#[derive(Debug, Clone)]
pub(crate) enum PlayOp {
    /// Waits until this time after power-up or after the start of the round.
    At(u64),
    /// Waits this long after the previous op.
    After(u64),
    Do(PlayAction),
    Every {
        period: u64,
        times: Option<u64>,
        until: Option<u64>,
        act: PlayAction,
    },
    Wait(OutputChecks, Option<u64>),
    ExpectBytes(Vec<u8>, Option<u64>),
    /// Checks that must hold, or never hold: from now on, or in a window.
    Guard {
        checks: OutputChecks,
        wanted: bool,
        window: Option<(u64, u64)>,
    },
    /// Repeats the ops up to the matching [`PlayOp::RepeatEnd`] this many times.
    Repeat(u64),
    RepeatEnd,
}

/// An op, and the index of its step.
#[derive(Debug, Clone)]
pub(crate) struct PlayLine {
    pub op: PlayOp,
    pub step: usize,
}

/// A step as messages show it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct StepInfo {
    pub pos: Pos,
    /// Description of the step.
    pub text: String,
}
