//! Integers: moves, arithmetic, comparisons, bits and tables.
//!
//! A type of IEC 61131-3 has the width of the integer. An operation works in the type of the widest of
//! destination and operands; narrower operands are converted, and the result is cut by a conversion.

use crate::il::{IecType, IlBinaryOperator, IlName, IlOperand, IlOperation, IlParameter, IlValue};
use crate::model::{CompareOp, Element, LadderOperand, MathOp, UnaryOp};

use super::emitter::{IlEmitter, RungBit};
use super::facts::type_of_bytes;

impl IlEmitter<'_> {
    /// Emits an element that acts on integers while the rung bit is 1.
    pub(super) fn integer_element(&mut self, element: &Element) {
        match element {
            Element::Res { name } => {
                let value = self.facts.reset_value(name);
                self.move_to(name, &value);
            }
            Element::Move { dest, src } => self.move_to(dest, src),
            Element::Math { op, dest, op1, op2 } => self.math(*op, dest, op1, op2),
            Element::Unary { op, dest, src } => self.unary(*op, dest, src, element),
            Element::BitWrite { name, bit, value } => self.bit_write(name, bit, *value),
            Element::LookUpTable { dest, index, values, as_string: _, name: _ } => self.table(dest, index, values),
            Element::TimeValue { is_scans, dest, time } => {
                let LadderOperand::Const { value, .. } = time else { return };
                let settings = &self.source.settings;
                let value = match is_scans {
                    true => i128::from(*value).checked_div(settings.cycle_us.into()),
                    false => Some(i128::from(*value) * i128::from(settings.crystal_hz) / 1_000_000),
                };
                // The low bytes count.
                let value = value.unwrap_or(0).rem_euclid(1 << 32) as i64;
                self.move_to(dest, &LadderOperand::Const { value, text: String::new() });
            }
            // Only these elements are emitted as integers.
            _ => {}
        }
    }

    /// Returns the type of an integer, or reports that there is none.
    pub(super) fn type_of(&mut self, name: &str) -> IecType {
        self.facts.type_of(name).unwrap_or_else(|| {
            self.refuse(
                format!("`{name}` has 3 bytes, and IEC 61131-3 has no such type"),
                "give it 2 or 4 bytes in VAR LIST",
            );
            IecType::Dint
        })
    }

    /// Returns the type in which an operation works: that of the widest of its integers.
    fn widest<'b>(&mut self, names: &[&str], operands: impl IntoIterator<Item = &'b LadderOperand>) -> IecType {
        let mut widest = names.iter().map(|name| self.type_of(name)).max_by_key(IecType::bits);
        for operand in operands {
            let iec_type = self.operand_type(operand);
            widest = widest.into_iter().chain([iec_type]).max_by_key(IecType::bits);
        }
        widest.unwrap_or(IecType::Int)
    }

    /// Returns the type of an operand; a constant has the smallest that holds it.
    pub(super) fn operand_type(&mut self, operand: &LadderOperand) -> IecType {
        match operand {
            LadderOperand::Var(name) => self.type_of(name),
            // No type has 3 bytes. A wider one gives the same low bytes.
            LadderOperand::Const { .. } => type_of_bytes(self.facts.bytes_of(operand)).unwrap_or(IecType::Dint),
        }
    }

    /// Loads an operand and converts it to a type.
    pub(super) fn load_as(&mut self, operand: &LadderOperand, iec_type: &IecType) {
        let (loaded, from) = self.source_operand(operand, iec_type);
        self.load(loaded, false);
        self.convert(&from, iec_type);
    }

    /// Returns an operand and its type; a constant has the wanted type.
    fn source_operand(&mut self, operand: &LadderOperand, iec_type: &IecType) -> (IlOperand, IecType) {
        match operand {
            LadderOperand::Const { value, .. } => (self.number(*value, iec_type), iec_type.clone()),
            LadderOperand::Var(name) => (self.symbol(name), self.type_of(name)),
        }
    }

    /// Combines the current result with an operand that is converted to a type.
    pub(super) fn combine_as(&mut self, operator: IlBinaryOperator, operand: &LadderOperand, iec_type: &IecType) {
        let (value, from) = self.source_operand(operand, iec_type);
        if from == *iec_type {
            return self.binary(operator, false, value);
        }
        self.open_load(operator, value);
        self.convert(&from, iec_type);
        self.emit(IlOperation::Close);
    }

    /// Converts the current result.
    pub(super) fn convert(&mut self, from: &IecType, to: &IecType) {
        if from != to {
            self.function(format!("{}_TO_{}", from.keyword(), to.keyword()), Vec::new());
        }
    }

    /// Calls a function with the current result as its first argument.
    fn function(&mut self, text: String, arguments: Vec<IlOperand>) {
        let name = IlName { text, pos: self.pos };
        let arguments = arguments.into_iter().map(IlParameter::Positional).collect();
        self.emit(IlOperation::Function { name, parenthesized: false, arguments });
    }

    /// Stores the current result, which has a type, in an integer.
    pub(super) fn store_integer(&mut self, dest: &str, from: &IecType) {
        let to = self.type_of(dest);
        self.convert(from, &to);
        let target = self.symbol(dest);
        self.emit(IlOperation::Store { negated: false, target });
    }

    /// MOVE.
    pub(super) fn move_to(&mut self, dest: &str, src: &LadderOperand) {
        let to = self.type_of(dest);
        let from = match src {
            LadderOperand::Const { .. } => to,
            LadderOperand::Var(name) => self.type_of(name),
        };
        self.load_as(src, &from);
        self.store_integer(dest, &from);
    }

    fn math(&mut self, op: MathOp, dest: &str, op1: &LadderOperand, op2: &LadderOperand) {
        let iec_type = self.widest(&[dest], [op1, op2]);
        let operator = match op {
            MathOp::Add => IlBinaryOperator::Add,
            MathOp::Sub => IlBinaryOperator::Sub,
            MathOp::Mul => IlBinaryOperator::Mul,
            MathOp::Div => return self.divide(dest, op1, op2, &iec_type),
            MathOp::Mod => return self.remainder(dest, op1, op2, &iec_type),
            MathOp::And => return self.logic(IlBinaryOperator::And, dest, [op1, op2], &iec_type),
            MathOp::Or => return self.logic(IlBinaryOperator::Or, dest, [op1, op2], &iec_type),
            MathOp::Xor => return self.logic(IlBinaryOperator::Xor, dest, [op1, op2], &iec_type),
        };
        self.load_as(op1, &iec_type);
        self.combine_as(operator, op2, &iec_type);
        self.store_integer(dest, &iec_type);
    }

    /// DIV: x / 0 is -1 for x >= 0 and 1 for x < 0, where Instruction List gives 0.
    fn divide(&mut self, dest: &str, op1: &LadderOperand, op2: &LadderOperand, iec_type: &IecType) {
        let zero = LadderOperand::Const { value: 0, text: String::new() };
        let is_constant = |operand: &LadderOperand, wanted: bool| match operand {
            LadderOperand::Const { value, .. } => (*value != 0) == wanted,
            LadderOperand::Var(_) => false,
        };
        if is_constant(op2, true) {
            self.load_as(op1, iec_type);
            self.combine_as(IlBinaryOperator::Div, op2, iec_type);
            return self.store_integer(dest, iec_type);
        }
        let labels = (!is_constant(op2, false)).then(|| (self.new_label(), self.new_label()));
        if let Some((by_zero, end)) = &labels {
            self.load_as(op2, iec_type);
            self.combine_as(IlBinaryOperator::Eq, &zero, iec_type);
            self.jump(crate::il::IlCondition::IfTrue, by_zero);
            self.load_as(op1, iec_type);
            self.combine_as(IlBinaryOperator::Div, op2, iec_type);
            self.store_integer(dest, iec_type);
            self.jump(crate::il::IlCondition::Always, end);
            self.label(by_zero.clone());
        }
        self.load_as(op1, iec_type);
        self.combine_as(IlBinaryOperator::Ge, &zero, iec_type);
        let arguments = vec![self.number(1, iec_type), self.number(-1, iec_type)];
        self.function("SEL".to_owned(), arguments);
        self.store_integer(dest, iec_type);
        if let Some((_, end)) = labels {
            self.label(end);
        }
    }

    /// MOD: the dividend where the divisor is 0, so it is the dividend minus quotient times divisor.
    fn remainder(&mut self, dest: &str, op1: &LadderOperand, op2: &LadderOperand, iec_type: &IecType) {
        self.load_as(op1, iec_type);
        let (value, from) = self.source_operand(op1, iec_type);
        self.open_load(IlBinaryOperator::Sub, value);
        self.convert(&from, iec_type);
        self.combine_as(IlBinaryOperator::Div, op2, iec_type);
        self.combine_as(IlBinaryOperator::Mul, op2, iec_type);
        self.emit(IlOperation::Close);
        self.store_integer(dest, iec_type);
    }

    /// AND, OR and XOR of integers, bit by bit.
    fn logic(&mut self, operator: IlBinaryOperator, dest: &str, operands: [&LadderOperand; 2], iec_type: &IecType) {
        let bits = bit_string(iec_type);
        let [op1, op2] = operands;
        self.load_as(op1, iec_type);
        self.convert(iec_type, &bits);
        match op2 {
            LadderOperand::Const { value, .. } => {
                let mask = self.number(*value, &bits);
                self.binary(operator, false, mask);
            }
            LadderOperand::Var(_) => {
                let (value, from) = self.source_operand(op2, iec_type);
                self.open_load(operator, value);
                self.convert(&from, iec_type);
                self.convert(iec_type, &bits);
                self.emit(IlOperation::Close);
            }
        }
        self.convert(&bits, iec_type);
        self.store_integer(dest, iec_type);
    }

    fn unary(&mut self, op: UnaryOp, dest: &str, src: &LadderOperand, element: &Element) {
        let minuend = match op {
            UnaryOp::Not => -1,
            UnaryOp::Neg => 0,
            UnaryOp::Swap | UnaryOp::Opposite | UnaryOp::BinToBcd | UnaryOp::BcdToBin => {
                let cause = format!("Instruction List has no element like `{}`", crate::element_text(element));
                return self.refuse(cause, "remove the element, or keep the program in LDmicro's notation");
            }
        };
        let iec_type = self.operand_type(src);
        let minuend = self.number(minuend, &iec_type);
        self.load(minuend, false);
        self.combine_as(IlBinaryOperator::Sub, src, &iec_type);
        self.store_integer(dest, &iec_type);
    }

    /// Returns the constant number of a bit that the integer has, or reports that it is none.
    fn bit_of(&mut self, name: &str, bit: &LadderOperand) -> Option<(IecType, u32)> {
        let iec_type = self.type_of(name);
        match bit {
            LadderOperand::Const { value, .. } if (0..i64::from(iec_type.bits())).contains(value) => {
                Some((iec_type, u32::try_from(*value).unwrap_or(0)))
            }
            LadderOperand::Const { .. } | LadderOperand::Var(_) => {
                let cause = format!("the number of a bit of `{name}` is no constant within its width");
                self.refuse(cause, "give the number of the bit as a constant");
                None
            }
        }
    }

    fn bit_write(&mut self, name: &str, bit: &LadderOperand, value: bool) {
        let Some((iec_type, bit)) = self.bit_of(name, bit) else { return };
        let bits = bit_string(&iec_type);
        self.load_as(&LadderOperand::Var(name.to_owned()), &iec_type);
        self.convert(&iec_type, &bits);
        let (operator, mask) =
            if value { (IlBinaryOperator::Or, 1 << bit) } else { (IlBinaryOperator::And, !(1_i64 << bit)) };
        let mask = self.mask(mask, &bits);
        self.binary(operator, false, mask);
        self.convert(&bits, &iec_type);
        self.store_integer(name, &iec_type);
    }

    /// IF_BIT_SET and IF_BIT_CLEAR.
    pub(super) fn bit_test(&mut self, name: &str, bit: &LadderOperand, value: bool) {
        let Some((iec_type, bit)) = self.bit_of(name, bit) else { return };
        let bits = bit_string(&iec_type);
        let operand = self.symbol(name);
        let is_inside = self.begin_condition(operand);
        self.convert(&iec_type, &bits);
        let (mask, zero) = (self.mask(1 << bit, &bits), self.mask(0, &bits));
        self.binary(IlBinaryOperator::And, false, mask);
        self.binary(if value { IlBinaryOperator::Ne } else { IlBinaryOperator::Eq }, false, zero);
        self.end_condition(is_inside);
    }

    /// A literal of a bit string in base 16.
    fn mask(&self, value: i64, bits: &IecType) -> IlOperand {
        self.literal(IlValue::Integer { value: bits.wrap(value), base: 16 }, Some(bits.clone()))
    }

    /// EQU to LEQ: a comparison in series with the rung bit.
    pub(super) fn compare(&mut self, op: CompareOp, op1: &LadderOperand, op2: &LadderOperand) {
        let operator = match op {
            CompareOp::Equ => IlBinaryOperator::Eq,
            CompareOp::Neq => IlBinaryOperator::Ne,
            CompareOp::Grt => IlBinaryOperator::Gt,
            CompareOp::Geq => IlBinaryOperator::Ge,
            CompareOp::Les => IlBinaryOperator::Lt,
            CompareOp::Leq => IlBinaryOperator::Le,
        };
        let iec_type = self.widest(&[], [op1, op2]);
        let (value, from) = self.source_operand(op1, &iec_type);
        let is_inside = self.begin_condition(value);
        self.convert(&from, &iec_type);
        self.combine_as(operator, op2, &iec_type);
        self.end_condition(is_inside);
    }

    /// Begins a condition that takes several lines with a load, in parentheses unless it is at the rail.
    fn begin_condition(&mut self, operand: IlOperand) -> bool {
        let is_inside = self.bit == RungBit::Loaded;
        match self.bit {
            RungBit::One => self.load(operand, false),
            RungBit::Loaded => self.open_load(IlBinaryOperator::And, operand),
        }
        is_inside
    }

    fn end_condition(&mut self, is_inside: bool) {
        if is_inside {
            self.emit(IlOperation::Close);
        }
        self.bit = RungBit::Loaded;
    }

    /// LOOK_UP_TABLE: the value at an index within the table.
    fn table(&mut self, dest: &str, index: &LadderOperand, values: &[i64]) {
        let iec_type = self.operand_type(index);
        let iec_type = if iec_type == IecType::Sint { IecType::Int } else { iec_type };
        let to = self.type_of(dest);
        let constant = |value: i64| LadderOperand::Const { value, text: String::new() };
        let Ok(count) = i64::try_from(values.len()) else { return };
        self.load_as(index, &iec_type);
        self.combine_as(IlBinaryOperator::Ge, &constant(0), &iec_type);
        let (value, from) = self.source_operand(index, &iec_type);
        self.open_load(IlBinaryOperator::And, value);
        self.convert(&from, &iec_type);
        self.combine_as(IlBinaryOperator::Lt, &constant(count), &iec_type);
        self.emit(IlOperation::Close);
        self.if_result(|emitter| {
            // The last value stands twice, because MUX takes at least two.
            let last = values.last().copied().unwrap_or(0);
            let arguments = values.iter().chain([&last]).map(|value| emitter.number(*value, &to)).collect();
            emitter.load_as(index, &iec_type);
            emitter.function("MUX".to_owned(), arguments);
            emitter.store_integer(dest, &to);
        });
    }

    /// SHIFT_REGISTER: on a rising edge each stage takes the value before it.
    pub(super) fn shift_register(&mut self, name: &str, stages: u32, is_needed: bool) {
        let saved = if is_needed && self.bit == RungBit::Loaded { Some(self.save()) } else { None };
        let edge = self.edge();
        if stages > 1 {
            self.load_output(&edge, false);
            self.if_result(|emitter| {
                for stage in (1..stages).rev() {
                    emitter.move_to(&format!("{name}{stage}"), &LadderOperand::Var(format!("{name}{}", stage - 1)));
                }
            });
        }
        match saved {
            Some(saved) => self.load_bit(&saved),
            None => self.bit = RungBit::One,
        }
    }
}

/// The bit string with as many bits as an integer.
fn bit_string(iec_type: &IecType) -> IecType {
    match iec_type.bits() {
        8 => IecType::Byte,
        16 => IecType::Word,
        _ => IecType::Dword,
    }
}
