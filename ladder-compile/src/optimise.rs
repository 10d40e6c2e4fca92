//! Two passes over the intermediate code, for all targets: forward, what is known of the accumulator and the temporaries;
//! backward, what nobody reads.
//!
//! Values are known only within one scan. What can be seen between scans (relays, outputs, edge memories, words) leaves a
//! scan as the program says; a value that is overwritten in the same scan before anything reads it is not written.

mod factor;

use std::collections::{HashMap, HashSet};

use crate::ir::{Bit, Compare, Cond, Ir, Logic, Op, Step, Value, Word, WordRole};

/// The same scan with less to do. Joining opens a little more to the passes, so they run twice.
#[must_use]
pub fn optimise(mut ir: Ir) -> Ir {
    let temporary: HashSet<Bit> = (0..ir.bits.len() as u32).map(Bit).filter(|&bit| ir.is_temporary(bit)).collect();
    for _ in 0..2 {
        propagate(&mut ir, &temporary);
        dead(&mut ir);
        factor::factor(&mut ir, &temporary);
        ir.rungs.iter_mut().for_each(|rung| join(&mut rung.steps));
    }
    dead(&mut ir);
    ir
}

/// The forward pass over a scan.
fn propagate(ir: &mut Ir, temporary: &HashSet<Bit>) {
    let mut known = Known { acc: Val::Unknown(0), loaded: None, bits: HashMap::new(), next: 1 };
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

/// `store t; load x; or t` is `store t; or x`, and so with `and`: branches of one contact need no temporary.
fn join(steps: &mut Vec<Step>) {
    let mut at = 0;
    while let Some([store, load, last]) = steps.get_mut(at..at + 3) {
        at += 1;
        let (Op::Store { bit: stored, negated: false }, Op::Load { bit, negated }) = (&store.op, &load.op) else {
            continue;
        };
        let (bit, negated) = (*bit, *negated);
        load.op = match last.op {
            Op::Or { bit: joined, negated: false } if joined == *stored => Op::Or { bit, negated },
            Op::And { bit: joined, negated: false } if joined == *stored => Op::And { bit, negated },
            _ => continue,
        };
        steps.remove(at + 1);
    }
}

/// Removes what nobody reads, from the end of the scan to its start.
fn dead(ir: &mut Ir) {
    let mut later = Later::behind_the_scan(ir);
    ir.end = backward(std::mem::take(&mut ir.end), &mut later);
    for rung in ir.rungs.iter_mut().rev() {
        let steps = std::mem::take(&mut rung.steps).into_iter().rev();
        rung.steps = steps.filter_map(|step| later.op(step.op).map(|op| Step { at: step.at, op })).collect();
        rung.steps.reverse();
    }
    ir.begin = backward(std::mem::take(&mut ir.begin), &mut later);
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
    /// What the accumulator was loaded from just before.
    loaded: Option<(Bit, bool)>,
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
        self.loaded = None;
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
    let loaded = known.loaded.take();
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
                known.loaded = Some((bit, negated));
                out.push(op);
            }
        },
        Op::And { bit, negated } if loaded == Some((bit, !negated)) => one(Op::Acc(false), known, temporary, out),
        Op::Or { bit, negated } if loaded == Some((bit, !negated)) => one(Op::Acc(true), known, temporary, out),
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
            known.loaded = loaded.filter(|(from, _)| *from != bit);
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

/// What becomes of values later on in the scan.
#[derive(Clone, PartialEq, Eq)]
struct Later {
    /// The accumulator is read.
    acc: bool,
    /// Bits that are overwritten, or end with the scan, before anything reads them.
    dead_bits: HashSet<Bit>,
    /// Such words.
    dead_words: HashSet<Word>,
}

fn backward(ops: Vec<Op>, later: &mut Later) -> Vec<Op> {
    let mut kept: Vec<Op> = ops.into_iter().rev().filter_map(|op| later.op(op)).collect();
    kept.reverse();
    kept
}

impl Later {
    /// Behind the last operation: temporaries have ended, all else stays.
    fn behind_the_scan(ir: &Ir) -> Later {
        let words = ir.words.iter().enumerate().filter(|(_, cell)| cell.role == WordRole::Temporary);
        Later {
            acc: false,
            dead_bits: (0..ir.bits.len() as u32).map(Bit).filter(|&bit| ir.is_temporary(bit)).collect(),
            dead_words: words.map(|(n, _)| Word(n as u32)).collect(),
        }
    }

    /// What is left of `op`, and what becomes of the values before it.
    fn op(&mut self, op: Op) -> Option<Op> {
        match op {
            Op::Acc(_) => self.acc.then(|| {
                self.acc = false;
                op
            }),
            Op::Load { bit, .. } => self.acc.then(|| {
                self.acc = false;
                self.reads_bit(bit);
                op
            }),
            Op::And { bit, .. } | Op::Or { bit, .. } => self.acc.then(|| {
                self.reads_bit(bit);
                op
            }),
            Op::AndCompare(ref compare) => {
                if !self.acc {
                    return None;
                }
                self.compares(compare);
                Some(op)
            }
            Op::Store { bit, .. } | Op::Put { bit, .. } => self.dead_bits.insert(bit).then(|| {
                self.acc |= matches!(op, Op::Store { .. });
                op
            }),
            // With its result unread an edge only stores its input.
            Op::Rising(bit) | Op::Falling(bit) if !self.acc => self.op(Op::Store { bit, negated: false }),
            Op::Rising(bit) | Op::Falling(bit) => {
                self.reads_bit(bit);
                Some(op)
            }
            Op::Logic { dst, is } => self.dead_bits.insert(dst).then(|| {
                match is {
                    Logic::Copy(a) | Logic::Not(a) => self.reads_bit(a),
                    Logic::And(a, b) | Logic::Or(a, b) => [a, b].into_iter().for_each(|bit| self.reads_bit(bit)),
                }
                op
            }),
            Op::Move { dst, src } => self.dead_words.insert(dst).then(|| {
                self.reads(src);
                op
            }),
            Op::Math { dst, a, b, .. } => self.dead_words.insert(dst).then(|| {
                self.reads(a);
                self.reads(b);
                op
            }),
            Op::Lookup { dst, index, .. } => self.dead_words.insert(dst).then(|| {
                self.reads(Value::Cell(index));
                op
            }),
            // A conversion and a read of the EEPROM happen whatever becomes of their values.
            Op::ReadAdc { dst, .. } | Op::Recall { dst, .. } => {
                self.dead_words.insert(dst);
                Some(op)
            }
            Op::SetPwm { duty: value } | Op::Send { value } => {
                self.reads(value);
                Some(op)
            }
            // The destination keeps its value where no byte has come.
            Op::Receive { dst } => {
                self.acc = false;
                self.reads(Value::Cell(dst));
                Some(op)
            }
            Op::Persist { src, busy, .. } => {
                self.reads(Value::Cell(src));
                self.reads(Value::Cell(busy));
                Some(op)
            }
            Op::Module { word, limit, .. } => {
                self.acc = true;
                self.reads(Value::Cell(word));
                self.reads(limit);
                Some(op)
            }
            Op::If { cond, then, otherwise } => {
                let mut other = self.clone();
                let then = backward(then, self);
                let otherwise = backward(otherwise, &mut other);
                if then.is_empty() && otherwise.is_empty() {
                    return None;
                }
                self.acc |= other.acc;
                self.dead_bits.retain(|bit| other.dead_bits.contains(bit));
                self.dead_words.retain(|word| other.dead_words.contains(word));
                match &cond {
                    Cond::Acc => self.acc = true,
                    Cond::Bit(bit) => self.reads_bit(*bit),
                    Cond::Compare(compare) => self.compares(compare),
                }
                Some(Op::If { cond, then, otherwise })
            }
        }
    }

    fn reads_bit(&mut self, bit: Bit) {
        self.dead_bits.remove(&bit);
    }

    fn reads(&mut self, value: Value) {
        if let Value::Cell(word) = value {
            self.dead_words.remove(&word);
        }
    }

    fn compares(&mut self, compare: &Compare) {
        self.reads(Value::Cell(compare.a));
        self.reads(compare.b);
    }
}
