//! Selects conditional branches and joins the known state of both paths.

use super::compare::BranchStates;
use emu_8051::isa::Mcs51OpKind;

use super::arch::Mcs51Jump;
use super::known_state::{AccumulatorState, BitSource, SelectorState, reads_accumulator};
use super::registers::F0;
use super::select::{Mcs51Selector, PendingCode};
use crate::code::CodeLabel;
use crate::ir::{BranchCondition, IrOp};

impl Mcs51Selector<'_> {
    /// Selects code for one of two lists; `after` says whether the accumulator is read afterwards.
    pub(super) fn branch(&mut self, cond: BranchCondition, then: &[IrOp], otherwise: &[IrOp], after: bool) {
        if then.is_empty() && otherwise.is_empty() {
            return;
        }
        if let (BranchCondition::Acc, Some(value)) = (cond, self.state.acc.known) {
            return self.select_ops(if value { then } else { otherwise }, after);
        }
        // With one arm, jump past it; with two, the first ends with a jump past the second.
        let (first, second, holds) = if then.is_empty() { (otherwise, then, false) } else { (then, otherwise, true) };
        let (other, end) = (self.asm.new_label(), self.asm.new_label());
        let (go_on, jump) =
            self.branch_on(cond, holds, other, reads_accumulator(then, after) || reads_accumulator(otherwise, after));
        let before = std::mem::take(&mut self.pending);
        self.state = go_on;
        self.select_ops(first, after);
        let (mut one, one_ends) = (std::mem::take(&mut self.pending), self.state);
        self.state = jump;
        self.select_ops(second, after);
        let (mut two, two_ends) = (std::mem::take(&mut self.pending), self.state);

        let mut joined = one_ends.merge(&two_ends);
        if !after {
            joined.acc = AccumulatorState::default();
        } else if joined.acc == AccumulatorState::default() {
            // Prefer a form in which an arm without code stays empty.
            let cost = |inverted| {
                one_ends.carry_cost(inverted) + two_ends.carry_cost(inverted) * if two.is_empty() { 3 } else { 1 }
            };
            let inverted = cost(true) < cost(false);
            let mut agree = |lines: &mut Vec<PendingCode>, ends: SelectorState| {
                self.state = ends;
                self.acc_to_carry_as(inverted);
                lines.append(&mut self.pending);
                self.state
            };
            let (one_ends, two_ends) = (agree(&mut one, one_ends), agree(&mut two, two_ends));
            joined = one_ends.merge(&two_ends);
        }
        self.state = joined;
        self.pending = before;
        self.pending.append(&mut one);
        if !two.is_empty() {
            self.pending.push(PendingCode::Jump(Mcs51Jump::Unconditional, end));
        }
        self.place(other);
        self.pending.append(&mut two);
        self.place(end);
    }

    /// Continues if the condition equals `holds`, and jumps to `other` if not; returns the known state of
    /// both paths.
    fn branch_on(
        &mut self,
        cond: BranchCondition,
        holds: bool,
        other: CodeLabel,
        live: bool,
    ) -> (SelectorState, SelectorState) {
        let (flag, negated) = match cond {
            BranchCondition::Compare(compare) => {
                let keep = live && self.state.only_in_carry();
                let BranchStates { on, jump } = self.compare_jump(&compare, !holds, other, keep);
                return if live { (on, jump) } else { (without_acc(on), without_acc(jump)) };
            }
            BranchCondition::Bit(bit) => (Some(BitSource::Cell(bit)), false),
            BranchCondition::Acc => {
                (self.state.acc.flag.map(|(flag, _)| flag), self.state.acc.flag.is_some_and(|(_, n)| n))
            }
        };
        let is_acc = cond == BranchCondition::Acc || self.state.acc.flag.is_some_and(|(known, _)| Some(known) == flag);
        let wanted = |state: SelectorState, value: bool| {
            // Value of the condition, and of the accumulator if it is the same bit.
            let flips = cond != BranchCondition::Acc && complemented(&state);
            SelectorState {
                acc: AccumulatorState {
                    known: if is_acc { Some(value ^ flips) } else { state.acc.known },
                    ..state.acc
                },
                ..state
            }
        };
        let (on, off) = if let (true, Some(inverted)) = (is_acc, self.state.in_carry()) {
            // The condition is the carry, complemented if `flips`.
            let flips = inverted ^ (cond != BranchCondition::Acc && complemented(&self.state));
            self.jump(if holds ^ flips { Mcs51OpKind::Jnc } else { Mcs51OpKind::Jc }, &[], other);
            let carry = |value: bool| SelectorState { carry: Some(value ^ flips), ..self.state };
            (wanted(carry(holds), holds), wanted(carry(!holds), !holds))
        } else {
            let at = flag.map_or(F0, |flag| self.load_flag(flag));
            self.jump(if holds ^ negated { Mcs51OpKind::Jnb } else { Mcs51OpKind::Jb }, &[at], other);
            (wanted(self.state, holds), wanted(self.state, !holds))
        };
        if live { (on, off) } else { (without_acc(on), without_acc(off)) }
    }
}

/// True if the flag that equals the accumulator is its complement.
fn complemented(state: &SelectorState) -> bool {
    state.acc.flag.is_some_and(|(_, negated)| negated)
}

fn without_acc(state: SelectorState) -> SelectorState {
    SelectorState { acc: AccumulatorState::default(), ..state }
}
