//! Optimises intermediate code for all targets: a forward pass propagates known values, a backward pass
//! removes unread ones.
//!
//! Values are known only within one scan. State that is visible between scans (relays, outputs, edge
//! memories, words) leaves a scan as the program defines. A value that is overwritten in the same scan before
//! it is read is not written.

mod factor;

use std::collections::{HashMap, HashSet};

use crate::ir::{BitId, BranchCondition, Ir, IrOp, IrStep, LogicOp, WordComparison, WordId, WordOperand, WordRole};

/// Optimises a scan. Joining steps gives the passes new opportunities, so they run twice.
#[must_use]
pub fn optimise(mut ir: Ir) -> Ir {
    let temporary: HashSet<BitId> = (0..ir.bits.len() as u32).map(BitId).filter(|&bit| ir.is_temporary(bit)).collect();
    for _ in 0..2 {
        propagate(&mut ir, &temporary);
        remove_dead(&mut ir);
        factor::factor_common_contacts(&mut ir, &temporary);
        ir.rungs.iter_mut().for_each(|rung| join_store_load(&mut rung.steps));
    }
    remove_dead(&mut ir);
    ir
}

/// Runs the forward pass over a scan.
fn propagate(ir: &mut Ir, temporary: &HashSet<BitId>) {
    let mut known = KnownBits { acc: BitValue::Unknown(0), loaded: None, bits: HashMap::new(), next: 1 };
    ir.prologue = forward(std::mem::take(&mut ir.prologue), &mut known, temporary);
    for rung in &mut ir.rungs {
        let (mut ops, mut owners) = (Vec::new(), Vec::new());
        for step in std::mem::take(&mut rung.steps) {
            forward_op(step.op, &mut known, temporary, &mut ops);
            owners.resize(ops.len(), step.element);
        }
        rung.steps = owners.into_iter().zip(ops).map(|(at, op)| IrStep { element: at, op }).collect();
    }
    ir.epilogue = forward(std::mem::take(&mut ir.epilogue), &mut known, temporary);
}

/// Replaces `store t; load x; or t` by `store t; or x`, and likewise for `and`, so branches of one contact
/// need no temporary.
fn join_store_load(steps: &mut Vec<IrStep>) {
    let mut at = 0;
    while let Some([store, load, last]) = steps.get_mut(at..at + 3) {
        at += 1;
        let (IrOp::Store { bit: stored, negated: false }, IrOp::Load { bit, negated }) = (&store.op, &load.op) else {
            continue;
        };
        let (bit, negated) = (*bit, *negated);
        load.op = match last.op {
            IrOp::Or { bit: joined, negated: false } if joined == *stored => IrOp::Or { bit, negated },
            IrOp::And { bit: joined, negated: false } if joined == *stored => IrOp::And { bit, negated },
            _ => continue,
        };
        steps.remove(at + 1);
    }
}

/// Removes values that are never read, from the end of the scan to its start.
fn remove_dead(ir: &mut Ir) {
    let mut liveness = Liveness::at_scan_end(ir);
    ir.epilogue = backward(std::mem::take(&mut ir.epilogue), &mut liveness);
    for rung in ir.rungs.iter_mut().rev() {
        let steps = std::mem::take(&mut rung.steps).into_iter().rev();
        rung.steps =
            steps.filter_map(|step| liveness.op(step.op).map(|op| IrStep { element: step.element, op })).collect();
        rung.steps.reverse();
    }
    ir.prologue = backward(std::mem::take(&mut ir.prologue), &mut liveness);
}

/// Value of the accumulator or of a temporary: a constant, or an unknown value that is the same wherever its
/// number is equal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum BitValue {
    Const(bool),
    Unknown(u32),
}

/// Known values of the accumulator and of temporaries.
#[derive(Clone)]
struct KnownBits {
    acc: BitValue,
    /// The bit that the accumulator was loaded from just before, and whether complemented.
    loaded: Option<(BitId, bool)>,
    bits: HashMap<BitId, BitValue>,
    /// Number of the last unknown value.
    next: u32,
}

impl KnownBits {
    fn new_unknown(&mut self) -> BitValue {
        self.next += 1;
        BitValue::Unknown(self.next)
    }

    /// Value of `bit`, complemented if `negated`, if it can be expressed.
    fn value_of(&self, bit: BitId, negated: bool) -> Option<BitValue> {
        match self.bits.get(&bit) {
            Some(BitValue::Const(value)) => Some(BitValue::Const(value ^ negated)),
            Some(value) if !negated => Some(*value),
            _ => None,
        }
    }

    /// Keeps what both states know.
    fn merge(&mut self, other: &KnownBits) {
        self.next = self.next.max(other.next);
        self.loaded = None;
        if self.acc != other.acc {
            self.acc = self.new_unknown();
        }
        self.bits.retain(|bit, value| other.bits.get(bit) == Some(value));
    }
}

fn forward(ops: Vec<IrOp>, known: &mut KnownBits, temporary: &HashSet<BitId>) -> Vec<IrOp> {
    let mut out = Vec::new();
    ops.into_iter().for_each(|op| forward_op(op, known, temporary, &mut out));
    out
}

/// Appends what remains of `op` with the known values to `out`, and updates the known values.
fn forward_op(op: IrOp, known: &mut KnownBits, temporary: &HashSet<BitId>, out: &mut Vec<IrOp>) {
    let loaded = known.loaded.take();
    match op {
        IrOp::SetAccumulator(value) => {
            if known.acc != BitValue::Const(value) {
                known.acc = BitValue::Const(value);
                out.push(op);
            }
        }
        IrOp::Load { bit, negated } => match known.value_of(bit, negated) {
            Some(BitValue::Const(value)) => forward_op(IrOp::SetAccumulator(value), known, temporary, out),
            Some(value) if value == known.acc => {}
            value => {
                known.acc = value.unwrap_or_else(|| known.new_unknown());
                known.loaded = Some((bit, negated));
                out.push(op);
            }
        },
        IrOp::And { bit, negated } if loaded == Some((bit, !negated)) => {
            forward_op(IrOp::SetAccumulator(false), known, temporary, out)
        }
        IrOp::Or { bit, negated } if loaded == Some((bit, !negated)) => {
            forward_op(IrOp::SetAccumulator(true), known, temporary, out)
        }
        IrOp::And { bit, negated } => match (known.acc, known.value_of(bit, negated)) {
            (BitValue::Const(false), _) | (_, Some(BitValue::Const(true))) => {}
            (BitValue::Const(true), _) => forward_op(IrOp::Load { bit, negated }, known, temporary, out),
            (_, Some(BitValue::Const(false))) => forward_op(IrOp::SetAccumulator(false), known, temporary, out),
            (acc, Some(value)) if acc == value => {}
            _ => {
                known.acc = known.new_unknown();
                out.push(op);
            }
        },
        IrOp::Or { bit, negated } => match (known.acc, known.value_of(bit, negated)) {
            (BitValue::Const(true), _) | (_, Some(BitValue::Const(false))) => {}
            (BitValue::Const(false), _) => forward_op(IrOp::Load { bit, negated }, known, temporary, out),
            (_, Some(BitValue::Const(true))) => forward_op(IrOp::SetAccumulator(true), known, temporary, out),
            (acc, Some(value)) if acc == value => {}
            _ => {
                known.acc = known.new_unknown();
                out.push(op);
            }
        },
        IrOp::Store { bit, negated } => {
            known.loaded = loaded.filter(|(from, _)| *from != bit);
            if let BitValue::Const(value) = known.acc {
                return forward_op(IrOp::SetBit { bit, value: value ^ negated }, known, temporary, out);
            }
            if temporary.contains(&bit) {
                let value = if negated { known.new_unknown() } else { known.acc };
                known.bits.insert(bit, value);
            }
            out.push(op);
        }
        IrOp::SetBit { bit, value } => {
            if temporary.contains(&bit) {
                known.bits.insert(bit, BitValue::Const(value));
            }
            out.push(op);
        }
        IrOp::Rising(bit) => match known.acc {
            BitValue::Const(false) => out.push(IrOp::SetBit { bit, value: false }),
            BitValue::Const(true) => forward_edge(bit, true, known, out),
            BitValue::Unknown(_) => {
                known.acc = known.new_unknown();
                out.push(op);
            }
        },
        IrOp::Falling(bit) => match known.acc {
            BitValue::Const(true) => {
                out.push(IrOp::SetBit { bit, value: true });
                forward_op(IrOp::SetAccumulator(false), known, temporary, out);
            }
            BitValue::Const(false) => forward_edge(bit, false, known, out),
            BitValue::Unknown(_) => {
                known.acc = known.new_unknown();
                out.push(op);
            }
        },
        IrOp::AndCompare(_) => {
            if known.acc != BitValue::Const(false) {
                known.acc = known.new_unknown();
                out.push(op);
            }
        }
        IrOp::Receive { .. } | IrOp::Module { .. } => {
            known.acc = known.new_unknown();
            out.push(op);
        }
        IrOp::Logic { dst, .. } => {
            known.acc = known.new_unknown();
            known.bits.remove(&dst);
            out.push(op);
        }
        IrOp::Move { .. } | IrOp::Math { .. } | IrOp::Lookup { .. } | IrOp::ReadAdc { .. } | IrOp::SetPwm { .. } => {
            out.push(op)
        }
        IrOp::Send { .. } | IrOp::ReadEeprom { .. } | IrOp::WriteEeprom { .. } | IrOp::Jump { .. } => out.push(op),
        IrOp::Transfer { .. } | IrOp::WaitSent => out.push(op),
        // A label can be reached from several jumps, so nothing is known there.
        IrOp::Label(_) => {
            known.acc = known.new_unknown();
            known.bits.clear();
            out.push(op);
        }
        IrOp::If { cond, if_true, if_false } => forward_branch(cond, if_true, if_false, known, temporary, out),
    }
}

/// Simplifies an edge with a known input: the output is the memory or its complement, and the memory becomes
/// the input.
fn forward_edge(memory: BitId, input: bool, known: &mut KnownBits, out: &mut Vec<IrOp>) {
    known.acc = known.new_unknown();
    out.push(IrOp::Load { bit: memory, negated: input });
    out.push(IrOp::SetBit { bit: memory, value: input });
}

fn forward_branch(
    cond: BranchCondition,
    if_true: Vec<IrOp>,
    if_false: Vec<IrOp>,
    known: &mut KnownBits,
    temporary: &HashSet<BitId>,
    out: &mut Vec<IrOp>,
) {
    let known_condition = match cond {
        BranchCondition::Acc => Some(known.acc),
        BranchCondition::Bit(bit) => known.value_of(bit, false),
        BranchCondition::Compare(_) => None,
    };
    if let Some(BitValue::Const(value)) = known_condition {
        let taken_ops = if value { if_true } else { if_false };
        return taken_ops.into_iter().for_each(|op| forward_op(op, known, temporary, out));
    }
    let before = known.acc;
    let mut other = known.clone();
    if cond == BranchCondition::Acc {
        known.acc = BitValue::Const(true);
        other.acc = BitValue::Const(false);
    }
    let if_true = forward(if_true, known, temporary);
    other.next = known.next;
    let if_false = forward(if_false, &mut other, temporary);
    let acc_unchanged =
        cond == BranchCondition::Acc && known.acc == BitValue::Const(true) && other.acc == BitValue::Const(false);
    known.merge(&other);
    if acc_unchanged {
        known.acc = before;
    }
    out.push(IrOp::If { cond, if_true, if_false });
}

/// Which values are read later in the scan.
#[derive(Clone, PartialEq, Eq)]
struct Liveness {
    /// True if the accumulator is read.
    is_acc_read: bool,
    /// Bits that are overwritten, or end with the scan, before they are read.
    dead_bits: HashSet<BitId>,
    /// Words that are overwritten, or end with the scan, before they are read.
    dead_words: HashSet<WordId>,
}

fn backward(ops: Vec<IrOp>, liveness: &mut Liveness) -> Vec<IrOp> {
    let mut remaining: Vec<IrOp> = ops.into_iter().rev().filter_map(|op| liveness.op(op)).collect();
    remaining.reverse();
    remaining
}

impl Liveness {
    /// State after the last operation: temporaries are dead, all other cells are live.
    fn at_scan_end(ir: &Ir) -> Liveness {
        let words = ir.words.iter().enumerate().filter(|(_, cell)| cell.role == WordRole::Temporary);
        Liveness {
            is_acc_read: false,
            dead_bits: (0..ir.bits.len() as u32).map(BitId).filter(|&bit| ir.is_temporary(bit)).collect(),
            dead_words: words.map(|(n, _)| WordId(n as u32)).collect(),
        }
    }

    /// Returns what remains of `op`, and updates the liveness to the state before it.
    fn op(&mut self, op: IrOp) -> Option<IrOp> {
        match op {
            IrOp::SetAccumulator(_) => self.is_acc_read.then(|| {
                self.is_acc_read = false;
                op
            }),
            IrOp::Load { bit, .. } => self.is_acc_read.then(|| {
                self.is_acc_read = false;
                self.mark_bit_read(bit);
                op
            }),
            IrOp::And { bit, .. } | IrOp::Or { bit, .. } => self.is_acc_read.then(|| {
                self.mark_bit_read(bit);
                op
            }),
            IrOp::AndCompare(ref compare) => {
                if !self.is_acc_read {
                    return None;
                }
                self.mark_comparison_read(compare);
                Some(op)
            }
            IrOp::Store { bit, .. } | IrOp::SetBit { bit, .. } => self.dead_bits.insert(bit).then(|| {
                self.is_acc_read |= matches!(op, IrOp::Store { .. });
                op
            }),
            // If its output is not read, an edge only stores its input.
            IrOp::Rising(bit) | IrOp::Falling(bit) if !self.is_acc_read => self.op(IrOp::Store { bit, negated: false }),
            IrOp::Rising(bit) | IrOp::Falling(bit) => {
                self.mark_bit_read(bit);
                Some(op)
            }
            IrOp::Logic { dst, function: is } => self.dead_bits.insert(dst).then(|| {
                match is {
                    LogicOp::Copy(a) | LogicOp::Not(a) => self.mark_bit_read(a),
                    LogicOp::And(a, b) | LogicOp::Or(a, b) => {
                        [a, b].into_iter().for_each(|bit| self.mark_bit_read(bit))
                    }
                }
                op
            }),
            IrOp::Move { dst, src } => self.dead_words.insert(dst).then(|| {
                self.mark_operand_read(src);
                op
            }),
            IrOp::Math { dst, a, b, .. } => self.dead_words.insert(dst).then(|| {
                self.mark_operand_read(a);
                self.mark_operand_read(b);
                op
            }),
            IrOp::Lookup { dst, index, .. } => self.dead_words.insert(dst).then(|| {
                self.mark_operand_read(WordOperand::Cell(index));
                op
            }),
            // A conversion and an EEPROM read are executed even if their values are unused.
            IrOp::ReadAdc { dst, .. } | IrOp::ReadEeprom { dst, .. } => {
                self.dead_words.insert(dst);
                Some(op)
            }
            IrOp::SetPwm { duty: value, .. } | IrOp::Send { value } => {
                self.mark_operand_read(value);
                Some(op)
            }
            IrOp::WaitSent => Some(op),
            IrOp::Transfer { register, value, dst, .. } => {
                dst.iter().for_each(|dst| _ = self.dead_words.insert(*dst));
                self.mark_operand_read(register);
                self.mark_operand_read(value);
                Some(op)
            }
            // The destination keeps its value if no byte was received.
            IrOp::Receive { dst } => {
                self.is_acc_read = false;
                self.mark_operand_read(WordOperand::Cell(dst));
                Some(op)
            }
            IrOp::WriteEeprom { src, busy, .. } => {
                self.mark_operand_read(WordOperand::Cell(src));
                self.mark_operand_read(WordOperand::Cell(busy));
                Some(op)
            }
            IrOp::Module { word, limit, .. } => {
                self.is_acc_read = true;
                self.mark_operand_read(WordOperand::Cell(word));
                self.mark_operand_read(limit);
                Some(op)
            }
            IrOp::Label(_) => {
                self.is_acc_read = false;
                Some(op)
            }
            // Whatever is there may be read at its label.
            IrOp::Jump { .. } => {
                *self = Liveness { is_acc_read: false, dead_bits: HashSet::new(), dead_words: HashSet::new() };
                Some(op)
            }
            IrOp::If { cond, if_true, if_false } => {
                let mut other = self.clone();
                let if_true = backward(if_true, self);
                let if_false = backward(if_false, &mut other);
                if if_true.is_empty() && if_false.is_empty() {
                    return None;
                }
                self.is_acc_read |= other.is_acc_read;
                self.dead_bits.retain(|bit| other.dead_bits.contains(bit));
                self.dead_words.retain(|word| other.dead_words.contains(word));
                match &cond {
                    BranchCondition::Acc => self.is_acc_read = true,
                    BranchCondition::Bit(bit) => self.mark_bit_read(*bit),
                    BranchCondition::Compare(compare) => self.mark_comparison_read(compare),
                }
                Some(IrOp::If { cond, if_true, if_false })
            }
        }
    }

    fn mark_bit_read(&mut self, bit: BitId) {
        self.dead_bits.remove(&bit);
    }

    fn mark_operand_read(&mut self, value: WordOperand) {
        if let WordOperand::Cell(word) = value {
            self.dead_words.remove(&word);
        }
    }

    fn mark_comparison_read(&mut self, compare: &WordComparison) {
        self.mark_operand_read(WordOperand::Cell(compare.a));
        self.mark_operand_read(compare.b);
    }
}
