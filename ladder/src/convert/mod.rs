//! Converts programs between notations.
//!
//! [`to_instruction_list`] makes Instruction List of a program of LDmicro. The result computes the same bits
//! in every scan (`docs/convert.md`); what Instruction List cannot express is an error at the element.
//!
//! ```
//! let head = "LDmicro0.1\nCYCLE=10000\nCRYSTAL=4000000\nPROGRAM\n";
//! let rung = "RUNG\n    CONTACTS Xstart 0\n    TON Tdelay 30000\n    COIL Ylamp 0 0 0\nEND\n";
//! let text = format!("{head}{rung}");
//! let program = ladder::parse("lamp.ld", &text).expect("a sound program").program;
//! let converted = ladder::convert::to_instruction_list(&program).expect("elements of IL");
//! // LDmicro's TON counts the scan of the rising edge: 3 scans are 20 ms after it.
//! assert!(ladder::il::write(&converted.program).contains("TON Tdelay, T#20ms"));
//! ```

mod codes;
mod elements;
mod emitter;
mod facts;
mod flow;
mod integers;
mod ldmicro;
mod ldmicro_blocks;
mod ldmicro_networks;
mod names;
mod timers;

use diag::{Diagnostic, Pos, Severity};

use crate::il::{IlProgram, IlSection};
use crate::model::{LadderDialect, LadderProgram};

pub use codes::{CONVERT_CODES, NOT_CONVERTED};
use emitter::IlEmitter;
use facts::SourceFacts;
pub use ldmicro::{ConvertedLadder, to_ldmicro};
use names::NameTable;

/// A program of LDmicro as Instruction List.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConvertedProgram {
    /// The program. Positions are those of the source file.
    pub program: IlProgram,
    /// Names that Instruction List does not take, each with the name in its place.
    pub renamed: Vec<(String, String)>,
    /// Notes: what has another name, and what Instruction List has no place for.
    pub notes: Vec<Diagnostic>,
}

/// Converts a program of LDmicro to Instruction List.
///
/// # Errors
/// Each element that Instruction List cannot express, with its position (CV001); a program of IEC 61131-3.
pub fn to_instruction_list(program: &LadderProgram) -> Result<ConvertedProgram, Vec<Diagnostic>> {
    if program.dialect == LadderDialect::Iec {
        let cause = "the program is one of IEC 61131-3 already";
        let pos = Pos::new(1, 1, 1);
        let hint = "give a program of LDmicro";
        return Err(vec![Diagnostic::new(Severity::Error, codes::NOT_CONVERTED, &program.file, pos, cause, hint)]);
    }
    let facts = SourceFacts::new(program);
    let names = NameTable::new(&facts);
    let mut emitter = IlEmitter::new(program, &facts, names);
    emitter.emit_program();
    if emitter.diagnostics.iter().any(Diagnostic::is_error) {
        return Err(emitter.diagnostics);
    }
    let (program, renamed, mut notes) = emitter.finish();
    notes.sort_by_key(|note| note.pos);
    Ok(ConvertedProgram { program, renamed, notes })
}

/// Order of the sections of a converted program.
const SECTIONS: [IlSection; 3] = [IlSection::Input, IlSection::Output, IlSection::Local];
