//! Exit codes, and the ways in which a verb fails.

use diag::Diagnostic;
use serde_json::json;

use crate::shared::codes::{UNWRITABLE, file_error, system_message};
use crate::shared::output;
use crate::shared::report::{FileTexts, MessageStyle, report_diagnostics};

/// Exit codes of `emu`.
pub mod exit {
    /// Success.
    pub const OK: u8 = 0;
    /// An expectation failed, or states differ.
    pub const FAILED: u8 = 1;
    /// The command line makes no sense.
    pub const USAGE: u8 = 2;
    /// A file was refused.
    pub const REFUSED: u8 = 3;
    /// The program on the chip did something impossible.
    pub const FAULT: u8 = 4;
    /// A limit came before the awaited event.
    pub const LIMIT: u8 = 5;
    /// A fault of `emu` itself.
    pub const INTERNAL: u8 = 70;
}

/// Why a verb failed.
#[derive(Debug)]
pub enum VerbFailure {
    /// The command line makes no sense.
    Usage(String),
    /// Files were refused: the diagnostics, and the file texts for drawing them.
    Refused(Vec<Diagnostic>, FileTexts),
    /// Nobody reads standard output any more (broken pipe).
    Pipe,
}

impl VerbFailure {
    /// Returns the failure that a result could not be written to `file`.
    pub fn write_failed(file: &str, error: &std::io::Error) -> VerbFailure {
        if error.kind() == std::io::ErrorKind::BrokenPipe {
            return VerbFailure::Pipe;
        }
        let cause = format!("cannot be written: {}", system_message(error));
        let hint = "check the path and the free space of the disk";
        VerbFailure::Refused(vec![file_error(UNWRITABLE, file, cause, hint)], FileTexts::default())
    }

    /// Returns the failure as one sentence, for callers that report it themselves.
    pub fn sentence(&self) -> String {
        match self {
            VerbFailure::Usage(text) => text.clone(),
            VerbFailure::Refused(all, _) => {
                let each: Vec<_> = all.iter().map(|d| format!("{} {} ({})", d.file, d.cause, d.code)).collect();
                each.join("; ")
            }
            VerbFailure::Pipe => "the reader has ended".to_owned(),
        }
    }

    /// Returns a usage error with the message of a library error.
    pub fn usage(error: impl std::error::Error) -> VerbFailure {
        VerbFailure::Usage(error.to_string())
    }

    /// Returns a usage error for an invalid value of a flag.
    pub fn invalid_flag_value(flag: &str, value: &str, why: &dyn std::fmt::Display) -> VerbFailure {
        VerbFailure::Usage(format!("invalid value '{value}' for '{flag}': {why}"))
    }
}

/// Reports the result of a verb, and returns the exit code.
pub fn report_result(result: Result<u8, VerbFailure>, verb: &str, json: bool, style: &MessageStyle) -> u8 {
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
                report_diagnostics(style, &diagnostics, &texts);
            } else if let Err(VerbFailure::Refused(why, _)) =
                output::print_json(&json!({ "schema": 1, "errors": diagnostics }))
            {
                // Standard output failed, so report the diagnostics and the write error on standard error.
                report_diagnostics(style, &diagnostics, &texts);
                report_diagnostics(style, &why, FileTexts::NONE);
            }
            exit::REFUSED
        }
    }
}
