//! Integers of one to four bytes: moves, arithmetic, comparisons.

use emu_8051::isa::Kind;

use super::arch::Jump;
use super::bytes::Alu;
use super::regs::{ACC, B, DPL, OV};
use super::select::{Line, Select};
use super::state::{Acc, Byte, State};
use crate::code::Label;
use crate::ir::{Compare, Math, Rel, Value, Word, bytes_of};

impl Select<'_> {
    /// The bytes of a value at `width`, low byte first. The sign of a narrower cell goes to `slot`, which costs A and the carry.
    fn sources(&mut self, value: Value, width: u8, slot: i32) -> Vec<Byte> {
        match value {
            Value::Const(value) => value.to_le_bytes().into_iter().take(width.into()).map(Byte::Imm).collect(),
            Value::Cell(word) => {
                let (at, bytes) = (self.layout.word(word), self.ir.bytes(word));
                let mut all: Vec<Byte> = (0..bytes.min(width)).map(|n| Byte::At(at + n)).collect();
                if bytes < width {
                    self.load(Byte::At(at + bytes - 1));
                    self.sign_of_a();
                    self.emit(Kind::MovDirA, &[slot]);
                    all.resize(width.into(), Byte::Sfr(slot));
                }
                all
            }
        }
    }

    /// The bytes of two values at `width`.
    fn both(&mut self, a: Value, b: Value, width: u8) -> Vec<(Byte, Byte)> {
        let a = self.sources(a, width, B);
        let b = self.sources(b, width, DPL);
        a.into_iter().zip(b).collect()
    }

    fn is_narrower(&self, value: Value, width: u8) -> bool {
        matches!(value, Value::Cell(word) if self.ir.bytes(word) < width)
    }

    /// Places of the bytes of a word, low byte first.
    fn places(&self, word: Word) -> Vec<u8> {
        let at = self.layout.word(word);
        (0..self.ir.bytes(word)).map(|n| at + n).collect()
    }

    /// dst := src.
    pub(super) fn set(&mut self, dst: Word, src: Value, live: bool) {
        let places = self.places(dst);
        match src {
            Value::Const(value) => {
                let bytes: Vec<(u8, u8)> = places.into_iter().zip(value.to_le_bytes()).collect();
                // What comes twice goes by A.
                for &(at, byte) in &bytes {
                    if bytes.iter().filter(|(_, other)| *other == byte).count() > 1 {
                        self.load(Byte::Imm(byte));
                    }
                    self.copy(at, Byte::Imm(byte));
                }
            }
            Value::Cell(word) if word == dst => {}
            Value::Cell(word) => {
                let (from, bytes) = (self.layout.word(word), self.ir.bytes(word));
                let wider = places.len() > usize::from(bytes);
                for (&at, n) in places.iter().zip(0..bytes) {
                    if wider && n + 1 == bytes {
                        self.load(Byte::At(from + n));
                    }
                    self.copy(at, Byte::At(from + n));
                }
                if wider {
                    self.lose_carry(live);
                    self.load(Byte::At(from + bytes - 1));
                    self.sign_of_a();
                    places.iter().skip(bytes.into()).for_each(|&at| self.save(at));
                }
            }
        }
    }

    /// dst := a op b.
    pub(super) fn math(&mut self, op: Math, dst: Word, a: Value, b: Value, live: bool) {
        match (op, a, b) {
            (Math::Add, Value::Const(c), Value::Cell(a)) | (Math::Add, Value::Cell(a), Value::Const(c)) => {
                self.add_constant(dst, a, c, live);
            }
            (Math::Sub, Value::Cell(a), Value::Const(c)) => self.add_constant(dst, a, c.wrapping_neg(), live),
            (Math::Add | Math::Sub, ..) => {
                self.lose_carry(live);
                let pairs = self.both(a, b, self.ir.bytes(dst));
                let first = if op == Math::Add { Alu::Add } else { Alu::Subb };
                if op == Math::Sub {
                    self.emit(Kind::ClrC, &[]);
                }
                for (n, (at, (a, b))) in self.places(dst).into_iter().zip(pairs).enumerate() {
                    self.load(a);
                    self.alu(if n > 0 && op == Math::Add { Alu::Addc } else { first }, b);
                    self.save(at);
                }
            }
            (Math::Mul, ..) if self.ir.bytes(dst) == 1 => {
                self.lose_carry(live);
                let byte = |this: &mut Self, value| this.sources(value, 1, B).first().copied().unwrap_or(Byte::Imm(0));
                let (a, b) = (byte(self, a), byte(self, b));
                self.load(a);
                self.times(b);
                self.save(self.layout.word(dst));
            }
            (Math::Mul | Math::Div, ..) => self.by_subroutine(op, dst, a, b, live),
        }
    }

    /// dst := a + constant.
    fn add_constant(&mut self, dst: Word, a: Word, constant: i32, live: bool) {
        let width = self.ir.bytes(dst);
        let places = self.places(dst);
        let constant = constant.to_le_bytes();
        let constant = constant.get(..width.into()).unwrap_or(&constant);
        let all = |value: u8| constant.iter().all(|&byte| byte == value);
        if all(0) {
            return self.set(dst, Value::Cell(a), live);
        }
        let upper = |value: u8| constant.iter().skip(1).all(|&byte| byte == value);
        if dst == a {
            if constant.first() == Some(&1) && upper(0) {
                return self.count_up(&places);
            }
            if all(0xFF) {
                return self.count_down(&places);
            }
        }
        self.lose_carry(live);
        let sources = self.sources(Value::Cell(a), width, B);
        // With an upper half that does nothing but carry on, two bytes are short.
        if let (true, true, [low, high], [small, _]) = (dst == a, upper(0) || upper(0xFF), &places[..], constant) {
            let up = upper(0);
            let over = self.asm.label();
            self.load(Byte::At(*low));
            self.alu(Alu::Add, Byte::Imm(*small));
            self.save(*low);
            self.jump(if up { Kind::Jnc } else { Kind::Jc }, &[], over);
            let there = self.now;
            self.step(*high, up);
            self.place(over);
            self.now = self.now.meet(&there);
            return;
        }
        let mut begun = false;
        for ((at, source), &byte) in places.into_iter().zip(sources).zip(constant) {
            if !begun && byte == 0 {
                self.copy(at, source);
                continue;
            }
            self.load(source);
            self.alu(if begun { Alu::Addc } else { Alu::Add }, Byte::Imm(byte));
            self.save(at);
            begun = true;
        }
    }

    /// One more; no flag changes.
    fn count_up(&mut self, places: &[u8]) {
        let over = self.asm.label();
        for (n, &at) in places.iter().enumerate() {
            self.step(at, true);
            if n + 1 < places.len() {
                self.load(Byte::At(at));
                self.jump(Kind::Jnz, &[], over);
            }
        }
        if places.len() > 1 {
            self.place(over);
            (self.now.a, self.now.r0) = (None, None);
        }
        if let ([low, _], true) = (places, places.iter().all(|at| *at < 0x80)) {
            self.now.a = Some(Byte::At(*low));
        }
    }

    /// One less; no flag changes. A byte is taken from where all below it are 0.
    fn count_down(&mut self, places: &[u8]) {
        let [low, upper @ ..] = places else { return };
        if !upper.is_empty() {
            let over = self.asm.label();
            self.load(Byte::At(*low));
            self.jump(Kind::Jnz, &[], over);
            let before = self.now;
            self.count_down(upper);
            self.place(over);
            self.now = self.now.meet(&before);
        }
        self.step(*low, false);
    }

    /// dst := a op b, by a subroutine that takes and gives at fixed places.
    fn by_subroutine(&mut self, op: Math, dst: Word, a: Value, b: Value, live: bool) {
        self.lose_carry(live);
        let width = self.ir.width(op, dst, a, b);
        let count = usize::from(width);
        let pairs = self.both(a, b, width);
        let (first, second): (Vec<Byte>, Vec<Byte>) = pairs.into_iter().unzip();
        let places: Vec<u8> = self.layout.scratch.clone();
        for (&at, byte) in places.iter().zip(first.into_iter().chain(second)) {
            self.copy(at, byte);
        }
        let entries = if op == Math::Mul { &mut self.multiply } else { &mut self.divide };
        if let Some(entry) = entries.get_mut(count) {
            let label = *entry.get_or_insert_with(|| self.asm.label());
            self.out.push(Line::Jump(Jump::Call, label));
        }
        (self.now.a, self.now.r0, self.now.carry) = (None, None, None);
        for (at, &result) in self.places(dst).into_iter().zip(&places) {
            self.copy(at, Byte::At(result));
        }
    }

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
        self.to_carry_as(inverted);
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
        let inverted = self.to_carry();
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
