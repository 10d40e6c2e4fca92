//! Operations on bits and the course of the program to instructions.
//!
//! The accumulator of the intermediate code is the carry; what else is known of it stands in [`State`]. Code is collected in
//! lines, so that the two arms of a branch can be brought to agree before they are joined.

use emu_8051::isa::Kind;

use super::arch::{Jump, Mcs51};
use super::layout::Layout;
use super::regs::{ACC, B, F0, Regs};
use super::state::{Acc, Byte, Flag, State, live, reads};
use crate::code::{Asm, Label};
use crate::ir::{Bit, Cond, Ir, Logic, Op};
use crate::target::Mark;

/// A line of code that is not yet in the assembler.
#[derive(Debug, Clone)]
pub enum Line {
    /// An instruction.
    Op(Kind, Vec<i32>),
    /// What refers to a label.
    Jump(Jump, Label),
    /// A label.
    Place(Label),
    /// A jump back, taken at most so many times in a row.
    Repeat(Jump, Label, u32),
}

/// Code of operations.
#[derive(Debug)]
pub struct Select<'a> {
    /// What becomes of it.
    pub asm: &'a mut Asm<Mcs51>,
    pub(super) ir: &'a Ir,
    pub(super) layout: &'a Layout,
    pub(super) regs: Regs,
    pub(super) now: State,
    pub(super) out: Vec<Line>,
    /// The multiplications in use, by width in bytes.
    pub multiply: [Option<Label>; 5],
    /// The divisions in use, by width in bytes.
    pub divide: [Option<Label>; 5],
    /// The tables in use, a byte of each value.
    pub tables: Vec<(Label, Vec<u8>)>,
    /// Places where a byte is sent.
    pub sends: Vec<Label>,
    /// The byte before may still be on its way when a byte is sent.
    pub waits: bool,
}

impl<'a> Select<'a> {
    /// Nothing is known at first.
    pub fn new(asm: &'a mut Asm<Mcs51>, ir: &'a Ir, layout: &'a Layout, regs: Regs) -> Self {
        Select {
            asm,
            ir,
            layout,
            regs,
            now: State::default(),
            out: Vec::new(),
            multiply: [None; 5],
            divide: [None; 5],
            tables: Vec::new(),
            sends: Vec::new(),
            waits: false,
        }
    }

    /// Appends the code of one operation; `live` says that the accumulator is read after it.
    pub fn one(&mut self, op: &Op, live: bool) {
        self.op(op, live);
        self.flush();
    }

    /// Hands what is collected to the assembler.
    pub(super) fn flush(&mut self) {
        for line in std::mem::take(&mut self.out) {
            match line {
                Line::Op(kind, operands) => self.asm.op(kind, &operands),
                Line::Jump(jump, to) => self.asm.jump(jump, to),
                Line::Place(label) => self.asm.place(label),
                Line::Repeat(jump, to, times) => self.asm.repeat(jump, to, times),
            }
        }
    }

    /// A mark stands here.
    pub fn mark(&mut self, mark: Mark) {
        self.asm.mark(mark);
    }

    pub(super) fn emit(&mut self, kind: Kind, operands: &[i32]) {
        self.out.push(Line::Op(kind, operands.to_vec()));
    }

    pub(super) fn jump(&mut self, kind: Kind, operands: &[i32], to: Label) {
        self.out.push(Line::Jump(Jump::when(kind, operands), to));
    }

    pub(super) fn place(&mut self, label: Label) {
        self.out.push(Line::Place(label));
    }

    fn list(&mut self, ops: &[Op], after: bool) {
        let all: Vec<&Op> = ops.iter().collect();
        for (op, live) in all.iter().zip(live(&all, after)) {
            self.op(op, live);
        }
    }

    fn op(&mut self, op: &Op, live: bool) {
        match op {
            Op::Acc(value) => self.now.acc = Acc { known: Some(*value), ..Acc::default() },
            Op::Load { bit, negated } => {
                self.now.acc = Acc { flag: Some((Flag::Cell(*bit), *negated)), ..Acc::default() };
            }
            Op::And { bit, negated } if live => self.combine(true, Flag::Cell(*bit), *negated),
            Op::Or { bit, negated } if live => self.combine(false, Flag::Cell(*bit), *negated),
            Op::And { .. } | Op::Or { .. } => {}
            Op::Store { bit, negated } => self.store_acc(*bit, *negated),
            Op::Put { bit, value } => self.put_bit(*bit, *value, live),
            Op::Rising(bit) | Op::Falling(bit) if !live => self.store_acc(*bit, false),
            Op::Rising(bit) => self.edge(*bit, true),
            Op::Falling(bit) => self.edge(*bit, false),
            Op::AndCompare(compare) if live => self.and_compare(compare),
            Op::AndCompare(_) => {}
            Op::Move { dst, src } => self.set(*dst, *src, live),
            Op::Math { op, dst, a, b } => self.math(*op, *dst, *a, *b, live),
            Op::Logic { dst, is } => self.logic(*dst, *is),
            Op::Lookup { dst, index, table } => self.lookup(*dst, *index, *table, live),
            Op::Send { value } => self.send(*value),
            Op::Receive { dst } => self.receive(*dst),
            Op::If { cond, then, otherwise } => self.branch(*cond, then, otherwise, live),
            // Refused before: the chips have nothing of the kind.
            Op::ReadAdc { .. } | Op::SetPwm { .. } | Op::Recall { .. } | Op::Persist { .. } | Op::Module { .. } => {}
        }
        if !live {
            self.now.acc = Acc::default();
        }
    }

    /// Bit address of a flag, in A where it has none of its own.
    fn look(&mut self, flag: Flag) -> i32 {
        let Flag::Cell(bit) = flag else { return F0 };
        let (byte, n) = self.layout.bit(bit);
        own_address(byte, n).unwrap_or_else(|| {
            self.load(Byte::At(byte));
            ACC + i32::from(n)
        })
    }

    /// Makes the carry the accumulator; returns whether complemented.
    pub(super) fn acc_to_carry(&mut self) -> bool {
        let inverted = match (self.now.in_carry(), self.now.acc.known, self.now.acc.flag) {
            (Some(inverted), ..) => inverted,
            (_, Some(value), _) => {
                self.set_carry(value);
                false
            }
            (_, _, Some((flag, negated))) => {
                let at = self.look(flag);
                self.emit(Kind::MovCBit, &[at]);
                self.now.carry = None;
                negated
            }
            _ => false,
        };
        self.now.acc.carry = Some(inverted);
        inverted
    }

    /// Makes the carry the accumulator, complemented if `inverted`.
    pub(super) fn acc_to_carry_as(&mut self, inverted: bool) {
        if let (None, Some(value)) = (self.now.in_carry(), self.now.acc.known) {
            self.set_carry(value ^ inverted);
        } else if self.acc_to_carry() != inverted {
            self.emit(Kind::CplC, &[]);
            self.now.carry = self.now.carry.map(|value| !value);
        }
        self.now.acc.carry = Some(inverted);
    }

    pub(super) fn set_carry(&mut self, value: bool) {
        self.emit(if value { Kind::SetbC } else { Kind::ClrC }, &[]);
        self.now.carry = Some(value);
    }

    /// The carry is about to change: what must last goes to F0.
    pub(super) fn lose_carry(&mut self, live: bool) {
        if live
            && self.now.only_in_carry()
            && let Some(inverted) = self.now.acc.carry
        {
            self.emit(Kind::MovBitC, &[F0]);
            self.now.acc.flag = Some((Flag::Saved, inverted));
        }
        self.now.acc.carry = None;
        self.now.carry = None;
    }

    /// acc := acc and bit, or acc or bit: an "or" is an "and" of complements.
    pub(super) fn combine(&mut self, and: bool, flag: Flag, negated: bool) {
        let negated = negated ^ !and;
        if let Some(known) = self.now.acc.known {
            if known == and {
                self.now.acc = Acc { flag: Some((flag, negated ^ !and)), ..Acc::default() };
            }
            return;
        }
        let inverted = match (self.now.in_carry(), self.now.acc.flag) {
            (Some(carry), _) => carry ^ !and,
            // Whichever is not complemented is loaded, and the other one joins it.
            (None, Some((first, first_negated))) => {
                let (loaded, joined, inverted) = match (first_negated ^ !and, negated) {
                    (false, _) => (first, (flag, negated), false),
                    (true, false) => (flag, (first, true), false),
                    (true, true) => (first, (flag, true), true),
                };
                let at = self.look(loaded);
                self.emit(Kind::MovCBit, &[at]);
                return self.join(joined.0, joined.1, inverted, and);
            }
            _ => false,
        };
        self.join(flag, negated, inverted, and);
    }

    /// The carry, complemented if `inverted`, and the bit, complemented if `negated`: a complemented carry takes the complement
    /// by "or".
    fn join(&mut self, flag: Flag, negated: bool, inverted: bool, and: bool) {
        let at = self.look(flag);
        let kind = match (inverted, negated) {
            (false, false) => Kind::AnlC,
            (false, true) => Kind::AnlCNot,
            (true, true) => Kind::OrlC,
            (true, false) => Kind::OrlCNot,
        };
        self.emit(kind, &[at]);
        self.now.carry = None;
        self.now.acc = Acc { carry: Some(inverted ^ !and), ..Acc::default() };
    }

    fn store_acc(&mut self, bit: Bit, negated: bool) {
        if let Some(value) = self.now.acc.known {
            self.write_constant(bit, value ^ negated);
        } else {
            self.acc_to_carry();
            self.acc_to_carry_as(negated);
            self.write_carry(bit);
        }
        self.now.acc.flag = Some((Flag::Cell(bit), negated));
    }

    fn put_bit(&mut self, bit: Bit, value: bool, live: bool) {
        if let Some((Flag::Cell(same), _)) = self.now.acc.flag
            && same == bit
        {
            if live && self.now.acc.known.is_none() {
                self.acc_to_carry();
            }
            self.now.acc.flag = None;
        }
        self.write_constant(bit, value);
    }

    /// bit := carry.
    fn write_carry(&mut self, bit: Bit) {
        let (byte, n) = self.layout.bit(bit);
        if let Some(at) = own_address(byte, n) {
            self.emit(Kind::MovBitC, &[at]);
            self.changed(byte);
        } else {
            self.load(Byte::At(byte));
            self.emit(Kind::MovBitC, &[ACC + i32::from(n)]);
            self.now.a = None;
            self.save(byte);
        }
    }

    /// bit := constant; the carry stays.
    pub(super) fn write_constant(&mut self, bit: Bit, value: bool) {
        let (byte, n) = self.layout.bit(bit);
        if let Some(at) = own_address(byte, n) {
            self.emit(if value { Kind::SetbBit } else { Kind::ClrBit }, &[at]);
            self.changed(byte);
            return;
        }
        let mask = if value { 1 << n } else { 0xFF ^ (1 << n) };
        if byte < 0x80 {
            self.emit(if value { Kind::OrlDirImm } else { Kind::AnlDirImm }, &[byte.into(), mask]);
            self.changed(byte);
        } else {
            self.load(Byte::At(byte));
            self.emit(if value { Kind::OrlImm } else { Kind::AnlImm }, &[mask]);
            self.now.a = None;
            self.save(byte);
        }
    }

    /// An edge: the old byte of the memory goes to A, the memory becomes the accumulator, and the two meet.
    fn edge(&mut self, bit: Bit, rising: bool) {
        self.acc_to_carry();
        self.acc_to_carry_as(false);
        let (byte, n) = self.layout.bit(bit);
        self.load(Byte::At(byte));
        let old = if own_address(byte, n).is_some() {
            ACC
        } else {
            self.emit(Kind::MovDirA, &[B]);
            B
        };
        self.write_carry(bit);
        // Rising: in and not old. Falling: not (in or not old).
        self.emit(if rising { Kind::AnlCNot } else { Kind::OrlCNot }, &[old + i32::from(n)]);
        self.now.carry = None;
        self.now.acc = Acc { carry: Some(!rising), ..Acc::default() };
    }

    /// The templates of plain translation: one temporary for each operation.
    fn logic(&mut self, dst: Bit, is: Logic) {
        let (a, b) = match is {
            Logic::Copy(a) | Logic::Not(a) => (a, None),
            Logic::And(a, b) => (a, Some((Kind::AnlC, b))),
            Logic::Or(a, b) => (a, Some((Kind::OrlC, b))),
        };
        let at = self.look(Flag::Cell(a));
        self.emit(Kind::MovCBit, &[at]);
        if let Some((kind, b)) = b {
            let at = self.look(Flag::Cell(b));
            self.emit(kind, &[at]);
        }
        if matches!(is, Logic::Not(_)) {
            self.emit(Kind::CplC, &[]);
        }
        self.write_carry(dst);
        (self.now.carry, self.now.acc) = (None, Acc::default());
    }

    fn branch(&mut self, cond: Cond, then: &[Op], otherwise: &[Op], after: bool) {
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

/// The bit address of a bit, where it has one.
fn own_address(byte: u8, n: u8) -> Option<i32> {
    (0x20..0x30).contains(&byte).then(|| i32::from(byte - 0x20) * 8 + i32::from(n))
}
