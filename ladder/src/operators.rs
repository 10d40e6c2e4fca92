//! Operations of the elements on integers, by keyword.

/// Two-operand arithmetic. The last four only in LDmicro 5.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum MathOp {
    /// `op1 + op2`.
    Add,
    /// `op1 - op2`.
    Sub,
    /// `op1 * op2`.
    Mul,
    /// `op1 / op2`.
    Div,
    /// Remainder of `op1 / op2`.
    Mod,
    /// Bits of both.
    And,
    /// Bits of one or both.
    Or,
    /// Bits of exactly one.
    Xor,
}

/// LDmicro 5's operations on one operand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum UnaryOp {
    /// Every bit complemented.
    Not,
    /// The negative.
    Neg,
    /// Bytes in reverse order; nibbles where there is one byte.
    Swap,
    /// Bits in reverse order.
    Opposite,
    /// Decimal digits, one a byte.
    BinToBcd,
    /// The number of such digits.
    BcdToBin,
}

/// LDmicro 5's shifts and rotations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ShiftOp {
    /// To the left, zeros come in.
    Shl,
    /// To the right, the sign comes in.
    Shr,
    /// To the right, zeros come in.
    Sr0,
    /// Rotation to the left.
    Rol,
    /// Rotation to the right.
    Ror,
}

/// Comparisons, signed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CompareOp {
    /// `op1 == op2`.
    Equ,
    /// `op1 != op2`.
    Neq,
    /// `op1 > op2`.
    Grt,
    /// `op1 >= op2`.
    Geq,
    /// `op1 < op2`.
    Les,
    /// `op1 <= op2`.
    Leq,
}
