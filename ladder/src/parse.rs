//! Reader of `.ld` text: reports every syntax error that it can find and leaves semantic errors to `check`.

use diag::text::{self, TextEncoding};
use diag::{Diagnostic, Pos, Severity, nearest};

use crate::codes;
use crate::dialect_marks::MarkPlace;
use crate::element_reader::read_element;
use crate::lexer::{self, LdLine};
use crate::list_lines;
use crate::model::{LadderDialect, LadderProgram, LdFormat, Rung, RungNode, SourceStyle};
use crate::program_head::{self, ProgramHead};
use crate::reader::{LdReader, message_text};
use crate::write::write;

/// Maximum size of a file in bytes.
pub const MAX_BYTES: usize = 4 << 20;
/// Maximum number of rungs of a program.
pub const MAX_RUNGS: usize = 2_000;
/// Maximum number of elements of a program.
pub const MAX_ELEMENTS: usize = 20_000;
/// Maximum nesting depth of groups (PARALLEL and SERIES).
pub const MAX_DEPTH: usize = 64;

/// Options for reading a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ParseOptions {
    /// Dialect that overrides the default of the header.
    pub dialect: Option<LadderDialect>,
}

/// A program that was read, with its warnings and notes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ParsedProgram {
    /// The program.
    pub program: LadderProgram,
    /// Warnings and notes, in order of their positions; never errors.
    pub warnings: Vec<Diagnostic>,
    /// Character encoding of the file, for [`crate::write_bytes`].
    pub encoding: TextEncoding,
}

/// Reads a program; its header selects the dialect. `file` is the name used in messages.
///
/// # Errors
/// All errors and warnings found, in order of their positions; at least one of them is an error.
pub fn parse(file: &str, text: &str) -> Result<ParsedProgram, Vec<Diagnostic>> {
    parse_with(file, text, ParseOptions::default())
}

/// Reads a program from bytes in UTF-8 or in any 8-bit code page.
///
/// In a code page, comments keep their bytes and are decoded as code page 1252 ([`diag::text`]).
///
/// # Errors
/// As for [`parse`], and LD002 if the file uses two bytes per character.
pub fn parse_bytes(file: &str, bytes: &[u8], options: ParseOptions) -> Result<ParsedProgram, Vec<Diagnostic>> {
    if let Some(name) = text::wide_encoding(bytes) {
        let mut reader = LdReader::new(file);
        let hint = "save it as UTF-8 or in the code page of your system";
        reader.error(codes::BINARY, Pos::default(), format!("the file is written in {name}"), hint);
        return Err(reader.finish());
    }
    let plain = text::strip_line_decorations(bytes);
    let decoded = text::decode_text(&plain);
    parse_text(
        file,
        &text::to_display_text(&decoded),
        text::encoding(&plain),
        bytes.starts_with(text::BYTE_ORDER_MARK),
        options,
    )
}

/// Reads a program with options.
///
/// # Errors
/// As [`parse`].
pub fn parse_with(file: &str, text: &str, options: ParseOptions) -> Result<ParsedProgram, Vec<Diagnostic>> {
    let bare = text.strip_prefix('\u{feff}');
    parse_text(file, bare.unwrap_or(text), TextEncoding::Utf8, bare.is_some(), options)
}

/// Reads a text from which a byte order mark was removed if `marked` is true.
fn parse_text(
    file: &str,
    text: &str,
    encoding: TextEncoding,
    marked: bool,
    options: ParseOptions,
) -> Result<ParsedProgram, Vec<Diagnostic>> {
    if options.dialect.is_none()
        && let Some(parsed) = parse_as_ldmicro5(file, text, encoding, marked)
    {
        return Ok(parsed);
    }
    let mut reader = LdReader::new(file);
    let text = cut_at_end_mark(&mut reader, text);
    if marked {
        let (cause, hint) =
            ("the file begins with a byte order mark", "save it without the mark, which LDmicro does not read");
        reader.report(Severity::Note, codes::BOM, Pos::new(1, 1, 1), cause, hint);
    }
    let program = read_program(&mut reader, text, options);
    let diagnostics = reader.finish();
    match program {
        Some(program) if !diagnostics.iter().any(Diagnostic::is_error) => {
            let mut warnings = diagnostics;
            warnings.extend(rewritten_note(&program, text));
            warnings.sort_by_key(|d| d.pos);
            Ok(ParsedProgram { program, warnings, encoding })
        }
        _ => Err(diagnostics),
    }
}

/// The text before a ^Z, which ends a text file for LDmicro.
fn cut_at_end_mark<'t>(reader: &mut LdReader<'_>, text: &'t str) -> &'t str {
    let Some((kept, _)) = text.split_once('\x1A') else { return text };
    let cause = "the file ends at this ^Z, as LDmicro reads it";
    reader.report(Severity::Note, codes::BINARY, end_position(kept), cause, "remove ^Z and what follows it");
    kept
}

/// A program under the header of release 2.3 that only LDmicro 5 can have written. `None` for all other
/// programs.
fn parse_as_ldmicro5(file: &str, text: &str, encoding: TextEncoding, marked: bool) -> Option<ParsedProgram> {
    lexer::split_lines(text).next().filter(|line| read_header(line.text) == Some((LdFormat::V01, None)))?;
    let newer = ParseOptions { dialect: Some(LadderDialect::Ldmicro5) };
    let mut parsed = parse_text(file, text, encoding, marked, newer).ok()?;
    let mark = parsed.program.ldmicro5_mark()?;
    let pos = match mark.place {
        MarkPlace::At(pos) => pos,
        MarkPlace::HeadLine(begin) => {
            lexer::split_lines(text).find(|line| line.text.starts_with(begin)).map_or(Pos::default(), |line| line.pos)
        }
    };
    let cause = format!("{}, so the program has its meanings", mark.what);
    let hint = "--dialect ldmicro-5 says the same, --dialect ldmicro-2.3 reads it as release 2.3";
    let note = Diagnostic::new(Severity::Note, codes::TAKEN_AS_LDMICRO5, file, pos, cause, hint);
    parsed.warnings.push(note);
    parsed.warnings.sort_by_key(|d| d.pos);
    Some(parsed)
}

fn read_program(reader: &mut LdReader<'_>, text: &str, options: ParseOptions) -> Option<LadderProgram> {
    check_text(reader, text)?;
    let mut lines = lexer::split_lines(text);
    let Some(first) = lines.next() else {
        reader.error(codes::EMPTY, Pos::default(), "the file is empty", "a program begins with LDmicro0.1");
        return None;
    };
    let (format, header) = match (read_header(first.text), first.text) {
        (Some((format, header)), _) => {
            if let Some(version) = header.filter(|version| !version.is_empty()) {
                let cause = format!("the header LDmicro{} is read as LDmicro0.2", message_text(version));
                let hint = "write LDmicro0.2, or LDmicro0.1 for a program of release 2.3";
                reader.report(Severity::Note, codes::NO_HEADER, first.pos, cause, hint);
            }
            (format, header.map(str::to_owned))
        }
        (None, other) => {
            let cause = format!("the file must begin with LDmicro0.1 or LDmicro0.2, found `{}`", message_text(other));
            reader.error(
                codes::NO_HEADER,
                first.pos,
                cause,
                "put LDmicro0.2 in the first line for a program of LDmicro 5, LDmicro0.1 for one of release 2.3",
            );
            // Continue only if the first line could belong to a .ld file; other text would produce useless
            // errors.
            if !other.contains('=') && other != "IO LIST" {
                return None;
            }
            (LdFormat::V01, None)
        }
    };
    let default = match format {
        LdFormat::V01 => LadderDialect::Ldmicro23,
        LdFormat::V02 => LadderDialect::Ldmicro5,
    };
    reader.dialect = options.dialect.unwrap_or(default);
    // If the header is missing, the first line belongs to the settings.
    let kept = (!first.text.starts_with("LDmicro")).then_some(first);
    let mut lines = kept.into_iter().chain(lines);
    let mut parts = ProgramHead::default();
    if !program_head::read_head(reader, &mut lines, &mut parts) {
        return None;
    }
    if reader.dialect == LadderDialect::Ldmicro5 {
        list_lines::note_refused_var_lines(reader, text);
    }
    let (rungs, rung_numbers) = read_rungs(reader, &mut lines);
    let style = SourceStyle { header, rung_numbers, crlf: text.contains("\r\n") };
    Some(parts.into_program(reader.file, format, reader.dialect, style, rungs))
}

/// The format that a header selects, and the text after `LDmicro` if it is neither 0.1 nor 0.2. LDmicro 5
/// reads every text but 0.1 as 0.2.
fn read_header(line: &str) -> Option<(LdFormat, Option<&str>)> {
    match line.strip_prefix("LDmicro")?.split_whitespace().next().unwrap_or("") {
        "0.1" => Some((LdFormat::V01, None)),
        "0.2" => Some((LdFormat::V02, None)),
        other => Some((LdFormat::V02, Some(other))),
    }
}

/// Refuses a text that is too long or contains control characters.
///
/// Control characters above ASCII are accepted: they are bytes that code page 1252 leaves undefined.
fn check_text(reader: &mut LdReader<'_>, text: &str) -> Option<()> {
    if text.len() > MAX_BYTES {
        let cause = format!("the file has {} bytes, at most {MAX_BYTES} are read", text.len());
        reader.error(codes::TOO_LARGE, Pos::default(), cause, "give a .ld file");
    } else if let Some((at, bad)) =
        text.char_indices().find(|(_, c)| c.is_ascii_control() && !matches!(c, '\t' | '\n' | '\r'))
    {
        let cause = format!("control character U+{:04X}: this is not text", bad as u32);
        reader.error(codes::BINARY, end_position(text.get(..at).unwrap_or("")), cause, "give a .ld file");
    } else {
        return Some(());
    }
    None
}

/// Position just after the end of a text.
fn end_position(text: &str) -> Pos {
    let line = text.matches('\n').count() as u32 + 1;
    let column = text.rsplit('\n').next().map_or(0, |l| l.chars().count()) as u32 + 1;
    Pos::new(line, column, 1)
}

/// Kind of a group of lines that ends with END.
#[derive(Clone, Copy, PartialEq, Eq)]
enum GroupKind {
    Rung,
    Parallel,
    Series,
}

impl GroupKind {
    const fn name(self) -> &'static str {
        match self {
            GroupKind::Rung => "RUNG",
            GroupKind::Parallel => "PARALLEL",
            GroupKind::Series => "SERIES",
        }
    }
}

/// A group whose END has not been read yet.
struct OpenGroup {
    kind: GroupKind,
    pos: Pos,
    /// Nodes of a rung or of a series; empty for PARALLEL, which collects `branches`.
    nodes: Vec<RungNode>,
    /// Completed branches of PARALLEL.
    branches: Vec<Vec<RungNode>>,
    /// True if a part of it was refused, so that an empty group is no second error.
    has_refused_part: bool,
}

/// Reads all rungs; returns true with them if the first has a number. Open groups are kept in a list instead
/// of on the call stack, so deep nesting cannot overflow the stack.
fn read_rungs<'a>(reader: &mut LdReader<'_>, lines: &mut impl Iterator<Item = LdLine<'a>>) -> (Vec<Rung>, bool) {
    let (mut rungs, mut numbered) = (Vec::new(), None);
    let mut open: Vec<OpenGroup> = Vec::new();
    let mut elements = 0;
    for line in lines {
        if reader.has_too_many_errors() {
            break;
        }
        // LDmicro 5 looks for the word in a line that is in no rung.
        let loose = reader.dialect == LadderDialect::Ldmicro5 && open.is_empty() && line.text.contains("RUNG");
        match line.keyword() {
            _ if loose && line.keyword() != "RUNG" => {
                let cause = format!("`{}` begins a rung in LDmicro 5", message_text(line.text));
                reader.report(Severity::Note, codes::OUTSIDE_RUNG, line.pos, cause, "write RUNG");
                numbered.get_or_insert(false);
                open.push(open_group(GroupKind::Rung, line.pos));
            }
            "RUNG" => {
                report_unclosed_groups(reader, &mut open);
                if rungs.len() == MAX_RUNGS {
                    let cause = format!("more than {MAX_RUNGS} rungs");
                    reader.error(codes::TOO_LARGE, line.pos, cause, "split the program");
                    return (rungs, false);
                }
                let has_number = read_rung_number(reader, &line);
                numbered.get_or_insert(has_number);
                open.push(open_group(GroupKind::Rung, line.pos));
            }
            "PARALLEL" | "SERIES" if !open.is_empty() => {
                refuse_extra_words(reader, &line, 1);
                let kind = if line.keyword() == "SERIES" { GroupKind::Series } else { GroupKind::Parallel };
                check_nesting(reader, &open, kind, line.pos);
                open.push(open_group(kind, line.pos));
            }
            "END" => {
                refuse_extra_words(reader, &line, 1);
                match open.pop() {
                    Some(group) => close_group(reader, group, &mut open, &mut rungs),
                    None => reader.error(codes::STRAY_END, line.pos, "END closes nothing", "remove it"),
                }
            }
            _ => match open.last_mut() {
                None => {
                    let cause = format!("`{}` is outside a rung", message_text(line.keyword()));
                    let hint = match nearest(line.keyword(), ["RUNG"].into_iter()) {
                        Some(near) => format!("did you mean {near}?"),
                        None => "put it between RUNG and END".to_owned(),
                    };
                    reader.error(codes::OUTSIDE_RUNG, line.pos, cause, hint);
                }
                Some(group) => {
                    elements += 1;
                    if elements > MAX_ELEMENTS {
                        let cause = format!("more than {MAX_ELEMENTS} elements");
                        reader.error(codes::TOO_LARGE, line.pos, cause, "split the program");
                        return (rungs, false);
                    }
                    match read_element(reader, &line) {
                        Some(element) => add_node(group, RungNode::Leaf(element, line.pos)),
                        None => group.has_refused_part = true,
                    }
                }
            },
        }
    }
    if !reader.has_too_many_errors() {
        report_unclosed_groups(reader, &mut open);
    }
    (rungs, numbered.unwrap_or_default())
}

/// Reads the words after RUNG; returns true if the first is a number, which only repeats the order of the
/// rungs.
fn read_rung_number(reader: &mut LdReader<'_>, line: &LdLine<'_>) -> bool {
    let has_number = line.tokens.get(1).is_some_and(|word| word.text.chars().all(|c| c.is_ascii_digit()));
    let words = 1 + usize::from(has_number);
    match line.tokens.get(words) {
        Some(extra) if reader.dialect == LadderDialect::Ldmicro5 => {
            let cause = format!("`{}` follows RUNG and has no effect", message_text(extra.text));
            reader.report(Severity::Note, codes::TOO_MANY, extra.pos, cause, "write COMMENT for a remark");
        }
        _ => refuse_extra_words(reader, line, words),
    }
    has_number
}

const fn open_group(kind: GroupKind, pos: Pos) -> OpenGroup {
    OpenGroup { kind, pos, nodes: Vec::new(), branches: Vec::new(), has_refused_part: false }
}

fn add_node(group: &mut OpenGroup, node: RungNode) {
    match group.kind {
        GroupKind::Parallel => group.branches.push(vec![node]),
        GroupKind::Rung | GroupKind::Series => group.nodes.push(node),
    }
}

/// Reports a group at a place where it is not allowed. Reading continues in it, to find more errors.
fn check_nesting(reader: &mut LdReader<'_>, open: &[OpenGroup], kind: GroupKind, pos: Pos) {
    let parent = open.last().map_or(GroupKind::Rung, |o| o.kind);
    // The rung itself is in `open` but is no group, so `open.len()` counts the groups including the new one.
    if open.len() == MAX_DEPTH + 1 {
        let cause = format!("more than {MAX_DEPTH} groups lie in each other");
        reader.error(codes::TOO_DEEP, pos, cause, "split the rung, with relays between the parts");
    }
    if kind == GroupKind::Series && parent != GroupKind::Parallel {
        let cause = format!("SERIES is in {}, it may only be in PARALLEL", parent.name());
        let is_accepted = reader.dialect == LadderDialect::Ldmicro5;
        let severity = if is_accepted { Severity::Note } else { Severity::Error };
        let hint = "remove SERIES and its END: the elements are in series already";
        reader.report(severity, codes::NESTING, pos, cause, hint);
    }
    if kind == GroupKind::Parallel && parent == GroupKind::Parallel {
        let cause = "PARALLEL is directly in PARALLEL";
        reader.error(codes::NESTING, pos, cause, "put it into a SERIES of its own, or join the two");
    }
}

fn refuse_extra_words(reader: &mut LdReader<'_>, line: &LdLine<'_>, words: usize) {
    if let Some(extra) = line.tokens.get(words) {
        let cause = format!("`{}` follows {}", message_text(extra.text), line.keyword());
        reader.error(codes::TOO_MANY, extra.pos, cause, format!("put {} alone in its line", line.keyword()));
    }
}

fn close_group(reader: &mut LdReader<'_>, group: OpenGroup, open: &mut [OpenGroup], rungs: &mut Vec<Rung>) {
    let OpenGroup { kind, pos, nodes, branches, has_refused_part: broken } = group;
    if nodes.is_empty() && branches.is_empty() && !broken {
        let cause = format!("{} holds nothing", kind.name());
        let is_accepted = kind == GroupKind::Rung && reader.dialect == LadderDialect::Ldmicro5;
        let severity = if is_accepted { Severity::Note } else { Severity::Error };
        let hint = "write SHORT for a plain wire or OPEN for a cut one";
        reader.report(severity, codes::EMPTY_GROUP, pos, cause, hint);
    }
    // Groups deeper than the limit are not built, because dropping such a tree would recurse as deeply.
    let too_deep = open.len() > MAX_DEPTH;
    match (kind, open.last_mut()) {
        (GroupKind::Rung, _) => rungs.push(Rung { series: nodes, pos }),
        (_, Some(parent)) if too_deep || broken || (nodes.is_empty() && branches.is_empty()) => {
            parent.has_refused_part = true
        }
        (GroupKind::Parallel, Some(parent)) => add_node(parent, RungNode::Parallel(branches, pos)),
        (GroupKind::Series, Some(parent)) if parent.kind == GroupKind::Parallel => parent.branches.push(nodes),
        // SERIES outside of PARALLEL was reported above; its elements are in series with those around it.
        (GroupKind::Series, Some(parent)) => parent.nodes.extend(nodes),
        (_, None) => {}
    }
}

fn report_unclosed_groups(reader: &mut LdReader<'_>, open: &mut Vec<OpenGroup>) {
    for group in open.drain(..) {
        let cause = format!("{} is not closed", group.kind.name());
        reader.error(codes::UNCLOSED, group.pos, cause, "put END after its last line");
    }
}

/// Returns a note if the writer would spell a line differently from the file.
fn rewritten_note(program: &LadderProgram, text: &str) -> Option<Diagnostic> {
    let written = write(program);
    let mut after = lexer::split_lines(&written);
    for line in lexer::split_lines(text) {
        let new = after.next();
        let same = |new: &LdLine<'_>| {
            let bare = |l: &LdLine<'_>| l.text.split_whitespace().collect::<String>();
            bare(new) == bare(&line)
        };
        if !new.as_ref().is_some_and(same) {
            let now = new.map_or(String::new(), |l| message_text(l.text));
            let cause = format!(
                "written back, the file differs from here on: `{now}` instead of `{}`",
                message_text(line.text)
            );
            let hint = "nothing of its meaning changes";
            return Some(Diagnostic::new(Severity::Note, codes::REWRITTEN, &program.file, line.pos, cause, hint));
        }
    }
    after.next().map(|line| {
        let cause = format!("written back, the file gets one more line: `{}`", message_text(line.text));
        let hint = "nothing of its meaning changes";
        Diagnostic::new(Severity::Note, codes::REWRITTEN, &program.file, Pos::default(), cause, hint)
    })
}
