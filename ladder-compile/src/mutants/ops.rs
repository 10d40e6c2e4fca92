//! The faults of single operations.

use ladder::{CounterKind, TimerKind};

use crate::ir::{Bit, BitRole, Compare, Cond, Ir, Logic, Math, Module, Op, Rel, Value, Word};

/// The faults of one operation and of those within it: the operation that is changed, and what it becomes (`None`: it is
/// left out).
pub(super) fn variants(ir: &Ir, op: &Op) -> Vec<(Op, Option<Op>)> {
    let mut all: Vec<(Op, Option<Op>)> = own(ir, op).into_iter().map(|new| (op.clone(), new)).collect();
    if let Op::If { then, otherwise, .. } = op {
        all.extend(then.iter().chain(otherwise).flat_map(|inner| variants(ir, inner)));
    }
    all
}

/// `op` with its `n`-th fault, in the order of [`variants`].
pub(super) fn replaced(ir: &Ir, op: &Op, n: usize) -> Option<Op> {
    let own = own(ir, op);
    if let Some(new) = own.get(n) {
        return new.clone();
    }
    let Op::If { cond, mut then, mut otherwise } = op.clone() else { return Some(op.clone()) };
    let mut left = n - own.len();
    'found: for arm in [&mut then, &mut otherwise] {
        for (at, inner) in arm.clone().iter().enumerate() {
            let count = variants(ir, inner).len();
            if left >= count {
                left -= count;
                continue;
            }
            match replaced(ir, inner, left) {
                Some(new) => arm.splice(at..=at, [new]).for_each(drop),
                None => _ = arm.remove(at),
            }
            break 'found;
        }
    }
    Some(Op::If { cond, then, otherwise })
}

/// The faults of `op` itself.
fn own(ir: &Ir, op: &Op) -> Vec<Option<Op>> {
    let mut out = Vec::new();
    let mut new = |op: Op| out.push(Some(op));
    match op.clone() {
        Op::Acc(value) => new(Op::Acc(!value)),
        Op::Load { bit, negated } => {
            new(Op::Load { bit, negated: !negated });
            other_bits(ir, bit).for_each(|bit| new(Op::Load { bit, negated }));
        }
        Op::And { bit, negated } => {
            new(Op::And { bit, negated: !negated });
            new(Op::Or { bit, negated });
            new(Op::Load { bit, negated });
            other_bits(ir, bit).for_each(|bit| new(Op::And { bit, negated }));
        }
        Op::Or { bit, negated } => {
            new(Op::Or { bit, negated: !negated });
            new(Op::And { bit, negated });
            new(Op::Load { bit, negated });
            other_bits(ir, bit).for_each(|bit| new(Op::Or { bit, negated }));
        }
        Op::Store { bit, negated } => {
            new(Op::Store { bit, negated: !negated });
            other_bits(ir, bit).for_each(|bit| new(Op::Store { bit, negated }));
            out.push(None);
        }
        Op::Put { bit, value } => {
            new(Op::Put { bit, value: !value });
            out.push(None);
        }
        Op::Rising(bit) => {
            new(Op::Falling(bit));
            new(Op::Store { bit, negated: false });
            out.push(None);
        }
        Op::Falling(bit) => {
            new(Op::Rising(bit));
            out.push(None);
        }
        Op::AndCompare(compare) => {
            compares(ir, compare).into_iter().for_each(|compare| new(Op::AndCompare(compare)));
            out.push(None);
        }
        Op::Move { dst, src } => {
            values(ir, src).into_iter().for_each(|src| new(Op::Move { dst, src }));
            other_words(ir, dst).for_each(|dst| new(Op::Move { dst, src }));
            out.push(None);
        }
        Op::Math { op, dst, a, b } => {
            let operator = match op {
                Math::Add => Math::Sub,
                Math::Sub | Math::Mul => Math::Add,
                Math::Div => Math::Mul,
            };
            // Adding 0 or -32768 is the same as taking it away.
            if !matches!(b, Value::Const(0 | -0x8000)) || matches!(op, Math::Mul | Math::Div) {
                new(Op::Math { op: operator, dst, a, b });
            }
            if matches!(op, Math::Sub | Math::Div) && a != b {
                new(Op::Math { op, dst, a: b, b: a });
            }
            values(ir, a).into_iter().for_each(|a| new(Op::Math { op, dst, a, b }));
            values(ir, b).into_iter().for_each(|b| new(Op::Math { op, dst, a, b }));
            other_words(ir, dst).for_each(|dst| new(Op::Math { op, dst, a, b }));
            out.push(None);
        }
        Op::Logic { dst, is } => {
            logics(is).into_iter().for_each(|is| new(Op::Logic { dst, is }));
            out.push(None);
        }
        Op::Lookup { dst, index, table } => {
            // The index of another word might lie outside of the table; another table has another length.
            other_words(ir, dst).for_each(|dst| new(Op::Lookup { dst, index, table }));
            out.push(None);
        }
        Op::ReadAdc { dst, input } => {
            let inputs = ir.adcs.len() as u32;
            (1..inputs).take(1).for_each(|n| new(Op::ReadAdc { dst, input: (input + n) % inputs }));
            other_words(ir, dst).for_each(|dst| new(Op::ReadAdc { dst, input }));
            out.push(None);
        }
        Op::SetPwm { duty } => {
            values(ir, duty).into_iter().for_each(|duty| new(Op::SetPwm { duty }));
            out.push(None);
        }
        Op::Send { value } => {
            values(ir, value).into_iter().for_each(|value| new(Op::Send { value }));
            out.push(None);
        }
        Op::Receive { dst } => {
            other_words(ir, dst).for_each(|dst| new(Op::Receive { dst }));
            new(Op::Acc(false));
        }
        Op::Recall { dst, addr } => {
            let more = addr + 1;
            if more + u16::from(ir.bytes(dst)) <= ir.eeprom {
                new(Op::Recall { dst, addr: more });
            }
            out.push(None);
        }
        Op::Persist { src, addr, busy, scans } => {
            new(Op::Persist { src, addr, busy, scans: scans + 1 });
            out.push(None);
        }
        Op::Module { is, word, limit } => {
            values(ir, limit).into_iter().for_each(|limit| new(Op::Module { is, word, limit }));
            other_modules(is).into_iter().for_each(|is| new(Op::Module { is, word, limit }));
            out.push(None);
        }
        Op::If { cond, then, otherwise } => {
            new(Op::If { cond, then: otherwise.clone(), otherwise: then.clone() });
            if let Cond::Compare(compare) = cond {
                for compare in compares(ir, compare) {
                    let (then, otherwise) = (then.clone(), otherwise.clone());
                    new(Op::If { cond: Cond::Compare(compare), then, otherwise });
                }
            }
        }
    }
    out
}

/// Other functions of the same bits.
fn logics(is: Logic) -> Vec<Logic> {
    match is {
        Logic::Copy(a) => vec![Logic::Not(a)],
        Logic::Not(a) => vec![Logic::Copy(a)],
        Logic::And(a, b) => vec![Logic::Or(a, b), Logic::Copy(a), Logic::Copy(b)],
        Logic::Or(a, b) => vec![Logic::And(a, b), Logic::Copy(a), Logic::Copy(b)],
    }
}

/// The other kinds of timers, or of counters.
fn other_modules(is: Module) -> Vec<Module> {
    let timers = [TimerKind::Ton, TimerKind::Tof, TimerKind::Rto].map(Module::Timer).to_vec();
    let counters = |input, bounded| {
        [CounterKind::Ctu, CounterKind::Ctd, CounterKind::Ctc]
            .map(|kind| Module::Counter { kind, input, bounded })
            .to_vec()
    };
    let all = match is {
        Module::Timer(_) => timers,
        Module::Counter { input, bounded, .. } => counters(input, bounded),
    };
    all.into_iter().filter(|other| *other != is).collect()
}

fn compares(ir: &Ir, compare: Compare) -> Vec<Compare> {
    let rel = match compare.rel {
        Rel::Eq => Rel::Ne,
        Rel::Ne => Rel::Eq,
        Rel::Lt => Rel::Ge,
        Rel::Ge => Rel::Lt,
    };
    let mut out = vec![Compare { rel, ..compare }];
    if let (Value::Cell(b), Rel::Lt | Rel::Ge) = (compare.b, compare.rel)
        && b != compare.a
    {
        out.push(Compare { a: b, b: Value::Cell(compare.a), ..compare });
    }
    out.extend(values(ir, compare.b).into_iter().map(|b| Compare { b, ..compare }));
    out.extend(other_words(ir, compare.a).map(|a| Compare { a, ..compare }));
    out
}

/// A constant by one up and down, or the next word.
fn values(ir: &Ir, value: Value) -> Vec<Value> {
    match value {
        Value::Const(c) => vec![Value::Const(c.wrapping_add(1)), Value::Const(c.wrapping_sub(1))],
        Value::Cell(word) => other_words(ir, word).map(Value::Cell).collect(),
    }
}

/// The next bit of the same role, if there is another.
fn other_bits(ir: &Ir, bit: Bit) -> impl Iterator<Item = Bit> {
    let count = ir.bits.len() as u32;
    let role = |bit: Bit| ir.bits.get(bit.0 as usize).map(|cell| cell.role);
    let wanted = role(bit).filter(|role| *role != BitRole::Memory);
    (1..count).map(|n| Bit((bit.0 + n) % count)).find(|&other| wanted.is_some() && role(other) == wanted).into_iter()
}

/// The next word, if there is another.
fn other_words(ir: &Ir, word: Word) -> impl Iterator<Item = Word> {
    let count = ir.words.len() as u32;
    (count > 1).then(|| Word((word.0 + 1) % count)).into_iter()
}
