//! A fault of a line, before its file and line are known.

use std::ops::Range;

use diag::Severity;

/// A fault in a piece of the line that is being read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct LineFault {
    /// Code from [`crate::CODES`].
    pub code: &'static str,
    /// Error, warning or note.
    pub severity: Severity,
    /// Byte range within the line.
    pub range: Range<usize>,
    /// What is wrong.
    pub cause: String,
    /// How to fix it.
    pub hint: String,
    /// A name for which the report suggests a similar one.
    pub misspelt_name: Option<String>,
}

impl LineFault {
    /// Returns an error.
    pub fn new(code: &'static str, at: Range<usize>, cause: impl Into<String>, hint: impl Into<String>) -> LineFault {
        LineFault {
            code,
            severity: Severity::Error,
            range: at,
            cause: cause.into(),
            hint: hint.into(),
            misspelt_name: None,
        }
    }

    /// Makes it a warning.
    pub fn warning(self) -> LineFault {
        LineFault { severity: Severity::Warning, ..self }
    }

    /// Makes it a note.
    pub fn note(self) -> LineFault {
        LineFault { severity: Severity::Note, ..self }
    }

    /// Adds a similar name to the hint, if there is one.
    pub fn with_similar_name(self, name: &str) -> LineFault {
        LineFault { misspelt_name: Some(name.to_owned()), ..self }
    }
}

/// Why something is refused, and what to write instead.
#[derive(Debug, Clone)]
pub(crate) struct CauseAndHint {
    pub cause: String,
    pub hint: String,
}

impl CauseAndHint {
    pub fn new(cause: impl Into<String>, hint: impl Into<String>) -> CauseAndHint {
        CauseAndHint { cause: cause.into(), hint: hint.into() }
    }
}

/// A diagnostic of a dialect before its place in the line is known.
#[derive(Debug)]
pub(crate) struct AsmRefusal {
    code: &'static str,
    reason: CauseAndHint,
}

impl AsmRefusal {
    pub fn new(code: &'static str, cause: impl Into<String>, hint: impl Into<String>) -> AsmRefusal {
        AsmRefusal { code, reason: CauseAndHint::new(cause, hint) }
    }

    /// Returns the diagnostic at a place of the line.
    pub fn at(self, at: Range<usize>) -> LineFault {
        LineFault::new(self.code, at, self.reason.cause, self.reason.hint)
    }
}
