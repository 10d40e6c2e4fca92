//! Operands whose width decides about the width of a computation.

use ladder::LadderOperand;

/// An operand or name whose width is asked for.
pub enum NarrowOperand<'a> {
    Name(&'a str),
    Value(i64),
}

impl<'a> From<&'a String> for NarrowOperand<'a> {
    fn from(name: &'a String) -> Self {
        NarrowOperand::Name(name)
    }
}

impl<'a> From<&'a LadderOperand> for NarrowOperand<'a> {
    fn from(operand: &'a LadderOperand) -> Self {
        match operand {
            LadderOperand::Var(name) => NarrowOperand::Name(name),
            LadderOperand::Const { value, .. } => NarrowOperand::Value(*value),
        }
    }
}
