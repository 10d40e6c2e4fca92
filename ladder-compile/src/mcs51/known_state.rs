//! State known during selection: the accumulator of the intermediate code, the carry, A and R0.
//!
//! The accumulator is usually the carry, but it may also be complemented, equal to a bit that was loaded or
//! stored, or constant. Code that computes it is emitted only where it is needed. So a jump can test the bit
//! directly, and unused values cost nothing.

use crate::ir::{BitId, BranchCondition, IrOp};

/// A bit that instructions can test.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum BitSource {
    /// A bit cell.
    Cell(BitId),
    /// F0, which holds the accumulator while the carry is in use.
    Saved,
}

/// What is known of the accumulator; all entries are true at the same time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct AccumulatorState {
    /// The accumulator is the carry; `true` if complemented.
    pub carry: Option<bool>,
    /// The accumulator is this bit; `true` if complemented.
    pub flag: Option<(BitSource, bool)>,
    /// The accumulator is this constant.
    pub known: Option<bool>,
}

/// A byte operand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ByteOperand {
    /// RAM: 0 to 7 are the registers; from 80h on it is accessed through R0.
    At(u8),
    /// A constant.
    Imm(u8),
    /// A special function register.
    Sfr(i32),
}

/// What is known at one position in the code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct SelectorState {
    /// The accumulator of the intermediate code.
    pub acc: AccumulatorState,
    /// Value of the carry.
    pub carry: Option<bool>,
    /// Content of A: RAM or a constant.
    pub a: Option<ByteOperand>,
    /// Content of R0.
    pub r0: Option<u8>,
}

impl SelectorState {
    /// Whether the carry is the accumulator; `Some(true)` if complemented.
    #[must_use]
    pub(super) fn in_carry(&self) -> Option<bool> {
        let constant = || Some(self.acc.known? ^ self.carry?);
        self.acc.carry.or_else(constant)
    }

    /// True if a change of the carry destroys the accumulator.
    #[must_use]
    pub(super) fn only_in_carry(&self) -> bool {
        self.acc.carry.is_some() && self.acc.flag.is_none() && self.acc.known.is_none()
    }

    /// What is known after either of two states; the accumulator is kept only if something is known of it.
    #[must_use]
    pub(super) fn merge(&self, other: &SelectorState) -> SelectorState {
        fn both<T: PartialEq>(a: Option<T>, b: Option<T>) -> Option<T> {
            if a == b { a } else { None }
        }
        SelectorState {
            acc: AccumulatorState {
                carry: both(self.in_carry(), other.in_carry()),
                flag: both(self.acc.flag, other.acc.flag),
                known: both(self.acc.known, other.acc.known),
            },
            carry: both(self.carry, other.carry),
            a: both(self.a, other.a),
            r0: both(self.r0, other.r0),
        }
    }

    /// Number of instructions that load the accumulator into the carry, complemented if `inverted`.
    #[must_use]
    pub(super) fn carry_cost(&self, inverted: bool) -> u32 {
        match (self.in_carry(), self.acc.known, self.acc.flag) {
            (Some(now), ..) => u32::from(now != inverted),
            (_, Some(_), _) => 1,
            (_, _, Some((_, negated))) => 2 + u32::from(negated != inverted),
            _ => 0,
        }
    }
}

/// Whether the accumulator is read after each of `ops` before it is set; `after` is the answer for the last.
#[must_use]
pub(super) fn acc_live_after(ops: &[&IrOp], after: bool) -> Vec<bool> {
    let mut live = after;
    let mut all: Vec<bool> = ops
        .iter()
        .rev()
        .map(|op| {
            let this = live;
            live = is_accumulator_read(op, live);
            this
        })
        .collect();
    all.reverse();
    all
}

/// True if a list reads the accumulator before setting it; `after` says whether the following code reads it.
#[must_use]
pub(super) fn reads_accumulator(ops: &[IrOp], after: bool) -> bool {
    ops.iter().rev().fold(after, |live, op| is_accumulator_read(op, live))
}

fn is_accumulator_read(op: &IrOp, after: bool) -> bool {
    match op {
        IrOp::SetAccumulator(_) | IrOp::Load { .. } | IrOp::Receive { .. } | IrOp::Logic { .. } => false,
        // Nobody reads it where a jump goes.
        IrOp::Label(_) | IrOp::Jump { .. } => false,
        // Operations that only narrow or widen the accumulator are omitted if it is not read.
        IrOp::And { .. } | IrOp::Or { .. } | IrOp::AndCompare(_) => after,
        IrOp::Store { .. } | IrOp::Rising(_) | IrOp::Falling(_) | IrOp::Module { .. } => true,
        IrOp::SetBit { .. } | IrOp::Move { .. } | IrOp::Math { .. } | IrOp::Lookup { .. } | IrOp::ReadAdc { .. } => {
            after
        }
        IrOp::Transfer { .. } | IrOp::WaitSent => after,
        IrOp::SetPwm { .. } | IrOp::Send { .. } | IrOp::ReadEeprom { .. } | IrOp::WriteEeprom { .. } => after,
        IrOp::If { cond, if_true: then, if_false: otherwise } => {
            *cond == BranchCondition::Acc || reads_accumulator(then, after) || reads_accumulator(otherwise, after)
        }
    }
}
