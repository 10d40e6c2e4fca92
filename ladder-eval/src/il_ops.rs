//! Lines of Instruction List in the flat form, and their execution: section 6 of `docs/semantics.md`.

use ladder::il::{IlBinaryOperator, IlCondition};

use crate::flat_program::{FlatProgram, ScanState};
use crate::il_blocks::{BlockState, FlatBlock};
use crate::il_functions::FlatFunction;

/// How a type holds numbers (I1).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct NumberType {
    /// Number of bits: 1, 8, 16 or 32.
    pub bits: u32,
    /// Whether the highest bit is a sign.
    pub signed: bool,
}

impl NumberType {
    /// BOOL.
    pub const BIT: NumberType = NumberType { bits: 1, signed: false };

    /// The number modulo 2^n (I1).
    pub fn modulo(self, number: i64) -> i64 {
        let unused = 64 - self.bits;
        let top = number.wrapping_shl(unused);
        if self.signed { top >> unused } else { (top as u64 >> unused) as i64 }
    }
}

/// An operand: the current result, a symbol or a constant.
#[derive(Debug, Clone, Copy)]
pub(crate) enum FlatOperand {
    /// The current result.
    Result,
    /// A symbol, by its index, and the type of its number.
    Symbol(u32, NumberType),
    /// A number.
    Constant(i64),
}

/// A symbol that a line writes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct IlTarget {
    /// Index of the symbol.
    pub symbol: u32,
    /// Type of its number.
    pub number: NumberType,
}

/// What a line does, with its names resolved.
#[derive(Debug, Clone)]
#[rustfmt::skip]
pub(crate) enum IlOp {
    /// A label alone.
    Nothing,
    /// LD, LDN: the operand becomes the current result.
    Load   { negated: bool, value: FlatOperand, number: NumberType },
    /// ST, STN: the symbol gets the current result.
    Store  { negated: bool, target: IlTarget },
    /// S, R: the symbol gets the value if the current result is not 0.
    Set    { symbol: u32, value: bool },
    /// NOT: inverts all bits of the current result.
    Not    { number: NumberType },
    /// An operator with an operand: the current result becomes `result operator operand`.
    Binary { operator: IlBinaryOperator, negated: bool, value: FlatOperand, number: NumberType },
    /// An operator with `(`: saves the current result and loads the operand, if there is one.
    Open   { loaded: Option<(FlatOperand, NumberType)> },
    /// `)`: the current result becomes `saved operator result`. `operator` is that of the line with `(`.
    Close  { operator: IlBinaryOperator, negated: bool, number: NumberType },
    /// JMP to the first line of rung `to`. A scan takes a jump back a limited number of times.
    Jump   { condition: IlCondition, to: u32, is_back: bool },
    /// RET: ends the scan.
    Return { condition: IlCondition },
    /// CAL, an input operator or the short form of a block.
    Call   { condition: IlCondition, call: Box<IlCall> },
    /// A standard function: its value becomes the current result.
    Function(FlatFunction),
}

/// A call of a block: its inputs, the block, its outputs.
#[derive(Debug, Clone)]
pub(crate) struct IlCall {
    /// The inputs that the call writes, each with its value.
    pub inputs: Vec<(IlTarget, FlatOperand)>,
    /// The block.
    pub block: FlatBlock,
    /// The output, whether it is complemented, and where it goes.
    pub outputs: Vec<(u32, NumberType, bool, IlTarget)>,
}

/// Where the scan goes after a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum IlNext {
    /// To the next line.
    Line,
    /// To the first line of rung `to`. `is_back` if that is this rung or one before it.
    Jump { to: u32, is_back: bool },
    /// To the end of the scan.
    End,
}

/// State of a program in Instruction List besides its symbols.
#[derive(Debug, Clone, Default)]
pub(crate) struct IlState {
    /// The current result.
    pub result: i64,
    /// Results that wait for their `)`.
    saved: Vec<i64>,
    /// State of each instance.
    pub blocks: Vec<BlockState>,
}

impl IlState {
    /// The state after power is applied, with `instances` instances of blocks.
    pub(crate) fn power_up(instances: u32) -> IlState {
        IlState { result: 0, saved: Vec::new(), blocks: vec![BlockState::default(); instances as usize] }
    }
}

/// The result of an operator (I13).
pub(crate) fn combine(operator: IlBinaryOperator, a: i64, b: i64, number: NumberType) -> i64 {
    let (a, b) = (number.modulo(a), number.modulo(b));
    let value = match operator {
        IlBinaryOperator::And => a & b,
        IlBinaryOperator::Or => a | b,
        IlBinaryOperator::Xor => a ^ b,
        IlBinaryOperator::Add => a + b,
        IlBinaryOperator::Sub => a - b,
        // 32 bits times 32 bits may need 64 without a sign.
        IlBinaryOperator::Mul => a.wrapping_mul(b),
        IlBinaryOperator::Div => a.checked_div(b).unwrap_or(0),
        IlBinaryOperator::Mod => a.checked_rem(b).unwrap_or(0),
        IlBinaryOperator::Gt => i64::from(a > b),
        IlBinaryOperator::Ge => i64::from(a >= b),
        IlBinaryOperator::Eq => i64::from(a == b),
        IlBinaryOperator::Ne => i64::from(a != b),
        IlBinaryOperator::Le => i64::from(a <= b),
        IlBinaryOperator::Lt => i64::from(a < b),
    };
    if operator.is_comparison() { value } else { number.modulo(value) }
}

impl ScanState {
    /// The number of an operand.
    pub(crate) fn il_value(&self, value: FlatOperand) -> i64 {
        match value {
            FlatOperand::Result => self.il.result,
            FlatOperand::Symbol(symbol, number) => number.modulo(self.read_symbol(symbol).into()),
            FlatOperand::Constant(value) => value,
        }
    }

    /// Writes a number to a symbol (I10).
    pub(crate) fn il_store(&mut self, code: &FlatProgram, target: IlTarget, value: i64) {
        self.store(code, target.symbol, target.number.modulo(value));
    }

    /// Executes a line; returns where the scan goes.
    pub(crate) fn execute_line(&mut self, code: &FlatProgram, line: u32) -> IlNext {
        let Some(op) = code.lines.get(line as usize) else { return IlNext::Line };
        let complement = |negated: bool, value: i64| if negated { !value } else { value };
        match op {
            IlOp::Nothing => {}
            IlOp::Load { negated, value, number } => {
                self.il.result = number.modulo(complement(*negated, self.il_value(*value)));
            }
            IlOp::Store { negated, target } => self.il_store(code, *target, complement(*negated, self.il.result)),
            IlOp::Set { symbol, value } => {
                if self.il.result != 0 {
                    self.store(code, *symbol, i64::from(*value));
                }
            }
            IlOp::Not { number } => self.il.result = number.modulo(!self.il.result),
            IlOp::Binary { operator, negated, value, number } => {
                let value = complement(*negated, self.il_value(*value));
                self.il.result = combine(*operator, self.il.result, value, *number);
            }
            IlOp::Open { loaded } => {
                self.il.saved.push(self.il.result);
                if let Some((value, number)) = loaded {
                    self.il.result = number.modulo(self.il_value(*value));
                }
            }
            IlOp::Close { operator, negated, number } => {
                let outer = self.il.saved.pop().unwrap_or(0);
                self.il.result = combine(*operator, outer, complement(*negated, self.il.result), *number);
            }
            IlOp::Jump { condition, to, is_back } if self.holds(*condition) => {
                return IlNext::Jump { to: *to, is_back: *is_back };
            }
            IlOp::Return { condition } if self.holds(*condition) => return IlNext::End,
            IlOp::Call { condition, call } if self.holds(*condition) => self.call_block(code, call),
            IlOp::Jump { .. } | IlOp::Return { .. } | IlOp::Call { .. } => {}
            IlOp::Function(function) => self.il.result = self.function_value(function),
        }
        IlNext::Line
    }

    /// Whether a condition holds (I21).
    fn holds(&self, condition: IlCondition) -> bool {
        match condition {
            IlCondition::Always => true,
            IlCondition::IfTrue => self.il.result != 0,
            IlCondition::IfFalse => self.il.result == 0,
        }
    }

    fn call_block(&mut self, code: &FlatProgram, call: &IlCall) {
        for (input, value) in &call.inputs {
            self.il_store(code, *input, self.il_value(*value));
        }
        self.run_block(code, &call.block);
        for (output, number, negated, target) in &call.outputs {
            let value = self.il_value(FlatOperand::Symbol(*output, *number));
            self.il_store(code, *target, if *negated { !value } else { value });
        }
    }
}
