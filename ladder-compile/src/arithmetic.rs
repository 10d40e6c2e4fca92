//! Arithmetic of the intermediate code.

use crate::ir::WordOperand;

/// Arithmetic modulo 2^(8 w) with w of [`Ir::width`](crate::ir::Ir::width). `Div` truncates; x / 0 is -1 for
/// x >= 0 and 1 for x < 0; the lowest number divided by -1 stays what it is. `And`, `Or` and `Xor` are of all
/// bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ArithmeticOp {
    /// Sum.
    Add,
    /// Difference.
    Sub,
    /// Low word of the product.
    Mul,
    /// Quotient.
    Div,
    /// Bits of both.
    And,
    /// Bits of one or both.
    Or,
    /// Bits of exactly one.
    Xor,
    /// The left operand, cut or extended with sign to the width and then taken without sign, shifted right by
    /// a constant from 0 on; the right operand is that constant.
    Shr,
}

impl ArithmeticOp {
    /// The sign of the operation in texts, and in C where it has one.
    #[must_use]
    pub const fn sign(self) -> &'static str {
        match self {
            ArithmeticOp::Add => "+",
            ArithmeticOp::Sub => "-",
            ArithmeticOp::Mul => "*",
            ArithmeticOp::Div => "/",
            ArithmeticOp::And => "&",
            ArithmeticOp::Or => "|",
            ArithmeticOp::Xor => "^",
            ArithmeticOp::Shr => ">>",
        }
    }
}

/// By how many bits [`ArithmeticOp::Shr`] shifts; more than there are shift everything out.
#[must_use]
pub fn shift_count(count: WordOperand) -> usize {
    match count {
        WordOperand::Const(count) => count.clamp(0, 32) as usize,
        WordOperand::Cell(_) => 0,
    }
}

/// The least width in bytes, 1 to 4, that holds a constant.
#[must_use]
pub fn min_bytes(constant: i32) -> u8 {
    (1..4).find(|n| constant >> (8 * n - 1) == constant >> 31).unwrap_or(4)
}
