//! `emu check --via`: checks programs through an emitted source instead of an image.

use diag::Diagnostic;
use emu_check::CheckOptions;
use emu_check::via::{SourceCheckReport, SourceRoute};
use serde::Serialize;

use crate::shared::fail::{VerbFailure, exit};
use crate::shared::input::ReadProgram;
use crate::shared::output;
use crate::shared::usage_error::UsageError;

/// Parses the value of `--via`.
pub fn parse_via(text: &str) -> Result<SourceRoute, UsageError> {
    match text {
        "native" => Ok(SourceRoute::Native),
        "c" => Ok(SourceRoute::C),
        "arduino" => Ok(SourceRoute::Arduino),
        "bytecode" => Ok(SourceRoute::Bytecode),
        _ => Err(UsageError::malformed("the routes are native, c, arduino and bytecode")),
    }
}

/// The JSON document of all checks.
#[derive(Serialize)]
struct ViaDocument {
    schema: u32,
    checks: Vec<SourceCheckReport>,
    refused: Vec<ViaRefusal>,
}

/// A program that was refused, so that nothing could be checked.
#[derive(Serialize)]
struct ViaRefusal {
    program: String,
    mcu: String,
    errors: Vec<Diagnostic>,
}

/// Checks every program with each of `options`, one per chip (`native`: once). With `all`, a chip that
/// refuses is listed, and it is a failure only if every chip refuses.
pub fn check(
    via: SourceRoute,
    options: &[CheckOptions],
    programs: Vec<ReadProgram>,
    all: bool,
    json: bool,
) -> Result<u8, VerbFailure> {
    let options = if via == SourceRoute::Native { options.get(..1).unwrap_or(options) } else { options };
    let mut document = ViaDocument { schema: 1, checks: Vec::new(), refused: Vec::new() };
    let mut any_refused = false;
    let single = programs.len() == 1 && options.len() == 1;
    for read in programs {
        let before = document.checks.len();
        for options in options {
            match emu_check::via::check(&read.program, via, options) {
                Ok(report) => document.checks.push(report),
                Err(errors) if single => return Err(VerbFailure::Refused(errors, read.texts)),
                Err(errors) => {
                    let (program, mcu) = (read.program.file.clone(), options.mcu.clone());
                    document.refused.push(ViaRefusal { program, mcu, errors });
                    any_refused |= !all;
                }
            }
        }
        any_refused |= document.checks.len() == before;
    }
    let differs = document.checks.iter().any(|report| !report.agreed);
    if json {
        output::print_json(&document)?;
    } else {
        let mut text: String = document.checks.iter().map(SourceCheckReport::text).collect();
        for refused in &document.refused {
            let why = refused.errors.first().map_or_else(String::new, |error| error.cause.clone());
            text += &format!("{} on {} refused: {why}\n", refused.program, refused.mcu);
        }
        output::print(text)?;
    }
    Ok(match (differs, any_refused) {
        (true, _) => exit::FAILED,
        (false, true) => exit::REFUSED,
        (false, false) => exit::OK,
    })
}
