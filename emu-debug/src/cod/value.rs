//! Values of expressions: integers, decimals, truth values and texts.

use super::error::CodError;

/// A value.
#[derive(Debug, Clone, PartialEq)]
pub enum CodValue {
    /// An integer.
    Int(i64),
    /// A decimal, for frequencies, resistances and voltages.
    Real(f64),
    /// True or false.
    Bool(bool),
    /// A text.
    Text(String),
}

impl std::fmt::Display for CodValue {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            CodValue::Int(i @ 0..) => write!(f, "0x{i:02x}"),
            CodValue::Int(i) => write!(f, "{i}"),
            CodValue::Real(r) => write!(f, "{r}"),
            CodValue::Bool(b) => write!(f, "{b}"),
            CodValue::Text(text) => write!(f, "{text:?}"),
        }
    }
}

impl CodValue {
    /// Converts to an integer: decimals lose their fraction, true is 1; `None` for a text.
    #[must_use]
    pub fn to_integer(&self) -> Option<i64> {
        match self {
            CodValue::Int(i) => Some(*i),
            // The conversion saturates.
            CodValue::Real(r) => Some(*r as i64),
            CodValue::Bool(b) => Some(i64::from(*b)),
            CodValue::Text(_) => None,
        }
    }

    /// Converts to a decimal; `None` for a text.
    #[must_use]
    pub fn to_real(&self) -> Option<f64> {
        match self {
            CodValue::Real(r) => Some(*r),
            other => other.to_integer().map(|i| i as f64),
        }
    }

    /// Returns whether the value is not 0; `None` for a text.
    #[must_use]
    pub fn to_bool(&self) -> Option<bool> {
        self.to_real().map(|r| r != 0.0)
    }
}

/// An operator with two operands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum CodOperator {
    Add,
    Sub,
    Xor,
    Or,
    And,
    Mul,
    Div,
    Shl,
    Shr,
    Any,
    All,
    Eq,
    Ne,
    Lt,
    Le,
    Gt,
    Ge,
}

impl CodOperator {
    /// The spellings of the operators, longest first, with their binding strength. This is gpsim's order, in
    /// which comparisons bind most tightly and `& | ^` as loosely as `+`.
    pub(super) const ALL: [(&'static str, CodOperator, u8); 17] = [
        ("<<", CodOperator::Shl, 3),
        (">>", CodOperator::Shr, 3),
        ("||", CodOperator::Any, 4),
        ("&&", CodOperator::All, 5),
        ("==", CodOperator::Eq, 6),
        ("!=", CodOperator::Ne, 6),
        ("<=", CodOperator::Le, 7),
        (">=", CodOperator::Ge, 7),
        ("<", CodOperator::Lt, 7),
        (">", CodOperator::Gt, 7),
        ("+", CodOperator::Add, 1),
        ("-", CodOperator::Sub, 1),
        ("^", CodOperator::Xor, 1),
        ("|", CodOperator::Or, 1),
        ("&", CodOperator::And, 1),
        ("*", CodOperator::Mul, 2),
        ("/", CodOperator::Div, 2),
    ];

    /// Computes the result; the error is the reason why there is none.
    pub(super) fn apply(self, a: &CodValue, b: &CodValue) -> Result<CodValue, CodError> {
        if let (CodValue::Text(a), CodValue::Text(b)) = (a, b) {
            return match self {
                CodOperator::Eq => Ok(CodValue::Bool(a == b)),
                CodOperator::Ne => Ok(CodValue::Bool(a != b)),
                _ => Err(CodError::TextsInArithmetic),
            };
        }
        let text = || CodError::TextIsNo { wanted: "number" };
        match self {
            CodOperator::Any => {
                return Ok(CodValue::Bool(a.to_bool().ok_or_else(text)? || b.to_bool().ok_or_else(text)?));
            }
            CodOperator::All => {
                return Ok(CodValue::Bool(a.to_bool().ok_or_else(text)? && b.to_bool().ok_or_else(text)?));
            }
            _ => {}
        }
        if matches!(a, CodValue::Real(_)) || matches!(b, CodValue::Real(_)) {
            return self.real(a.to_real().ok_or_else(text)?, b.to_real().ok_or_else(text)?);
        }
        self.int(a.to_integer().ok_or_else(text)?, b.to_integer().ok_or_else(text)?)
    }

    fn real(self, a: f64, b: f64) -> Result<CodValue, CodError> {
        Ok(match self {
            CodOperator::Add => CodValue::Real(a + b),
            CodOperator::Sub => CodValue::Real(a - b),
            CodOperator::Mul => CodValue::Real(a * b),
            CodOperator::Div => CodValue::Real(a / b),
            CodOperator::Eq => CodValue::Bool(a == b),
            CodOperator::Ne => CodValue::Bool(a != b),
            CodOperator::Lt => CodValue::Bool(a < b),
            CodOperator::Le => CodValue::Bool(a <= b),
            CodOperator::Gt => CodValue::Bool(a > b),
            CodOperator::Ge => CodValue::Bool(a >= b),
            _ => return Err(CodError::BitsOfDecimal),
        })
    }

    fn int(self, a: i64, b: i64) -> Result<CodValue, CodError> {
        let shift = u32::try_from(b).unwrap_or(u32::MAX);
        Ok(match self {
            CodOperator::Add => CodValue::Int(a.wrapping_add(b)),
            CodOperator::Sub => CodValue::Int(a.wrapping_sub(b)),
            CodOperator::Mul => CodValue::Int(a.wrapping_mul(b)),
            CodOperator::Div => CodValue::Int(a.checked_div(b).ok_or(CodError::DivisionByZero)?),
            CodOperator::And => CodValue::Int(a & b),
            CodOperator::Or => CodValue::Int(a | b),
            CodOperator::Xor => CodValue::Int(a ^ b),
            CodOperator::Shl => CodValue::Int(a.checked_shl(shift).unwrap_or(0)),
            CodOperator::Shr => CodValue::Int(a.checked_shr(shift).unwrap_or(0)),
            CodOperator::Eq => CodValue::Bool(a == b),
            CodOperator::Ne => CodValue::Bool(a != b),
            CodOperator::Lt => CodValue::Bool(a < b),
            CodOperator::Le => CodValue::Bool(a <= b),
            CodOperator::Gt => CodValue::Bool(a > b),
            CodOperator::Ge => CodValue::Bool(a >= b),
            CodOperator::Any | CodOperator::All => CodValue::Bool(false),
        })
    }
}
