//! Compares integers into flags. Signed comparisons become unsigned ones by inverting the sign bits.

use emu_pic16::isa::Pic16OpKind;

use super::rung_formula::{BitLiteral, RungFormula};
use super::select::Pic16Selector;
use super::writer::{C, STATUS, Z};
use crate::ir::{RelationOp, WordComparison, WordId, WordOperand};

fn status_flag(bit: u8, is: bool) -> RungFormula {
    RungFormula::Lit(BitLiteral { at: (STATUS, bit), is })
}

impl Pic16Selector<'_, '_> {
    /// Returns the sign bit if it alone decides a comparison with 0.
    pub fn sign_bit_comparison(&self, c: &WordComparison) -> Option<BitLiteral> {
        let top = u16::from(self.ir.bytes(c.a)) - 1;
        let is = c.rel == RelationOp::Lt;
        (c.b == WordOperand::Const(0) && matches!(c.rel, RelationOp::Lt | RelationOp::Ge))
            .then(|| BitLiteral { at: (self.layout.word(c.a) + top, 7), is })
    }

    /// Emits code that evaluates a comparison or a range into the flags; returns the formula over the flags.
    pub fn compare_to_flags(&mut self, e: &RungFormula) -> RungFormula {
        match e {
            RungFormula::Cmp(c) => {
                if let Some(lit) = self.sign_bit_comparison(c) {
                    return RungFormula::Lit(lit);
                }
                match (c.rel, c.b) {
                    (RelationOp::Eq | RelationOp::Ne, WordOperand::Const(k)) => self.compare_equal(c.a, k),
                    (RelationOp::Eq | RelationOp::Ne, WordOperand::Cell(b)) => self.compare_equal_cells(c.a, b),
                    (_, WordOperand::Const(k)) => self.compare_at_least(c.a, k),
                    (_, WordOperand::Cell(b)) => self.compare_at_least_cells(c.a, b),
                }
                match c.rel {
                    RelationOp::Eq => status_flag(Z, true),
                    RelationOp::Ne => status_flag(Z, false),
                    RelationOp::Ge => status_flag(C, true),
                    RelationOp::Lt => status_flag(C, false),
                }
            }
            RungFormula::Range { word, first, end, is } => self.compare_range(*word, *first, *end).opposite_if(!is),
            e => e.clone(),
        }
    }

    fn compare_range(&mut self, word: WordId, first: i32, end: i32) -> RungFormula {
        let (at, bytes) = (self.layout.word(word), u16::from(self.ir.bytes(word)));
        let out = &mut self.out;
        let low = match (first, end) {
            (0, 256) => RungFormula::Const(true),
            (0, end) => {
                out.load_w(end as u8);
                out.byte_op(Pic16OpKind::SubwfW, at);
                status_flag(C, false)
            }
            (first, 256) => {
                out.load_w(first as u8);
                out.byte_op(Pic16OpKind::SubwfW, at);
                status_flag(C, true)
            }
            (first, end) => {
                out.load_w((first as u8).wrapping_neg());
                out.byte_op(Pic16OpKind::AddwfW, at);
                out.literal_op(Pic16OpKind::Sublw, (end - first - 1) as u8);
                status_flag(C, true)
            }
        };
        if bytes == 1 {
            return low;
        }
        // The bytes above the lowest must be 0; the carry is preserved.
        out.byte_op(Pic16OpKind::MovfW, at + 1);
        (2..bytes).for_each(|n| out.byte_op(Pic16OpKind::IorwfW, at + n));
        status_flag(Z, true).and(low)
    }

    /// Z := the word equals `k`.
    fn compare_equal(&mut self, word: WordId, k: i32) {
        let (at, bytes) = (self.layout.word(word), self.ir.bytes(word));
        let out = &mut self.out;
        let all: Vec<(u16, u8)> = (0..).map(|n| at + n).zip(k.to_le_bytes()).take(bytes.into()).collect();
        let (zero, other): (Vec<_>, Vec<_>) = all.into_iter().partition(|&(_, k)| k == 0);
        for (n, &(at, k)) in other.iter().enumerate() {
            // W is 0 afterwards if this byte and all previous ones are equal.
            let short = match k {
                1 => Some(Pic16OpKind::DecfW),
                0xFF => Some(Pic16OpKind::IncfW),
                _ => None,
            };
            if short.is_none() {
                out.select_bank(out.chip.reachable_banks(at));
                out.load_w(k);
            }
            if n > 0 {
                out.skip_unless((STATUS, Z), true);
            }
            out.byte_op(short.unwrap_or(Pic16OpKind::XorwfW), at);
        }
        for (n, &(at, _)) in zero.iter().enumerate() {
            out.byte_op(if n == 0 && other.is_empty() { Pic16OpKind::MovfW } else { Pic16OpKind::IorwfW }, at);
        }
    }

    fn compare_equal_cells(&mut self, a: WordId, b: WordId) {
        let bytes = self.ir.bytes(a).max(self.ir.bytes(b));
        let (a, b) = (self.widened_address(a, bytes, 0), self.widened_address(b, bytes, 1));
        let temp = self.layout.scratch;
        for n in 0..u16::from(bytes) {
            self.out.byte_op(Pic16OpKind::MovfW, b + n);
            self.out.byte_op(Pic16OpKind::XorwfW, a + n);
            match (n, n + 1 == u16::from(bytes)) {
                (0, true) => {}
                (0, false) => self.out.byte_op(Pic16OpKind::Movwf, temp),
                (_, true) => self.out.byte_op(Pic16OpKind::IorwfW, temp),
                (_, false) => self.out.byte_op(Pic16OpKind::IorwfF, temp),
            }
        }
    }

    /// C := the word is at least `k`.
    fn compare_at_least(&mut self, word: WordId, k: i32) {
        let (at, bytes) = (self.layout.word(word), self.ir.bytes(word));
        let out = &mut self.out;
        let k: Vec<u8> = k.to_le_bytes().into_iter().take(bytes.into()).collect();
        let byte = |n: usize| k.get(n).copied().unwrap_or(0);
        if bytes == 2 && byte(1) == 0 {
            // Unless it is 0, the high byte decides: 1 to 127 means greater, 128 and above means negative.
            out.select_bank(out.chip.reachable_banks(at));
            out.load_w(byte(0));
            out.byte_op(Pic16OpKind::SubwfW, at);
            out.byte_op(Pic16OpKind::MovfW, at + 1);
            out.skip_unless((STATUS, Z), false);
            out.literal_op(Pic16OpKind::Sublw, 0x7F);
            return;
        }
        let top = usize::from(bytes) - 1;
        out.byte_op(Pic16OpKind::MovfW, at + top as u16);
        out.literal_op(Pic16OpKind::Xorlw, 0x80);
        match byte(top) ^ 0x80 {
            0 => out.set_bit((STATUS, C), true),
            k => out.literal_op(Pic16OpKind::Addlw, k.wrapping_neg()),
        }
        // If all higher bytes are equal, C is set and the next byte decides. Low zero bytes of `k` need
        // no comparison.
        let lowest = (0..top).find(|&n| byte(n) != 0).unwrap_or(top);
        for n in (lowest..top).rev() {
            out.literal_op(Pic16OpKind::Movlw, byte(n));
            out.skip_unless((STATUS, Z), true);
            out.byte_op(Pic16OpKind::SubwfW, at + n as u16);
        }
    }

    /// C := a is at least b.
    fn compare_at_least_cells(&mut self, a: WordId, b: WordId) {
        let bytes = self.ir.bytes(a).max(self.ir.bytes(b));
        let (a, b) = (self.widened_address(a, bytes, 0), self.widened_address(b, bytes, 1));
        let (temp, top) = (self.layout.scratch, u16::from(bytes) - 1);
        let out = &mut self.out;
        out.byte_op(Pic16OpKind::MovfW, a + top);
        out.literal_op(Pic16OpKind::Xorlw, 0x80);
        out.byte_op(Pic16OpKind::Movwf, temp);
        out.byte_op(Pic16OpKind::MovfW, b + top);
        out.literal_op(Pic16OpKind::Xorlw, 0x80);
        out.byte_op(Pic16OpKind::SubwfW, temp);
        let done = out.label();
        for n in (0..top).rev() {
            out.skip_unless((STATUS, Z), false);
            out.goto(done);
            out.byte_op(Pic16OpKind::MovfW, b + n);
            out.byte_op(Pic16OpKind::SubwfW, a + n);
        }
        out.place(done);
    }
}
