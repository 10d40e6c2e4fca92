//! Values of expressions: whole numbers, and numbers with a point.

use super::expression::BinaryOperator;

/// Bytes of a `double` of AVR-GCC, if nothing says otherwise (AVR-GCC, "-mdouble").
const DOUBLE_BYTES: u32 = 4;

/// The value of an expression.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ExpressionValue {
    /// A whole number.
    Whole(i64),
    /// A number with a point, and the bytes of its type: 4, 8, or 0 where it is written out and takes the type of what it meets.
    Real(f64, u32),
}

impl ExpressionValue {
    /// Anything but 0.
    #[must_use]
    pub fn is_true(self) -> bool {
        match self {
            ExpressionValue::Whole(value) => value != 0,
            ExpressionValue::Real(value, _) => value != 0.0,
        }
    }

    /// The whole number that it becomes where one is wanted, as C has it: towards 0.
    #[must_use]
    pub fn to_integer(self) -> i64 {
        match self {
            ExpressionValue::Whole(value) => value,
            ExpressionValue::Real(value, _) => value as i64,
        }
    }

    /// The number as a type of so many bytes has it.
    pub(super) fn to_real(self, bytes: u32) -> f64 {
        let value = match self {
            ExpressionValue::Whole(value) => value as f64,
            ExpressionValue::Real(value, _) => value,
        };
        if bytes > DOUBLE_BYTES { value } else { f64::from(value as f32) }
    }

    /// The bits of a number with a point of so many bytes.
    pub(super) fn to_bits(self, bytes: u32) -> i64 {
        match bytes {
            0..=4 => i64::from((self.to_real(bytes) as f32).to_bits()),
            _ => self.to_real(bytes).to_bits() as i64,
        }
    }

    /// The number whose bits these are; nothing where no such number has so many bytes.
    pub(super) fn from_bits(bits: i64, bytes: u32) -> Option<ExpressionValue> {
        match bytes {
            4 => Some(ExpressionValue::Real(f32::from_bits(bits as u32).into(), bytes)),
            8 => Some(ExpressionValue::Real(f64::from_bits(bits as u64), bytes)),
            _ => None,
        }
    }

    /// `-`, `!` or `~`; nothing where there is no such operator for it.
    pub(super) fn apply_unary(self, sign: char) -> Option<ExpressionValue> {
        Some(match (sign, self) {
            ('!', _) => ExpressionValue::Whole(i64::from(!self.is_true())),
            ('-', ExpressionValue::Whole(value)) => ExpressionValue::Whole(value.wrapping_neg()),
            ('-', ExpressionValue::Real(value, bytes)) => ExpressionValue::Real(-value, bytes),
            (_, ExpressionValue::Whole(value)) => ExpressionValue::Whole(!value),
            (_, ExpressionValue::Real(..)) => return None,
        })
    }

    /// Two operands; nothing where there is no such operator for them, or no result.
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

    /// A number with a point to as many digits as it holds.
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
