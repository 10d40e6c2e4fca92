//! Integers: moves, sums, differences, and the calls of the subroutines for the rest.

use emu_pic16::isa::Kind;

use super::out::{C, STATUS, Z};
use super::select::{Routine, Select};
use crate::ir::{Math, Value, Word};

impl Select<'_, '_> {
    /// Scratch operand 0 or 1 of a width: behind the first byte of scratch, side by side.
    fn operand(&self, which: u16, bytes: u8) -> u16 {
        self.layout.scratch + 1 + which * u16::from(bytes)
    }

    /// The address of a word at a width: its own, or a copy with sign in scratch operand `which`.
    pub fn extended(&mut self, word: Word, bytes: u8, which: u16) -> u16 {
        if self.ir.bytes(word) >= bytes {
            return self.layout.word(word);
        }
        let at = self.operand(which, bytes);
        self.copy(at, bytes, Value::Cell(word));
        at
    }

    /// `bytes` at `to` := the value, with sign, low bytes first.
    pub fn copy(&mut self, to: u16, bytes: u8, value: Value) {
        match value {
            Value::Const(k) => {
                // Zeros first, then equal bytes side by side, so that W is loaded once.
                let mut all: Vec<(u8, u16)> = k.to_le_bytes().into_iter().zip(to..).take(bytes.into()).collect();
                all.sort_by_key(|&(k, at)| (k != 0, k, at));
                all.into_iter().for_each(|(k, at)| self.out.set(at, k));
            }
            Value::Cell(word) => {
                let (from, own) = (self.layout.word(word), self.ir.bytes(word));
                if from != to {
                    for n in 0..u16::from(own.min(bytes)) {
                        self.out.f(Kind::MovfW, from + n);
                        self.out.f(Kind::Movwf, to + n);
                    }
                }
                self.sign_extend(to, own, bytes);
            }
        }
    }

    /// Fills what is above `own` bytes with the sign.
    pub fn sign_extend(&mut self, to: u16, own: u8, bytes: u8) {
        for n in u16::from(own)..u16::from(bytes) {
            self.out.f(Kind::Clrf, to + n);
            self.out.only_if((to + u16::from(own) - 1, 7), true);
            self.out.f(Kind::DecfF, to + n);
        }
    }

    /// dst := a op b.
    pub fn math(&mut self, op: Math, dst: Word, a: Value, b: Value) {
        let (to, bytes) = (self.layout.word(dst), self.ir.bytes(dst));
        match (op, a, b) {
            (Math::Add, a @ Value::Cell(_), Value::Const(k)) | (Math::Add, Value::Const(k), a) => {
                self.copy(to, bytes, a);
                self.add_constant(to, bytes, k, false);
            }
            (Math::Sub, a, Value::Const(k)) => {
                self.copy(to, bytes, a);
                self.add_constant(to, bytes, k.wrapping_neg(), false);
            }
            (Math::Sub, Value::Const(k), b @ Value::Cell(_)) => {
                // k - b is k + 1 plus the complement of b.
                self.copy(to, bytes, b);
                (0..u16::from(bytes)).for_each(|n| self.out.f(Kind::ComfF, to + n));
                self.add_constant(to, bytes, k.wrapping_add(1), false);
            }
            (Math::Add, Value::Cell(a), Value::Cell(b)) => {
                let (a, b) = if dst == b { (b, a) } else { (a, b) };
                self.sum(Math::Add, dst, a, b);
            }
            (Math::Sub, Value::Cell(a), Value::Cell(b)) => self.sum(Math::Sub, dst, a, b),
            (Math::Mul | Math::Div, a, b) => {
                let width = self.ir.width(op, dst, a, b);
                let (first, second) = (self.operand(0, width), self.operand(1, width));
                self.copy(second, width, b);
                self.copy(first, width, a);
                let routine = if op == Math::Mul { Routine::Multiply(width) } else { Routine::Divide(width) };
                self.call(routine);
                let result = if op == Math::Mul { self.operand(2, width) } else { first };
                for n in 0..u16::from(bytes) {
                    self.out.f(Kind::MovfW, result + n);
                    self.out.f(Kind::Movwf, to + n);
                }
            }
        }
    }

    /// dst := a + b or a - b of cells.
    fn sum(&mut self, op: Math, dst: Word, a: Word, b: Word) {
        let (to, bytes) = (self.layout.word(dst), self.ir.bytes(dst));
        let second = self.extended(b, bytes, 1);
        let first = self.layout.word(a);
        // Skips stand between accesses to both, so one bank must reach them.
        let near = |out: &super::out::Out<'_>, x: u16, y: u16| out.common(&[x, y]) != 0;
        if bytes <= 2
            && self.ir.bytes(a) >= bytes
            && first != to
            && [first, to].iter().all(|&x| near(&self.out, x, second))
        {
            return self.sum_short(op, to, first, second, bytes);
        }
        if !near(&self.out, to, second) || (to == second && first != to) {
            let [x, y] = [self.operand(0, bytes), self.operand(1, bytes)];
            self.copy(y, bytes, Value::Cell(b));
            if near(&self.out, to, y) {
                self.copy(to, bytes, Value::Cell(a));
                return self.in_place(op, to, y, bytes);
            }
            self.copy(x, bytes, Value::Cell(a));
            self.in_place(op, x, y, bytes);
            for n in 0..u16::from(bytes) {
                self.out.f(Kind::MovfW, x + n);
                self.out.f(Kind::Movwf, to + n);
            }
            return;
        }
        self.copy(to, bytes, Value::Cell(a));
        self.in_place(op, to, second, bytes);
    }

    /// One or two bytes into another cell.
    fn sum_short(&mut self, op: Math, to: u16, a: u16, b: u16, bytes: u8) {
        let (kind, carry) = if op == Math::Add { (Kind::AddwfW, true) } else { (Kind::SubwfW, false) };
        let out = &mut self.out;
        out.f(Kind::MovfW, b);
        out.f(kind, a);
        out.f(Kind::Movwf, to);
        if bytes == 2 {
            out.f(Kind::MovfW, b + 1);
            out.only_if((STATUS, C), carry);
            out.f(Kind::IncfW, b + 1);
            out.f(kind, a + 1);
            out.f(Kind::Movwf, to + 1);
        }
    }

    /// to := to + b or to - b, both reached from one bank.
    fn in_place(&mut self, op: Math, to: u16, b: u16, bytes: u8) {
        let (kind, carry) = if op == Math::Add { (Kind::AddwfF, true) } else { (Kind::SubwfF, false) };
        let out = &mut self.out;
        out.select(out.common(&[to, b]));
        for n in 0..u16::from(bytes) {
            out.f(Kind::MovfW, b + n);
            if n > 0 {
                out.only_if((STATUS, C), carry);
                // A byte of FFh and a carry change nothing, and the carry stays.
                out.f(Kind::IncfszW, b + n);
            }
            out.f(kind, to + n);
        }
    }

    /// `bytes` at `at` += k; leaves the carry if `carry`.
    pub fn add_constant(&mut self, at: u16, bytes: u8, k: i32, carry: bool) {
        let out = &mut self.out;
        let k: Vec<u8> = k.to_le_bytes().into_iter().take(bytes.into()).collect();
        let top = u16::from(bytes) - 1;
        if !carry && k.first() == Some(&1) && k.iter().skip(1).all(|&k| k == 0) {
            out.f(Kind::IncfF, at);
            for n in 1..=top {
                out.only_if((STATUS, Z), true);
                out.f(Kind::IncfF, at + n);
            }
            return;
        }
        let mut any = false;
        for (n, &k) in (at..).zip(&k) {
            let last = n == at + top && !carry;
            match (any, k) {
                (false, 0) => continue,
                (false, k) => {
                    out.select(out.chip.reach(n));
                    out.load(k);
                    out.f(Kind::AddwfF, n);
                }
                (true, 0) if last => {
                    out.only_if((STATUS, C), true);
                    out.f(Kind::IncfF, n);
                }
                (true, 0xFF) if last => {
                    out.only_if((STATUS, C), false);
                    out.f(Kind::DecfF, n);
                }
                (true, 0xFF) => {
                    // With a carry nothing changes, and the carry stays.
                    out.load(0xFF);
                    out.only_if((STATUS, C), false);
                    out.f(Kind::AddwfF, n);
                }
                (true, k) => {
                    out.load(k);
                    out.only_if((STATUS, C), true);
                    out.lit(Kind::Movlw, k + 1);
                    out.f(Kind::AddwfF, n);
                }
            }
            any = true;
        }
    }
}
