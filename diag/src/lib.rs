//! Diagnostics: one shape for every complaint about text and files.
//!
//! A [`Diagnostic`] says what is wrong (`cause`), where (`file:line:column`), what to do (`hint`) and carries a stable
//! code that `emu explain CODE` expands. Crates that read files declare their codes in a [`DiagnosticCode`] table, so the code,
//! its title and its explanation stand in one row.

#![forbid(unsafe_code)]

mod markup;
mod nearest;
pub mod text;

use std::borrow::Cow;
use std::fmt;

use serde::Serialize;

pub use markup::escape_markup;
pub use nearest::{distance, nearest};

/// One row of a crate's table of codes, the text behind `emu explain`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DiagnosticCode {
    /// Stable identifier: a family in capitals and three digits, such as `HEX007`. Never reused for another meaning.
    pub code: &'static str,
    /// What is wrong, in half a line.
    pub title: &'static str,
    /// Why it matters, an example, and how to mend it: some sentences of plain text.
    pub explain: &'static str,
}

/// How bad it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Told for information; nothing is wrong.
    Note,
    /// Suspicious but accepted.
    Warning,
    /// The input is refused.
    Error,
}

/// A place in a text file. Lines and columns count from 1; columns count characters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize)]
pub struct Pos {
    /// Line, from 1; 0 when the complaint is about the file as a whole.
    pub line: u32,
    /// Column in characters, from 1; 0 when the complaint is about the whole line.
    pub column: u32,
    /// Number of characters marked, at least 1 where `column` is not 0.
    pub width: u32,
}

impl Pos {
    /// A place of `width` characters at `line` and `column`.
    #[must_use]
    pub const fn new(line: u32, column: u32, width: u32) -> Self {
        Pos { line, column, width }
    }
}

/// One complaint.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Diagnostic {
    /// Stable code, such as `HEX007`.
    pub code: &'static str,
    /// Error, warning or note.
    pub severity: Severity,
    /// Name of the file as the user gave it (`-` for standard input).
    pub file: String,
    /// Where in the file.
    pub pos: Pos,
    /// What is wrong, one sentence, with the values found and wanted.
    pub cause: String,
    /// What to do about it, one sentence.
    pub hint: String,
}

impl Diagnostic {
    /// A complaint of the given severity; `code` comes from a crate's table of codes. Words of a text that was taken byte by byte
    /// ([`text::decode_text`]) are made readable, and control characters are escaped ([`text::printable`]).
    #[must_use]
    pub fn new(
        severity: Severity,
        code: &'static str,
        file: &str,
        pos: Pos,
        cause: impl Into<String>,
        hint: impl Into<String>,
    ) -> Self {
        let shown = |words: String| match text::to_display_text(&words) {
            Cow::Owned(shown) => text::into_printable(shown),
            Cow::Borrowed(_) => text::into_printable(words),
        };
        Diagnostic { code, severity, file: file.to_owned(), pos, cause: shown(cause.into()), hint: shown(hint.into()) }
    }

    /// True for complaints that refuse the input.
    #[must_use]
    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }
}

/// `file:line:column: error[CODE]: cause (hint)`, the form for logs; the command line draws a source line and caret.
impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let severity = match self.severity {
            Severity::Note => "note",
            Severity::Warning => "warning",
            Severity::Error => "error",
        };
        f.write_str(&text::printable(&self.file))?;
        if self.pos.line > 0 {
            write!(f, ":{}", self.pos.line)?;
        }
        if self.pos.column > 0 {
            write!(f, ":{}", self.pos.column)?;
        }
        write!(f, ": {severity}[{}]: {}", self.code, self.cause)?;
        if !self.hint.is_empty() {
            write!(f, " ({})", self.hint)?;
        }
        Ok(())
    }
}

impl std::error::Error for Diagnostic {}
