//! Values of expressions: whole numbers, and numbers with a point.

use super::expr::Operator;

/// Bytes of a `double` of AVR-GCC, if nothing says otherwise (AVR-GCC, "-mdouble").
const DOUBLE: u32 = 4;

/// The value of an expression.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Amount {
    /// A whole number.
    Whole(i64),
    /// A number with a point, and the bytes of its type: 4, 8, or 0 where it is written out and takes the type of what it meets.
    Real(f64, u32),
}

impl Amount {
    /// Anything but 0.
    #[must_use]
    pub fn is_true(self) -> bool {
        match self {
            Amount::Whole(value) => value != 0,
            Amount::Real(value, _) => value != 0.0,
        }
    }

    /// The whole number that it becomes where one is wanted, as C has it: towards 0.
    #[must_use]
    pub fn whole(self) -> i64 {
        match self {
            Amount::Whole(value) => value,
            Amount::Real(value, _) => value as i64,
        }
    }

    /// The number as a type of so many bytes has it.
    pub(super) fn real(self, bytes: u32) -> f64 {
        let value = match self {
            Amount::Whole(value) => value as f64,
            Amount::Real(value, _) => value,
        };
        if bytes > DOUBLE { value } else { f64::from(value as f32) }
    }

    /// The bits of a number with a point of so many bytes.
    pub(super) fn bits(self, bytes: u32) -> i64 {
        match bytes {
            0..=4 => i64::from((self.real(bytes) as f32).to_bits()),
            _ => self.real(bytes).to_bits() as i64,
        }
    }

    /// The number whose bits these are; nothing where no such number has so many bytes.
    pub(super) fn of_bits(bits: i64, bytes: u32) -> Option<Amount> {
        match bytes {
            4 => Some(Amount::Real(f32::from_bits(bits as u32).into(), bytes)),
            8 => Some(Amount::Real(f64::from_bits(bits as u64), bytes)),
            _ => None,
        }
    }

    /// `-`, `!` or `~`; nothing where there is no such operator for it.
    pub(super) fn signed(self, sign: char) -> Option<Amount> {
        Some(match (sign, self) {
            ('!', _) => Amount::Whole(i64::from(!self.is_true())),
            ('-', Amount::Whole(value)) => Amount::Whole(value.wrapping_neg()),
            ('-', Amount::Real(value, bytes)) => Amount::Real(-value, bytes),
            (_, Amount::Whole(value)) => Amount::Whole(!value),
            (_, Amount::Real(..)) => return None,
        })
    }

    /// Two operands; nothing where there is no such operator for them, or no result.
    pub(super) fn with(self, operator: Operator, other: Amount) -> Option<Amount> {
        let bytes = match (self, other) {
            (Amount::Whole(a), Amount::Whole(b)) => return operator.of(a, b).map(Amount::Whole),
            (Amount::Real(_, a), Amount::Real(_, b)) => a.max(b),
            (Amount::Real(_, bytes), _) | (_, Amount::Real(_, bytes)) => bytes,
        };
        let (a, b) = (self.real(bytes), other.real(bytes));
        let truth = |holds: bool| Some(Amount::Whole(i64::from(holds)));
        let value = match operator {
            Operator::Eq => return truth(a == b),
            Operator::Ne => return truth(a != b),
            Operator::Le => return truth(a <= b),
            Operator::Ge => return truth(a >= b),
            Operator::Lt => return truth(a < b),
            Operator::Gt => return truth(a > b),
            Operator::And => return truth(self.is_true() && other.is_true()),
            Operator::Or => return truth(self.is_true() || other.is_true()),
            Operator::Add => a + b,
            Operator::Sub => a - b,
            Operator::Mul => a * b,
            Operator::Div => a / b,
            _ => return None,
        };
        Some(Amount::Real(Amount::Real(value, bytes).real(bytes), bytes))
    }

    /// A number with a point to as many digits as it holds.
    #[must_use]
    pub fn text(self) -> String {
        match self {
            Amount::Whole(value) => value.to_string(),
            Amount::Real(value, 8) => super::ctext::general(value, 17),
            Amount::Real(..) => super::ctext::general(self.real(DOUBLE), 9),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Amount, Operator};

    #[test]
    fn numbers_with_a_point_are_of_four_bytes_unless_one_has_eight() {
        let tenth = Amount::Real(0.1, 0);
        let stored = Amount::of_bits(0x3DCC_CCCD, 4);
        assert_eq!(stored.and_then(|own| own.with(Operator::Eq, tenth)), Some(Amount::Whole(1)));
        assert_eq!(Amount::Real(0.1, 8).with(Operator::Eq, tenth), Some(Amount::Whole(1)));
        assert_eq!(Amount::Real(2.5, 4).with(Operator::Mul, Amount::Whole(3)), Some(Amount::Real(7.5, 4)));
        assert_eq!(Amount::Real(2.5, 4).with(Operator::Shl, Amount::Whole(1)), None);
        assert_eq!(Amount::Real(2.5, 4).bits(4), 0x4020_0000);
        assert!(Amount::Real(0.5, 4).is_true());
    }
}
