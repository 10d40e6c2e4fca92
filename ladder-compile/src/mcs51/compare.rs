//! Selects comparisons of integers: as jumps, and as a bit combined with the accumulator.

use super::word_ops::BytePair;
use emu_8051::isa::Mcs51OpKind;

use super::arch::Mcs51Jump;
use super::byte_ops::AluOp;
use super::known_state::{AccumulatorState, ByteOperand, SelectorState};
use super::registers::{ACC, B, OV};
use super::select::{Mcs51Selector, PendingCode};
use crate::code::CodeLabel;
use crate::ir::{RelationOp, WordComparison, WordId, WordOperand, min_bytes};

/// The known states on both paths of a conditional jump.
pub(super) struct BranchStates {
    /// When the code continues.
    pub on: SelectorState,
    /// When it jumps.
    pub jump: SelectorState,
}

impl BranchStates {
    /// A jump that does not depend on the known state.
    pub(super) fn same(state: SelectorState) -> BranchStates {
        BranchStates { on: state, jump: state }
    }
}

impl Mcs51Selector<'_> {
    /// Width of a comparison in bytes.
    fn compare_width(&self, compare: &WordComparison) -> u8 {
        let b = match compare.b {
            WordOperand::Cell(word) => self.ir.bytes(word),
            WordOperand::Const(value) => min_bytes(value),
        };
        self.ir.bytes(compare.a).max(b)
    }

    /// Compares and jumps if the result is `when`; with `keep` it saves the accumulator from the carry first.
    pub(super) fn compare_jump(
        &mut self,
        compare: &WordComparison,
        when: bool,
        to: CodeLabel,
        keep: bool,
    ) -> BranchStates {
        let width = self.compare_width(compare);
        let a = WordOperand::Cell(compare.a);
        let extends = self.is_narrower(a, width) || self.is_narrower(compare.b, width);
        match compare.rel {
            RelationOp::Eq | RelationOp::Ne => {
                if extends || !keep {
                    self.save_carry(keep);
                }
                let pairs = self.operand_byte_pairs(a, compare.b, width);
                let jumps_if_equal = (compare.rel == RelationOp::Eq) == when;
                self.equal_jump(&pairs, jumps_if_equal, to, keep && !extends);
                BranchStates::same(self.state)
            }
            RelationOp::Lt | RelationOp::Ge => {
                let jumps_if_less = (compare.rel == RelationOp::Lt) == when;
                if compare.b == WordOperand::Const(0) {
                    self.load_sign_byte(compare.a);
                    self.jump(if jumps_if_less { Mcs51OpKind::Jb } else { Mcs51OpKind::Jnb }, &[ACC + 7], to);
                    return BranchStates::same(self.state);
                }
                self.save_carry(keep);
                if let WordOperand::Cell(_) = compare.b {
                    self.difference_sign(compare, width);
                    self.jump(if jumps_if_less { Mcs51OpKind::Jb } else { Mcs51OpKind::Jnb }, &[ACC + 7], to);
                    return BranchStates::same(self.state);
                }
                let inverted = self.compare_less(compare);
                self.jump(if jumps_if_less ^ inverted { Mcs51OpKind::Jc } else { Mcs51OpKind::Jnc }, &[], to);
                let with = |less: bool| SelectorState { carry: Some(less ^ inverted), ..self.state };
                BranchStates { on: with(!jumps_if_less), jump: with(jumps_if_less) }
            }
        }
    }

    fn load_sign_byte(&mut self, word: WordId) {
        let top = self.layout.word(word) + self.ir.bytes(word) - 1;
        self.load(ByteOperand::At(top));
    }

    /// Jumps if all pairs are equal (`if_equal`), or if some pair differs. Preserves the carry if `keep`.
    fn equal_jump(&mut self, pairs: &[BytePair], if_equal: bool, to: CodeLabel, keep: bool) {
        let constant = |byte: &ByteOperand| matches!(byte, ByteOperand::Imm(value) if *value != 0);
        let zeros = pairs.iter().filter(|pair| pair.right == ByteOperand::Imm(0)).count();
        // At most one byte is compared with a value; the others only need to be 0.
        if zeros + 1 >= pairs.len() {
            let mut rest: Vec<ByteOperand> =
                pairs.iter().filter(|pair| pair.right == ByteOperand::Imm(0)).map(|pair| pair.left).collect();
            match pairs.iter().find(|pair| pair.right != ByteOperand::Imm(0)) {
                Some(&BytePair { left, right }) if rest.is_empty() && !if_equal && !keep => {
                    return self.jump_if_different(left, right, to);
                }
                Some(pair) => {
                    self.load(pair.left);
                    self.alu(AluOp::Xrl, pair.right);
                }
                None => rest.pop().into_iter().for_each(|a| self.load(a)),
            }
            rest.into_iter().for_each(|a| self.alu(AluOp::Orl, a));
            return self.jump(if if_equal { Mcs51OpKind::Jz } else { Mcs51OpKind::Jnz }, &[], to);
        }
        let skip = self.asm.new_label();
        let differs = if if_equal { skip } else { to };
        let mut r0 = None;
        for (n, &BytePair { left: a, right: b }) in pairs.iter().enumerate() {
            let last = n + 1 == pairs.len();
            if (last && if_equal) || keep || (constant(&a) && constant(&b)) {
                self.load(a);
                self.alu(AluOp::Xrl, b);
                let kind = if last && if_equal { Mcs51OpKind::Jz } else { Mcs51OpKind::Jnz };
                self.jump(kind, &[], if last && if_equal { to } else { differs });
            } else {
                self.jump_if_different(a, b, differs);
            }
            r0 = if n == 0 { self.state.r0 } else { r0.filter(|_| r0 == self.state.r0) };
        }
        self.place(skip);
        (self.state.a, self.state.r0) = (None, r0);
    }

    /// Jumps if two bytes differ. Changes the carry.
    fn jump_if_different(&mut self, a: ByteOperand, b: ByteOperand, to: CodeLabel) {
        match (a, b) {
            (ByteOperand::At(at @ 0..8), ByteOperand::Imm(value)) if self.state.a != Some(a) => {
                self.jump(Mcs51OpKind::CjneReg, &[at.into(), value.into()], to);
            }
            (_, ByteOperand::Imm(value)) => {
                self.load(a);
                self.jump(Mcs51OpKind::CjneImm, &[value.into()], to);
            }
            (_, ByteOperand::At(at @ 0..0x80)) => {
                self.load(a);
                self.jump(Mcs51OpKind::CjneDir, &[at.into()], to);
            }
            (_, ByteOperand::Sfr(at)) => {
                self.load(a);
                self.jump(Mcs51OpKind::CjneDir, &[at], to);
            }
            _ => {
                self.load(a);
                self.alu(AluOp::Xrl, b);
                self.jump(Mcs51OpKind::Jnz, &[], to);
            }
        }
        self.state.carry = None;
    }

    /// Bit 7 of A := a < b, for two cells. Changes the carry.
    fn difference_sign(&mut self, compare: &WordComparison, width: u8) {
        let pairs = self.operand_byte_pairs(WordOperand::Cell(compare.a), compare.b, width);
        for (n, BytePair { left: a, right: b }) in pairs.into_iter().enumerate() {
            self.load(a);
            if n == 0 && self.state.carry != Some(false) {
                self.emit(Mcs51OpKind::ClrC, &[]);
            }
            self.alu(AluOp::Subb, b);
        }
        let right = self.asm.new_label();
        self.jump(Mcs51OpKind::Jnb, &[OV], right);
        self.emit(Mcs51OpKind::CplA, &[]);
        self.place(right);
    }

    /// The carry := a < b; returns true if it is complemented.
    fn compare_less(&mut self, compare: &WordComparison) -> bool {
        let width = self.compare_width(compare);
        match compare.b {
            WordOperand::Const(0) => {
                self.load_sign_byte(compare.a);
                self.emit(Mcs51OpKind::MovCBit, &[ACC + 7]);
                self.state.carry = None;
                false
            }
            WordOperand::Cell(_) => {
                self.difference_sign(compare, width);
                self.emit(Mcs51OpKind::RlcA, &[]);
                (self.state.a, self.state.carry) = (None, None);
                false
            }
            WordOperand::Const(value) => {
                // Compute a - b as a + (2^n - b), with both offset to unsigned; the carry is set if a >= b.
                let sources = self.operand_bytes(WordOperand::Cell(compare.a), width, B);
                let half = 1i64 << (8 * width - 1);
                let other = (2 * half - (i64::from(value) + half)) & (2 * half - 1);
                if other == 0 {
                    // No number is less than the lowest one.
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
                        self.alu(AluOp::Xrl, ByteOperand::Imm(0x80));
                    }
                    self.alu(if begun { AluOp::Addc } else { AluOp::Add }, ByteOperand::Imm(byte));
                    begun = true;
                }
                true
            }
        }
    }

    /// acc := acc and the comparison.
    pub(super) fn and_compare(&mut self, compare: &WordComparison) {
        if self.state.acc.known == Some(false) {
            return;
        }
        if let RelationOp::Eq | RelationOp::Ne = compare.rel {
            return self.and_equal(compare);
        }
        let less_inverted = matches!(compare.b, WordOperand::Const(value) if value != 0);
        let inverted = less_inverted ^ (compare.rel == RelationOp::Ge);
        if self.state.acc.known == Some(true) {
            self.save_carry(false);
            self.compare_less(compare);
            self.state.acc = AccumulatorState { carry: Some(inverted), ..AccumulatorState::default() };
            return;
        }
        if let (false, Some((flag, negated))) = (self.state.acc.carry.is_some(), self.state.acc.flag) {
            self.compare_less(compare);
            self.state.acc = AccumulatorState { carry: Some(inverted), ..AccumulatorState::default() };
            return self.combine(true, flag, negated);
        }
        // False stays false; otherwise the comparison decides.
        let over = self.asm.new_label();
        self.acc_to_carry_as(inverted);
        self.jump(if inverted { Mcs51OpKind::Jc } else { Mcs51OpKind::Jnc }, &[], over);
        let before = self.state;
        self.compare_less(compare);
        self.place(over);
        self.state = self.state.merge(&before);
        self.state.carry = None;
        self.state.acc = AccumulatorState { carry: Some(inverted), ..AccumulatorState::default() };
    }

    /// acc := acc and a comparison for equality: the carry holds the accumulator and changes if the
    /// comparison fails.
    fn and_equal(&mut self, compare: &WordComparison) {
        let (holds, end) = (self.asm.new_label(), self.asm.new_label());
        let certain = self.state.acc.known.is_some();
        let inverted = self.acc_to_carry();
        if !certain {
            self.jump(if inverted { Mcs51OpKind::Jc } else { Mcs51OpKind::Jnc }, &[], end);
        }
        let width = self.compare_width(compare);
        // Sign-extending a narrow operand destroys the carry, which is then set on both paths.
        let lost = self.is_narrower(WordOperand::Cell(compare.a), width) || self.is_narrower(compare.b, width);
        self.state.acc = AccumulatorState { carry: Some(inverted), ..AccumulatorState::default() };
        self.compare_jump(compare, true, holds, !lost);
        self.set_carry(inverted);
        if lost {
            self.pending.push(PendingCode::Jump(Mcs51Jump::Unconditional, end));
        }
        self.place(holds);
        if lost {
            self.set_carry(!inverted);
        }
        self.place(end);
        let acc = AccumulatorState { carry: Some(inverted), ..AccumulatorState::default() };
        self.state = SelectorState { acc, ..SelectorState::default() };
    }
}
