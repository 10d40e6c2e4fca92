//! Finds the cells that operations read and write.

use std::collections::BTreeSet;

use crate::ir::{BitId, BranchCondition, IrOp, LogicOp, WordId};

/// Cells that a list of operations accesses.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TouchedCells {
    /// Bits that are written.
    pub bits: BTreeSet<BitId>,
    /// Words that are written.
    pub words: BTreeSet<WordId>,
    /// True if the accumulator is changed.
    pub acc: bool,
    /// Bits that are read.
    pub read: BTreeSet<BitId>,
    /// True if a jump may lead to code that reads and writes anything.
    pub leaves: bool,
}

impl TouchedCells {
    /// Cells of a write to one bit.
    #[must_use]
    pub fn bit(bit: BitId) -> TouchedCells {
        TouchedCells { bits: BTreeSet::from([bit]), ..TouchedCells::default() }
    }

    /// True if the bit is read or written.
    #[must_use]
    pub fn uses(&self, bit: BitId) -> bool {
        self.leaves || self.bits.contains(&bit) || self.read.contains(&bit)
    }

    /// Adds the accesses of a list.
    pub fn list(&mut self, ops: &[IrOp]) {
        ops.iter().for_each(|op| self.op(op));
    }

    /// Adds the accesses of an operation.
    pub fn op(&mut self, op: &IrOp) {
        match op {
            IrOp::SetAccumulator(_) | IrOp::AndCompare(_) => self.acc = true,
            IrOp::Load { bit, .. } | IrOp::And { bit, .. } | IrOp::Or { bit, .. } => {
                self.acc = true;
                self.read.insert(*bit);
            }
            IrOp::Store { bit, .. } | IrOp::SetBit { bit, .. } => _ = self.bits.insert(*bit),
            IrOp::Rising(bit) | IrOp::Falling(bit) => {
                self.acc = true;
                self.bits.insert(*bit);
                self.read.insert(*bit);
            }
            IrOp::Move { dst, .. } | IrOp::Math { dst, .. } | IrOp::Lookup { dst, .. } => _ = self.words.insert(*dst),
            IrOp::ReadAdc { dst, .. } | IrOp::ReadEeprom { dst, .. } => _ = self.words.insert(*dst),
            IrOp::Receive { dst } | IrOp::Module { word: dst, .. } => {
                self.acc = true;
                self.words.insert(*dst);
            }
            IrOp::WriteEeprom { busy, .. } => _ = self.words.insert(*busy),
            IrOp::WaitSent => {}
            IrOp::Transfer { dst, .. } => self.words.extend(dst),
            IrOp::SetPwm { .. } | IrOp::Send { .. } | IrOp::Label(_) => {}
            IrOp::Jump { .. } => self.leaves = true,
            IrOp::Logic { dst, function: is } => {
                self.acc = true;
                self.bits.insert(*dst);
                match *is {
                    LogicOp::Copy(a) | LogicOp::Not(a) => self.read.extend([a]),
                    LogicOp::And(a, b) | LogicOp::Or(a, b) => self.read.extend([a, b]),
                }
            }
            IrOp::If { cond, if_true: then, if_false: otherwise } => {
                if let BranchCondition::Bit(bit) = cond {
                    self.read.insert(*bit);
                }
                self.list(then);
                self.list(otherwise);
            }
        }
    }
}

/// True if `ops` read the accumulator before they set it; `read_after` if they do neither.
#[must_use]
pub fn is_accumulator_read(ops: &[&IrOp], read_after: bool) -> bool {
    ops.iter().find_map(|op| accumulator_use(op)).unwrap_or(read_after)
}

/// True if `ops` read the value that the accumulator has at their start.
#[must_use]
pub fn reads_accumulator(ops: &[IrOp]) -> bool {
    ops.iter().find_map(accumulator_use).unwrap_or(false)
}

/// Whether the operation reads the accumulator (true) or sets it first (false); `None` if it does neither.
fn accumulator_use(op: &IrOp) -> Option<bool> {
    match op {
        IrOp::SetAccumulator(_) | IrOp::Load { .. } | IrOp::Receive { .. } | IrOp::Logic { .. } => Some(false),
        // Nobody reads it where a jump goes.
        IrOp::Label(_) | IrOp::Jump { .. } => Some(false),
        IrOp::And { .. } | IrOp::Or { .. } | IrOp::AndCompare(_) | IrOp::Store { .. } => Some(true),
        IrOp::Rising(_) | IrOp::Falling(_) | IrOp::Module { .. } | IrOp::If { cond: BranchCondition::Acc, .. } => {
            Some(true)
        }
        IrOp::If { if_true: then, if_false: otherwise, .. } => {
            let ways = [then, otherwise].map(|way| way.iter().find_map(accumulator_use));
            match ways {
                [Some(true), _] | [_, Some(true)] => Some(true),
                [Some(false), Some(false)] => Some(false),
                _ => None,
            }
        }
        _ => None,
    }
}

/// Number of reads of a temporary by `ops` until it is written again; `None` if a branch reads or writes it.
#[must_use]
pub fn count_reads(bit: BitId, ops: &[&IrOp]) -> Option<u32> {
    let mut reads = 0;
    for op in ops {
        match op {
            IrOp::Load { bit: read, .. } | IrOp::And { bit: read, .. } | IrOp::Or { bit: read, .. } if *read == bit => {
                reads += 1
            }
            IrOp::Store { bit: written, .. } | IrOp::SetBit { bit: written, .. } if *written == bit => break,
            IrOp::If { .. } | IrOp::Logic { .. } | IrOp::Rising(_) | IrOp::Falling(_) | IrOp::Jump { .. } => {
                let mut touched = TouchedCells::default();
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
