//! Values of bits, integers and operands of the naive interpreter.

use super::*;

impl NaiveInterpreter {
    pub(super) fn operand_value(&self, operand: &LadderOperand) -> i64 {
        match operand {
            LadderOperand::Var(name) => self.integer(name),
            LadderOperand::Const { value, .. } => *value,
        }
    }

    /// The width of a variable, or of the shortest integer that holds a constant, in bits.
    pub(super) fn operand_bits(&self, operand: &LadderOperand) -> usize {
        match operand {
            LadderOperand::Var(name) => 8 * self.widths[name] as usize,
            LadderOperand::Const { value, .. } => {
                8 * (1..=4).find(|&n| wrap_to_bits(*value, 8 * n) == *value).expect("a width") as usize
            }
        }
    }

    pub fn bit(&self, name: &str) -> bool {
        self.bits.get(name).copied().unwrap_or(false)
    }

    pub fn integer(&self, name: &str) -> i64 {
        self.with_outputs(name, self.integers.get(name).copied().unwrap_or(0))
    }

    /// Stores `value` reduced to the width of the integer.
    pub fn store(&mut self, name: &str, value: i64) {
        let bits = 8 * self.widths.get(name).copied().unwrap_or(2);
        self.integers.insert(name.to_owned(), wrap_to_bits(value, bits));
        self.store_outputs(name, value);
    }

    /// True if an operand, or the variable with a name, has at most 16 bits.
    pub(super) fn is_narrow<'a>(&self, operand: impl Into<NarrowOperand<'a>>) -> bool {
        match operand.into() {
            NarrowOperand::Name(name) => self.widths[name] <= 2,
            NarrowOperand::Value(value) => (-0x8000..0x8000).contains(&value),
        }
    }
}
