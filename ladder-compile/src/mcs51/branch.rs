//! Conditions, and the joining of the two ways that a program may take.

use emu_8051::isa::Kind;

use super::arch::Jump;
use super::regs::F0;
use super::select::{Line, Select};
use super::state::{Acc, Flag, State, reads};
use crate::code::Label;
use crate::ir::{Cond, Op};

impl Select<'_> {
    pub(super) fn branch(&mut self, cond: Cond, then: &[Op], otherwise: &[Op], after: bool) {
        if then.is_empty() && otherwise.is_empty() {
            return;
        }
        if let (Cond::Acc, Some(value)) = (cond, self.now.acc.known) {
            return self.list(if value { then } else { otherwise }, after);
        }
        // Only one arm: jump past it. Two: the first ends with a jump past the second.
        let (first, second, holds) = if then.is_empty() { (otherwise, then, false) } else { (then, otherwise, true) };
        let (other, end) = (self.asm.label(), self.asm.label());
        let (go_on, jump) = self.decide(cond, holds, other, reads(then, after) || reads(otherwise, after));
        let before = std::mem::take(&mut self.out);
        self.now = go_on;
        self.list(first, after);
        let (mut one, one_ends) = (std::mem::take(&mut self.out), self.now);
        self.now = jump;
        self.list(second, after);
        let (mut two, two_ends) = (std::mem::take(&mut self.out), self.now);

        let mut joined = one_ends.meet(&two_ends);
        if !after {
            joined.acc = Acc::default();
        } else if joined.acc == Acc::default() {
            // An arm without code is best left so.
            let cost =
                |inverted| one_ends.cost(inverted) + two_ends.cost(inverted) * if two.is_empty() { 3 } else { 1 };
            let inverted = cost(true) < cost(false);
            let mut agree = |lines: &mut Vec<Line>, ends: State| {
                self.now = ends;
                self.acc_to_carry_as(inverted);
                lines.append(&mut self.out);
                self.now
            };
            let (one_ends, two_ends) = (agree(&mut one, one_ends), agree(&mut two, two_ends));
            joined = one_ends.meet(&two_ends);
        }
        self.now = joined;
        self.out = before;
        self.out.append(&mut one);
        if !two.is_empty() {
            self.out.push(Line::Jump(Jump::Go, end));
        }
        self.place(other);
        self.out.append(&mut two);
        self.place(end);
    }

    /// Goes on where the condition is as `holds` says, jumps elsewhere; returns what is known in both cases.
    fn decide(&mut self, cond: Cond, holds: bool, other: Label, live: bool) -> (State, State) {
        let (flag, negated) = match cond {
            Cond::Compare(compare) => {
                let keep = live && self.now.only_in_carry();
                let (on, off) = self.compare_jump(&compare, !holds, other, keep);
                return if live { (on, off) } else { (without_acc(on), without_acc(off)) };
            }
            Cond::Bit(bit) => (Some(Flag::Cell(bit)), false),
            Cond::Acc => (self.now.acc.flag.map(|(flag, _)| flag), self.now.acc.flag.is_some_and(|(_, n)| n)),
        };
        let is_acc = cond == Cond::Acc || self.now.acc.flag.is_some_and(|(known, _)| Some(known) == flag);
        let wanted = |state: State, value: bool| {
            // The value of the condition; of the accumulator, where that is the same.
            let flips = cond != Cond::Acc && complemented(&state);
            State {
                acc: Acc { known: if is_acc { Some(value ^ flips) } else { state.acc.known }, ..state.acc },
                ..state
            }
        };
        let (on, off) = if let (true, Some(inverted)) = (is_acc, self.now.in_carry()) {
            // The condition is the carry, complemented if so.
            let flips = inverted ^ (cond != Cond::Acc && complemented(&self.now));
            self.jump(if holds ^ flips { Kind::Jnc } else { Kind::Jc }, &[], other);
            let carry = |value: bool| State { carry: Some(value ^ flips), ..self.now };
            (wanted(carry(holds), holds), wanted(carry(!holds), !holds))
        } else {
            let at = flag.map_or(F0, |flag| self.look(flag));
            self.jump(if holds ^ negated { Kind::Jnb } else { Kind::Jb }, &[at], other);
            (wanted(self.now, holds), wanted(self.now, !holds))
        };
        if live { (on, off) } else { (without_acc(on), without_acc(off)) }
    }
}

/// The flag that the accumulator is the same as is complemented.
fn complemented(state: &State) -> bool {
    state.acc.flag.is_some_and(|(_, negated)| negated)
}

fn without_acc(state: State) -> State {
    State { acc: Acc::default(), ..state }
}
