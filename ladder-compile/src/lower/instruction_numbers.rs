//! Numbers of Instruction List: types of 1, 2 and 4 bytes with and without sign (section 6.2 of
//! `docs/semantics.md`).
//!
//! The cells have a sign, so a number without sign is compared with its highest bit inverted, and divided at
//! a larger width.

use ladder::CompareOp;
use ladder::il::{IecType, IlBinaryOperator, IlSource};

use super::Lowering;
use super::instructions::{constant_of, width};
use crate::ir::{ArithmeticOp, IrOp, WordId, WordOperand};

/// The lowest number of a width, which has only the highest bit.
fn lowest(bytes: u8) -> i32 {
    i32::MIN >> (32 - 8 * u32::from(bytes.clamp(1, 4)))
}

impl Lowering<'_> {
    /// An operand as a number of the type. `place` names the temporary that may hold it.
    pub(super) fn number(
        &mut self,
        source: &IlSource,
        before: Option<&IecType>,
        iec_type: &IecType,
        place: &str,
    ) -> WordOperand {
        match source {
            IlSource::Constant(value) => WordOperand::Const(constant_of(*value, iec_type)),
            IlSource::Symbol(symbol) if symbol.iec_type == IecType::Bool => {
                let bit = self.symbol_bit(&symbol.name);
                let dst = self.temporary(place, 1);
                self.bit_to_number(crate::ir::BranchCondition::Bit(bit), dst);
                dst.into()
            }
            IlSource::Symbol(symbol) => {
                let word = self.word(&symbol.name);
                self.convert_number(word, &symbol.iec_type, iec_type, place)
            }
            IlSource::Result => match before {
                None | Some(IecType::Bool) => {
                    let dst = self.temporary(place, 1);
                    self.bit_to_number(crate::ir::BranchCondition::Acc, dst);
                    dst.into()
                }
                Some(from) => {
                    let word = self.result_word(width(from));
                    self.convert_number(word, from, iec_type, place)
                }
            },
        }
    }

    /// dst := 1 or 0.
    pub(super) fn bit_to_number(&mut self, cond: crate::ir::BranchCondition, dst: WordId) {
        let set = |value| vec![IrOp::Move { dst, src: WordOperand::Const(value) }];
        self.push(IrOp::If { cond, if_true: set(1), if_false: set(0) });
    }

    /// A number of one type as a number of another (I1).
    pub(super) fn convert_number(&mut self, word: WordId, from: &IecType, to: &IecType, place: &str) -> WordOperand {
        let (have, want) = (width(from), width(to));
        if have == want || have < want && from.is_signed() {
            return word.into();
        }
        let dst = self.temporary(place, want);
        self.push(IrOp::Move { dst, src: word.into() });
        if have < want {
            self.clear_above(dst, have);
        }
        dst.into()
    }

    /// Clears the bytes above the lowest `bytes`.
    fn clear_above(&mut self, word: WordId, bytes: u8) {
        let mask = ((1_i64 << (8 * bytes)) - 1) as i32;
        self.math(ArithmeticOp::And, word, word.into(), WordOperand::Const(mask));
    }

    /// A number with all bits inverted.
    pub(super) fn complement_number(&mut self, value: WordOperand, iec_type: &IecType) -> WordOperand {
        match value {
            WordOperand::Const(constant) => WordOperand::Const(!constant),
            WordOperand::Cell(_) => {
                let dst = self.temporary("complement", width(iec_type));
                self.math(ArithmeticOp::Xor, dst, value, WordOperand::Const(-1));
                dst.into()
            }
        }
    }

    /// dst := a operator b, or acc := the comparison. `dst` may be `a`.
    pub(super) fn combine(
        &mut self,
        operator: IlBinaryOperator,
        dst: WordId,
        a: WordOperand,
        b: WordOperand,
        iec_type: &IecType,
    ) {
        use IlBinaryOperator as Op;
        let op = match operator {
            Op::And => ArithmeticOp::And,
            Op::Or => ArithmeticOp::Or,
            Op::Xor => ArithmeticOp::Xor,
            Op::Add => ArithmeticOp::Add,
            Op::Sub => ArithmeticOp::Sub,
            Op::Mul => ArithmeticOp::Mul,
            Op::Div => return self.divide(dst, a, b, iec_type, false),
            Op::Mod => return self.divide(dst, a, b, iec_type, true),
            Op::Gt => return self.compare(CompareOp::Grt, a, b, iec_type),
            Op::Ge => return self.compare(CompareOp::Geq, a, b, iec_type),
            Op::Eq => return self.compare(CompareOp::Equ, a, b, iec_type),
            Op::Ne => return self.compare(CompareOp::Neq, a, b, iec_type),
            Op::Le => return self.compare(CompareOp::Leq, a, b, iec_type),
            Op::Lt => return self.compare(CompareOp::Les, a, b, iec_type),
        };
        self.math(op, dst, a, b);
    }

    /// acc := the comparison of numbers of the type.
    fn compare(&mut self, op: CompareOp, a: WordOperand, b: WordOperand, iec_type: &IecType) {
        let (a, b) = self.order_as_signed(op, a, b, iec_type);
        self.compare_to_accumulator(op, a, b);
    }

    /// Two numbers of the type as numbers with sign that have the same order.
    fn order_as_signed(
        &mut self,
        op: CompareOp,
        a: WordOperand,
        b: WordOperand,
        iec_type: &IecType,
    ) -> (WordOperand, WordOperand) {
        if iec_type.is_signed() || matches!(op, CompareOp::Equ | CompareOp::Neq) {
            return (a, b);
        }
        let bytes = width(iec_type);
        let mut inverted = |value, name| match value {
            WordOperand::Const(constant) => WordOperand::Const(constant ^ lowest(bytes)),
            WordOperand::Cell(_) => {
                let dst = self.temporary(name, bytes);
                self.math(ArithmeticOp::Xor, dst, value, WordOperand::Const(lowest(bytes)));
                dst.into()
            }
        };
        (inverted(a, "left"), inverted(b, "right"))
    }

    /// Executes `then` if the comparison of numbers of the type holds.
    pub(super) fn if_ordered(
        &mut self,
        op: CompareOp,
        a: WordOperand,
        b: WordOperand,
        iec_type: &IecType,
        [then, otherwise]: [Vec<IrOp>; 2],
    ) {
        let (a, b) = self.order_as_signed(op, a, b, iec_type);
        let ops = self.if_comparison(op, a, b, then, otherwise);
        self.push_all(ops);
    }

    /// dst := a / b or a modulo b; 0 if b is 0 (I13).
    fn divide(&mut self, dst: WordId, a: WordOperand, b: WordOperand, iec_type: &IecType, remainder: bool) {
        let zero = vec![IrOp::Move { dst, src: WordOperand::Const(0) }];
        let divided = self.captured(|this| match (iec_type.is_signed(), width(iec_type)) {
            (true, bytes) => this.divide_signed(dst, a, b, bytes, remainder),
            (false, 4) => this.divide_unsigned(dst, a, b, remainder),
            (false, bytes) => {
                let widened = [(a, "dividend"), (b, "divisor")].map(|(value, name)| this.widen(value, bytes, name));
                let wide = this.temporary("quotient", bytes + 1);
                this.divide_signed(wide, widened[0], widened[1], bytes + 1, remainder);
                this.push(IrOp::Move { dst, src: wide.into() });
            }
        });
        let ops = self.if_comparison(CompareOp::Equ, b, WordOperand::Const(0), zero, divided);
        self.push_all(ops);
    }

    fn divide_signed(&mut self, dst: WordId, a: WordOperand, b: WordOperand, bytes: u8, remainder: bool) {
        if !remainder {
            return self.math(ArithmeticOp::Div, dst, a, b);
        }
        let multiple = self.temporary("multiple", bytes);
        self.math(ArithmeticOp::Div, multiple, a, b);
        self.math(ArithmeticOp::Mul, multiple, multiple.into(), b);
        self.math(ArithmeticOp::Sub, dst, a, multiple.into());
    }

    /// A number without sign at one byte more.
    fn widen(&mut self, value: WordOperand, bytes: u8, name: &str) -> WordOperand {
        match value {
            WordOperand::Const(constant) => WordOperand::Const(constant & ((1 << (8 * bytes)) - 1)),
            WordOperand::Cell(_) => {
                let dst = self.temporary(name, bytes + 1);
                self.push(IrOp::Move { dst, src: value });
                self.clear_above(dst, bytes);
                dst.into()
            }
        }
    }

    /// Divides 32 bits without sign. Half of the dividend has a sign that is never used; what is left tells
    /// the lowest bit of the quotient. A divisor with the highest bit goes in at most once.
    fn divide_unsigned(&mut self, dst: WordId, a: WordOperand, b: WordOperand, remainder: bool) {
        let [quotient, rest] = ["quotient", "rest"].map(|name| self.temporary(name, 4));
        let [dividend, divisor] = [(a, "dividend"), (b, "divisor")].map(|(value, name)| {
            let dst = self.temporary(name, 4);
            self.push(IrOp::Move { dst, src: value });
            dst
        });
        let constant = WordOperand::Const;
        let halved = self.captured(|this| {
            this.math(ArithmeticOp::Shr, quotient, dividend.into(), constant(1));
            this.math(ArithmeticOp::Div, quotient, quotient.into(), divisor.into());
            this.math(ArithmeticOp::Mul, quotient, quotient.into(), constant(2));
            this.math(ArithmeticOp::Mul, rest, quotient.into(), divisor.into());
            this.math(ArithmeticOp::Sub, rest, dividend.into(), rest.into());
        });
        let large = self.captured(|this| {
            this.push(IrOp::Move { dst: quotient, src: constant(0) });
            this.push(IrOp::Move { dst: rest, src: dividend.into() });
        });
        let ops = self.if_comparison(CompareOp::Les, divisor.into(), constant(0), large, halved);
        self.push_all(ops);
        let once_more = self.captured(|this| {
            this.math(ArithmeticOp::Add, quotient, quotient.into(), constant(1));
            this.math(ArithmeticOp::Sub, rest, rest.into(), divisor.into());
        });
        self.if_ordered(CompareOp::Geq, rest.into(), divisor.into(), &IecType::Udint, [once_more, Vec::new()]);
        let src = if remainder { rest } else { quotient };
        self.push(IrOp::Move { dst, src: src.into() });
    }
}
