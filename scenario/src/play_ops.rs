//! A scenario on one machine: names are identifiers, times are ticks, steps are ops in a row.

use std::sync::Arc;

use diag::Pos;

use crate::model::Comparison;
use crate::world::{OutputReading, ScenarioInput};

/// Something gets a value; of what is toggled somewhere, its number among those and the level.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct InputWrite {
    pub input: ScenarioInput,
    pub level: Option<(usize, bool)>,
}

/// Something that is looked at, and what it should be.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct OutputCheck {
    pub output: usize,
    pub compare: Comparison,
    /// For messages.
    pub name: String,
    pub wanted: String,
}

impl OutputCheck {
    /// The reading is what it should be.
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

/// All of these.
pub(crate) type OutputChecks = Arc<[OutputCheck]>;

/// A piece of a line to be told.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum LogPiece {
    Text(String),
    Value(usize),
}

/// What is done in a moment.
#[derive(Debug, Clone)]
pub(crate) enum PlayAction {
    Write(Vec<InputWrite>),
    /// Numbers of toggled bits.
    Toggle(Vec<usize>),
    /// Values, each so many ticks after the first.
    Ramp(Arc<[(u64, Vec<InputWrite>)]>),
    Send(Vec<u8>),
    Check(OutputChecks),
    Log(Vec<LogPiece>),
    Snapshot(String),
    Power,
}

impl PlayAction {
    /// It is done at its time, between two instructions, and neither decides anything nor changes what a step goes by: it tells, or
    /// writes memory.
    pub(crate) fn is_independent(&self) -> bool {
        match self {
            PlayAction::Log(_) => true,
            PlayAction::Write(puts) => puts.iter().all(|put| !put.input.can_be_queued && put.level.is_none()),
            _ => false,
        }
    }

    /// The toggled bits whose level it goes by or gives.
    pub(crate) fn toggled_bits(&self) -> Box<dyn Iterator<Item = usize> + '_> {
        let written_bit = |put: &InputWrite| put.level.map(|(bit, _)| bit);
        match self {
            PlayAction::Write(puts) => Box::new(puts.iter().filter_map(written_bit)),
            PlayAction::Ramp(values) => Box::new(values.iter().flat_map(|(_, puts)| puts).filter_map(written_bit)),
            PlayAction::Toggle(bits) => Box::new(bits.iter().copied()),
            _ => Box::new(std::iter::empty()),
        }
    }

    /// It can be told to the machine before its time.
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

/// An op.
#[derive(Debug, Clone)]
pub(crate) enum PlayOp {
    /// Up to so many ticks after power-up, or after the start of the round.
    At(u64),
    /// So many ticks behind the op before.
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
    /// From now on, or in a window, the checks hold, or never do.
    Guard {
        checks: OutputChecks,
        wanted: bool,
        window: Option<(u64, u64)>,
    },
    /// So many rounds up to the next [`PlayOp::RepeatEnd`] of this depth.
    Repeat(u64),
    RepeatEnd,
}

/// An op, and the step that it is of.
#[derive(Debug, Clone)]
pub(crate) struct PlayLine {
    pub op: PlayOp,
    pub step: usize,
}

/// A step, for messages.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct StepInfo {
    pub pos: Pos,
    /// What it does, in words.
    pub text: String,
}
