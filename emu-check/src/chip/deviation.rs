//! A value of the chip that differs from what the check expects.

/// What a check expects and what it found instead, each as text for the report.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Deviation {
    /// The value that the program requires.
    pub expected: String,
    /// The value of the chip, its pins or its map.
    pub found: String,
}

impl Deviation {
    /// A deviation from `expected`.
    pub(crate) fn new(expected: impl Into<String>, found: impl Into<String>) -> Deviation {
        Deviation { expected: expected.into(), found: found.into() }
    }
}
