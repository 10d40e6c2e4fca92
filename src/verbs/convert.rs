//! `emu convert`: writes a program in another notation.

use clap::Args;
use diag::{Diagnostic, Severity};
use ladder::convert::{to_instruction_list, to_ldmicro};
use ladder::{LadderDialect, LadderProgram, Notation};

use crate::shared::fail::{VerbFailure, exit};
use crate::shared::flags::{LadderFlags, parse_notation};
use crate::shared::input;
use crate::shared::output::{self, RequestedOutput};
use crate::shared::report::{MessageStyle, report_diagnostics};

const EXAMPLES: &str = "\
Examples:
  emu convert examples/welder.ld -o welder.il
  emu convert examples/lamp.il -o lamp.ld
  emu convert examples/tank.ld --to il -o -

The result computes the same bits in every scan. What the other notation cannot express is an error with its
place, and no file is written. Notes name what has another name.

Exit codes: 0 the file is written; 3 a part of the program has no equal in the other notation.";

/// Flags of `emu convert`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct ConvertArgs {
    #[command(flatten)]
    program: LadderFlags,
    /// Output file; its extension is the notation. - is standard output, and needs --to.
    #[arg(short, long, value_name = "FILE")]
    output: String,
    /// Notation of the output: il or ld. Default: the extension of the output file.
    #[arg(long, value_name = "NOTATION", value_parser = parse_notation)]
    to: Option<Notation>,
}

/// Converts a program and writes it.
pub fn convert(args: &ConvertArgs, style: &MessageStyle) -> Result<u8, VerbFailure> {
    let (file, out) = (&args.program.file, &args.output);
    let Some(to) = args.to.or_else(|| Notation::of_file(out)) else {
        return Err(VerbFailure::Usage(format!("{out} does not show a notation; give --to il or --to ld")));
    };
    output::check_input_not_overwritten(file, &[RequestedOutput::new("--output", out)])?;
    let (read, mut notes) = input::parse_program(file, input::read_bytes(file)?, args.program.read.options(), true)?;
    // Warnings about the program are those of the other verbs; here they would hide the notes.
    notes.retain(|note| note.severity == Severity::Warning);
    match converted(&read.program, to) {
        Ok((text, more)) => {
            notes.extend(more);
            report_diagnostics(style, &notes, &read.texts);
            output::write_files(&[(out, text.as_bytes())])?;
            Ok(exit::OK)
        }
        Err(faults) => Err(VerbFailure::Refused(faults, read.texts)),
    }
}

/// Returns the text of a program in a notation, and notes.
fn converted(program: &LadderProgram, to: Notation) -> Result<(String, Vec<Diagnostic>), Vec<Diagnostic>> {
    let is_iec = program.dialect == LadderDialect::Iec;
    match to {
        Notation::InstructionList if !is_iec => {
            let converted = to_instruction_list(program)?;
            Ok((ladder::il::write(&converted.program), converted.notes))
        }
        Notation::Ldmicro if is_iec => {
            let converted = to_ldmicro(program)?;
            Ok((ladder::write(&converted.program), converted.notes))
        }
        // The notation stays: the canonical text.
        Notation::InstructionList | Notation::Ldmicro => Ok((ladder::write(program), Vec::new())),
        Notation::PlcOpen | Notation::OpenPlc | Notation::Rockwell | Notation::Grid => {
            let cause = "programs are not written in this notation";
            let pos = diag::Pos::new(1, 1, 1);
            let code = ladder::convert::NOT_CONVERTED;
            Err(vec![Diagnostic::new(Severity::Error, code, &program.file, pos, cause, "choose il or ld")])
        }
    }
}
