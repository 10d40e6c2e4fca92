//! Converts intermediate code to three-address code, which is easy to follow: each bit operation has its own
//! temporary.

use crate::ir::{BitCell, BitId, BitRole, BranchCondition, Ir, IrOp, IrStep, LogicOp};

/// Converts a scan to three-address code. Only operations that need the accumulator themselves still use it.
#[must_use]
pub fn to_three_address(mut ir: Ir) -> Ir {
    let first = ir.bits.len() as u32;
    let mut plain = ThreeAddress { first_temporary: first, used: 0, most_used: 0, acc: BitId(first) };
    ir.prologue = plain.translate_ops(&ir.prologue);
    let mut rungs = std::mem::take(&mut ir.rungs);
    for rung in &mut rungs {
        plain.used = 0;
        let mut steps = Vec::new();
        for step in std::mem::take(&mut rung.steps) {
            let mut ops = Vec::new();
            plain.translate_op(&step.op, &mut ops);
            steps.extend(ops.into_iter().map(|op| IrStep { element: step.element, op }));
        }
        rung.steps = steps;
    }
    ir.rungs = rungs;
    plain.used = 0;
    ir.epilogue = plain.translate_ops(&ir.epilogue);
    let named = |n| BitCell { name: format!("t{}", n + 1), role: BitRole::Temporary, initial: false };
    ir.bits.extend((0..plain.most_used).map(named));
    ir
}

/// State of the conversion.
struct ThreeAddress {
    /// First temporary, number of temporaries that the current rung uses so far, and the maximum over all
    /// rungs.
    first_temporary: u32,
    used: u32,
    most_used: u32,
    /// Bit that holds the state of the rung.
    acc: BitId,
}

impl ThreeAddress {
    fn translate_ops(&mut self, ops: &[IrOp]) -> Vec<IrOp> {
        let mut out = Vec::new();
        ops.iter().for_each(|op| self.translate_op(op, &mut out));
        out
    }

    fn temporary(&mut self) -> BitId {
        self.used += 1;
        self.most_used = self.most_used.max(self.used);
        BitId(self.first_temporary + self.used - 1)
    }

    /// Stores a function of bits in a new temporary.
    fn store_logic(&mut self, is: LogicOp, out: &mut Vec<IrOp>) -> BitId {
        let dst = self.temporary();
        out.push(IrOp::Logic { dst, function: is });
        dst
    }

    /// Returns the bit, or a temporary with its complement.
    fn complemented_bit(&mut self, bit: BitId, negated: bool, out: &mut Vec<IrOp>) -> BitId {
        if negated { self.store_logic(LogicOp::Not(bit), out) } else { bit }
    }

    fn translate_op(&mut self, op: &IrOp, out: &mut Vec<IrOp>) {
        match op {
            IrOp::SetAccumulator(value) => {
                self.acc = self.temporary();
                out.push(IrOp::SetBit { bit: self.acc, value: *value });
            }
            IrOp::Load { bit, negated } => {
                let is = if *negated { LogicOp::Not(*bit) } else { LogicOp::Copy(*bit) };
                self.acc = self.store_logic(is, out);
            }
            IrOp::And { bit, negated } => {
                let bit = self.complemented_bit(*bit, *negated, out);
                self.acc = self.store_logic(LogicOp::And(self.acc, bit), out);
            }
            IrOp::Or { bit, negated } => {
                let bit = self.complemented_bit(*bit, *negated, out);
                self.acc = self.store_logic(LogicOp::Or(self.acc, bit), out);
            }
            IrOp::Store { bit, negated } => {
                let is = if *negated { LogicOp::Not(self.acc) } else { LogicOp::Copy(self.acc) };
                out.push(IrOp::Logic { dst: *bit, function: is });
            }
            IrOp::Rising(memory) => {
                let (now, before) = (self.acc, self.store_logic(LogicOp::Not(*memory), out));
                self.acc = self.store_logic(LogicOp::And(now, before), out);
                out.push(IrOp::Logic { dst: *memory, function: LogicOp::Copy(now) });
            }
            IrOp::Falling(memory) => {
                let now = self.acc;
                let off = self.store_logic(LogicOp::Not(now), out);
                self.acc = self.store_logic(LogicOp::And(off, *memory), out);
                out.push(IrOp::Logic { dst: *memory, function: LogicOp::Copy(now) });
            }
            IrOp::AndCompare(compare) => {
                let holds = self.temporary();
                let put = |value| vec![IrOp::SetBit { bit: holds, value }];
                out.push(IrOp::If {
                    cond: BranchCondition::Compare(*compare),
                    if_true: put(true),
                    if_false: put(false),
                });
                self.acc = self.store_logic(LogicOp::And(self.acc, holds), out);
            }
            IrOp::Receive { .. } => {
                out.push(op.clone());
                self.store_accumulator(out);
            }
            IrOp::Module { .. } => {
                out.push(IrOp::Load { bit: self.acc, negated: false });
                out.push(op.clone());
                self.store_accumulator(out);
            }
            IrOp::If { cond, if_true: then, if_false: otherwise } => self.translate_branch(*cond, then, otherwise, out),
            other => out.push(other.clone()),
        }
    }

    /// Stores the accumulator after an operation in a temporary.
    fn store_accumulator(&mut self, out: &mut Vec<IrOp>) {
        self.acc = self.temporary();
        out.push(IrOp::Store { bit: self.acc, negated: false });
    }

    /// Makes both branches leave the state of the rung in the same bit.
    fn translate_branch(&mut self, cond: BranchCondition, then: &[IrOp], otherwise: &[IrOp], out: &mut Vec<IrOp>) {
        let before = self.acc;
        let cond = if cond == BranchCondition::Acc { BranchCondition::Bit(before) } else { cond };
        let mut then = self.translate_ops(then);
        let after_then = std::mem::replace(&mut self.acc, before);
        let mut otherwise = self.translate_ops(otherwise);
        let after_otherwise = std::mem::replace(&mut self.acc, before);
        if after_then != before || after_otherwise != before {
            self.acc = self.temporary();
            let join = |from| IrOp::Logic { dst: self.acc, function: LogicOp::Copy(from) };
            then.push(join(after_then));
            otherwise.push(join(after_otherwise));
        }
        out.push(IrOp::If { cond, if_true: then, if_false: otherwise });
    }
}
