//! Recognises the notation of a program by its file name and content, and reads it.

use diag::text::{self, TextEncoding};
use diag::{Diagnostic, Pos, Severity};

use crate::codes;
use crate::il::{self, IlProgram};
use crate::model::LadderDialect;
use crate::parse::{ParseOptions, ParsedProgram, parse_bytes};
use crate::{grid, openplc, plcopen, rockwell};

/// A notation that is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Notation {
    /// `.ld` text of LDmicro.
    Ldmicro,
    /// Instruction List of IEC 61131-3.
    InstructionList,
    /// PLCopen XML with a body in ladder diagram or Instruction List.
    PlcOpen,
    /// `.ld` of OpenPLC Editor 4: variables, then rungs as JSON.
    OpenPlc,
    /// Neutral text of Allen-Bradley, alone or in an export (L5X).
    Rockwell,
    /// Grids of CSLadder.
    Grid,
}

impl Notation {
    /// All notations with the names that `--format` takes.
    pub const ALL: [(Notation, &'static str); 6] = [
        (Notation::Ldmicro, "ld"),
        (Notation::InstructionList, "il"),
        (Notation::PlcOpen, "plcopen"),
        (Notation::OpenPlc, "openplc"),
        (Notation::Rockwell, "rockwell"),
        (Notation::Grid, "grid"),
    ];

    /// Ends of the names of files, in order of preference.
    pub const EXTENSIONS: [(Notation, &'static str); 5] = [
        (Notation::Ldmicro, "ld"),
        (Notation::InstructionList, "il"),
        (Notation::PlcOpen, "xml"),
        (Notation::Rockwell, "l5x"),
        (Notation::Grid, "grid"),
    ];

    /// Returns the notation that the extension of a file name shows.
    #[must_use]
    pub fn of_file(file: &str) -> Option<Notation> {
        let extension = file.rsplit_once('.')?.1.to_ascii_lowercase();
        Self::EXTENSIONS.iter().find(|(_, name)| *name == extension).map(|(notation, _)| *notation)
    }
}

/// Options for reading a program in any notation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ReadOptions {
    /// Dialect of LDmicro that overrides the default of the header.
    pub dialect: Option<LadderDialect>,
    /// Notation; by default the one that the file name and the content show.
    pub notation: Option<Notation>,
    /// Time of a scan in microseconds, which overrides CYCLE= and the interval of a task. Without any it is
    /// [`IL_CYCLE_US`].
    pub cycle_us: Option<u64>,
}

/// Time of a scan of a program that gives none, in microseconds.
pub const IL_CYCLE_US: u64 = 10_000;

/// Whether the name of a file ends as that of a program: `.ld`, `.il`, `.xml` or `.l5x`.
#[must_use]
pub fn is_program_name(file: &str) -> bool {
    Notation::of_file(file).is_some()
}

/// What a file is.
enum FoundNotation {
    Read(Notation),
    /// A notation that is recognised but not read: its name, and what to do.
    Refused(&'static str, &'static str),
}

/// Reads a program in the notation that its file name and its content show.
///
/// # Errors
/// All errors and warnings found, in order of their positions; at least one of them is an error. LD040 names
/// a notation that is not read.
pub fn read_program(file: &str, bytes: &[u8], options: ReadOptions) -> Result<ParsedProgram, Vec<Diagnostic>> {
    let plain = text::strip_line_decorations(bytes);
    let decoded = text::decode_text(&plain);
    let found = match options.notation {
        // LD002 refuses text of two bytes per character.
        _ if text::wide_encoding(bytes).is_some() => FoundNotation::Read(Notation::Ldmicro),
        Some(notation) => FoundNotation::Read(notation),
        None => find_notation(file, &decoded),
    };
    match found {
        FoundNotation::Read(Notation::Ldmicro) => {
            let mut parsed = parse_bytes(file, bytes, ParseOptions { dialect: options.dialect })?;
            parsed.program.settings.cycle_us = options.cycle_us.unwrap_or(parsed.program.settings.cycle_us);
            Ok(parsed)
        }
        FoundNotation::Read(Notation::InstructionList) => {
            let read = il::read(file, &decoded)?;
            resolve(&read.program, read.warnings, options.cycle_us.unwrap_or(IL_CYCLE_US), text::encoding(&plain))
        }
        FoundNotation::Read(Notation::PlcOpen) => {
            let read = plcopen::read(file, &decoded)?;
            let cycle_us = options.cycle_us.or(read.cycle_us).unwrap_or(IL_CYCLE_US);
            resolve(&read.program, Vec::new(), cycle_us, text::encoding(&plain))
        }
        FoundNotation::Read(Notation::OpenPlc) => {
            let (program, noticed) = openplc::read(file, &decoded)?;
            resolve(&program, noticed, options.cycle_us.unwrap_or(IL_CYCLE_US), text::encoding(&plain))
        }
        FoundNotation::Read(Notation::Rockwell) => {
            let program = rockwell::read(file, &decoded)?;
            resolve(&program, Vec::new(), options.cycle_us.unwrap_or(IL_CYCLE_US), text::encoding(&plain))
        }
        FoundNotation::Read(Notation::Grid) => {
            let read = grid::read(file, &decoded)?;
            resolve(
                &grid::to_instruction_list(&read.program),
                read.notes,
                options.cycle_us.unwrap_or(IL_CYCLE_US),
                text::encoding(&plain),
            )
        }
        FoundNotation::Refused(name, hint) => {
            let cause = format!("this is {name}, which is not read");
            Err(vec![Diagnostic::new(Severity::Error, codes::OTHER_NOTATION, file, Pos::new(1, 1, 1), cause, hint)])
        }
    }
}

/// Returns the notation of a text by its file name and content; `None` for one that is not read.
#[must_use]
pub fn notation_of(file: &str, text: &str, options: ReadOptions) -> Option<Notation> {
    options.notation.or_else(|| match find_notation(file, text) {
        FoundNotation::Read(notation) => Some(notation),
        FoundNotation::Refused(..) => None,
    })
}

/// Makes a ladder program of instructions; `noticed` are the warnings of their reader.
fn resolve(
    program: &IlProgram,
    noticed: Vec<Diagnostic>,
    cycle_us: u64,
    encoding: TextEncoding,
) -> Result<ParsedProgram, Vec<Diagnostic>> {
    let il::ResolvedIlProgram { program, mut warnings } = il::to_ladder(program, il::il_settings(cycle_us))?;
    warnings.extend(noticed);
    warnings.sort_by_key(|diagnostic| diagnostic.pos);
    Ok(ParsedProgram { program, warnings, encoding })
}

const WRITE_IL: &str = "write the program in Instruction List (docs/languages/il.md) or draw it in LDmicro";

/// Decides what a file is. The content decides where it is clear, else the extension.
fn find_notation(file: &str, text: &str) -> FoundNotation {
    let has_extension =
        |extension: &str| file.rsplit_once('.').is_some_and(|(_, found)| found.eq_ignore_ascii_case(extension));
    let start = text.trim_start_matches('\u{feff}').trim_start();
    if start.starts_with('<') {
        let head: String = start.chars().take(4_000).collect();
        return if head.contains("RSLogix5000Content") {
            FoundNotation::Read(Notation::Rockwell)
        } else if head.to_ascii_lowercase().contains("plcopen") {
            FoundNotation::Read(Notation::PlcOpen)
        } else {
            FoundNotation::Refused("XML", WRITE_IL)
        };
    }
    if start.starts_with('{') && !il::is_pragma(start) {
        return FoundNotation::Refused("ladder as JSON", WRITE_IL);
    }
    if start.starts_with("LDmicro") {
        return FoundNotation::Read(Notation::Ldmicro);
    }
    if start.lines().next().is_some_and(|line| line.trim().eq_ignore_ascii_case("CSLADDER")) || has_extension("grid") {
        return FoundNotation::Read(Notation::Grid);
    }
    if has_extension("st") {
        return FoundNotation::Refused("Structured Text", WRITE_IL);
    }
    let code = without_comments(start);
    if is_iec_head(code) {
        let has_json = code.lines().any(|line| line.trim() == "{") && code.contains("\"rungs\"");
        return match has_json {
            true => FoundNotation::Read(Notation::OpenPlc),
            false => FoundNotation::Read(Notation::InstructionList),
        };
    }
    if rockwell::is_neutral_text(code) && !has_extension("il") {
        return FoundNotation::Read(Notation::Rockwell);
    }
    let first_line = code.lines().next().unwrap_or_default();
    if has_extension("il") || is_instruction(first_line) {
        return FoundNotation::Read(Notation::InstructionList);
    }
    FoundNotation::Read(Notation::Ldmicro)
}

/// Returns the text behind the comments and pragmas at its beginning.
fn without_comments(text: &str) -> &str {
    let mut rest = text;
    loop {
        rest = rest.trim_start();
        let end = if rest.starts_with("(*") {
            rest.find("*)").map(|end| end + 2)
        } else if il::is_pragma(rest) {
            rest.find('}').map(|end| end + 1)
        } else if rest.starts_with(';') || rest.starts_with("//") {
            Some(rest.find('\n').unwrap_or(rest.len()))
        } else {
            None
        };
        match end.and_then(|end| rest.get(end..)) {
            Some(behind) => rest = behind,
            None => return rest,
        }
    }
}

/// Whether the text begins with a part of IEC 61131-3: PROGRAM with a name, a section of variables, a type, a
/// function, a block.
fn is_iec_head(code: &str) -> bool {
    let mut words = code.lines().next().unwrap_or_default().split_whitespace();
    let first = words.next().unwrap_or_default().to_ascii_uppercase();
    match first.as_str() {
        // LDmicro's line PROGRAM has no name.
        "PROGRAM" => words.next().is_some(),
        "TYPE" | "FUNCTION" | "FUNCTION_BLOCK" | "CONFIGURATION" => true,
        _ => il::IlSection::ALL.iter().any(|(_, keyword)| *keyword == first),
    }
}

/// Whether a line is a label or begins with an operator of Instruction List and an operand.
fn is_instruction(line: &str) -> bool {
    let mut words = line.split_whitespace();
    let first = words.next().unwrap_or_default();
    let is_name = |word: &str| word.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    if let Some((label, _)) = first.split_once(':') {
        return !label.is_empty() && is_name(label) && !first.contains('=');
    }
    words.next().is_some() && il::is_operator(first.trim_end_matches('('))
}
