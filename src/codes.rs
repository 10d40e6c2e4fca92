//! The codes of the command line itself.

use diag::{Code, Diagnostic, Pos, Severity};

/// A file could not be read.
pub const UNREADABLE: &str = "CLI001";
/// A file could not be written.
pub const UNWRITABLE: &str = "CLI002";
/// An element has no meaning in the evaluator.
pub const NO_MEANING: &str = "CLI003";

/// All of them.
#[rustfmt::skip]
pub const CODES: &[Code] = &[
    Code { code: UNREADABLE, title: "a file cannot be read",
        explain: "The file does not exist, is a folder, is not permitted, or is larger than 64 MB. The message gives the \
                  reason that the system gave. Mend: check the path; - stands for standard input." },
    Code { code: UNWRITABLE, title: "a result cannot be written",
        explain: "The folder does not exist, is not permitted, or the disk is full. Results are written to a temporary \
                  file beside their place and then renamed, so an old file there is still whole. Mend: check the path \
                  and the room on the disk." },
    Code { code: NO_MEANING, title: "an element has no meaning in the reference evaluator",
        explain: "The reference evaluator knows the elements listed in docs/semantics.md. A program with any other \
                  element is refused as a whole, because running a part of it would show wrong results. Mend: remove \
                  the element, or read the program in the dialect that it was written for (--dialect)." },
];

/// An error about a whole file.
pub fn about_file(code: &'static str, file: &str, cause: String, hint: &str) -> Diagnostic {
    Diagnostic::new(Severity::Error, code, file, Pos::default(), cause, hint)
}

/// What the system said, without its error number.
pub fn reason(error: &std::io::Error) -> String {
    let text = error.to_string();
    text.split(" (os error").next().unwrap_or_default().to_lowercase()
}
