//! What operations read and write.

use std::collections::BTreeSet;

use crate::ir::{Bit, Cond, Logic, Op, Word};

/// What a list of operations touches.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Touched {
    /// Bits written.
    pub bits: BTreeSet<Bit>,
    /// Words written.
    pub words: BTreeSet<Word>,
    /// The accumulator is changed.
    pub acc: bool,
    /// Bits read.
    pub read: BTreeSet<Bit>,
}

impl Touched {
    /// One bit is written.
    #[must_use]
    pub fn bit(bit: Bit) -> Touched {
        Touched { bits: BTreeSet::from([bit]), ..Touched::default() }
    }

    /// The bit is read or written.
    #[must_use]
    pub fn uses(&self, bit: Bit) -> bool {
        self.bits.contains(&bit) || self.read.contains(&bit)
    }

    /// Adds a list.
    pub fn list(&mut self, ops: &[Op]) {
        ops.iter().for_each(|op| self.op(op));
    }

    /// Adds an operation.
    pub fn op(&mut self, op: &Op) {
        match op {
            Op::Acc(_) | Op::AndCompare(_) => self.acc = true,
            Op::Load { bit, .. } | Op::And { bit, .. } | Op::Or { bit, .. } => {
                self.acc = true;
                self.read.insert(*bit);
            }
            Op::Store { bit, .. } | Op::Put { bit, .. } => _ = self.bits.insert(*bit),
            Op::Rising(bit) | Op::Falling(bit) => {
                self.acc = true;
                self.bits.insert(*bit);
                self.read.insert(*bit);
            }
            Op::Move { dst, .. } | Op::Math { dst, .. } | Op::Lookup { dst, .. } => _ = self.words.insert(*dst),
            Op::ReadAdc { dst, .. } | Op::Recall { dst, .. } => _ = self.words.insert(*dst),
            Op::Receive { dst } | Op::Module { word: dst, .. } => {
                self.acc = true;
                self.words.insert(*dst);
            }
            Op::Persist { busy, .. } => _ = self.words.insert(*busy),
            Op::SetPwm { .. } | Op::Send { .. } => {}
            Op::Logic { dst, is } => {
                self.acc = true;
                self.bits.insert(*dst);
                match *is {
                    Logic::Copy(a) | Logic::Not(a) => self.read.extend([a]),
                    Logic::And(a, b) | Logic::Or(a, b) => self.read.extend([a, b]),
                }
            }
            Op::If { cond, then, otherwise } => {
                if let Cond::Bit(bit) = cond {
                    self.read.insert(*bit);
                }
                self.list(then);
                self.list(otherwise);
            }
        }
    }
}

/// Whether the accumulator is read by `ops` before they set it; `behind` if they do neither.
#[must_use]
pub fn acc_read(ops: &[&Op], behind: bool) -> bool {
    ops.iter().find_map(|op| of_one(op)).unwrap_or(behind)
}

/// Whether the accumulator as it is at their start is read by `ops`.
#[must_use]
pub fn reads_acc(ops: &[Op]) -> bool {
    ops.iter().find_map(of_one).unwrap_or(false)
}

/// True: reads it; false: sets it first; nothing: passes it on.
fn of_one(op: &Op) -> Option<bool> {
    match op {
        Op::Acc(_) | Op::Load { .. } | Op::Receive { .. } | Op::Logic { .. } => Some(false),
        Op::And { .. } | Op::Or { .. } | Op::AndCompare(_) | Op::Store { .. } => Some(true),
        Op::Rising(_) | Op::Falling(_) | Op::Module { .. } | Op::If { cond: Cond::Acc, .. } => Some(true),
        Op::If { then, otherwise, .. } => {
            let ways = [then, otherwise].map(|way| way.iter().find_map(of_one));
            match ways {
                [Some(true), _] | [_, Some(true)] => Some(true),
                [Some(false), Some(false)] => Some(false),
                _ => None,
            }
        }
        _ => None,
    }
}

/// How often a temporary is read by `ops` until it is written again; nothing where a branch reads or writes it.
#[must_use]
pub fn reads_of(bit: Bit, ops: &[&Op]) -> Option<u32> {
    let mut reads = 0;
    for op in ops {
        match op {
            Op::Load { bit: read, .. } | Op::And { bit: read, .. } | Op::Or { bit: read, .. } if *read == bit => {
                reads += 1
            }
            Op::Store { bit: written, .. } | Op::Put { bit: written, .. } if *written == bit => break,
            Op::If { .. } | Op::Logic { .. } | Op::Rising(_) | Op::Falling(_) => {
                let mut touched = Touched::default();
                touched.op(op);
                if touched.uses(bit) {
                    return None;
                }
            }
            _ => {}
        }
    }
    Some(reads)
}
