//! Values of expressions: integers and floating-point numbers.

use super::expression::BinaryOperator;

/// Size of a `double` in bytes by default (AVR-GCC, "-mdouble").
const DOUBLE_BYTES: u32 = 4;

/// The value of an expression.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ExpressionValue {
    /// An integer.
    Whole(i64),
    /// A floating-point number, and the size of its type in bytes: 4, 8, or 0 for a literal, which takes the
    /// type of the other operand.
    Real(f64, u32),
}

impl ExpressionValue {
    /// Returns true if the value is not 0.
    #[must_use]
    pub fn is_true(self) -> bool {
        match self {
            ExpressionValue::Whole(value) => value != 0,
            ExpressionValue::Real(value, _) => value != 0.0,
        }
    }

    /// Converts to an integer, as in C: towards 0.
    #[must_use]
    pub fn to_integer(self) -> i64 {
        match self {
            ExpressionValue::Whole(value) => value,
            ExpressionValue::Real(value, _) => value as i64,
        }
    }

    /// Rounds to a floating-point type of this size in bytes.
    pub(super) fn to_real(self, bytes: u32) -> f64 {
        let value = match self {
            ExpressionValue::Whole(value) => value as f64,
            ExpressionValue::Real(value, _) => value,
        };
        if bytes > DOUBLE_BYTES { value } else { f64::from(value as f32) }
    }

    /// Returns the bits of a floating-point number of this size in bytes.
    pub(super) fn to_bits(self, bytes: u32) -> i64 {
        match bytes {
            0..=4 => i64::from((self.to_real(bytes) as f32).to_bits()),
            _ => self.to_real(bytes).to_bits() as i64,
        }
    }

    /// Returns the number with these bits; `None` if no floating-point type has this size.
    pub(super) fn from_bits(bits: i64, bytes: u32) -> Option<ExpressionValue> {
        match bytes {
            4 => Some(ExpressionValue::Real(f32::from_bits(bits as u32).into(), bytes)),
            8 => Some(ExpressionValue::Real(f64::from_bits(bits as u64), bytes)),
            _ => None,
        }
    }

    /// Applies `-`, `!` or `~`; `None` if the operator does not apply.
    pub(super) fn apply_unary(self, sign: char) -> Option<ExpressionValue> {
        Some(match (sign, self) {
            ('!', _) => ExpressionValue::Whole(i64::from(!self.is_true())),
            ('-', ExpressionValue::Whole(value)) => ExpressionValue::Whole(value.wrapping_neg()),
            ('-', ExpressionValue::Real(value, bytes)) => ExpressionValue::Real(-value, bytes),
            (_, ExpressionValue::Whole(value)) => ExpressionValue::Whole(!value),
            (_, ExpressionValue::Real(..)) => return None,
        })
    }

    /// Applies an operator with two operands; `None` if it does not apply or has no result.
    pub(super) fn apply_binary(self, operator: BinaryOperator, other: ExpressionValue) -> Option<ExpressionValue> {
        let bytes = match (self, other) {
            (ExpressionValue::Whole(a), ExpressionValue::Whole(b)) => {
                return operator.apply(a, b).map(ExpressionValue::Whole);
            }
            (ExpressionValue::Real(_, a), ExpressionValue::Real(_, b)) => a.max(b),
            (ExpressionValue::Real(_, bytes), _) | (_, ExpressionValue::Real(_, bytes)) => bytes,
        };
        let (a, b) = (self.to_real(bytes), other.to_real(bytes));
        let truth = |holds: bool| Some(ExpressionValue::Whole(i64::from(holds)));
        let value = match operator {
            BinaryOperator::Eq => return truth(a == b),
            BinaryOperator::Ne => return truth(a != b),
            BinaryOperator::Le => return truth(a <= b),
            BinaryOperator::Ge => return truth(a >= b),
            BinaryOperator::Lt => return truth(a < b),
            BinaryOperator::Gt => return truth(a > b),
            BinaryOperator::And => return truth(self.is_true() && other.is_true()),
            BinaryOperator::Or => return truth(self.is_true() || other.is_true()),
            BinaryOperator::Add => a + b,
            BinaryOperator::Sub => a - b,
            BinaryOperator::Mul => a * b,
            BinaryOperator::Div => a / b,
            _ => return None,
        };
        Some(ExpressionValue::Real(ExpressionValue::Real(value, bytes).to_real(bytes), bytes))
    }

    /// Formats the value; a floating-point number with all its significant digits.
    #[must_use]
    pub fn text(self) -> String {
        match self {
            ExpressionValue::Whole(value) => value.to_string(),
            ExpressionValue::Real(value, 8) => super::c_values::format_significant(value, 17),
            ExpressionValue::Real(..) => super::c_values::format_significant(self.to_real(DOUBLE_BYTES), 9),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{BinaryOperator, ExpressionValue};

    #[test]
    fn numbers_with_a_point_are_of_four_bytes_unless_one_has_eight() {
        let tenth = ExpressionValue::Real(0.1, 0);
        let stored = ExpressionValue::from_bits(0x3DCC_CCCD, 4);
        assert_eq!(stored.and_then(|own| own.apply_binary(BinaryOperator::Eq, tenth)), Some(ExpressionValue::Whole(1)));
        assert_eq!(
            ExpressionValue::Real(0.1, 8).apply_binary(BinaryOperator::Eq, tenth),
            Some(ExpressionValue::Whole(1))
        );
        assert_eq!(
            ExpressionValue::Real(2.5, 4).apply_binary(BinaryOperator::Mul, ExpressionValue::Whole(3)),
            Some(ExpressionValue::Real(7.5, 4))
        );
        assert_eq!(ExpressionValue::Real(2.5, 4).apply_binary(BinaryOperator::Shl, ExpressionValue::Whole(1)), None);
        assert_eq!(ExpressionValue::Real(2.5, 4).to_bits(4), 0x4020_0000);
        assert!(ExpressionValue::Real(0.5, 4).is_true());
    }
}
