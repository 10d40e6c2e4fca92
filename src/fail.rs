//! Exit codes, and the ways in which a verb fails.

use diag::Diagnostic;
use serde_json::json;

use crate::codes::{UNWRITABLE, file_error, system_message};
use crate::output;
use crate::report::{FileTexts, MessageStyle, report_diagnostics};

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
pub enum VerbFailure {
    /// The command line makes no sense.
    Usage(String),
    /// Files were refused: why, and their texts for drawing.
    Refused(Vec<Diagnostic>, FileTexts),
    /// Nobody reads standard output any more.
    Pipe,
}

impl VerbFailure {
    /// A result could not be written to `file`.
    pub fn write_failed(file: &str, error: &std::io::Error) -> VerbFailure {
        if error.kind() == std::io::ErrorKind::BrokenPipe {
            return VerbFailure::Pipe;
        }
        let cause = format!("cannot be written: {}", system_message(error));
        let hint = "check the path and the room on the disk";
        VerbFailure::Refused(vec![file_error(UNWRITABLE, file, cause, hint)], FileTexts::default())
    }

    /// It in a sentence, for those who tell of it themselves.
    pub fn sentence(&self) -> String {
        match self {
            VerbFailure::Usage(text) => text.clone(),
            VerbFailure::Refused(all, _) => {
                let each: Vec<_> = all.iter().map(|d| format!("{} {} ({})", d.file, d.cause, d.code)).collect();
                each.join("; ")
            }
            VerbFailure::Pipe => "nobody reads it".to_owned(),
        }
    }

    /// The command line makes no sense, as an error of a library says.
    pub fn usage(error: impl std::error::Error) -> VerbFailure {
        VerbFailure::Usage(error.to_string())
    }

    /// The value of a flag makes no sense.
    pub fn invalid_flag_value(flag: &str, value: &str, why: &dyn std::fmt::Display) -> VerbFailure {
        VerbFailure::Usage(format!("invalid value '{value}' for '{flag}': {why}"))
    }
}

/// Tells about a failure and gives the exit code.
pub fn report_result(result: Result<u8, VerbFailure>, verb: &str, json: bool, terminal: &MessageStyle) -> u8 {
    match result {
        Ok(code) => code,
        Err(VerbFailure::Pipe) => exit::OK,
        Err(VerbFailure::Usage(text)) => {
            output::print_to_stderr(&format!("error: {text}\n\nFor more information, try 'emu {verb} --help'.\n"));
            exit::USAGE
        }
        Err(VerbFailure::Refused(diagnostics, texts)) => {
            let lost = diagnostics.iter().any(|d| d.code == UNWRITABLE && d.file == "-");
            if !json || lost {
                report_diagnostics(terminal, &diagnostics, &texts);
            } else if let Err(VerbFailure::Refused(why, _)) =
                output::print_json(&json!({ "schema": 1, "errors": diagnostics }))
            {
                // Standard output takes nothing, so the document is told here, and why it is.
                report_diagnostics(terminal, &diagnostics, &texts);
                report_diagnostics(terminal, &why, FileTexts::NONE);
            }
            exit::REFUSED
        }
    }
}
