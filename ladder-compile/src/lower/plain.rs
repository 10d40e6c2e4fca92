//! Code that can be followed by eye: every operation on bits has a temporary of its own, and the accumulator is gone.

use crate::ir::{Bit, BitCell, BitRole, Cond, Ir, Logic, Op, Step};

/// The same scan as three-address code. The accumulator lives on only where an operation itself needs it.
#[must_use]
pub fn plain(mut ir: Ir) -> Ir {
    let first = ir.bits.len() as u32;
    let mut plain = Plain { first, used: 0, most: 0, acc: Bit(first) };
    ir.begin = plain.block(&ir.begin);
    let mut rungs = std::mem::take(&mut ir.rungs);
    for rung in &mut rungs {
        plain.used = 0;
        let mut steps = Vec::new();
        for step in std::mem::take(&mut rung.steps) {
            let mut ops = Vec::new();
            plain.op(&step.op, &mut ops);
            steps.extend(ops.into_iter().map(|op| Step { at: step.at, op }));
        }
        rung.steps = steps;
    }
    ir.rungs = rungs;
    plain.used = 0;
    ir.end = plain.block(&ir.end);
    let named = |n| BitCell { name: format!("t{}", n + 1), role: BitRole::Temporary };
    ir.bits.extend((0..plain.most).map(named));
    ir
}

struct Plain {
    /// The first temporary, and how many a rung has used so far, and at most.
    first: u32,
    used: u32,
    most: u32,
    /// Where the state of the rung is.
    acc: Bit,
}

impl Plain {
    fn block(&mut self, ops: &[Op]) -> Vec<Op> {
        let mut out = Vec::new();
        ops.iter().for_each(|op| self.op(op, &mut out));
        out
    }

    fn temporary(&mut self) -> Bit {
        self.used += 1;
        self.most = self.most.max(self.used);
        Bit(self.first + self.used - 1)
    }

    /// A temporary that holds `is`.
    fn hold(&mut self, is: Logic, out: &mut Vec<Op>) -> Bit {
        let dst = self.temporary();
        out.push(Op::Logic { dst, is });
        dst
    }

    /// The bit, or a temporary that holds its complement.
    fn signed(&mut self, bit: Bit, negated: bool, out: &mut Vec<Op>) -> Bit {
        if negated { self.hold(Logic::Not(bit), out) } else { bit }
    }

    fn op(&mut self, op: &Op, out: &mut Vec<Op>) {
        match op {
            Op::Acc(value) => {
                self.acc = self.temporary();
                out.push(Op::Put { bit: self.acc, value: *value });
            }
            Op::Load { bit, negated } => {
                let is = if *negated { Logic::Not(*bit) } else { Logic::Copy(*bit) };
                self.acc = self.hold(is, out);
            }
            Op::And { bit, negated } => {
                let bit = self.signed(*bit, *negated, out);
                self.acc = self.hold(Logic::And(self.acc, bit), out);
            }
            Op::Or { bit, negated } => {
                let bit = self.signed(*bit, *negated, out);
                self.acc = self.hold(Logic::Or(self.acc, bit), out);
            }
            Op::Store { bit, negated } => {
                let is = if *negated { Logic::Not(self.acc) } else { Logic::Copy(self.acc) };
                out.push(Op::Logic { dst: *bit, is });
            }
            Op::Rising(memory) => {
                let (now, before) = (self.acc, self.hold(Logic::Not(*memory), out));
                self.acc = self.hold(Logic::And(now, before), out);
                out.push(Op::Logic { dst: *memory, is: Logic::Copy(now) });
            }
            Op::Falling(memory) => {
                let now = self.acc;
                let off = self.hold(Logic::Not(now), out);
                self.acc = self.hold(Logic::And(off, *memory), out);
                out.push(Op::Logic { dst: *memory, is: Logic::Copy(now) });
            }
            Op::AndCompare(compare) => {
                let holds = self.temporary();
                let put = |value| vec![Op::Put { bit: holds, value }];
                out.push(Op::If { cond: Cond::Compare(*compare), then: put(true), otherwise: put(false) });
                self.acc = self.hold(Logic::And(self.acc, holds), out);
            }
            Op::Receive { .. } => {
                out.push(op.clone());
                self.keep(out);
            }
            Op::Module { .. } => {
                out.push(Op::Load { bit: self.acc, negated: false });
                out.push(op.clone());
                self.keep(out);
            }
            Op::If { cond, then, otherwise } => self.branch(*cond, then, otherwise, out),
            other => out.push(other.clone()),
        }
    }

    /// The accumulator of an operation goes to a temporary.
    fn keep(&mut self, out: &mut Vec<Op>) {
        self.acc = self.temporary();
        out.push(Op::Store { bit: self.acc, negated: false });
    }

    /// Both arms leave the state of the rung in one place.
    fn branch(&mut self, cond: Cond, then: &[Op], otherwise: &[Op], out: &mut Vec<Op>) {
        let before = self.acc;
        let cond = if cond == Cond::Acc { Cond::Bit(before) } else { cond };
        let mut then = self.block(then);
        let after_then = std::mem::replace(&mut self.acc, before);
        let mut otherwise = self.block(otherwise);
        let after_otherwise = std::mem::replace(&mut self.acc, before);
        if after_then != before || after_otherwise != before {
            self.acc = self.temporary();
            let join = |from| Op::Logic { dst: self.acc, is: Logic::Copy(from) };
            then.push(join(after_then));
            otherwise.push(join(after_otherwise));
        }
        out.push(Op::If { cond, then, otherwise });
    }
}
