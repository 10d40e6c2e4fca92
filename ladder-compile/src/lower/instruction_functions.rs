//! Lowers standard functions: section 6.3 of `docs/semantics.md`.

use ladder::il::{FunctionCall, IecType, IlBinaryOperator, IlFunction, IlSource};
use ladder::{CompareOp, ShiftOp};

use super::Lowering;
use super::instructions::{BitSource, constant_of, width};
use crate::ir::{ArithmeticOp, BitRole, BranchCondition, IrOp, WordId, WordOperand};

impl Lowering<'_> {
    /// The value of a function becomes the current result.
    pub(super) fn function(&mut self, call: &FunctionCall, before: Option<&IecType>) {
        if call.iec_type == IecType::Bool && call.arguments.contains(&IlSource::Result) {
            self.result_to_bit(before);
        }
        match call.function {
            IlFunction::Convert => return self.convert(call, before),
            IlFunction::Select => return self.select(call, before),
            IlFunction::Multiplex => return self.multiplex(call, before),
            IlFunction::ShiftLeft | IlFunction::ShiftRight | IlFunction::RotateLeft | IlFunction::RotateRight => {
                return self.shift_result(call, before);
            }
            _ => {}
        }
        if call.iec_type == IecType::Bool {
            let bits: Vec<BitSource> = call.arguments.iter().map(|source| self.bit_source(source)).collect();
            return self.function_of_bits(call.function, &bits);
        }
        let numbers: Vec<WordOperand> =
            (0..).zip(&call.arguments).map(|(n, source)| self.argument(n, source, before, &call.iec_type)).collect();
        self.function_of_numbers(call, &numbers);
    }

    /// An argument as a number of the type, in a place that the function does not change.
    fn argument(&mut self, n: usize, source: &IlSource, before: Option<&IecType>, iec_type: &IecType) -> WordOperand {
        let place = format!("argument {n}");
        let value = self.number(source, before, iec_type, &place);
        if *source != IlSource::Result {
            return value;
        }
        let dst = self.temporary(&place, width(iec_type));
        if value != WordOperand::Cell(dst) {
            self.push(IrOp::Move { dst, src: value });
        }
        dst.into()
    }

    fn function_of_bits(&mut self, function: IlFunction, bits: &[BitSource]) {
        let Some((first, others)) = bits.split_first() else { return };
        match function {
            IlFunction::Operator(operator) if operator.is_comparison() => self.compare_bits(operator, bits),
            IlFunction::Limit => {
                if let [least, value, most] = *bits {
                    self.load_bit(value, false);
                    self.combine_bit(IlBinaryOperator::Or, false, least);
                    self.combine_bit(IlBinaryOperator::And, false, most);
                }
            }
            _ => {
                let operator = match function {
                    IlFunction::Operator(operator) => operator,
                    IlFunction::Minimum => IlBinaryOperator::And,
                    _ => IlBinaryOperator::Or,
                };
                self.load_bit(*first, false);
                others.iter().for_each(|bit| self.combine_bit(operator, false, *bit));
            }
        }
    }

    /// acc := whether the comparison holds for all neighbours.
    fn compare_bits(&mut self, operator: IlBinaryOperator, bits: &[BitSource]) {
        let all = self.named_bit("all hold", BitRole::Temporary);
        for (n, pair) in bits.windows(2).enumerate() {
            let [a, b] = pair else { continue };
            self.load_bit(*a, false);
            self.combine_bit(operator, false, *b);
            if n > 0 {
                self.push(IrOp::And { bit: all, negated: false });
            }
            if n + 2 < bits.len() {
                self.push(IrOp::Store { bit: all, negated: false });
            }
        }
    }

    fn function_of_numbers(&mut self, call: &FunctionCall, numbers: &[WordOperand]) {
        let Some((first, others)) = numbers.split_first() else { return };
        let iec_type = &call.iec_type;
        if let IlFunction::Operator(operator) = call.function
            && operator.is_comparison()
        {
            return self.compare_numbers(operator, numbers, iec_type);
        }
        let dst = self.result_word(width(iec_type));
        let put = |src: WordOperand| IrOp::Move { dst, src };
        match call.function {
            IlFunction::Limit => {
                if let [least, value, most] = *numbers {
                    self.push(put(value));
                    self.keep_larger(dst, least, iec_type, true);
                    self.keep_larger(dst, most, iec_type, false);
                }
            }
            function => {
                self.push(put(*first));
                match function {
                    IlFunction::Operator(operator) => {
                        others.iter().for_each(|other| self.combine(operator, dst, dst.into(), *other, iec_type));
                    }
                    IlFunction::Maximum => {
                        others.iter().for_each(|other| self.keep_larger(dst, *other, iec_type, true));
                    }
                    IlFunction::Minimum => {
                        others.iter().for_each(|other| self.keep_larger(dst, *other, iec_type, false));
                    }
                    IlFunction::Absolute if iec_type.is_signed() => {
                        let negate = IrOp::Math { op: ArithmeticOp::Sub, dst, a: WordOperand::Const(0), b: dst.into() };
                        let zero = WordOperand::Const(0);
                        let ops = self.if_comparison(CompareOp::Les, dst.into(), zero, vec![negate], Vec::new());
                        self.push_all(ops);
                    }
                    _ => {}
                }
            }
        }
    }

    /// dst := the larger of dst and a number, or the smaller.
    fn keep_larger(&mut self, dst: WordId, other: WordOperand, iec_type: &IecType, larger: bool) {
        let op = if larger { CompareOp::Les } else { CompareOp::Grt };
        let put = vec![IrOp::Move { dst, src: other }];
        self.if_ordered(op, dst.into(), other, iec_type, [put, Vec::new()]);
    }

    /// acc := whether the comparison holds for all neighbours.
    fn compare_numbers(&mut self, operator: IlBinaryOperator, numbers: &[WordOperand], iec_type: &IecType) {
        let all = self.named_bit("all hold", BitRole::Temporary);
        for (n, pair) in numbers.windows(2).enumerate() {
            let [a, b] = pair else { continue };
            let unused = self.result_word(width(iec_type));
            self.combine(operator, unused, *a, *b, iec_type);
            if n > 0 {
                self.push(IrOp::And { bit: all, negated: false });
            }
            if n + 2 < numbers.len() {
                self.push(IrOp::Store { bit: all, negated: false });
            }
        }
    }

    /// The number of an argument that chooses or counts, in 32 bits with sign; larger numbers are cut to the
    /// largest.
    fn read_selector(&mut self, source: &IlSource, before: Option<&IecType>) -> WordOperand {
        let from = match source {
            IlSource::Constant(value) => {
                let value = (*value).clamp(i64::from(i32::MIN), i64::from(i32::MAX));
                return WordOperand::Const(value as i32);
            }
            IlSource::Symbol(symbol) => symbol.iec_type.clone(),
            IlSource::Result => before.cloned().unwrap_or(IecType::Bool),
        };
        let value = self.number(source, before, &IecType::Dint, "chooser");
        if from.is_signed() || width(&from) < 4 {
            return value;
        }
        let dst = self.temporary("chooser", 4);
        self.push(IrOp::Move { dst, src: value });
        let put = vec![IrOp::Move { dst, src: WordOperand::Const(i32::MAX) }];
        let ops = self.if_comparison(CompareOp::Les, dst.into(), WordOperand::Const(0), put, Vec::new());
        self.push_all(ops);
        dst.into()
    }

    /// The operations that make a value the current result. Arguments that are the result were stored before.
    fn load_argument_ops(
        &mut self,
        n: usize,
        source: &IlSource,
        before: Option<&IecType>,
        iec_type: &IecType,
    ) -> Vec<IrOp> {
        self.captured(|this| {
            if *iec_type == IecType::Bool {
                let bit = match source {
                    IlSource::Result => BitSource::Cell(this.named_bit("bit argument", BitRole::Temporary)),
                    other => this.bit_source(other),
                };
                return this.load_bit(bit, false);
            }
            let dst = this.result_word(width(iec_type));
            let src = match source {
                IlSource::Result => this.temporary("argument", width(iec_type)).into(),
                other => this.argument(n, other, before, iec_type),
            };
            this.push(IrOp::Move { dst, src });
        })
    }

    /// Puts the current result where [`Lowering::load_argument_ops`] finds it, if it is one of the arguments.
    fn save_result_if_argument(&mut self, arguments: &[IlSource], before: Option<&IecType>, iec_type: &IecType) {
        if !arguments.contains(&IlSource::Result) {
            return;
        }
        if *iec_type == IecType::Bool {
            self.bit_source(&IlSource::Result);
        } else {
            let src = self.number(&IlSource::Result, before, iec_type, "argument");
            let dst = self.temporary("argument", width(iec_type));
            if src != WordOperand::Cell(dst) {
                self.push(IrOp::Move { dst, src });
            }
        }
    }

    fn select(&mut self, call: &FunctionCall, before: Option<&IecType>) {
        let [selector, zero, one] = call.arguments.as_slice() else { return };
        self.save_result_if_argument(&[zero.clone(), one.clone()], before, &call.iec_type);
        let [if_zero, if_one] =
            [(1, zero), (2, one)].map(|(n, source)| self.load_argument_ops(n, source, before, &call.iec_type));
        let is_bit = |iec_type: Option<&IecType>| iec_type.is_none_or(|iec_type| *iec_type == IecType::Bool);
        let cond = match selector {
            IlSource::Constant(value) => {
                let ops = if *value == 0 { if_zero } else { if_one };
                return self.push_all(ops);
            }
            IlSource::Symbol(symbol) if symbol.iec_type == IecType::Bool => {
                BranchCondition::Bit(self.symbol_bit(&symbol.name))
            }
            IlSource::Result if is_bit(before) => BranchCondition::Acc,
            source => {
                let value = self.read_selector(source, before);
                let ops = self.if_comparison(CompareOp::Equ, value, WordOperand::Const(0), if_zero, if_one);
                return self.push_all(ops);
            }
        };
        self.push(IrOp::If { cond, if_true: if_one, if_false: if_zero });
    }

    fn multiplex(&mut self, call: &FunctionCall, before: Option<&IecType>) {
        let Some((selector, choices)) = call.arguments.split_first() else { return };
        self.save_result_if_argument(choices, before, &call.iec_type);
        let value = self.read_selector(selector, before);
        let mut bodies: Vec<Vec<IrOp>> = Vec::new();
        for (n, source) in choices.iter().enumerate() {
            bodies.push(self.load_argument_ops(n + 1, source, before, &call.iec_type));
        }
        let Some(mut ops) = bodies.pop() else { return };
        for (n, body) in (0..).zip(bodies).collect::<Vec<(i32, _)>>().into_iter().rev() {
            // Negative numbers choose the first.
            let op = if n == 0 { CompareOp::Leq } else { CompareOp::Equ };
            ops = self.if_comparison(op, value, WordOperand::Const(n), body, ops);
        }
        self.push_all(ops);
    }

    fn shift_result(&mut self, call: &FunctionCall, before: Option<&IecType>) {
        let [value, count] = call.arguments.as_slice() else { return };
        let iec_type = &call.iec_type;
        let op = match call.function {
            IlFunction::ShiftLeft => ShiftOp::Shl,
            IlFunction::ShiftRight => ShiftOp::Sr0,
            IlFunction::RotateLeft => ShiftOp::Rol,
            _ => ShiftOp::Ror,
        };
        let count = self.read_selector(count, before);
        if *iec_type == IecType::Bool {
            let bit = self.bit_source(value);
            self.load_bit(bit, false);
            if matches!(op, ShiftOp::Shl | ShiftOp::Sr0) {
                let ops = self.and_comparison(CompareOp::Leq, count, WordOperand::Const(0));
                self.push_all(ops);
            }
            return;
        }
        let dst = self.result_word(width(iec_type));
        let src = self.number(value, before, iec_type, "taken");
        if src != WordOperand::Cell(dst) {
            self.push(IrOp::Move { dst, src });
        }
        let ops = self.shift_word(op, dst, count);
        self.push_all(ops);
    }

    fn convert(&mut self, call: &FunctionCall, before: Option<&IecType>) {
        let Some(source) = call.arguments.first() else { return };
        let (from, to) = (&call.iec_type, &call.result);
        if *from == IecType::Bool {
            let bit = self.bit_source(source);
            if *to == IecType::Bool {
                return self.load_bit(bit, false);
            }
            let dst = self.result_word(width(to));
            return match bit {
                BitSource::Known(value) => self.push(IrOp::Move { dst, src: WordOperand::Const(value.into()) }),
                BitSource::Cell(bit) => self.bit_to_number(BranchCondition::Bit(bit), dst),
            };
        }
        if *to == IecType::Bool {
            let value = self.number(source, before, from, "converted");
            return self.compare_to_accumulator(CompareOp::Neq, value, WordOperand::Const(0));
        }
        let dst = self.result_word(width(to));
        let src = match source {
            IlSource::Constant(value) => WordOperand::Const(constant_of(from.wrap(*value), to)),
            other => match self.number(other, before, from, "converted") {
                WordOperand::Cell(word) if self.ir.bytes(word) == width(from) => {
                    self.convert_number(word, from, to, "wider")
                }
                value => value,
            },
        };
        if src != WordOperand::Cell(dst) {
            self.push(IrOp::Move { dst, src });
        }
    }
}
