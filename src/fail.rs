//! Exit codes, and the ways in which a verb fails.

use diag::Diagnostic;
use serde_json::json;

use crate::codes::{UNWRITABLE, about_file, reason};
use crate::output;
use crate::report::{Terminal, Texts, report};

/// Exit codes.
pub mod exit {
    /// All went well.
    pub const OK: u8 = 0;
    /// An expectation failed, or states differ.
    pub const FAILED: u8 = 1;
    /// The command line makes no sense.
    pub const USAGE: u8 = 2;
    /// A file was refused.
    pub const REFUSED: u8 = 3;
    /// The program on the chip did something impossible.
    pub const FAULT: u8 = 4;
    /// A limit came before what was waited for.
    pub const LIMIT: u8 = 5;
    /// A fault of emu.
    pub const INTERNAL: u8 = 70;
}

/// Why a verb did not come to its end.
#[derive(Debug)]
pub enum Failure {
    /// The command line makes no sense.
    Usage(String),
    /// Files were refused: why, and their texts for drawing.
    Refused(Vec<Diagnostic>, Texts),
    /// Nobody reads standard output any more.
    Pipe,
}

impl Failure {
    /// A result could not be written to `file`.
    pub fn writing(file: &str, error: &std::io::Error) -> Failure {
        if error.kind() == std::io::ErrorKind::BrokenPipe {
            return Failure::Pipe;
        }
        let cause = format!("cannot be written: {}", reason(error));
        let hint = "check the path and the room on the disk";
        Failure::Refused(vec![about_file(UNWRITABLE, file, cause, hint)], Texts::default())
    }

    /// It in a sentence, for those who tell of it themselves.
    pub fn sentence(&self) -> String {
        match self {
            Failure::Usage(text) => text.clone(),
            Failure::Refused(all, _) => {
                let each: Vec<_> = all.iter().map(|d| format!("{} {} ({})", d.file, d.cause, d.code)).collect();
                each.join("; ")
            }
            Failure::Pipe => "nobody reads it".to_owned(),
        }
    }

    /// The value of a flag makes no sense.
    pub fn value(flag: &str, value: &str, why: &str) -> Failure {
        Failure::Usage(format!("invalid value '{value}' for '{flag}': {why}"))
    }
}

/// Tells about a failure and gives the exit code.
pub fn finish(result: Result<u8, Failure>, verb: &str, json: bool, terminal: &Terminal) -> u8 {
    match result {
        Ok(code) => code,
        Err(Failure::Pipe) => exit::OK,
        Err(Failure::Usage(text)) => {
            output::tell(&format!("error: {text}\n\nFor more information, try 'emu {verb} --help'.\n"));
            exit::USAGE
        }
        Err(Failure::Refused(diagnostics, texts)) => {
            let lost = diagnostics.iter().any(|d| d.code == UNWRITABLE && d.file == "-");
            if !json || lost {
                report(terminal, &diagnostics, &texts);
            } else if let Err(Failure::Refused(why, _)) = output::json(&json!({ "schema": 1, "errors": diagnostics })) {
                // Standard output takes nothing, so the document is told here, and why it is.
                report(terminal, &diagnostics, &texts);
                report(terminal, &why, Texts::NONE);
            }
            exit::REFUSED
        }
    }
}
