//! Comparisons to flags. Signed numbers are compared without sign after their highest bits were turned.

use emu_pic16::isa::Kind;

use super::expr::{Expr, Lit};
use super::out::{C, STATUS, Z};
use super::select::Select;
use crate::ir::{Compare, Rel, Value, Word};

fn flag(bit: u8, is: bool) -> Expr {
    Expr::Lit(Lit { at: (STATUS, bit), is })
}

impl Select<'_, '_> {
    /// A comparison with 0 that the sign bit answers.
    pub fn sign(&self, c: &Compare) -> Option<Lit> {
        let top = u16::from(self.ir.bytes(c.a)) - 1;
        let is = c.rel == Rel::Lt;
        (c.b == Value::Const(0) && matches!(c.rel, Rel::Lt | Rel::Ge))
            .then(|| Lit { at: (self.layout.word(c.a) + top, 7), is })
    }

    /// Emits what is needed to see a comparison or a range in the flags; gives the formula over them.
    pub fn flags(&mut self, e: &Expr) -> Expr {
        match e {
            Expr::Cmp(c) => {
                if let Some(lit) = self.sign(c) {
                    return Expr::Lit(lit);
                }
                match (c.rel, c.b) {
                    (Rel::Eq | Rel::Ne, Value::Const(k)) => self.equal(c.a, k),
                    (Rel::Eq | Rel::Ne, Value::Cell(b)) => self.equal_cell(c.a, b),
                    (_, Value::Const(k)) => self.at_least(c.a, k),
                    (_, Value::Cell(b)) => self.at_least_cell(c.a, b),
                }
                match c.rel {
                    Rel::Eq => flag(Z, true),
                    Rel::Ne => flag(Z, false),
                    Rel::Ge => flag(C, true),
                    Rel::Lt => flag(C, false),
                }
            }
            Expr::Range { word, first, end, is } => self.range(*word, *first, *end).opposite_if(!is),
            e => e.clone(),
        }
    }

    fn range(&mut self, word: Word, first: i32, end: i32) -> Expr {
        let (at, bytes) = (self.layout.word(word), u16::from(self.ir.bytes(word)));
        let out = &mut self.out;
        let low = match (first, end) {
            (0, 256) => Expr::Const(true),
            (0, end) => {
                out.load(end as u8);
                out.f(Kind::SubwfW, at);
                flag(C, false)
            }
            (first, 256) => {
                out.load(first as u8);
                out.f(Kind::SubwfW, at);
                flag(C, true)
            }
            (first, end) => {
                out.load((first as u8).wrapping_neg());
                out.f(Kind::AddwfW, at);
                out.lit(Kind::Sublw, (end - first - 1) as u8);
                flag(C, true)
            }
        };
        if bytes == 1 {
            return low;
        }
        // What is above the lowest byte is 0; the carry stays.
        out.f(Kind::MovfW, at + 1);
        (2..bytes).for_each(|n| out.f(Kind::IorwfW, at + n));
        flag(Z, true).and(low)
    }

    /// Z := the word is `k`.
    fn equal(&mut self, word: Word, k: i32) {
        let (at, bytes) = (self.layout.word(word), self.ir.bytes(word));
        let out = &mut self.out;
        let all: Vec<(u16, u8)> = (0..).map(|n| at + n).zip(k.to_le_bytes()).take(bytes.into()).collect();
        let (zero, other): (Vec<_>, Vec<_>) = all.into_iter().partition(|&(_, k)| k == 0);
        for (n, &(at, k)) in other.iter().enumerate() {
            // W is 0 afterwards if this byte is equal, as those before, else it is not.
            let short = match k {
                1 => Some(Kind::DecfW),
                0xFF => Some(Kind::IncfW),
                _ => None,
            };
            if short.is_none() {
                out.select(out.chip.reach(at));
                out.load(k);
            }
            if n > 0 {
                out.only_if((STATUS, Z), true);
            }
            out.f(short.unwrap_or(Kind::XorwfW), at);
        }
        for (n, &(at, _)) in zero.iter().enumerate() {
            out.f(if n == 0 && other.is_empty() { Kind::MovfW } else { Kind::IorwfW }, at);
        }
    }

    fn equal_cell(&mut self, a: Word, b: Word) {
        let bytes = self.ir.bytes(a).max(self.ir.bytes(b));
        let (a, b) = (self.extended(a, bytes, 0), self.extended(b, bytes, 1));
        let temp = self.layout.scratch;
        for n in 0..u16::from(bytes) {
            self.out.f(Kind::MovfW, b + n);
            self.out.f(Kind::XorwfW, a + n);
            match (n, n + 1 == u16::from(bytes)) {
                (0, true) => {}
                (0, false) => self.out.f(Kind::Movwf, temp),
                (_, true) => self.out.f(Kind::IorwfW, temp),
                (_, false) => self.out.f(Kind::IorwfF, temp),
            }
        }
    }

    /// C := the word is `k` or more.
    fn at_least(&mut self, word: Word, k: i32) {
        let (at, bytes) = (self.layout.word(word), self.ir.bytes(word));
        let out = &mut self.out;
        let k: Vec<u8> = k.to_le_bytes().into_iter().take(bytes.into()).collect();
        let byte = |n: usize| k.get(n).copied().unwrap_or(0);
        if bytes == 2 && byte(1) == 0 {
            // The high byte decides unless it is 0: 1 to 127 is more, 128 and up is negative.
            out.select(out.chip.reach(at));
            out.load(byte(0));
            out.f(Kind::SubwfW, at);
            out.f(Kind::MovfW, at + 1);
            out.only_if((STATUS, Z), false);
            out.lit(Kind::Sublw, 0x7F);
            return;
        }
        let top = usize::from(bytes) - 1;
        out.f(Kind::MovfW, at + top as u16);
        out.lit(Kind::Xorlw, 0x80);
        match byte(top) ^ 0x80 {
            0 => out.put((STATUS, C), true),
            k => out.lit(Kind::Addlw, k.wrapping_neg()),
        }
        // Where all above is equal C is set, and the next byte decides; nothing is below zeros.
        let lowest = (0..top).find(|&n| byte(n) != 0).unwrap_or(top);
        for n in (lowest..top).rev() {
            out.lit(Kind::Movlw, byte(n));
            out.only_if((STATUS, Z), true);
            out.f(Kind::SubwfW, at + n as u16);
        }
    }

    /// C := a is b or more.
    fn at_least_cell(&mut self, a: Word, b: Word) {
        let bytes = self.ir.bytes(a).max(self.ir.bytes(b));
        let (a, b) = (self.extended(a, bytes, 0), self.extended(b, bytes, 1));
        let (temp, top) = (self.layout.scratch, u16::from(bytes) - 1);
        let out = &mut self.out;
        out.f(Kind::MovfW, a + top);
        out.lit(Kind::Xorlw, 0x80);
        out.f(Kind::Movwf, temp);
        out.f(Kind::MovfW, b + top);
        out.lit(Kind::Xorlw, 0x80);
        out.f(Kind::SubwfW, temp);
        let done = out.label();
        for n in (0..top).rev() {
            out.only_if((STATUS, Z), false);
            out.goto(done);
            out.f(Kind::MovfW, b + n);
            out.f(Kind::SubwfW, a + n);
        }
        out.place(done);
    }
}
