//! Selects moves, sums and differences of integers, and calls of the subroutines for other arithmetic.

use emu_pic16::isa::Pic16OpKind;

use super::select::{Pic16Routine, Pic16Selector};
use super::writer::{C, STATUS, Z};
use crate::ir::{ArithmeticOp, WordId, WordOperand, shift_count};

impl Pic16Selector<'_, '_> {
    /// Address of scratch operand 0 or 1 of a width: the operands follow the first byte of scratch.
    fn operand(&self, which: u16, bytes: u8) -> u16 {
        self.layout.scratch + 1 + which * u16::from(bytes)
    }

    /// Address of a word at a width: its own, or that of a sign-extended copy in scratch operand `which`.
    pub fn widened_address(&mut self, word: WordId, bytes: u8, which: u16) -> u16 {
        if self.ir.bytes(word) >= bytes {
            return self.layout.word(word);
        }
        let at = self.operand(which, bytes);
        self.copy_value(at, bytes, WordOperand::Cell(word));
        at
    }

    /// `bytes` bytes at `to` := the value, sign-extended, low byte first.
    pub fn copy_value(&mut self, to: u16, bytes: u8, value: WordOperand) {
        match value {
            WordOperand::Const(k) => {
                // Zeros first, then equal bytes together, so that W is loaded once.
                let mut all: Vec<(u8, u16)> = k.to_le_bytes().into_iter().zip(to..).take(bytes.into()).collect();
                all.sort_by_key(|&(k, at)| (k != 0, k, at));
                all.into_iter().for_each(|(k, at)| self.out.set_byte(at, k));
            }
            WordOperand::Cell(word) => {
                let (from, source_bytes) = (self.layout.word(word), self.ir.bytes(word));
                if from != to {
                    for n in 0..u16::from(source_bytes.min(bytes)) {
                        self.out.byte_op(Pic16OpKind::MovfW, from + n);
                        self.out.byte_op(Pic16OpKind::Movwf, to + n);
                    }
                }
                self.sign_extend(to, source_bytes, bytes);
            }
        }
    }

    /// Sign-extends a value of `source_bytes` bytes to `bytes` bytes.
    pub fn sign_extend(&mut self, to: u16, source_bytes: u8, bytes: u8) {
        for n in u16::from(source_bytes)..u16::from(bytes) {
            self.out.byte_op(Pic16OpKind::Clrf, to + n);
            self.out.skip_unless((to + u16::from(source_bytes) - 1, 7), true);
            self.out.byte_op(Pic16OpKind::DecfF, to + n);
        }
    }

    /// dst := a op b.
    pub fn math(&mut self, op: ArithmeticOp, dst: WordId, a: WordOperand, b: WordOperand) {
        let (to, bytes) = (self.layout.word(dst), self.ir.bytes(dst));
        match (op, a, b) {
            (ArithmeticOp::Add, a @ WordOperand::Cell(_), WordOperand::Const(k))
            | (ArithmeticOp::Add, WordOperand::Const(k), a) => {
                self.copy_value(to, bytes, a);
                self.add_constant(to, bytes, k, false);
            }
            (ArithmeticOp::Sub, a, WordOperand::Const(k)) => {
                self.copy_value(to, bytes, a);
                self.add_constant(to, bytes, k.wrapping_neg(), false);
            }
            (ArithmeticOp::Sub, WordOperand::Const(k), b @ WordOperand::Cell(_)) => {
                // k - b = k + 1 + the complement of b.
                self.copy_value(to, bytes, b);
                (0..u16::from(bytes)).for_each(|n| self.out.byte_op(Pic16OpKind::ComfF, to + n));
                self.add_constant(to, bytes, k.wrapping_add(1), false);
            }
            (ArithmeticOp::Add, WordOperand::Cell(a), WordOperand::Cell(b)) => {
                let (a, b) = if dst == b { (b, a) } else { (a, b) };
                self.add_or_subtract(ArithmeticOp::Add, dst, a, b);
            }
            (ArithmeticOp::Sub, WordOperand::Cell(a), WordOperand::Cell(b)) => {
                self.add_or_subtract(ArithmeticOp::Sub, dst, a, b)
            }
            (ArithmeticOp::And | ArithmeticOp::Or | ArithmeticOp::Xor, WordOperand::Cell(a), WordOperand::Cell(b)) => {
                let (a, b) = if dst == b { (b, a) } else { (a, b) };
                self.bitwise(op, dst, a, b);
            }
            (ArithmeticOp::And | ArithmeticOp::Or | ArithmeticOp::Xor, a, WordOperand::Const(k))
            | (ArithmeticOp::And | ArithmeticOp::Or | ArithmeticOp::Xor, WordOperand::Const(k), a) => {
                self.copy_value(to, bytes, a);
                (to..to + u16::from(bytes)).zip(k.to_le_bytes()).for_each(|(at, k)| self.bitwise_constant(op, at, k));
            }
            (ArithmeticOp::Shr, a, b) => self.shift_right(dst, a, shift_count(b)),
            (ArithmeticOp::Mul | ArithmeticOp::Div, a, b) => {
                let width = self.ir.width(op, dst, a, b);
                let (first, second) = (self.operand(0, width), self.operand(1, width));
                self.copy_value(second, width, b);
                self.copy_value(first, width, a);
                let routine =
                    if op == ArithmeticOp::Mul { Pic16Routine::Multiply(width) } else { Pic16Routine::Divide(width) };
                self.call(routine);
                let result = if op == ArithmeticOp::Mul { self.operand(2, width) } else { first };
                for n in 0..u16::from(bytes) {
                    self.out.byte_op(Pic16OpKind::MovfW, result + n);
                    self.out.byte_op(Pic16OpKind::Movwf, to + n);
                }
            }
        }
    }

    /// dst := an operation on the bits of cells; b is dst only where a is.
    fn bitwise(&mut self, op: ArithmeticOp, dst: WordId, a: WordId, b: WordId) {
        let (to, bytes) = (self.layout.word(dst), self.ir.bytes(dst));
        let second = self.widened_address(b, bytes, 1);
        self.copy_value(to, bytes, WordOperand::Cell(a));
        let kind = match op {
            ArithmeticOp::And => Pic16OpKind::AndwfF,
            ArithmeticOp::Or => Pic16OpKind::IorwfF,
            _ => Pic16OpKind::XorwfF,
        };
        for n in 0..u16::from(bytes) {
            self.out.byte_op(Pic16OpKind::MovfW, second + n);
            self.out.byte_op(kind, to + n);
        }
    }

    /// A byte := an operation on its bits and those of a constant.
    fn bitwise_constant(&mut self, op: ArithmeticOp, at: u16, k: u8) {
        let kind = match (op, k) {
            (ArithmeticOp::And, 0xFF) | (ArithmeticOp::Or | ArithmeticOp::Xor, 0) => return,
            (ArithmeticOp::And, 0) => return self.out.byte_op(Pic16OpKind::Clrf, at),
            (ArithmeticOp::Xor, 0xFF) => return self.out.byte_op(Pic16OpKind::ComfF, at),
            (ArithmeticOp::And, _) => Pic16OpKind::AndwfF,
            (ArithmeticOp::Or, _) => Pic16OpKind::IorwfF,
            _ => Pic16OpKind::XorwfF,
        };
        self.out.select_bank(self.out.chip.reachable_banks(at));
        self.out.load_w(k);
        self.out.byte_op(kind, at);
    }

    /// dst := a shifted right by a constant, zeros coming in: whole bytes are moved, the rest bit by bit.
    fn shift_right(&mut self, dst: WordId, a: WordOperand, count: usize) {
        let (to, bytes) = (self.layout.word(dst), u16::from(self.ir.bytes(dst)));
        let (skipped, bits) = ((count as u16 / 8).min(bytes), count % 8);
        let from = match a {
            WordOperand::Cell(word) if u16::from(self.ir.bytes(word)) >= bytes => self.layout.word(word),
            _ => {
                self.copy_value(to, self.ir.bytes(dst), a);
                to
            }
        };
        let kept_bytes = bytes - skipped;
        if from != to || skipped > 0 {
            for n in 0..kept_bytes {
                self.out.byte_op(Pic16OpKind::MovfW, from + skipped + n);
                self.out.byte_op(Pic16OpKind::Movwf, to + n);
            }
            (kept_bytes..bytes).for_each(|n| self.out.byte_op(Pic16OpKind::Clrf, to + n));
        }
        for _ in 0..bits {
            self.out.set_bit((STATUS, C), false);
            (0..kept_bytes).rev().for_each(|n| self.out.byte_op(Pic16OpKind::RrfF, to + n));
        }
    }

    /// dst := a + b or a - b, for two cells.
    fn add_or_subtract(&mut self, op: ArithmeticOp, dst: WordId, a: WordId, b: WordId) {
        let (to, bytes) = (self.layout.word(dst), self.ir.bytes(dst));
        let second = self.widened_address(b, bytes, 1);
        let first = self.layout.word(a);
        // Skips are between accesses to both operands, so one bank must reach both.
        let near = |out: &super::writer::Pic16Writer<'_>, x: u16, y: u16| out.common_banks(&[x, y]) != 0;
        if bytes <= 2
            && self.ir.bytes(a) >= bytes
            && first != to
            && [first, to].iter().all(|&x| near(&self.out, x, second))
        {
            return self.add_or_subtract_short(op, to, first, second, bytes);
        }
        if !near(&self.out, to, second) || (to == second && first != to) {
            let [x, y] = [self.operand(0, bytes), self.operand(1, bytes)];
            self.copy_value(y, bytes, WordOperand::Cell(b));
            if near(&self.out, to, y) {
                self.copy_value(to, bytes, WordOperand::Cell(a));
                return self.add_or_subtract_in_place(op, to, y, bytes);
            }
            self.copy_value(x, bytes, WordOperand::Cell(a));
            self.add_or_subtract_in_place(op, x, y, bytes);
            for n in 0..u16::from(bytes) {
                self.out.byte_op(Pic16OpKind::MovfW, x + n);
                self.out.byte_op(Pic16OpKind::Movwf, to + n);
            }
            return;
        }
        self.copy_value(to, bytes, WordOperand::Cell(a));
        self.add_or_subtract_in_place(op, to, second, bytes);
    }

    /// Computes one or two bytes into another cell.
    fn add_or_subtract_short(&mut self, op: ArithmeticOp, to: u16, a: u16, b: u16, bytes: u8) {
        let (kind, carry) =
            if op == ArithmeticOp::Add { (Pic16OpKind::AddwfW, true) } else { (Pic16OpKind::SubwfW, false) };
        let out = &mut self.out;
        out.byte_op(Pic16OpKind::MovfW, b);
        out.byte_op(kind, a);
        out.byte_op(Pic16OpKind::Movwf, to);
        if bytes == 2 {
            out.byte_op(Pic16OpKind::MovfW, b + 1);
            out.skip_unless((STATUS, C), carry);
            out.byte_op(Pic16OpKind::IncfW, b + 1);
            out.byte_op(kind, a + 1);
            out.byte_op(Pic16OpKind::Movwf, to + 1);
        }
    }

    /// to := to + b or to - b, where one bank reaches both.
    fn add_or_subtract_in_place(&mut self, op: ArithmeticOp, to: u16, b: u16, bytes: u8) {
        let (kind, carry) =
            if op == ArithmeticOp::Add { (Pic16OpKind::AddwfF, true) } else { (Pic16OpKind::SubwfF, false) };
        let out = &mut self.out;
        out.select_bank(out.common_banks(&[to, b]));
        for n in 0..u16::from(bytes) {
            out.byte_op(Pic16OpKind::MovfW, b + n);
            if n > 0 {
                out.skip_unless((STATUS, C), carry);
                // A byte of FFh with a carry changes nothing and preserves the carry.
                out.byte_op(Pic16OpKind::IncfszW, b + n);
            }
            out.byte_op(kind, to + n);
        }
    }

    /// Adds k to `bytes` bytes at `at`; with `carry`, leaves the carry of the result.
    pub fn add_constant(&mut self, at: u16, bytes: u8, k: i32, carry: bool) {
        let out = &mut self.out;
        let k: Vec<u8> = k.to_le_bytes().into_iter().take(bytes.into()).collect();
        let top = u16::from(bytes) - 1;
        if !carry && k.first() == Some(&1) && k.iter().skip(1).all(|&k| k == 0) {
            out.byte_op(Pic16OpKind::IncfF, at);
            for n in 1..=top {
                out.skip_unless((STATUS, Z), true);
                out.byte_op(Pic16OpKind::IncfF, at + n);
            }
            return;
        }
        let mut any = false;
        for (n, &k) in (at..).zip(&k) {
            let last = n == at + top && !carry;
            match (any, k) {
                (false, 0) => continue,
                (false, k) => {
                    out.select_bank(out.chip.reachable_banks(n));
                    out.load_w(k);
                    out.byte_op(Pic16OpKind::AddwfF, n);
                }
                (true, 0) if last => {
                    out.skip_unless((STATUS, C), true);
                    out.byte_op(Pic16OpKind::IncfF, n);
                }
                (true, 0xFF) if last => {
                    out.skip_unless((STATUS, C), false);
                    out.byte_op(Pic16OpKind::DecfF, n);
                }
                (true, 0xFF) => {
                    // With a carry, nothing changes and the carry is preserved.
                    out.load_w(0xFF);
                    out.skip_unless((STATUS, C), false);
                    out.byte_op(Pic16OpKind::AddwfF, n);
                }
                (true, k) => {
                    out.load_w(k);
                    out.skip_unless((STATUS, C), true);
                    out.literal_op(Pic16OpKind::Movlw, k + 1);
                    out.byte_op(Pic16OpKind::AddwfF, n);
                }
            }
            any = true;
        }
    }
}
