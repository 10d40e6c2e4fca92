//! What an operation reads and writes.

use std::collections::HashSet;

use crate::ir::{Bit, Compare, Cond, Logic, Op, Value, Word};

/// Something that an operation reads or writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Cell {
    Acc,
    Bit(Bit),
    Word(Word),
    /// A part of the chip.
    Part,
}

/// What is read and what is written.
#[derive(Default)]
pub(super) struct Touched {
    pub reads: HashSet<Cell>,
    pub writes: HashSet<Cell>,
}

impl Touched {
    /// By these operations, one after the other.
    pub fn of<'a>(ops: impl IntoIterator<Item = &'a Op>) -> Touched {
        let mut touched = Touched::default();
        ops.into_iter().for_each(|op| touched.add(&mut op.clone()));
        touched
    }

    /// The two do not commute.
    pub fn meets(&self, other: &Touched) -> bool {
        let meets = |a: &HashSet<Cell>, b: &HashSet<Cell>| a.intersection(b).next().is_some();
        meets(&self.writes, &other.writes) || meets(&self.writes, &other.reads) || meets(&self.reads, &other.writes)
    }

    fn add(&mut self, op: &mut Op) {
        each(op, &mut |cell, write| {
            let cell = match cell {
                Slot::Acc => Cell::Acc,
                Slot::Bit(bit) => Cell::Bit(*bit),
                Slot::Word(word) => Cell::Word(*word),
                Slot::Part => Cell::Part,
            };
            _ = if write { self.writes.insert(cell) } else { self.reads.insert(cell) };
        });
    }
}

/// A cell where an operation names it.
pub(super) enum Slot<'a> {
    Acc,
    Bit(&'a mut Bit),
    Word(&'a mut Word),
    Part,
}

/// Calls `see` for everything that `op` and what lies within it reads (`false`) and writes (`true`).
pub(super) fn each(op: &mut Op, see: &mut dyn FnMut(Slot<'_>, bool)) {
    fn value(value: &mut Value, see: &mut dyn FnMut(Slot<'_>, bool)) {
        if let Value::Cell(word) = value {
            see(Slot::Word(word), false);
        }
    }
    fn compare(compare: &mut Compare, see: &mut dyn FnMut(Slot<'_>, bool)) {
        see(Slot::Word(&mut compare.a), false);
        value(&mut compare.b, see);
    }
    match op {
        Op::Acc(_) => see(Slot::Acc, true),
        Op::Load { bit, .. } => {
            see(Slot::Bit(bit), false);
            see(Slot::Acc, true);
        }
        Op::And { bit, .. } | Op::Or { bit, .. } => {
            see(Slot::Bit(bit), false);
            see(Slot::Acc, false);
            see(Slot::Acc, true);
        }
        Op::Store { bit, .. } => {
            see(Slot::Acc, false);
            see(Slot::Bit(bit), true);
        }
        Op::Put { bit, .. } => see(Slot::Bit(bit), true),
        Op::Rising(bit) | Op::Falling(bit) => {
            see(Slot::Bit(bit), false);
            see(Slot::Bit(bit), true);
            see(Slot::Acc, false);
            see(Slot::Acc, true);
        }
        Op::AndCompare(c) => {
            compare(c, see);
            see(Slot::Acc, false);
            see(Slot::Acc, true);
        }
        Op::Move { dst, src } => {
            value(src, see);
            see(Slot::Word(dst), true);
        }
        Op::Math { dst, a, b, .. } => {
            value(a, see);
            value(b, see);
            see(Slot::Word(dst), true);
        }
        Op::Logic { dst, is } => {
            match is {
                Logic::Copy(a) | Logic::Not(a) => see(Slot::Bit(a), false),
                Logic::And(a, b) | Logic::Or(a, b) => {
                    see(Slot::Bit(a), false);
                    see(Slot::Bit(b), false);
                }
            }
            see(Slot::Bit(dst), true);
        }
        Op::Lookup { dst, index, .. } => {
            see(Slot::Word(index), false);
            see(Slot::Word(dst), true);
        }
        Op::ReadAdc { dst, .. } => see(Slot::Word(dst), true),
        Op::SetPwm { duty: v } | Op::Send { value: v } => {
            value(v, see);
            see(Slot::Part, true);
        }
        Op::Receive { dst } => {
            see(Slot::Word(dst), true);
            see(Slot::Acc, true);
            see(Slot::Part, true);
        }
        Op::Recall { dst, .. } => {
            see(Slot::Part, false);
            see(Slot::Word(dst), true);
        }
        Op::Persist { src, busy, .. } => {
            see(Slot::Word(src), false);
            see(Slot::Word(busy), true);
            see(Slot::Part, true);
        }
        Op::Module { word, limit, .. } => {
            value(limit, see);
            see(Slot::Acc, false);
            see(Slot::Acc, true);
            see(Slot::Word(word), false);
            see(Slot::Word(word), true);
        }
        Op::If { cond, then, otherwise } => {
            match cond {
                Cond::Acc => see(Slot::Acc, false),
                Cond::Bit(bit) => see(Slot::Bit(bit), false),
                Cond::Compare(c) => compare(c, see),
            }
            then.iter_mut().chain(otherwise).for_each(|op| each(op, see));
        }
    }
}
