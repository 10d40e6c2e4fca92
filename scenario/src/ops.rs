//! A scenario on one machine: names are identifiers, times are ticks, steps are ops in a row.

use std::sync::Arc;

use diag::Pos;

use crate::model::Compare;
use crate::world::{Input, Reading};

/// Something gets a value; of what is toggled somewhere, its number among those and the level.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Put {
    pub input: Input,
    pub level: Option<(usize, bool)>,
}

/// Something that is looked at, and what it should be.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Check {
    pub output: usize,
    pub compare: Compare,
    /// For messages.
    pub name: String,
    pub wanted: String,
}

impl Check {
    /// The reading is what it should be.
    pub(crate) fn holds(&self, reading: Reading) -> bool {
        match (self.compare, reading) {
            (Compare::Floating, reading) => reading == Reading::Floating,
            (Compare::Is(wanted), Reading::Value(value)) => value == wanted,
            (Compare::Not(other), Reading::Value(value)) => value != other,
            (Compare::Within(low, high), Reading::Value(value)) => (low..=high).contains(&value),
            (_, Reading::Floating) => false,
        }
    }
}

/// All of these.
pub(crate) type Checks = Arc<[Check]>;

/// A piece of a line to be told.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Piece {
    Text(String),
    Value(usize),
}

/// What is done in a moment.
#[derive(Debug, Clone)]
pub(crate) enum Act {
    Put(Vec<Put>),
    /// Numbers of toggled bits.
    Toggle(Vec<usize>),
    /// Values, each so many ticks after the first.
    Series(Arc<[(u64, Vec<Put>)]>),
    Send(Vec<u8>),
    Check(Checks),
    Log(Vec<Piece>),
    Snapshot(String),
    Power,
}

impl Act {
    /// It is done at its time, between two instructions, and neither decides anything nor changes what a step goes by: it tells, or
    /// writes memory.
    pub(crate) fn is_quiet(&self) -> bool {
        match self {
            Act::Log(_) => true,
            Act::Put(puts) => puts.iter().all(|put| !put.input.ahead && put.level.is_none()),
            _ => false,
        }
    }

    /// The toggled bits whose level it goes by or gives.
    pub(crate) fn bits(&self) -> Box<dyn Iterator<Item = usize> + '_> {
        let given = |put: &Put| put.level.map(|(bit, _)| bit);
        match self {
            Act::Put(puts) => Box::new(puts.iter().filter_map(given)),
            Act::Series(values) => Box::new(values.iter().flat_map(|(_, puts)| puts).filter_map(given)),
            Act::Toggle(bits) => Box::new(bits.iter().copied()),
            _ => Box::new(std::iter::empty()),
        }
    }

    /// It can be told to the machine before its time.
    pub(crate) fn ahead(&self, bits: &[[Input; 2]]) -> bool {
        match self {
            Act::Put(puts) => puts.iter().all(|put| put.input.ahead),
            Act::Toggle(which) => which.iter().filter_map(|bit| bits.get(*bit)).flatten().all(|input| input.ahead),
            Act::Series(_) | Act::Send(_) => true,
            Act::Check(_) | Act::Log(_) | Act::Snapshot(_) | Act::Power => false,
        }
    }
}

/// An op.
#[derive(Debug, Clone)]
pub(crate) enum Op {
    /// Up to so many ticks after power-up, or after the start of the round.
    At(u64),
    /// So many ticks behind the op before.
    After(u64),
    Do(Act),
    Every {
        period: u64,
        times: Option<u64>,
        until: Option<u64>,
        act: Act,
    },
    Wait(Checks, Option<u64>),
    Hear(Vec<u8>, Option<u64>),
    /// From now on, or in a window, the checks hold, or never do.
    Guard {
        checks: Checks,
        wanted: bool,
        window: Option<(u64, u64)>,
    },
    /// So many rounds up to the next [`Op::Again`] of this depth.
    Repeat(u64),
    Again,
}

/// An op, and the step that it is of.
#[derive(Debug, Clone)]
pub(crate) struct Line {
    pub op: Op,
    pub step: usize,
}

/// A step, for messages.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Info {
    pub pos: Pos,
    /// What it does, in words.
    pub text: String,
}
