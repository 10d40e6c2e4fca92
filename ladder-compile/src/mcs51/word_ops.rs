//! Selects moves and arithmetic of integers of one to four bytes.

use emu_8051::isa::Mcs51OpKind;

use super::arch::Mcs51Jump;
use super::byte_ops::AluOp;
use super::known_state::ByteOperand;
use super::registers::{B, DPL};
use super::select::{Mcs51Selector, PendingCode};
use crate::ir::{ArithmeticOp, WordId, WordOperand, shift_count};

/// Two bytes of the same significance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct BytePair {
    /// Byte of the left operand.
    pub left: ByteOperand,
    /// Byte of the right operand.
    pub right: ByteOperand,
}

impl Mcs51Selector<'_> {
    /// Bytes of a value at `width`, low byte first. The sign of a narrower cell is written to `slot`, using A
    /// and the carry.
    pub(super) fn operand_bytes(&mut self, value: WordOperand, width: u8, slot: i32) -> Vec<ByteOperand> {
        match value {
            WordOperand::Const(value) => {
                value.to_le_bytes().into_iter().take(width.into()).map(ByteOperand::Imm).collect()
            }
            WordOperand::Cell(word) => {
                let (at, bytes) = (self.layout.word(word), self.ir.bytes(word));
                let mut all: Vec<ByteOperand> = (0..bytes.min(width)).map(|n| ByteOperand::At(at + n)).collect();
                if bytes < width {
                    self.load(ByteOperand::At(at + bytes - 1));
                    self.sign_of_a();
                    self.emit(Mcs51OpKind::MovDirA, &[slot]);
                    all.resize(width.into(), ByteOperand::Sfr(slot));
                }
                all
            }
        }
    }

    /// Bytes of two values at `width`, the lowest first.
    pub(super) fn operand_byte_pairs(&mut self, a: WordOperand, b: WordOperand, width: u8) -> Vec<BytePair> {
        let a = self.operand_bytes(a, width, B);
        let b = self.operand_bytes(b, width, DPL);
        a.into_iter().zip(b).map(|(left, right)| BytePair { left, right }).collect()
    }

    /// True if a value is a cell of fewer than `width` bytes.
    pub(super) fn is_narrower(&self, value: WordOperand, width: u8) -> bool {
        matches!(value, WordOperand::Cell(word) if self.ir.bytes(word) < width)
    }

    /// Addresses of the bytes of a word, low byte first.
    fn byte_addresses(&self, word: WordId) -> Vec<u8> {
        let at = self.layout.word(word);
        (0..self.ir.bytes(word)).map(|n| at + n).collect()
    }

    /// dst := src.
    pub(super) fn move_word(&mut self, dst: WordId, src: WordOperand, live: bool) {
        let places = self.byte_addresses(dst);
        match src {
            WordOperand::Const(value) => {
                let bytes: Vec<(u8, u8)> = places.into_iter().zip(value.to_le_bytes()).collect();
                // A byte value that occurs twice is loaded into A once.
                for &(at, byte) in &bytes {
                    if bytes.iter().filter(|(_, other)| *other == byte).count() > 1 {
                        self.load(ByteOperand::Imm(byte));
                    }
                    self.copy(at, ByteOperand::Imm(byte));
                }
            }
            WordOperand::Cell(word) if word == dst => {}
            WordOperand::Cell(word) => {
                let (from, bytes) = (self.layout.word(word), self.ir.bytes(word));
                let wider = places.len() > usize::from(bytes);
                for (&at, n) in places.iter().zip(0..bytes) {
                    if wider && n + 1 == bytes {
                        self.load(ByteOperand::At(from + n));
                    }
                    self.copy(at, ByteOperand::At(from + n));
                }
                if wider {
                    self.save_carry(live);
                    self.load(ByteOperand::At(from + bytes - 1));
                    self.sign_of_a();
                    places.iter().skip(bytes.into()).for_each(|&at| self.save(at));
                }
            }
        }
    }

    /// dst := a op b.
    pub(super) fn math(&mut self, op: ArithmeticOp, dst: WordId, a: WordOperand, b: WordOperand, live: bool) {
        match (op, a, b) {
            (ArithmeticOp::Add, WordOperand::Const(c), WordOperand::Cell(a))
            | (ArithmeticOp::Add, WordOperand::Cell(a), WordOperand::Const(c)) => {
                self.add_constant(dst, a, c, live);
            }
            (ArithmeticOp::Sub, WordOperand::Cell(a), WordOperand::Const(c)) => {
                self.add_constant(dst, a, c.wrapping_neg(), live)
            }
            (ArithmeticOp::Add | ArithmeticOp::Sub, ..) => {
                self.save_carry(live);
                let pairs = self.operand_byte_pairs(a, b, self.ir.bytes(dst));
                let first = if op == ArithmeticOp::Add { AluOp::Add } else { AluOp::Subb };
                if op == ArithmeticOp::Sub {
                    self.emit(Mcs51OpKind::ClrC, &[]);
                }
                for (n, (at, pair)) in self.byte_addresses(dst).into_iter().zip(pairs).enumerate() {
                    self.load(pair.left);
                    self.alu(if n > 0 && op == ArithmeticOp::Add { AluOp::Addc } else { first }, pair.right);
                    self.save(at);
                }
            }
            (ArithmeticOp::Mul, ..) if self.ir.bytes(dst) == 1 => {
                self.save_carry(live);
                let byte = |this: &mut Self, value| {
                    this.operand_bytes(value, 1, B).first().copied().unwrap_or(ByteOperand::Imm(0))
                };
                let (a, b) = (byte(self, a), byte(self, b));
                self.load(a);
                self.multiply_byte(b);
                self.save(self.layout.word(dst));
            }
            (ArithmeticOp::And, ..) => self.bitwise(AluOp::Anl, dst, a, b, live),
            (ArithmeticOp::Or, ..) => self.bitwise(AluOp::Orl, dst, a, b, live),
            (ArithmeticOp::Xor, ..) => self.bitwise(AluOp::Xrl, dst, a, b, live),
            (ArithmeticOp::Shr, ..) => self.shift_right(dst, a, shift_count(b), live),
            (ArithmeticOp::Mul | ArithmeticOp::Div, ..) => self.call_subroutine(op, dst, a, b, live),
        }
    }

    /// dst := an operation on the bits of a and b.
    fn bitwise(&mut self, op: AluOp, dst: WordId, a: WordOperand, b: WordOperand, live: bool) {
        let width = self.ir.bytes(dst);
        // The sign of a narrower operand costs the carry.
        if self.is_narrower(a, width) || self.is_narrower(b, width) {
            self.save_carry(live);
        }
        let pairs = self.operand_byte_pairs(a, b, width);
        for (at, pair) in self.byte_addresses(dst).into_iter().zip(pairs) {
            self.load(pair.left);
            self.alu(op, pair.right);
            self.save(at);
        }
    }

    /// dst := a shifted right by a constant, zeros coming in: whole bytes are moved, the rest bit by bit.
    fn shift_right(&mut self, dst: WordId, a: WordOperand, count: usize, live: bool) {
        self.save_carry(live);
        let places = self.byte_addresses(dst);
        let bytes = self.operand_bytes(a, self.ir.bytes(dst), B);
        let (skipped, bits) = (count / 8, count % 8);
        for (n, &at) in places.iter().enumerate() {
            self.copy(at, bytes.get(n + skipped).copied().unwrap_or(ByteOperand::Imm(0)));
        }
        for _ in 0..bits {
            self.emit(Mcs51OpKind::ClrC, &[]);
            for &at in places.iter().rev().skip(skipped) {
                self.load(ByteOperand::At(at));
                self.emit(Mcs51OpKind::RrcA, &[]);
                self.state.a = None;
                self.save(at);
            }
        }
    }

    /// dst := a + constant.
    fn add_constant(&mut self, dst: WordId, a: WordId, constant: i32, live: bool) {
        let width = self.ir.bytes(dst);
        let places = self.byte_addresses(dst);
        let constant = constant.to_le_bytes();
        let constant = constant.get(..width.into()).unwrap_or(&constant);
        let all = |value: u8| constant.iter().all(|&byte| byte == value);
        if all(0) {
            return self.move_word(dst, WordOperand::Cell(a), live);
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
        self.save_carry(live);
        let sources = self.operand_bytes(WordOperand::Cell(a), width, B);
        // If the upper half only propagates the carry, two bytes have a shorter form.
        if let (true, true, [low, high], [small, _]) = (dst == a, upper(0) || upper(0xFF), &places[..], constant) {
            let up = upper(0);
            let over = self.asm.new_label();
            self.load(ByteOperand::At(*low));
            self.alu(AluOp::Add, ByteOperand::Imm(*small));
            self.save(*low);
            self.jump(if up { Mcs51OpKind::Jnc } else { Mcs51OpKind::Jc }, &[], over);
            let there = self.state;
            self.step_byte(*high, up);
            self.place(over);
            self.state = self.state.merge(&there);
            return;
        }
        let mut begun = false;
        for ((at, source), &byte) in places.into_iter().zip(sources).zip(constant) {
            if !begun && byte == 0 {
                self.copy(at, source);
                continue;
            }
            self.load(source);
            self.alu(if begun { AluOp::Addc } else { AluOp::Add }, ByteOperand::Imm(byte));
            self.save(at);
            begun = true;
        }
    }

    /// Increments a word; no flag changes.
    fn count_up(&mut self, places: &[u8]) {
        let over = self.asm.new_label();
        for (n, &at) in places.iter().enumerate() {
            self.step_byte(at, true);
            if n + 1 < places.len() {
                self.load(ByteOperand::At(at));
                self.jump(Mcs51OpKind::Jnz, &[], over);
            }
        }
        if places.len() > 1 {
            self.place(over);
            (self.state.a, self.state.r0) = (None, None);
        }
        if let ([low, _], true) = (places, places.iter().all(|at| *at < 0x80)) {
            self.state.a = Some(ByteOperand::At(*low));
        }
    }

    /// Decrements a word; no flag changes. A byte is decremented if all lower bytes are 0.
    fn count_down(&mut self, places: &[u8]) {
        let [low, upper @ ..] = places else { return };
        if !upper.is_empty() {
            let over = self.asm.new_label();
            self.load(ByteOperand::At(*low));
            self.jump(Mcs51OpKind::Jnz, &[], over);
            let before = self.state;
            self.count_down(upper);
            self.place(over);
            self.state = self.state.merge(&before);
        }
        self.step_byte(*low, false);
    }

    /// dst := a op b, with a subroutine that has its operands and result at fixed addresses.
    fn call_subroutine(&mut self, op: ArithmeticOp, dst: WordId, a: WordOperand, b: WordOperand, live: bool) {
        self.save_carry(live);
        let width = self.ir.width(op, dst, a, b);
        let count = usize::from(width);
        let pairs = self.operand_byte_pairs(a, b, width);
        let (first, second): (Vec<ByteOperand>, Vec<ByteOperand>) =
            pairs.into_iter().map(|pair| (pair.left, pair.right)).unzip();
        let places: Vec<u8> = self.layout.scratch.clone();
        for (&at, byte) in places.iter().zip(first.into_iter().chain(second)) {
            self.copy(at, byte);
        }
        let entries = if op == ArithmeticOp::Mul { &mut self.multiply } else { &mut self.divide };
        if let Some(entry) = entries.get_mut(count) {
            let label = *entry.get_or_insert_with(|| self.asm.new_label());
            self.pending.push(PendingCode::Jump(Mcs51Jump::Call, label));
        }
        (self.state.a, self.state.r0, self.state.carry) = (None, None, None);
        for (at, &result) in self.byte_addresses(dst).into_iter().zip(&places) {
            self.copy(at, ByteOperand::At(result));
        }
    }
}
