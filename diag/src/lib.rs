//! Diagnostics: the common form of every error, warning and note about text and files.
//!
//! A [`Diagnostic`] says what is wrong (`cause`), where (`file:line:column`) and what to do (`hint`). It
//! carries a stable code that `emu explain CODE` explains. A crate that reads files declares its codes in a
//! table of [`DiagnosticCode`], so that the code, its title and its explanation are in one row.

#![forbid(unsafe_code)]

mod markup;
mod nearest;
mod table;
pub mod text;

use std::borrow::Cow;
use std::fmt;

use serde::Serialize;

pub use markup::escape_markup;
pub use nearest::{distance, nearest};
pub use table::align_columns;

/// One row of a crate's table of diagnostic codes; `emu explain` prints it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DiagnosticCode {
    /// Stable identifier: a family in capitals and three digits, such as `HEX007`. A code is never reused
    /// with another meaning.
    pub code: &'static str,
    /// What is wrong, in half a line.
    pub title: &'static str,
    /// Why it matters, an example, and how to fix it: a few sentences of plain text.
    pub explain: &'static str,
}

/// Declares the diagnostic codes of a crate: a constant for each, and the table of all, in order of their
/// numbers. A row has the name, the code, the title and the text of `emu explain`.
///
/// ```
/// diag::codes! {
///     /// All codes of this crate.
///     CODES;
///     EMPTY "LD001" "the file is empty"
///         "The file has only blank lines. A program begins with the line LDmicro0.1.";
/// }
/// assert_eq!(CODES[0].code, EMPTY);
/// ```
#[macro_export]
macro_rules! codes {
    ($(#[$about:meta])* $table:ident; $($name:ident $code:literal $title:literal $explain:literal;)*) => {
        $(#[doc = $title] #[allow(unreachable_pub)] pub const $name: &str = $code;)*
        $(#[$about])*
        pub const $table: &[$crate::DiagnosticCode] =
            &[$($crate::DiagnosticCode { code: $code, title: $title, explain: $explain }),*];
    };
}

/// How serious a diagnostic is; the order is note, warning, error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Information only; nothing is wrong.
    Note,
    /// Suspicious but accepted.
    Warning,
    /// The input is rejected.
    Error,
}

/// A position in a text file. Lines and columns count from 1; columns count characters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize)]
pub struct Pos {
    /// Line, from 1; 0 when the diagnostic is about the file as a whole.
    pub line: u32,
    /// Column in characters, from 1; 0 when the diagnostic is about the whole line.
    pub column: u32,
    /// Number of characters to mark, at least 1 if `column` is not 0.
    pub width: u32,
}

impl Pos {
    /// Makes a position that covers `width` characters from `line` and `column`.
    #[must_use]
    pub const fn new(line: u32, column: u32, width: u32) -> Self {
        Pos { line, column, width }
    }
}

/// One error, warning or note about a file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Diagnostic {
    /// Stable code, such as `HEX007`.
    pub code: &'static str,
    /// Error, warning or note.
    pub severity: Severity,
    /// Name of the file as the user gave it (`-` for standard input).
    pub file: String,
    /// Position in the file.
    pub pos: Pos,
    /// What is wrong: one sentence, with the value that was found and the value that was expected.
    pub cause: String,
    /// What to do about it: one sentence.
    pub hint: String,
}

impl Diagnostic {
    /// Makes a diagnostic. `code` comes from a crate's table of codes. Text in `cause` and `hint` that was
    /// decoded byte by byte ([`text::decode_text`]) is made readable, and control characters are escaped
    /// ([`text::printable`]).
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

    /// Whether the diagnostic is an error, so that the input is rejected.
    #[must_use]
    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }
}

/// Formats as `file:line:column: error[CODE]: cause (hint)`, the form for logs. The command line also prints
/// the source line with a caret.
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
