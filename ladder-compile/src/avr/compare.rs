//! Signed comparisons of integers.

use emu_avr::isa::AvrOpKind;

use super::arch::AvrJump;
use super::layout::AvrCellPlace;
use super::registers::{A, B, BYTE, SCRATCH, ZERO};
use super::select::AvrSelector;
use super::words::{RegisterQuad, constant_byte};
use crate::code::CodeLabel;
use crate::ir::{IrOp, RelationOp, WordComparison, WordId, WordOperand};

/// State of a chain of comparisons that is being selected.
#[derive(Debug, Clone, Copy, Default)]
pub struct ComparisonChain {
    /// Label for comparisons that fail, and what A holds there.
    failure_target: Option<(CodeLabel, Option<(WordId, usize)>)>,
    /// True if the next comparison is unsigned.
    unsigned: bool,
}

/// True if `first` checks that a word is not negative, and `second` that it is below a positive constant.
fn is_range(first: &WordComparison, second: &WordComparison) -> bool {
    let (WordOperand::Const(low), WordOperand::Const(high)) = (first.b, second.b) else { return false };
    first.a == second.a && first.rel == RelationOp::Ge && low == 0 && second.rel == RelationOp::Lt && high > 0
}

/// The branch instructions after a comparison.
pub(super) struct ComparisonBranches {
    /// Is taken if the comparison is true.
    pub if_true: AvrOpKind,
    /// Is taken if the comparison is false.
    pub if_false: AvrOpKind,
}

impl AvrSelector<'_> {
    /// T := T and the comparison; `next` is the following operation.
    ///
    /// In a chain of comparisons, one that fails jumps directly to the CLT at the end of the chain.
    pub fn and_compare(&mut self, compare: &WordComparison, next: Option<&IrOp>) {
        if self.known.t == Some(false) {
            return;
        }
        let next = match next {
            Some(IrOp::AndCompare(next)) => Some(next),
            _ => None,
        };
        if next.is_some_and(|next| is_range(compare, next)) {
            // Non-negative and below a constant is the same as below it unsigned, so the next comparison
            // checks both.
            self.comparison_chain.unsigned = true;
            return;
        }
        let unsigned = std::mem::take(&mut self.comparison_chain.unsigned);
        if let (RelationOp::Lt | RelationOp::Ge, WordOperand::Const(0), None, None) =
            (compare.rel, compare.b, next, self.comparison_chain.failure_target)
        {
            let top = self.sign_byte_register(compare.a);
            self.asm.op(if compare.rel == RelationOp::Ge { AvrOpKind::Sbrc } else { AvrOpKind::Sbrs }, &[top, 7]);
            self.asm.op(AvrOpKind::Clt, &[]);
            self.known.t = None;
            return;
        }
        let signed = self.compare(compare);
        let branches =
            if unsigned { ComparisonBranches { if_true: AvrOpKind::Brcs, if_false: AvrOpKind::Brcc } } else { signed };
        let (label, before) = match self.comparison_chain.failure_target {
            Some(known) => known,
            None => (self.asm.new_label(), self.known.a),
        };
        let known = self.known.a.filter(|_| self.known.a == before);
        if next.is_some() {
            self.asm.jump(AvrJump::If(branches.if_false), label);
            self.comparison_chain.failure_target = Some((label, known));
        } else {
            let over = self.asm.new_label();
            self.asm.jump(AvrJump::If(branches.if_true), over);
            self.asm.place_label(label);
            self.asm.op(AvrOpKind::Clt, &[]);
            self.asm.place_label(over);
            self.comparison_chain.failure_target = None;
            self.known.a = known;
        }
        self.known.t = None;
    }

    /// Compares, and returns the branches that follow it.
    pub(super) fn compare(&mut self, compare: &WordComparison) -> ComparisonBranches {
        let WordComparison { a, rel, b } = *compare;
        match (rel, b) {
            (RelationOp::Lt | RelationOp::Ge, WordOperand::Const(0)) => {
                // Only the sign matters.
                let top = self.sign_byte_register(a);
                self.asm.op(AvrOpKind::And, &[top, top]);
                let (if_true, if_false) = if rel == RelationOp::Lt {
                    (AvrOpKind::Brmi, AvrOpKind::Brpl)
                } else {
                    (AvrOpKind::Brpl, AvrOpKind::Brmi)
                };
                return ComparisonBranches { if_true, if_false };
            }
            (_, WordOperand::Const(constant)) => self.compare_constant(a, rel, constant),
            (_, WordOperand::Cell(word)) => {
                let width = self.bytes(a).max(self.bytes(word));
                // If A holds the right operand it stays there, and the left operand goes to B.
                let is_cached = matches!(self.known.a, Some((cached, to)) if cached == word && to >= width);
                let left = self.source_registers(WordOperand::Cell(a), width, if is_cached { B } else { A });
                let right = self.source_registers(b, width, B);
                self.compare_bytes(left, right, width);
            }
        }
        let (if_true, if_false) = match rel {
            RelationOp::Eq => (AvrOpKind::Breq, AvrOpKind::Brne),
            RelationOp::Ne => (AvrOpKind::Brne, AvrOpKind::Breq),
            RelationOp::Lt => (AvrOpKind::Brlt, AvrOpKind::Brge),
            RelationOp::Ge => (AvrOpKind::Brge, AvrOpKind::Brlt),
        };
        ComparisonBranches { if_true, if_false }
    }

    fn compare_bytes(&mut self, left: RegisterQuad, right: RegisterQuad, width: usize) {
        for (n, (&left, &right)) in left.iter().zip(&right).enumerate().take(width) {
            self.asm.op(if n == 0 { AvrOpKind::Cp } else { AvrOpKind::Cpc }, &[left, right]);
        }
    }

    /// Compares with a constant. For `Lt` and `Ge`, low bytes of the constant that are zero cannot change the
    /// result.
    fn compare_constant(&mut self, a: WordId, rel: RelationOp, constant: i32) {
        let width = self.bytes(a);
        let ordered = matches!(rel, RelationOp::Lt | RelationOp::Ge);
        let skipped = if ordered { (0..width - 1).take_while(|&n| constant_byte(constant, n) == 0).count() } else { 0 };
        let is_cached = matches!(self.known.a, Some((cached, to)) if cached == a && to >= width);
        let first = constant_byte(constant, skipped);
        let regs = match (self.layout.word(a), self.home_registers(a)) {
            // CPI needs r16 or above for the lowest relevant byte; zero can be compared in any register.
            (_, Some(home)) if home[0] >= 16 || first == 0 || (skipped + 1 == width && !is_cached) => home,
            (AvrCellPlace::Ram(addr), None) if skipped + 1 == width && !is_cached => {
                self.layout.load(self.asm, BYTE, addr + skipped as u16);
                [BYTE; 4]
            }
            _ => {
                self.load_value(WordOperand::Cell(a), width, A);
                A
            }
        };
        for (n, &reg) in regs.iter().enumerate().take(width).skip(skipped) {
            let (plain, immediate) = if n == skipped { (AvrOpKind::Cp, true) } else { (AvrOpKind::Cpc, false) };
            match constant_byte(constant, n) {
                0 => self.asm.op(plain, &[reg, ZERO]),
                byte if immediate && reg >= 16 => self.asm.op(AvrOpKind::Cpi, &[reg, byte]),
                byte => {
                    self.asm.op(AvrOpKind::Ldi, &[SCRATCH, byte]);
                    self.asm.op(plain, &[reg, SCRATCH]);
                }
            }
        }
    }

    /// Returns a register that holds the byte with the sign.
    fn sign_byte_register(&mut self, word: WordId) -> i32 {
        let last = self.bytes(word).saturating_sub(1);
        if let Some(&reg) = self.home_registers(word).as_ref().and_then(|home| home.get(last)) {
            return reg;
        }
        match (self.known.a, self.layout.word(word)) {
            (Some((cached, to)), _) if cached == word && to > last => A.get(last).copied().unwrap_or(BYTE),
            (_, AvrCellPlace::Ram(addr)) => {
                self.layout.load(self.asm, BYTE, addr + last as u16);
                BYTE
            }
            (_, AvrCellPlace::Reg(reg)) => reg.into(),
        }
    }
}
