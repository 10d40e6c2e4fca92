//! Reads the text of Instruction List (IEC 61131-3, 3.2; reference 001). Several errors in one pass.

use diag::{Diagnostic, Pos, Severity};

use super::codes;
use super::lexer::{IlToken, IlTokenKind, tokens};
use super::links;
use super::literals::LiteralRefusal;
use super::model::{IlInstruction, IlName, IlProgram, IlSection};
use super::reserved_words::is_reserved;

/// Greatest depth of parentheses.
pub const MAX_IL_DEPTH: usize = 64;
/// Largest number of lines in the body, and of variables.
pub const MAX_IL_LINES: usize = 20_000;
/// Largest number of errors that are reported.
const MAX_ERRORS: usize = 100;

/// A program and what the reader noticed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ParsedIlProgram {
    /// The program.
    pub program: IlProgram,
    /// Notes and warnings.
    pub warnings: Vec<Diagnostic>,
}

/// Error: the part in work has a fault, which is reported already. The caller skips the rest of the part.
pub(super) struct FaultReported;

/// State of reading one file.
pub(super) struct IlReader<'a> {
    file: &'a str,
    tokens: Vec<IlToken<'a>>,
    at: usize,
    /// Comments inside the part in work.
    passed_comments: Vec<String>,
    diagnostics: Vec<Diagnostic>,
    /// Positions of operators with `(` that wait for `)`.
    pub opened: Vec<Pos>,
    /// What was read so far.
    pub program: IlProgram,
    has_ended: bool,
}

/// Reads a program. `file` is its name in diagnostics.
///
/// # Errors
/// Returns all diagnostics if at least one is an error.
pub fn read(file: &str, text: &str) -> Result<ParsedIlProgram, Vec<Diagnostic>> {
    if text.len() > crate::parse::MAX_BYTES {
        let cause = format!("the file has {} bytes; the limit is {}", text.len(), crate::parse::MAX_BYTES);
        let hint = "split the program";
        return Err(vec![Diagnostic::new(Severity::Error, codes::IL_TOO_LARGE, file, Pos::default(), cause, hint)]);
    }
    if let Some((pos, notation)) = other_notation(text) {
        let (cause, hint) = (format!("this is {notation}"), "give a program in Instruction List");
        return Err(vec![Diagnostic::new(Severity::Error, codes::IL_OTHER_NOTATION, file, pos, cause, hint)]);
    }
    let mut reader = IlReader::of_fragment(file, text);
    reader.read_lines();
    reader.finish()
}

/// Recognises files that are no Instruction List by their first word. Returns its position and the notation.
fn other_notation(text: &str) -> Option<(Pos, &'static str)> {
    let first = tokens(text.lines().find(|line| !line.trim_matches('\u{feff}').trim().is_empty())?)[0];
    let line = text.lines().position(|line| !line.trim_matches('\u{feff}').trim().is_empty())?;
    let notation = match first.text {
        "<" => "XML",
        "{" | "[" => "JSON",
        word if word.starts_with("LDmicro") => "the text of LDmicro",
        _ => return None,
    };
    let line = u32::try_from(line + 1).unwrap_or(u32::MAX);
    Some((Pos { line, ..first.pos }, notation))
}

impl<'a> IlReader<'a> {
    /// Returns the state before the first token of a program or of a part of one.
    pub(super) fn of_fragment(file: &'a str, text: &'a str) -> Self {
        IlReader {
            file,
            tokens: tokens(text),
            at: 0,
            passed_comments: Vec::new(),
            diagnostics: Vec::new(),
            opened: Vec::new(),
            program: IlProgram { file: file.to_owned(), ..IlProgram::default() },
            has_ended: false,
        }
    }

    /// Returns the first error.
    pub(super) fn first_fault(&self) -> Option<Diagnostic> {
        self.diagnostics.iter().find(|fault| fault.is_error()).cloned()
    }

    /// Returns what was read, and what was noticed.
    pub(super) fn into_parts(self) -> (IlProgram, Vec<Diagnostic>) {
        (self.program, self.diagnostics)
    }

    /// Reports an error.
    pub(super) fn error(&mut self, code: &'static str, pos: Pos, cause: impl Into<String>, hint: impl Into<String>) {
        self.diagnostics.push(Diagnostic::new(Severity::Error, code, self.file, pos, cause, hint));
    }

    /// Reports an error and returns [`FaultReported`].
    pub(super) fn skip<T>(
        &mut self,
        code: &'static str,
        pos: Pos,
        cause: impl Into<String>,
        hint: impl Into<String>,
    ) -> Result<T, FaultReported> {
        self.error(code, pos, cause, hint);
        Err(FaultReported)
    }

    /// Reports a literal, an address or a type that is refused.
    pub(super) fn refuse(&mut self, pos: Pos, refusal: LiteralRefusal) {
        self.error(refusal.code, pos, refusal.cause, refusal.hint);
    }

    /// Returns the next token, comments included.
    pub(super) fn raw(&self) -> IlToken<'a> {
        self.tokens[self.at.min(self.tokens.len() - 1)]
    }

    /// Takes the next token. The end of the file stays.
    pub(super) fn advance(&mut self) {
        self.at = (self.at + 1).min(self.tokens.len() - 1);
    }

    /// Returns the next token that is no comment. The comments before it belong to the part in work.
    pub(super) fn peek(&mut self) -> IlToken<'a> {
        while self.raw().kind == IlTokenKind::Comment {
            let lines = comment_lines(self.raw().text);
            self.passed_comments.extend(lines);
            self.advance();
        }
        self.raw()
    }

    /// Returns the next token that is neither a comment nor the end of a line.
    pub(super) fn peek_past_lines(&mut self) -> IlToken<'a> {
        while self.peek().kind == IlTokenKind::Newline {
            self.advance();
        }
        self.raw()
    }

    /// Takes the next token if it is this symbol.
    pub(super) fn take_symbol(&mut self, symbol: &str) -> bool {
        let is_taken = self.peek().is(symbol);
        if is_taken {
            self.advance();
        }
        is_taken
    }

    /// Returns up to `N` tokens after the next one, without comments and ends of lines.
    pub(super) fn look_ahead<const N: usize>(&self) -> [IlToken<'a>; N] {
        let mut seen = self.tokens[self.at..].iter().skip(1);
        let mut next = || seen.find(|t| !matches!(t.kind, IlTokenKind::Comment | IlTokenKind::Newline));
        std::array::from_fn(|_| next().copied().unwrap_or(self.tokens[self.tokens.len() - 1]))
    }

    /// Returns the comments inside the part in work as one line.
    pub(super) fn take_comment(&mut self) -> Option<String> {
        let comments = std::mem::take(&mut self.passed_comments);
        (!comments.is_empty()).then(|| comments.join(" "))
    }

    /// Skips the rest of the line, and of the lines that a `(` joins to it.
    pub(super) fn skip_line(&mut self) {
        let mut depth = 0_usize;
        loop {
            let token = self.peek();
            match token.kind {
                IlTokenKind::End => return,
                IlTokenKind::Newline if depth == 0 => return,
                _ if token.is("(") => depth += usize::from(self.look_ahead::<1>()[0].kind != IlTokenKind::Newline),
                _ if token.is(")") => depth = depth.saturating_sub(1),
                _ => {}
            }
            self.advance();
        }
    }

    /// Takes a name that is no keyword.
    pub(super) fn name(&mut self, what: &str, hint: &str) -> Result<IlName, FaultReported> {
        let token = self.peek();
        if token.kind != IlTokenKind::Word {
            let found = shown(&token);
            return self.skip(codes::IL_OPERAND_MISSING, token.pos, format!("{what} is missing before {found}"), hint);
        }
        self.advance();
        self.check_name(&token)?;
        Ok(IlName { text: token.text.to_owned(), pos: token.pos })
    }

    /// Reports a name that is too long or a keyword.
    pub(super) fn check_name(&mut self, token: &IlToken<'a>) -> Result<(), FaultReported> {
        if token.text.len() > 127 {
            return self.skip(codes::IL_NAME, token.pos, "the name has more than 127 characters", "shorten the name");
        }
        if is_reserved(token.text) {
            let cause = format!("`{}` is a keyword", token.text);
            return self.skip(codes::IL_NAME, token.pos, cause, "choose another name");
        }
        Ok(())
    }

    /// Reads up to the end of the text.
    pub(super) fn read_lines(&mut self) {
        while self.diagnostics.len() < MAX_ERRORS {
            let token = self.raw();
            if self.program.instructions.len() > MAX_IL_LINES || self.program.variables.len() > MAX_IL_LINES {
                let cause = format!("the program has more than {MAX_IL_LINES} lines");
                self.error(codes::IL_TOO_LARGE, token.pos, cause, "split the program");
                return;
            }
            match token.kind {
                IlTokenKind::End => return self.check_end(token.pos),
                IlTokenKind::Newline => self.advance(),
                IlTokenKind::Comment => {
                    self.advance();
                    let lines = comment_lines(token.text).into_iter().map(comment_line);
                    self.program.instructions.extend(lines);
                }
                IlTokenKind::Open => {
                    let cause = match token.text.as_bytes().first() {
                        Some(b'(') => "the comment has no end",
                        Some(b'{') => "the pragma has no end",
                        _ => "the string has no end",
                    };
                    self.error(codes::IL_OPEN, token.pos, cause, "add the end");
                    self.advance();
                }
                _ if token.is("{") && self.look_ahead::<1>()[0].kind == IlTokenKind::Text => {
                    self.diagnostics.clear();
                    let hint = "give a program in Instruction List";
                    return self.error(codes::IL_OTHER_NOTATION, token.pos, "this is JSON", hint);
                }
                _ if self.is_structured_text() => return self.refuse_structured_text(token.pos),
                _ => self.read_line(token),
            }
            if self.diagnostics.iter().any(|d| d.code == codes::IL_STRUCTURED_TEXT) {
                return;
            }
        }
        self.error(codes::IL_TOO_MANY_ERRORS, Pos::default(), "further errors are not shown", "correct these first");
    }

    fn refuse_structured_text(&mut self, pos: Pos) {
        self.diagnostics.clear();
        let hint = "give a program in Instruction List";
        self.error(codes::IL_STRUCTURED_TEXT, pos, "this is Structured Text", hint);
    }

    fn is_structured_text(&self) -> bool {
        let token = self.raw();
        let [first, second, third] = self.look_ahead();
        let statements = ["IF", "CASE", "FOR", "WHILE", "REPEAT"];
        token.kind == IlTokenKind::Word
            && (first.is(":=")
                || first.is(".") && second.kind == IlTokenKind::Word && third.is(":=")
                || statements.iter().any(|word| token.is_word(word)) && !first.is(":"))
    }

    fn read_line(&mut self, token: IlToken<'a>) {
        let is_label = self.look_ahead::<1>()[0].is(":");
        let upper = token.text.to_ascii_uppercase();
        if self.has_ended {
            let hint = "end the file after END_PROGRAM";
            self.error(codes::IL_CHARACTER, token.pos, format!("{} after END_PROGRAM", shown(&token)), hint);
            return self.skip_line();
        }
        if token.kind == IlTokenKind::Word && !is_label {
            if let Some((section, _)) = IlSection::ALL.iter().find(|(_, keyword)| *keyword == upper) {
                self.move_remarks();
                self.advance();
                return self.read_section(*section, token.pos);
            }
            match upper.as_str() {
                "PROGRAM" => return self.read_program_head(token.pos),
                "END_PROGRAM" if self.program.name.is_some() => {
                    self.has_ended = true;
                    return self.advance();
                }
                "END_PROGRAM" | "END_VAR" => {
                    let hint = "remove the line";
                    let cause = format!("`{}` ends nothing", token.text);
                    self.error(codes::IL_DECLARATION, token.pos, cause, hint);
                    return self.advance();
                }
                "FUNCTION" | "FUNCTION_BLOCK" | "TYPE" | "CONFIGURATION" | "RESOURCE" | "VAR_EXTERNAL"
                | "VAR_ACCESS" | "VAR_CONFIG" => return self.skip_unread_part(&upper, token.pos),
                _ => {}
            }
        }
        self.read_instruction();
    }

    /// Moves the comments before the first instruction to the remarks before the declarations.
    fn move_remarks(&mut self) {
        let lines = &mut self.program.instructions;
        if lines.iter().all(|line| line.operation.is_none() && line.label.is_none()) {
            self.program.remarks.extend(lines.drain(..).filter_map(|line| line.comment));
        }
    }

    fn read_program_head(&mut self, pos: Pos) {
        self.advance();
        self.move_remarks();
        if self.program.name.is_some() {
            self.error(codes::IL_NOT_READ, pos, "a second PROGRAM is not read", "put each program in its own file");
        }
        if let Ok(name) = self.name("the name of the program", "write PROGRAM and a name") {
            self.program.name = Some(name);
        }
    }

    fn skip_unread_part(&mut self, word: &str, pos: Pos) {
        let hint = "give one PROGRAM with standard functions and blocks";
        self.error(codes::IL_NOT_READ, pos, format!("{word} is not read"), hint);
        let end = if word.starts_with("VAR") { "END_VAR".to_owned() } else { format!("END_{word}") };
        let (mut depth, mut in_variables, mut is_line_start) = (0_usize, word.starts_with("VAR"), false);
        while self.raw().kind != IlTokenKind::End && !self.raw().is_word(&end) {
            let token = self.raw();
            if is_line_start && depth == 0 && !in_variables && word.starts_with("FUNCTION") && self.is_structured_text()
            {
                return self.refuse_structured_text(token.pos);
            }
            depth = (depth + usize::from(token.is("("))).saturating_sub(usize::from(token.is(")")));
            if is_line_start && IlSection::ALL.iter().any(|(_, keyword)| token.is_word(keyword)) {
                in_variables = true;
            }
            in_variables &= !token.is_word("END_VAR");
            is_line_start = token.kind == IlTokenKind::Newline;
            self.advance();
        }
        self.advance();
    }

    fn check_end(&mut self, pos: Pos) {
        if self.program.name.is_some() && !self.has_ended {
            self.error(codes::IL_DECLARATION, pos, "END_PROGRAM is missing", "add END_PROGRAM at the end");
        }
        for opened in std::mem::take(&mut self.opened) {
            let hint = "add a line with `)`";
            self.error(codes::IL_UNCLOSED, opened, "the parenthesis of this operator is not closed", hint);
        }
    }

    fn finish(mut self) -> Result<ParsedIlProgram, Vec<Diagnostic>> {
        if self.program.name.is_none() && self.program.variables.is_empty() {
            let remarks = std::mem::take(&mut self.program.remarks);
            self.program.instructions.splice(0..0, remarks.into_iter().map(comment_line));
        }
        let stops =
            [codes::IL_STRUCTURED_TEXT, codes::IL_OTHER_NOTATION, codes::IL_TOO_MANY_ERRORS, codes::IL_TOO_LARGE];
        if !self.diagnostics.iter().any(|d| stops.contains(&d.code)) {
            let room = MAX_ERRORS.saturating_sub(self.diagnostics.len());
            let faults = links::check_links(&self.program);
            self.diagnostics.extend(faults.into_iter().take(room));
        }
        self.diagnostics.sort_by_key(|d| (d.code == codes::IL_TOO_MANY_ERRORS, d.pos));
        if self.diagnostics.iter().any(Diagnostic::is_error) {
            return Err(self.diagnostics);
        }
        Ok(ParsedIlProgram { program: self.program, warnings: self.diagnostics })
    }
}

/// Formats a token for a message.
pub(super) fn shown(token: &IlToken<'_>) -> String {
    match token.kind {
        IlTokenKind::End => "the end of the file".to_owned(),
        IlTokenKind::Newline => "the end of the line".to_owned(),
        _ => format!("`{}`", token.text.lines().next().unwrap_or("").chars().take(40).collect::<String>()),
    }
}

fn comment_line(comment: String) -> IlInstruction {
    IlInstruction { comment: Some(comment), ..IlInstruction::default() }
}

/// Returns the lines of a comment without its delimiters and without empty lines.
pub(super) fn comment_lines(text: &str) -> Vec<String> {
    let inner = match text.strip_prefix("(*") {
        Some(inner) => inner.strip_suffix("*)").unwrap_or(inner),
        None => text.strip_prefix("//").or_else(|| text.strip_prefix(';')).unwrap_or(text),
    };
    let lines = inner.split('\n').map(|line| line.trim().replace("*)", "* )"));
    lines.filter(|line| !line.is_empty()).collect()
}
