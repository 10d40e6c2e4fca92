//! What expressions are made of: whole numbers, decimals, truths and texts.

/// A value.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// A whole number.
    Int(i64),
    /// A decimal, as frequencies, resistances and voltages are written.
    Real(f64),
    /// True or false.
    Bool(bool),
    /// A text.
    Text(String),
}

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Value::Int(i @ 0..) => write!(f, "0x{i:02x}"),
            Value::Int(i) => write!(f, "{i}"),
            Value::Real(r) => write!(f, "{r}"),
            Value::Bool(b) => write!(f, "{b}"),
            Value::Text(text) => write!(f, "{text:?}"),
        }
    }
}

impl Value {
    /// As a whole number: decimals lose their fraction, truth is 1; nothing for a text.
    #[must_use]
    pub fn int(&self) -> Option<i64> {
        match self {
            Value::Int(i) => Some(*i),
            // The conversion saturates.
            Value::Real(r) => Some(*r as i64),
            Value::Bool(b) => Some(i64::from(*b)),
            Value::Text(_) => None,
        }
    }

    /// As a decimal; nothing for a text.
    #[must_use]
    pub fn real(&self) -> Option<f64> {
        match self {
            Value::Real(r) => Some(*r),
            other => other.int().map(|i| i as f64),
        }
    }

    /// True for what is not 0; nothing for a text.
    #[must_use]
    pub fn truth(&self) -> Option<bool> {
        self.real().map(|r| r != 0.0)
    }
}

/// An operator between two values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Op {
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

impl Op {
    /// The operator as it is written, longest spellings first, and how tightly it binds. This is gpsim's order, in which
    /// comparisons bind tightest and `& | ^` as loosely as `+`.
    pub(super) const ALL: [(&'static str, Op, u8); 17] = [
        ("<<", Op::Shl, 3),
        (">>", Op::Shr, 3),
        ("||", Op::Any, 4),
        ("&&", Op::All, 5),
        ("==", Op::Eq, 6),
        ("!=", Op::Ne, 6),
        ("<=", Op::Le, 7),
        (">=", Op::Ge, 7),
        ("<", Op::Lt, 7),
        (">", Op::Gt, 7),
        ("+", Op::Add, 1),
        ("-", Op::Sub, 1),
        ("^", Op::Xor, 1),
        ("|", Op::Or, 1),
        ("&", Op::And, 1),
        ("*", Op::Mul, 2),
        ("/", Op::Div, 2),
    ];

    /// The result; the reason where there is none.
    pub(super) fn apply(self, a: &Value, b: &Value) -> Result<Value, String> {
        if let (Value::Text(a), Value::Text(b)) = (a, b) {
            return match self {
                Op::Eq => Ok(Value::Bool(a == b)),
                Op::Ne => Ok(Value::Bool(a != b)),
                _ => Err("texts can only be compared".to_owned()),
            };
        }
        let text = || "a text is no number".to_owned();
        match self {
            Op::Any => return Ok(Value::Bool(a.truth().ok_or_else(text)? || b.truth().ok_or_else(text)?)),
            Op::All => return Ok(Value::Bool(a.truth().ok_or_else(text)? && b.truth().ok_or_else(text)?)),
            _ => {}
        }
        if matches!(a, Value::Real(_)) || matches!(b, Value::Real(_)) {
            return self.real(a.real().ok_or_else(text)?, b.real().ok_or_else(text)?);
        }
        self.int(a.int().ok_or_else(text)?, b.int().ok_or_else(text)?)
    }

    fn real(self, a: f64, b: f64) -> Result<Value, String> {
        Ok(match self {
            Op::Add => Value::Real(a + b),
            Op::Sub => Value::Real(a - b),
            Op::Mul => Value::Real(a * b),
            Op::Div => Value::Real(a / b),
            Op::Eq => Value::Bool(a == b),
            Op::Ne => Value::Bool(a != b),
            Op::Lt => Value::Bool(a < b),
            Op::Le => Value::Bool(a <= b),
            Op::Gt => Value::Bool(a > b),
            Op::Ge => Value::Bool(a >= b),
            _ => return Err("bits of a decimal".to_owned()),
        })
    }

    fn int(self, a: i64, b: i64) -> Result<Value, String> {
        let shift = u32::try_from(b).unwrap_or(u32::MAX);
        Ok(match self {
            Op::Add => Value::Int(a.wrapping_add(b)),
            Op::Sub => Value::Int(a.wrapping_sub(b)),
            Op::Mul => Value::Int(a.wrapping_mul(b)),
            Op::Div => Value::Int(a.checked_div(b).ok_or_else(|| "a division by 0".to_owned())?),
            Op::And => Value::Int(a & b),
            Op::Or => Value::Int(a | b),
            Op::Xor => Value::Int(a ^ b),
            Op::Shl => Value::Int(a.checked_shl(shift).unwrap_or(0)),
            Op::Shr => Value::Int(a.checked_shr(shift).unwrap_or(0)),
            Op::Eq => Value::Bool(a == b),
            Op::Ne => Value::Bool(a != b),
            Op::Lt => Value::Bool(a < b),
            Op::Le => Value::Bool(a <= b),
            Op::Gt => Value::Bool(a > b),
            Op::Ge => Value::Bool(a >= b),
            Op::Any | Op::All => Value::Bool(false),
        })
    }
}
