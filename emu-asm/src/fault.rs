//! What is wrong with a line, before it is known where the line stands.

use std::ops::Range;

use diag::Severity;

/// A complaint about a piece of the line that is being read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct LineFault {
    /// Code of [`crate::CODES`].
    pub code: &'static str,
    /// Error, warning or note.
    pub severity: Severity,
    /// Bytes of the line.
    pub range: Range<usize>,
    /// What is wrong.
    pub cause: String,
    /// What to do about it.
    pub hint: String,
    /// A name for which a similar one is looked up when the complaint is told.
    pub misspelt_name: Option<String>,
}

impl LineFault {
    /// An error.
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

    /// The same as a warning.
    pub fn warning(self) -> LineFault {
        LineFault { severity: Severity::Warning, ..self }
    }

    /// The same as a note.
    pub fn note(self) -> LineFault {
        LineFault { severity: Severity::Note, ..self }
    }

    /// With a similar name as its hint, if there is one.
    pub fn with_similar_name(self, name: &str) -> LineFault {
        LineFault { misspelt_name: Some(name.to_owned()), ..self }
    }
}
