//! Faults of single operations.

use ladder::{CounterKind, TimerKind};

use crate::ir::{
    ArithmeticOp, BitId, BitRole, BranchCondition, BusAction, Ir, IrOp, JumpKind, LogicOp, RelationOp, TimedModule,
    WordComparison, WordId, WordOperand,
};

/// Faults of one operation and of its nested operations: the affected operation and its replacement (`None`
/// if omitted).
pub(super) fn op_mutants(ir: &Ir, op: &IrOp) -> Vec<(IrOp, Option<IrOp>)> {
    let mut all: Vec<(IrOp, Option<IrOp>)> = own_mutants(ir, op).into_iter().map(|new| (op.clone(), new)).collect();
    if let IrOp::If { if_true: then, if_false: otherwise, .. } = op {
        all.extend(then.iter().chain(otherwise).flat_map(|inner| op_mutants(ir, inner)));
    }
    all
}

/// `op` with its `n`-th fault, in the order of [`op_mutants`].
pub(super) fn nth_mutant(ir: &Ir, op: &IrOp, n: usize) -> Option<IrOp> {
    let own = own_mutants(ir, op);
    if let Some(new) = own.get(n) {
        return new.clone();
    }
    let IrOp::If { cond, if_true: mut then, if_false: mut otherwise } = op.clone() else { return Some(op.clone()) };
    let mut left = n - own.len();
    'found: for arm in [&mut then, &mut otherwise] {
        for (at, inner) in arm.clone().iter().enumerate() {
            let count = op_mutants(ir, inner).len();
            if left >= count {
                left -= count;
                continue;
            }
            match nth_mutant(ir, inner, left) {
                Some(new) => arm.splice(at..=at, [new]).for_each(drop),
                None => _ = arm.remove(at),
            }
            break 'found;
        }
    }
    Some(IrOp::If { cond, if_true: then, if_false: otherwise })
}

/// Faults of `op` itself.
fn own_mutants(ir: &Ir, op: &IrOp) -> Vec<Option<IrOp>> {
    let mut out = Vec::new();
    let mut new = |op: IrOp| out.push(Some(op));
    match op.clone() {
        IrOp::SetAccumulator(value) => new(IrOp::SetAccumulator(!value)),
        // Without its label, its call or its return a program has no image.
        IrOp::Label(_) | IrOp::Jump { kind: JumpKind::Call { .. } | JumpKind::Return, .. } => {}
        IrOp::Jump { .. } => out.push(None),
        IrOp::Load { bit, negated } => {
            new(IrOp::Load { bit, negated: !negated });
            other_bits(ir, bit).for_each(|bit| new(IrOp::Load { bit, negated }));
        }
        IrOp::And { bit, negated } => {
            new(IrOp::And { bit, negated: !negated });
            new(IrOp::Or { bit, negated });
            new(IrOp::Load { bit, negated });
            other_bits(ir, bit).for_each(|bit| new(IrOp::And { bit, negated }));
        }
        IrOp::Or { bit, negated } => {
            new(IrOp::Or { bit, negated: !negated });
            new(IrOp::And { bit, negated });
            new(IrOp::Load { bit, negated });
            other_bits(ir, bit).for_each(|bit| new(IrOp::Or { bit, negated }));
        }
        IrOp::Store { bit, negated } => {
            new(IrOp::Store { bit, negated: !negated });
            other_bits(ir, bit).for_each(|bit| new(IrOp::Store { bit, negated }));
            out.push(None);
        }
        IrOp::SetBit { bit, value } => {
            new(IrOp::SetBit { bit, value: !value });
            out.push(None);
        }
        IrOp::Rising(bit) => {
            new(IrOp::Falling(bit));
            new(IrOp::Store { bit, negated: false });
            out.push(None);
        }
        IrOp::Falling(bit) => {
            new(IrOp::Rising(bit));
            out.push(None);
        }
        IrOp::AndCompare(compare) => {
            other_comparisons(ir, compare).into_iter().for_each(|compare| new(IrOp::AndCompare(compare)));
            out.push(None);
        }
        IrOp::Move { dst, src } => {
            other_operands(ir, src).into_iter().for_each(|src| new(IrOp::Move { dst, src }));
            other_words(ir, dst).for_each(|dst| new(IrOp::Move { dst, src }));
            out.push(None);
        }
        IrOp::Math { op, dst, a, b } => {
            let operator = match op {
                ArithmeticOp::Add => ArithmeticOp::Sub,
                ArithmeticOp::Sub | ArithmeticOp::Mul => ArithmeticOp::Add,
                ArithmeticOp::Div => ArithmeticOp::Mul,
                ArithmeticOp::And => ArithmeticOp::Or,
                ArithmeticOp::Or | ArithmeticOp::Xor => ArithmeticOp::And,
                ArithmeticOp::Shr => ArithmeticOp::Sub,
            };
            // Adding 0 or -32768 is the same as subtracting it.
            if !matches!(b, WordOperand::Const(0 | -0x8000)) || !matches!(op, ArithmeticOp::Add | ArithmeticOp::Sub) {
                new(IrOp::Math { op: operator, dst, a, b });
            }
            if matches!(op, ArithmeticOp::Sub | ArithmeticOp::Div) && a != b {
                new(IrOp::Math { op, dst, a: b, b: a });
            }
            other_operands(ir, a).into_iter().for_each(|a| new(IrOp::Math { op, dst, a, b }));
            other_operands(ir, b).into_iter().for_each(|b| new(IrOp::Math { op, dst, a, b }));
            other_words(ir, dst).for_each(|dst| new(IrOp::Math { op, dst, a, b }));
            out.push(None);
        }
        IrOp::Logic { dst, function: is } => {
            other_logic_ops(is).into_iter().for_each(|is| new(IrOp::Logic { dst, function: is }));
            out.push(None);
        }
        IrOp::Lookup { dst, index, table } => {
            // Only the destination changes: another index could be outside of the table, and other tables
            // have other lengths.
            other_words(ir, dst).for_each(|dst| new(IrOp::Lookup { dst, index, table }));
            out.push(None);
        }
        IrOp::ReadAdc { dst, input } => {
            let inputs = ir.adcs.len() as u32;
            (1..inputs).take(1).for_each(|n| new(IrOp::ReadAdc { dst, input: (input + n) % inputs }));
            other_words(ir, dst).for_each(|dst| new(IrOp::ReadAdc { dst, input }));
            out.push(None);
        }
        IrOp::SetPwm { output, duty } => {
            other_operands(ir, duty).into_iter().for_each(|duty| new(IrOp::SetPwm { output, duty }));
            out.push(None);
        }
        IrOp::Send { value } => {
            other_operands(ir, value).into_iter().for_each(|value| new(IrOp::Send { value }));
            out.push(None);
        }
        IrOp::Receive { dst } => {
            other_words(ir, dst).for_each(|dst| new(IrOp::Receive { dst }));
            new(IrOp::SetAccumulator(false));
        }
        // Without it a byte goes at another time, which matters only if others follow at once.
        IrOp::WaitSent => {}
        IrOp::Transfer { action, register, value, dst } => {
            let of = |action, register, value, dst| IrOp::Transfer { action, register, value, dst };
            let i2c = |device: u8| (device ^ 1) & 127;
            match action {
                BusAction::I2cWrite(device) => {
                    new(of(BusAction::I2cWrite(i2c(device)), register, value, dst));
                    other_operands(ir, value).into_iter().for_each(|value| new(of(action, register, value, dst)));
                }
                BusAction::I2cRead(device) => new(of(BusAction::I2cRead(i2c(device)), register, value, dst)),
                BusAction::Spi => {
                    other_operands(ir, value).into_iter().for_each(|value| new(of(action, register, value, dst)));
                }
            }
            if action != BusAction::Spi {
                other_operands(ir, register).into_iter().for_each(|register| new(of(action, register, value, dst)));
            }
            if let Some(to) = dst {
                other_words(ir, to).for_each(|to| new(of(action, register, value, Some(to))));
            }
            out.push(None);
        }
        IrOp::ReadEeprom { dst, addr } => {
            let more = addr + 1;
            if more + u16::from(ir.bytes(dst)) <= ir.eeprom_bytes {
                new(IrOp::ReadEeprom { dst, addr: more });
            }
            out.push(None);
        }
        IrOp::WriteEeprom { src, addr, busy, scans } => {
            new(IrOp::WriteEeprom { src, addr, busy, scans: scans + 1 });
            out.push(None);
        }
        IrOp::Module { module: is, word, limit } => {
            other_operands(ir, limit).into_iter().for_each(|limit| new(IrOp::Module { module: is, word, limit }));
            other_modules(is).into_iter().for_each(|is| new(IrOp::Module { module: is, word, limit }));
            out.push(None);
        }
        IrOp::If { cond, if_true: then, if_false: otherwise } => {
            new(IrOp::If { cond, if_true: otherwise.clone(), if_false: then.clone() });
            if let BranchCondition::Compare(compare) = cond {
                for compare in other_comparisons(ir, compare) {
                    let (then, otherwise) = (then.clone(), otherwise.clone());
                    new(IrOp::If { cond: BranchCondition::Compare(compare), if_true: then, if_false: otherwise });
                }
            }
        }
    }
    out
}

/// Other functions of the same bits.
fn other_logic_ops(is: LogicOp) -> Vec<LogicOp> {
    match is {
        LogicOp::Copy(a) => vec![LogicOp::Not(a)],
        LogicOp::Not(a) => vec![LogicOp::Copy(a)],
        LogicOp::And(a, b) => vec![LogicOp::Or(a, b), LogicOp::Copy(a), LogicOp::Copy(b)],
        LogicOp::Or(a, b) => vec![LogicOp::And(a, b), LogicOp::Copy(a), LogicOp::Copy(b)],
    }
}

/// Other kinds of timers, or of counters.
fn other_modules(is: TimedModule) -> Vec<TimedModule> {
    let timers = [TimerKind::Ton, TimerKind::Tof, TimerKind::Rto].map(TimedModule::Timer).to_vec();
    let counters = |input, bounded| {
        [CounterKind::Ctu, CounterKind::Ctd, CounterKind::Ctc]
            .map(|kind| TimedModule::Counter { kind, input, bounded })
            .to_vec()
    };
    let all = match is {
        TimedModule::Timer(_) => timers,
        TimedModule::Counter { input, bounded, .. } => counters(input, bounded),
    };
    all.into_iter().filter(|other| *other != is).collect()
}

fn other_comparisons(ir: &Ir, compare: WordComparison) -> Vec<WordComparison> {
    let rel = match compare.rel {
        RelationOp::Eq => RelationOp::Ne,
        RelationOp::Ne => RelationOp::Eq,
        RelationOp::Lt => RelationOp::Ge,
        RelationOp::Ge => RelationOp::Lt,
    };
    let mut out = vec![WordComparison { rel, ..compare }];
    if let (WordOperand::Cell(b), RelationOp::Lt | RelationOp::Ge) = (compare.b, compare.rel)
        && b != compare.a
    {
        out.push(WordComparison { a: b, b: WordOperand::Cell(compare.a), ..compare });
    }
    out.extend(other_operands(ir, compare.b).into_iter().map(|b| WordComparison { b, ..compare }));
    out.extend(other_words(ir, compare.a).map(|a| WordComparison { a, ..compare }));
    out
}

/// The constant plus one and minus one, or the next word.
fn other_operands(ir: &Ir, value: WordOperand) -> Vec<WordOperand> {
    match value {
        WordOperand::Const(c) => vec![WordOperand::Const(c.wrapping_add(1)), WordOperand::Const(c.wrapping_sub(1))],
        WordOperand::Cell(word) => other_words(ir, word).map(WordOperand::Cell).collect(),
    }
}

/// The next bit of the same role, if there is one.
fn other_bits(ir: &Ir, bit: BitId) -> impl Iterator<Item = BitId> {
    let count = ir.bits.len() as u32;
    let role = |bit: BitId| ir.bits.get(bit.0 as usize).map(|cell| cell.role);
    let wanted = role(bit).filter(|role| *role != BitRole::Memory);
    (1..count).map(|n| BitId((bit.0 + n) % count)).find(|&other| wanted.is_some() && role(other) == wanted).into_iter()
}

/// The next word, if there is one.
fn other_words(ir: &Ir, word: WordId) -> impl Iterator<Item = WordId> {
    let count = ir.words.len() as u32;
    (count > 1).then(|| WordId((word.0 + 1) % count)).into_iter()
}
