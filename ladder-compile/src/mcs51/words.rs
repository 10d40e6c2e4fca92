//! Integers of one to four bytes: moves and arithmetic.

use emu_8051::isa::Kind;

use super::arch::Jump;
use super::bytes::Alu;
use super::regs::{B, DPL};
use super::select::{Line, Select};
use super::state::Byte;
use crate::ir::{Math, Value, Word};

impl Select<'_> {
    /// The bytes of a value at `width`, low byte first. The sign of a narrower cell goes to `slot`, which costs A and the carry.
    pub(super) fn sources(&mut self, value: Value, width: u8, slot: i32) -> Vec<Byte> {
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
    pub(super) fn both(&mut self, a: Value, b: Value, width: u8) -> Vec<(Byte, Byte)> {
        let a = self.sources(a, width, B);
        let b = self.sources(b, width, DPL);
        a.into_iter().zip(b).collect()
    }

    pub(super) fn is_narrower(&self, value: Value, width: u8) -> bool {
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
}
