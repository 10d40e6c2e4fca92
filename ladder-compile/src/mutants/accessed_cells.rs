//! Finds the cells that an operation reads and writes.

use std::collections::HashSet;

use crate::ir::{BitId, BranchCondition, IrOp, LogicOp, WordComparison, WordId, WordOperand};

/// Something that an operation reads or writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum AccessedCell {
    Acc,
    Bit(BitId),
    Word(WordId),
    /// A peripheral.
    Peripheral,
}

/// Sets of cells that are read and written.
#[derive(Default)]
pub(super) struct CellAccesses {
    pub reads: HashSet<AccessedCell>,
    pub writes: HashSet<AccessedCell>,
}

impl CellAccesses {
    /// Collects the accesses of these operations.
    pub fn of<'a>(ops: impl IntoIterator<Item = &'a IrOp>) -> CellAccesses {
        let mut touched = CellAccesses::default();
        ops.into_iter().for_each(|op| touched.add(&mut op.clone()));
        touched
    }

    /// True if the two sets of operations do not commute.
    pub fn conflicts_with(&self, other: &CellAccesses) -> bool {
        let meets = |a: &HashSet<AccessedCell>, b: &HashSet<AccessedCell>| a.intersection(b).next().is_some();
        meets(&self.writes, &other.writes) || meets(&self.writes, &other.reads) || meets(&self.reads, &other.writes)
    }

    fn add(&mut self, op: &mut IrOp) {
        for_each_cell(op, &mut |cell, write| {
            let cell = match cell {
                CellSlot::Acc => AccessedCell::Acc,
                CellSlot::Bit(bit) => AccessedCell::Bit(*bit),
                CellSlot::Word(word) => AccessedCell::Word(*word),
                CellSlot::Peripheral => AccessedCell::Peripheral,
            };
            _ = if write { self.writes.insert(cell) } else { self.reads.insert(cell) };
        });
    }
}

/// A reference to a cell inside an operation.
pub(super) enum CellSlot<'a> {
    Acc,
    Bit(&'a mut BitId),
    Word(&'a mut WordId),
    Peripheral,
}

/// Calls `see` for everything that `op` and its nested operations read (`false`) and write (`true`).
pub(super) fn for_each_cell(op: &mut IrOp, see: &mut dyn FnMut(CellSlot<'_>, bool)) {
    fn value(value: &mut WordOperand, see: &mut dyn FnMut(CellSlot<'_>, bool)) {
        if let WordOperand::Cell(word) = value {
            see(CellSlot::Word(word), false);
        }
    }
    fn compare(compare: &mut WordComparison, see: &mut dyn FnMut(CellSlot<'_>, bool)) {
        see(CellSlot::Word(&mut compare.a), false);
        value(&mut compare.b, see);
    }
    match op {
        IrOp::SetAccumulator(_) => see(CellSlot::Acc, true),
        // What follows in the text is not what follows in the scan.
        IrOp::Label(_) | IrOp::Jump { .. } => see(CellSlot::Peripheral, true),
        IrOp::Load { bit, .. } => {
            see(CellSlot::Bit(bit), false);
            see(CellSlot::Acc, true);
        }
        IrOp::And { bit, .. } | IrOp::Or { bit, .. } => {
            see(CellSlot::Bit(bit), false);
            see(CellSlot::Acc, false);
            see(CellSlot::Acc, true);
        }
        IrOp::Store { bit, .. } => {
            see(CellSlot::Acc, false);
            see(CellSlot::Bit(bit), true);
        }
        IrOp::SetBit { bit, .. } => see(CellSlot::Bit(bit), true),
        IrOp::Rising(bit) | IrOp::Falling(bit) => {
            see(CellSlot::Bit(bit), false);
            see(CellSlot::Bit(bit), true);
            see(CellSlot::Acc, false);
            see(CellSlot::Acc, true);
        }
        IrOp::AndCompare(c) => {
            compare(c, see);
            see(CellSlot::Acc, false);
            see(CellSlot::Acc, true);
        }
        IrOp::Move { dst, src } => {
            value(src, see);
            see(CellSlot::Word(dst), true);
        }
        IrOp::Math { dst, a, b, .. } => {
            value(a, see);
            value(b, see);
            see(CellSlot::Word(dst), true);
        }
        IrOp::Logic { dst, function: is } => {
            match is {
                LogicOp::Copy(a) | LogicOp::Not(a) => see(CellSlot::Bit(a), false),
                LogicOp::And(a, b) | LogicOp::Or(a, b) => {
                    see(CellSlot::Bit(a), false);
                    see(CellSlot::Bit(b), false);
                }
            }
            see(CellSlot::Bit(dst), true);
        }
        IrOp::Lookup { dst, index, .. } => {
            see(CellSlot::Word(index), false);
            see(CellSlot::Word(dst), true);
        }
        IrOp::ReadAdc { dst, .. } => see(CellSlot::Word(dst), true),
        IrOp::SetPwm { duty: v, .. } | IrOp::Send { value: v } => {
            value(v, see);
            see(CellSlot::Peripheral, true);
        }
        IrOp::Receive { dst } => {
            see(CellSlot::Word(dst), true);
            see(CellSlot::Acc, true);
            see(CellSlot::Peripheral, true);
        }
        IrOp::WaitSent => see(CellSlot::Peripheral, true),
        IrOp::Transfer { register, value: sent, dst, .. } => {
            value(register, see);
            value(sent, see);
            see(CellSlot::Peripheral, true);
            dst.iter_mut().for_each(|dst| see(CellSlot::Word(dst), true));
        }
        IrOp::ReadEeprom { dst, .. } => {
            see(CellSlot::Peripheral, false);
            see(CellSlot::Word(dst), true);
        }
        IrOp::WriteEeprom { src, busy, .. } => {
            see(CellSlot::Word(src), false);
            see(CellSlot::Word(busy), true);
            see(CellSlot::Peripheral, true);
        }
        IrOp::Module { word, limit, .. } => {
            value(limit, see);
            see(CellSlot::Acc, false);
            see(CellSlot::Acc, true);
            see(CellSlot::Word(word), false);
            see(CellSlot::Word(word), true);
        }
        IrOp::If { cond, if_true: then, if_false: otherwise } => {
            match cond {
                BranchCondition::Acc => see(CellSlot::Acc, false),
                BranchCondition::Bit(bit) => see(CellSlot::Bit(bit), false),
                BranchCondition::Compare(c) => compare(c, see),
            }
            then.iter_mut().chain(otherwise).for_each(|op| for_each_cell(op, see));
        }
    }
}
