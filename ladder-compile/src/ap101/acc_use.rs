//! Finds how the code that follows an operation uses the accumulator.

use ladder::CounterKind;

use crate::ir::{BranchCondition, IrOp, TimedModule};

/// What follows an operation: the rest of its list, then the continuation of that list.
#[derive(Clone, Copy)]
pub(super) struct OpContinuation<'a> {
    /// Rest of the current list of operations.
    pub ops: &'a [&'a IrOp],
    /// Continuation after that list.
    pub then: Option<&'a OpContinuation<'a>>,
}

/// How a list of operations uses the accumulator that it receives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum AccumulatorUse {
    /// Reads it.
    Reads,
    /// Overwrites it before any read.
    Sets,
    /// Neither reads nor overwrites it.
    Leaves,
}

fn accumulator_use<'a>(mut ops: impl Iterator<Item = &'a IrOp>) -> AccumulatorUse {
    let one = |op: &IrOp| match op {
        IrOp::SetAccumulator(_) | IrOp::Load { .. } | IrOp::Logic { .. } => AccumulatorUse::Sets,
        // Nobody reads it where a jump goes.
        IrOp::Label(_) | IrOp::Jump { .. } => AccumulatorUse::Sets,
        IrOp::SetBit { .. } | IrOp::Move { .. } => AccumulatorUse::Leaves,
        IrOp::If { cond: BranchCondition::Bit(_), if_true: then, if_false: otherwise } => {
            match (accumulator_use(then.iter()), accumulator_use(otherwise.iter())) {
                (AccumulatorUse::Reads, _) | (_, AccumulatorUse::Reads) => AccumulatorUse::Reads,
                (AccumulatorUse::Sets, AccumulatorUse::Sets) => AccumulatorUse::Sets,
                _ => AccumulatorUse::Leaves,
            }
        }
        _ => AccumulatorUse::Reads,
    };
    ops.find_map(|op| Some(one(op)).filter(|used| *used != AccumulatorUse::Leaves)).unwrap_or(AccumulatorUse::Leaves)
}

/// True if the accumulator is read before it is overwritten.
pub(super) fn reads_acc(rest: &OpContinuation<'_>) -> bool {
    match accumulator_use(rest.ops.iter().copied()) {
        AccumulatorUse::Leaves => rest.then.is_some_and(reads_acc),
        used => used == AccumulatorUse::Reads,
    }
}

/// True if the following code is shorter when A holds the complement of the accumulator.
pub(super) fn prefers_inverted(rest: &OpContinuation<'_>) -> bool {
    let mut turned = false;
    for op in rest.ops {
        match op {
            IrOp::And { .. } | IrOp::Or { .. } | IrOp::Store { .. } => {}
            // A constant is written once for each value of A, which inverts A.
            IrOp::SetBit { .. } | IrOp::Move { .. } => turned = !turned,
            IrOp::Rising(_) => return !turned,
            IrOp::Module { module: TimedModule::Counter { kind: CounterKind::Ctc, .. }, .. } => {}
            IrOp::If { cond: BranchCondition::Acc, if_true: then, if_false: otherwise } => {
                return turned != (then.is_empty() && !otherwise.is_empty());
            }
            _ => return turned,
        }
    }
    turned
}
