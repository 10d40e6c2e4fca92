//! Values of expressions and symbols.

/// The value of an expression.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct AsmValue {
    /// The number.
    pub number: i64,
    /// It depends on a name whose value is not known (yet).
    pub is_unknown: bool,
    /// It is a chip register given by its name alone; the number is its address.
    pub is_register: bool,
    /// It is the address of a label, or computed from one.
    pub is_label: bool,
    /// It is meant for its high byte, which sdas8051's linker takes of the whole sum: `>label+n`.
    pub is_high: bool,
}

impl AsmValue {
    /// Returns a plain number.
    pub fn of(n: i64) -> AsmValue {
        AsmValue { number: n, ..AsmValue::default() }
    }

    /// Returns the value with its high byte taken, if that was left to the whole sum.
    pub fn with_high_taken(self) -> AsmValue {
        match self.is_high {
            true => AsmValue { number: self.number >> 8 & 0xFF, is_high: false, ..self },
            false => self,
        }
    }
}
