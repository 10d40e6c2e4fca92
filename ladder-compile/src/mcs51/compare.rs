//! Comparisons of integers: as jumps, and as a bit that joins the accumulator.

use emu_8051::isa::Kind;

use super::arch::Jump;
use super::bytes::Alu;
use super::regs::{ACC, B, OV};
use super::select::{Line, Select};
use super::state::{Acc, Byte, State};
use crate::code::Label;
use crate::ir::{Compare, Rel, Value, Word, bytes_of};

impl Select<'_> {
    /// Width of a comparison.
    fn compare_width(&self, compare: &Compare) -> u8 {
        let b = match compare.b {
            Value::Cell(word) => self.ir.bytes(word),
            Value::Const(value) => bytes_of(value),
        };
        self.ir.bytes(compare.a).max(b)
    }

    /// Compares and jumps where the outcome is `when`; with `keep` the accumulator is saved from the carry. Returns what is
    /// known when it goes on, and when it jumps.
    pub(super) fn compare_jump(&mut self, compare: &Compare, when: bool, to: Label, keep: bool) -> (State, State) {
        let width = self.compare_width(compare);
        let a = Value::Cell(compare.a);
        let extends = self.is_narrower(a, width) || self.is_narrower(compare.b, width);
        match compare.rel {
            Rel::Eq | Rel::Ne => {
                if extends || !keep {
                    self.lose_carry(keep);
                }
                let pairs = self.both(a, compare.b, width);
                let jumps_if_equal = (compare.rel == Rel::Eq) == when;
                self.equal_jump(&pairs, jumps_if_equal, to, keep && !extends);
                (self.now, self.now)
            }
            Rel::Lt | Rel::Ge => {
                let jumps_if_less = (compare.rel == Rel::Lt) == when;
                if compare.b == Value::Const(0) {
                    self.load_top(compare.a);
                    self.jump(if jumps_if_less { Kind::Jb } else { Kind::Jnb }, &[ACC + 7], to);
                    return (self.now, self.now);
                }
                self.lose_carry(keep);
                if let Value::Cell(_) = compare.b {
                    self.difference_sign(compare, width);
                    self.jump(if jumps_if_less { Kind::Jb } else { Kind::Jnb }, &[ACC + 7], to);
                    return (self.now, self.now);
                }
                let inverted = self.less(compare);
                self.jump(if jumps_if_less ^ inverted { Kind::Jc } else { Kind::Jnc }, &[], to);
                let with = |less: bool| State { carry: Some(less ^ inverted), ..self.now };
                (with(!jumps_if_less), with(jumps_if_less))
            }
        }
    }

    fn load_top(&mut self, word: Word) {
        let top = self.layout.word(word) + self.ir.bytes(word) - 1;
        self.load(Byte::At(top));
    }

    /// Jumps where all pairs are equal, or where one is not. The carry stays if `keep` says so.
    fn equal_jump(&mut self, pairs: &[(Byte, Byte)], if_equal: bool, to: Label, keep: bool) {
        let constant = |byte: &Byte| matches!(byte, Byte::Imm(value) if *value != 0);
        let zeros = pairs.iter().filter(|(_, b)| *b == Byte::Imm(0)).count();
        // At most one byte to compare with something: the others only need to be 0.
        if zeros + 1 >= pairs.len() {
            let mut rest: Vec<Byte> = pairs.iter().filter(|(_, b)| *b == Byte::Imm(0)).map(|&(a, _)| a).collect();
            match pairs.iter().find(|(_, b)| *b != Byte::Imm(0)) {
                Some(&(a, b)) if rest.is_empty() && !if_equal && !keep => return self.differ(a, b, to),
                Some(&(a, b)) => {
                    self.load(a);
                    self.alu(Alu::Xrl, b);
                }
                None => rest.pop().into_iter().for_each(|a| self.load(a)),
            }
            rest.into_iter().for_each(|a| self.alu(Alu::Orl, a));
            return self.jump(if if_equal { Kind::Jz } else { Kind::Jnz }, &[], to);
        }
        let skip = self.asm.label();
        let differs = if if_equal { skip } else { to };
        let mut r0 = None;
        for (n, &(a, b)) in pairs.iter().enumerate() {
            let last = n + 1 == pairs.len();
            if (last && if_equal) || keep || (constant(&a) && constant(&b)) {
                self.load(a);
                self.alu(Alu::Xrl, b);
                let kind = if last && if_equal { Kind::Jz } else { Kind::Jnz };
                self.jump(kind, &[], if last && if_equal { to } else { differs });
            } else {
                self.differ(a, b, differs);
            }
            r0 = if n == 0 { self.now.r0 } else { r0.filter(|_| r0 == self.now.r0) };
        }
        self.place(skip);
        (self.now.a, self.now.r0) = (None, r0);
    }

    /// Jumps where two bytes differ. The carry changes.
    fn differ(&mut self, a: Byte, b: Byte, to: Label) {
        match (a, b) {
            (Byte::At(at @ 0..8), Byte::Imm(value)) if self.now.a != Some(a) => {
                self.jump(Kind::CjneReg, &[at.into(), value.into()], to);
            }
            (_, Byte::Imm(value)) => {
                self.load(a);
                self.jump(Kind::CjneImm, &[value.into()], to);
            }
            (_, Byte::At(at @ 0..0x80)) => {
                self.load(a);
                self.jump(Kind::CjneDir, &[at.into()], to);
            }
            (_, Byte::Sfr(at)) => {
                self.load(a);
                self.jump(Kind::CjneDir, &[at], to);
            }
            _ => {
                self.load(a);
                self.alu(Alu::Xrl, b);
                self.jump(Kind::Jnz, &[], to);
            }
        }
        self.now.carry = None;
    }

    /// Bit 7 of A := a < b, of two cells. The carry changes.
    fn difference_sign(&mut self, compare: &Compare, width: u8) {
        let pairs = self.both(Value::Cell(compare.a), compare.b, width);
        for (n, (a, b)) in pairs.into_iter().enumerate() {
            self.load(a);
            if n == 0 && self.now.carry != Some(false) {
                self.emit(Kind::ClrC, &[]);
            }
            self.alu(Alu::Subb, b);
        }
        let right = self.asm.label();
        self.jump(Kind::Jnb, &[OV], right);
        self.emit(Kind::CplA, &[]);
        self.place(right);
    }

    /// The carry, complemented if that is returned, := a < b.
    fn less(&mut self, compare: &Compare) -> bool {
        let width = self.compare_width(compare);
        match compare.b {
            Value::Const(0) => {
                self.load_top(compare.a);
                self.emit(Kind::MovCBit, &[ACC + 7]);
                self.now.carry = None;
                false
            }
            Value::Cell(_) => {
                self.difference_sign(compare, width);
                self.emit(Kind::RlcA, &[]);
                (self.now.a, self.now.carry) = (None, None);
                false
            }
            Value::Const(value) => {
                // a - b as a + (2^n - b), with the signs moved up: it carries where a >= b.
                let sources = self.sources(Value::Cell(compare.a), width, B);
                let half = 1i64 << (8 * width - 1);
                let other = (2 * half - (i64::from(value) + half)) & (2 * half - 1);
                if other == 0 {
                    // Nothing is less than the lowest number.
                    self.set_carry(true);
                    return true;
                }
                let mut begun = false;
                let bytes = other.to_le_bytes();
                for (n, (source, byte)) in sources.into_iter().zip(bytes).enumerate() {
                    if byte == 0 && !begun {
                        continue;
                    }
                    self.load(source);
                    if n + 1 == usize::from(width) {
                        self.alu(Alu::Xrl, Byte::Imm(0x80));
                    }
                    self.alu(if begun { Alu::Addc } else { Alu::Add }, Byte::Imm(byte));
                    begun = true;
                }
                true
            }
        }
    }

    /// acc := acc and the comparison.
    pub(super) fn and_compare(&mut self, compare: &Compare) {
        if self.now.acc.known == Some(false) {
            return;
        }
        if let Rel::Eq | Rel::Ne = compare.rel {
            return self.and_equal(compare);
        }
        let less_inverted = matches!(compare.b, Value::Const(value) if value != 0);
        let inverted = less_inverted ^ (compare.rel == Rel::Ge);
        if self.now.acc.known == Some(true) {
            self.lose_carry(false);
            self.less(compare);
            self.now.acc = Acc { carry: Some(inverted), ..Acc::default() };
            return;
        }
        if let (false, Some((flag, negated))) = (self.now.acc.carry.is_some(), self.now.acc.flag) {
            self.less(compare);
            self.now.acc = Acc { carry: Some(inverted), ..Acc::default() };
            return self.combine(true, flag, negated);
        }
        // False stays false; else the comparison decides.
        let over = self.asm.label();
        self.acc_to_carry_as(inverted);
        self.jump(if inverted { Kind::Jc } else { Kind::Jnc }, &[], over);
        let before = self.now;
        self.less(compare);
        self.place(over);
        self.now = self.now.meet(&before);
        self.now.carry = None;
        self.now.acc = Acc { carry: Some(inverted), ..Acc::default() };
    }

    /// acc := acc and the comparison for equality: the carry is the accumulator, and changes where the comparison fails.
    fn and_equal(&mut self, compare: &Compare) {
        let (holds, end) = (self.asm.label(), self.asm.label());
        let certain = self.now.acc.known.is_some();
        let inverted = self.acc_to_carry();
        if !certain {
            self.jump(if inverted { Kind::Jc } else { Kind::Jnc }, &[], end);
        }
        let width = self.compare_width(compare);
        // The sign of a narrow operand costs the carry, which then is set in either case.
        let lost = self.is_narrower(Value::Cell(compare.a), width) || self.is_narrower(compare.b, width);
        self.now.acc = Acc { carry: Some(inverted), ..Acc::default() };
        self.compare_jump(compare, true, holds, !lost);
        self.set_carry(inverted);
        if lost {
            self.out.push(Line::Jump(Jump::Go, end));
        }
        self.place(holds);
        if lost {
            self.set_carry(!inverted);
        }
        self.place(end);
        let acc = Acc { carry: Some(inverted), ..Acc::default() };
        self.now = State { acc, ..State::default() };
    }
}
