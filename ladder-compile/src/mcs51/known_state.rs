//! What is known of the machine while code is made: the accumulator of the intermediate code, the carry, A and R0.
//!
//! The accumulator is the carry, but not always and not always as it is: it may be kept complemented, it may be the same as a
//! bit that was loaded or stored, or a constant. Code for it is made where it is needed, so that a jump can look at the
//! bit itself, and what nobody looks at costs nothing.

use crate::ir::{BitId, BranchCondition, IrOp};

/// A bit that can be looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum BitSource {
    /// A bit cell.
    Cell(BitId),
    /// F0, in which the accumulator waits while the carry works.
    Saved,
}

/// What is known of the accumulator; all of it is true at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct AccumulatorState {
    /// It is the carry, complemented if so.
    pub carry: Option<bool>,
    /// It is this bit, complemented if so.
    pub flag: Option<(BitSource, bool)>,
    /// It is this constant.
    pub known: Option<bool>,
}

/// A byte operand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ByteOperand {
    /// RAM; 0 to 7 are the registers, from 80h on it is reached through R0.
    At(u8),
    /// A constant.
    Imm(u8),
    /// A special function register.
    Sfr(i32),
}

/// What is known at a place in the code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct SelectorState {
    /// The accumulator of the intermediate code.
    pub acc: AccumulatorState,
    /// The carry.
    pub carry: Option<bool>,
    /// What A holds: RAM or a constant.
    pub a: Option<ByteOperand>,
    /// What R0 holds.
    pub r0: Option<u8>,
}

impl SelectorState {
    /// The carry is the accumulator, complemented if so.
    #[must_use]
    pub(super) fn in_carry(&self) -> Option<bool> {
        let constant = || Some(self.acc.known? ^ self.carry?);
        self.acc.carry.or_else(constant)
    }

    /// The accumulator is lost when the carry changes.
    #[must_use]
    pub(super) fn only_in_carry(&self) -> bool {
        self.acc.carry.is_some() && self.acc.flag.is_none() && self.acc.known.is_none()
    }

    /// What is true after either; the accumulator is only kept where that gives something.
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

    /// Instructions that make the carry the accumulator, complemented if `inverted`.
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

/// Whether the accumulator is read after each of `ops` before it is set, if `after` says so for the last.
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

/// Whether a list reads the accumulator before it sets it.
#[must_use]
pub(super) fn reads_accumulator(ops: &[IrOp], after: bool) -> bool {
    ops.iter().rev().fold(after, |live, op| is_accumulator_read(op, live))
}

fn is_accumulator_read(op: &IrOp, after: bool) -> bool {
    match op {
        IrOp::SetAccumulator(_) | IrOp::Load { .. } | IrOp::Receive { .. } | IrOp::Logic { .. } => false,
        // What only narrows or widens it is left out where nobody looks.
        IrOp::And { .. } | IrOp::Or { .. } | IrOp::AndCompare(_) => after,
        IrOp::Store { .. } | IrOp::Rising(_) | IrOp::Falling(_) | IrOp::Module { .. } => true,
        IrOp::SetBit { .. } | IrOp::Move { .. } | IrOp::Math { .. } | IrOp::Lookup { .. } | IrOp::ReadAdc { .. } => {
            after
        }
        IrOp::SetPwm { .. } | IrOp::Send { .. } | IrOp::ReadEeprom { .. } | IrOp::WriteEeprom { .. } => after,
        IrOp::If { cond, if_true: then, if_false: otherwise } => {
            *cond == BranchCondition::Acc || reads_accumulator(then, after) || reads_accumulator(otherwise, after)
        }
    }
}
