//! Two passes over the intermediate code, for all targets: forward, what is known of the accumulator and the temporaries;
//! backward, what nobody reads.
//!
//! Only values that live within one scan are tracked. Whatever can be seen or changed between scans (relays, outputs,
//! edge memories, words) is read and written exactly where the program says so.

use std::collections::{HashMap, HashSet};

use crate::ir::{Bit, Cond, Ir, Logic, Op, Step};

/// The same scan with less to do. Joining opens a little more to the passes, so they run twice.
#[must_use]
pub fn optimise(mut ir: Ir) -> Ir {
    let temporary: HashSet<Bit> = (0..ir.bits.len() as u32).map(Bit).filter(|&bit| ir.is_temporary(bit)).collect();
    for _ in 0..2 {
        propagate(&mut ir, &temporary);
        dead(&mut ir, &temporary);
        ir.rungs.iter_mut().for_each(|rung| join(&mut rung.steps));
    }
    dead(&mut ir, &temporary);
    ir
}

/// The forward pass over a scan.
fn propagate(ir: &mut Ir, temporary: &HashSet<Bit>) {
    let mut known = Known { acc: Val::Unknown(0), bits: HashMap::new(), next: 1 };
    ir.begin = forward(std::mem::take(&mut ir.begin), &mut known, temporary);
    for rung in &mut ir.rungs {
        let (mut ops, mut owners) = (Vec::new(), Vec::new());
        for step in std::mem::take(&mut rung.steps) {
            one(step.op, &mut known, temporary, &mut ops);
            owners.resize(ops.len(), step.at);
        }
        rung.steps = owners.into_iter().zip(ops).map(|(at, op)| Step { at, op }).collect();
    }
    ir.end = forward(std::mem::take(&mut ir.end), &mut known, temporary);
}

/// `store t; load x; or t` is `store t; or x`: branches of one contact need no temporary.
fn join(steps: &mut Vec<Step>) {
    let mut at = 0;
    while let Some([store, load, or]) = steps.get_mut(at..at + 3) {
        at += 1;
        let (
            Op::Store { bit: stored, negated: false },
            Op::Load { bit, negated },
            Op::Or { bit: joined, negated: false },
        ) = (&store.op, &load.op, &or.op)
        else {
            continue;
        };
        if stored == joined {
            load.op = Op::Or { bit: *bit, negated: *negated };
            steps.remove(at + 1);
        }
    }
}

/// Removes what nobody reads, from the end of the scan to its start.
fn dead(ir: &mut Ir, temporary: &HashSet<Bit>) {
    let mut live = Live { acc: false, bits: HashSet::new() };
    ir.end = backward(std::mem::take(&mut ir.end), &mut live, temporary);
    for rung in ir.rungs.iter_mut().rev() {
        let steps = std::mem::take(&mut rung.steps).into_iter().rev();
        rung.steps = steps.filter_map(|step| live.op(step.op, temporary).map(|op| Step { at: step.at, op })).collect();
        rung.steps.reverse();
    }
    ir.begin = backward(std::mem::take(&mut ir.begin), &mut live, temporary);
}

/// A value of the accumulator or of a temporary: a constant, or the same unknown wherever the number is the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Val {
    Const(bool),
    Unknown(u32),
}

#[derive(Clone)]
struct Known {
    acc: Val,
    bits: HashMap<Bit, Val>,
    next: u32,
}

impl Known {
    fn fresh(&mut self) -> Val {
        self.next += 1;
        Val::Unknown(self.next)
    }

    /// The value of `bit`, complemented if `negated`, where that can be said.
    fn of(&self, bit: Bit, negated: bool) -> Option<Val> {
        match self.bits.get(&bit) {
            Some(Val::Const(value)) => Some(Val::Const(value ^ negated)),
            Some(value) if !negated => Some(*value),
            _ => None,
        }
    }

    /// What both know.
    fn meet(&mut self, other: &Known) {
        self.next = self.next.max(other.next);
        if self.acc != other.acc {
            self.acc = self.fresh();
        }
        self.bits.retain(|bit, value| other.bits.get(bit) == Some(value));
    }
}

fn forward(ops: Vec<Op>, known: &mut Known, temporary: &HashSet<Bit>) -> Vec<Op> {
    let mut out = Vec::new();
    ops.into_iter().for_each(|op| one(op, known, temporary, &mut out));
    out
}

/// Appends to `out` what is left of `op`.
fn one(op: Op, known: &mut Known, temporary: &HashSet<Bit>, out: &mut Vec<Op>) {
    match op {
        Op::Acc(value) => {
            if known.acc != Val::Const(value) {
                known.acc = Val::Const(value);
                out.push(op);
            }
        }
        Op::Load { bit, negated } => match known.of(bit, negated) {
            Some(Val::Const(value)) => one(Op::Acc(value), known, temporary, out),
            Some(value) if value == known.acc => {}
            value => {
                known.acc = value.unwrap_or_else(|| known.fresh());
                out.push(op);
            }
        },
        Op::And { bit, negated } => match (known.acc, known.of(bit, negated)) {
            (Val::Const(false), _) | (_, Some(Val::Const(true))) => {}
            (Val::Const(true), _) => one(Op::Load { bit, negated }, known, temporary, out),
            (_, Some(Val::Const(false))) => one(Op::Acc(false), known, temporary, out),
            (acc, Some(value)) if acc == value => {}
            _ => {
                known.acc = known.fresh();
                out.push(op);
            }
        },
        Op::Or { bit, negated } => match (known.acc, known.of(bit, negated)) {
            (Val::Const(true), _) | (_, Some(Val::Const(false))) => {}
            (Val::Const(false), _) => one(Op::Load { bit, negated }, known, temporary, out),
            (_, Some(Val::Const(true))) => one(Op::Acc(true), known, temporary, out),
            (acc, Some(value)) if acc == value => {}
            _ => {
                known.acc = known.fresh();
                out.push(op);
            }
        },
        Op::Store { bit, negated } => {
            if let Val::Const(value) = known.acc {
                return one(Op::Put { bit, value: value ^ negated }, known, temporary, out);
            }
            if temporary.contains(&bit) {
                let value = if negated { known.fresh() } else { known.acc };
                known.bits.insert(bit, value);
            }
            out.push(op);
        }
        Op::Put { bit, value } => {
            if temporary.contains(&bit) {
                known.bits.insert(bit, Val::Const(value));
            }
            out.push(op);
        }
        Op::Rising(bit) => match known.acc {
            Val::Const(false) => out.push(Op::Put { bit, value: false }),
            Val::Const(true) => edge(bit, true, known, out),
            Val::Unknown(_) => {
                known.acc = known.fresh();
                out.push(op);
            }
        },
        Op::Falling(bit) => match known.acc {
            Val::Const(true) => {
                out.push(Op::Put { bit, value: true });
                one(Op::Acc(false), known, temporary, out);
            }
            Val::Const(false) => edge(bit, false, known, out),
            Val::Unknown(_) => {
                known.acc = known.fresh();
                out.push(op);
            }
        },
        Op::AndCompare(_) => {
            if known.acc != Val::Const(false) {
                known.acc = known.fresh();
                out.push(op);
            }
        }
        Op::Receive { .. } | Op::Module { .. } => {
            known.acc = known.fresh();
            out.push(op);
        }
        Op::Logic { dst, .. } => {
            known.acc = known.fresh();
            known.bits.remove(&dst);
            out.push(op);
        }
        Op::Move { .. } | Op::Math { .. } | Op::Lookup { .. } | Op::ReadAdc { .. } | Op::SetPwm { .. } => out.push(op),
        Op::Send { .. } | Op::Recall { .. } | Op::Persist { .. } => out.push(op),
        Op::If { cond, then, otherwise } => branch(cond, then, otherwise, known, temporary, out),
    }
}

/// An edge whose input is known: the output is the memory, or its complement, and the memory becomes the input.
fn edge(memory: Bit, input: bool, known: &mut Known, out: &mut Vec<Op>) {
    known.acc = known.fresh();
    out.push(Op::Load { bit: memory, negated: input });
    out.push(Op::Put { bit: memory, value: input });
}

fn branch(
    cond: Cond,
    then: Vec<Op>,
    otherwise: Vec<Op>,
    known: &mut Known,
    temporary: &HashSet<Bit>,
    out: &mut Vec<Op>,
) {
    let decided = match cond {
        Cond::Acc => Some(known.acc),
        Cond::Bit(bit) => known.of(bit, false),
        Cond::Compare(_) => None,
    };
    if let Some(Val::Const(value)) = decided {
        let arm = if value { then } else { otherwise };
        return arm.into_iter().for_each(|op| one(op, known, temporary, out));
    }
    let before = known.acc;
    let mut other = known.clone();
    if cond == Cond::Acc {
        known.acc = Val::Const(true);
        other.acc = Val::Const(false);
    }
    let then = forward(then, known, temporary);
    other.next = known.next;
    let otherwise = forward(otherwise, &mut other, temporary);
    let kept = cond == Cond::Acc && known.acc == Val::Const(true) && other.acc == Val::Const(false);
    known.meet(&other);
    if kept {
        known.acc = before;
    }
    out.push(Op::If { cond, then, otherwise });
}

/// What is read later on.
#[derive(Clone, PartialEq, Eq)]
struct Live {
    acc: bool,
    bits: HashSet<Bit>,
}

fn backward(ops: Vec<Op>, live: &mut Live, temporary: &HashSet<Bit>) -> Vec<Op> {
    let mut kept: Vec<Op> = ops.into_iter().rev().filter_map(|op| live.op(op, temporary)).collect();
    kept.reverse();
    kept
}

impl Live {
    /// What is left of `op`, and what it reads.
    fn op(&mut self, op: Op, temporary: &HashSet<Bit>) -> Option<Op> {
        match op {
            Op::Acc(_) => self.acc.then(|| {
                self.acc = false;
                op
            }),
            Op::Load { bit, .. } => self.acc.then(|| {
                self.acc = false;
                self.bits.insert(bit);
                op
            }),
            Op::And { bit, .. } | Op::Or { bit, .. } => self.acc.then(|| {
                self.bits.insert(bit);
                op
            }),
            Op::AndCompare(_) => self.acc.then_some(op),
            Op::Store { bit, .. } | Op::Put { bit, .. } => {
                if temporary.contains(&bit) && !self.bits.remove(&bit) {
                    return None;
                }
                self.acc |= matches!(op, Op::Store { .. });
                Some(op)
            }
            Op::Rising(bit) | Op::Falling(bit) => {
                if !self.acc {
                    self.acc = true;
                    return Some(Op::Store { bit, negated: false });
                }
                Some(op)
            }
            Op::Receive { .. } => {
                self.acc = false;
                Some(op)
            }
            Op::Module { .. } => {
                self.acc = true;
                Some(op)
            }
            Op::Logic { is, .. } => {
                match is {
                    Logic::Copy(a) | Logic::Not(a) => self.bits.extend([a]),
                    Logic::And(a, b) | Logic::Or(a, b) => self.bits.extend([a, b]),
                }
                Some(op)
            }
            Op::Move { .. } | Op::Math { .. } | Op::Lookup { .. } | Op::ReadAdc { .. } | Op::SetPwm { .. } => Some(op),
            Op::Send { .. } | Op::Recall { .. } | Op::Persist { .. } => Some(op),
            Op::If { cond, then, otherwise } => {
                let mut other = self.clone();
                let then = backward(then, self, temporary);
                let otherwise = backward(otherwise, &mut other, temporary);
                if then.is_empty() && otherwise.is_empty() {
                    return None;
                }
                self.acc |= other.acc;
                self.bits.extend(other.bits);
                match cond {
                    Cond::Acc => self.acc = true,
                    Cond::Bit(bit) => _ = self.bits.insert(bit),
                    Cond::Compare(_) => {}
                }
                Some(Op::If { cond, then, otherwise })
            }
        }
    }
}
