//! Splits the text into tokens with positions.
//!
//! `;` ends a declaration between VAR and END_VAR. Elsewhere it begins a comment, as `//` does everywhere.

use diag::Pos;

/// Kind of a token.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum IlTokenKind {
    /// Identifier or keyword.
    Word,
    /// `%IX0.3`.
    Address,
    /// Number without prefix.
    Number,
    /// Literal with a prefix: `T#500ms`.
    Typed,
    /// String between quotation marks.
    Text,
    /// Comment or pragma with its delimiters.
    Comment,
    /// A comment or string without its end.
    Open,
    /// Punctuation, or a character that IL does not have.
    Symbol,
    /// End of a line.
    Newline,
    /// End of the file.
    End,
}

/// A token of the text.
#[derive(Debug, Clone, Copy)]
pub(super) struct IlToken<'a> {
    /// Its kind.
    pub kind: IlTokenKind,
    /// Its text as written, with delimiters.
    pub text: &'a str,
    /// Position of its first character; the length is that of its first line.
    pub pos: Pos,
}

impl IlToken<'_> {
    /// Whether the token is this punctuation.
    pub(super) fn is(&self, symbol: &str) -> bool {
        self.kind == IlTokenKind::Symbol && self.text == symbol
    }

    /// Whether the token is this word, in any case.
    pub(super) fn is_word(&self, word: &str) -> bool {
        self.kind == IlTokenKind::Word && self.text.eq_ignore_ascii_case(word)
    }
}

/// Prefixes whose literals contain `:` and `-`.
const DATE_PREFIXES: [&str; 11] =
    ["D", "DATE", "TOD", "TIME_OF_DAY", "DT", "DATE_AND_TIME", "LD", "LDATE", "LTOD", "LDT", "LTIME_OF_DAY"];

/// Returns the tokens of `text`; the last one is the end of the file.
pub(super) fn tokens(text: &str) -> Vec<IlToken<'_>> {
    let mut lexer = IlLexer { rest: text, line: 1, column: 1, in_variables: false, tokens: Vec::new() };
    while !lexer.rest.is_empty() {
        lexer.next_token();
    }
    lexer.push(0, IlTokenKind::End);
    lexer.tokens
}

/// State of splitting one text.
struct IlLexer<'a> {
    /// The text that is not split yet.
    rest: &'a str,
    line: u32,
    column: u32,
    /// Whether the text is between VAR and END_VAR.
    in_variables: bool,
    tokens: Vec<IlToken<'a>>,
}

fn count(chars: usize) -> u32 {
    u32::try_from(chars).unwrap_or(u32::MAX)
}

fn is_name_char(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}

/// Whether a text that begins with `{` begins with a pragma (IEC 61131-3, 2.1.6), not with an object of JSON.
pub(crate) fn is_pragma(text: &str) -> bool {
    let inner = text.strip_prefix('{').map(str::trim_start);
    inner.is_some_and(|inner| !inner.is_empty() && !inner.starts_with(['"', '{', '}', '[']))
}

impl<'a> IlLexer<'a> {
    /// Takes `length` bytes as a token.
    fn push(&mut self, length: usize, kind: IlTokenKind) {
        let (text, _) = self.rest.split_at(length);
        let first = text.lines().next().unwrap_or("");
        let pos = Pos::new(self.line, self.column, count(first.chars().count()).max(1));
        self.tokens.push(IlToken { kind, text, pos });
        self.skip(length);
    }

    fn skip(&mut self, length: usize) {
        let (text, rest) = self.rest.split_at(length);
        self.rest = rest;
        match text.rsplit_once('\n') {
            Some((before, last)) => {
                self.line += 1 + count(before.matches('\n').count());
                self.column = 1 + count(last.chars().count());
            }
            None => self.column += count(text.chars().count()),
        }
    }

    /// Returns the number of bytes up to the end of the line.
    fn line_length(&self) -> usize {
        let length = self.rest.find('\n').unwrap_or(self.rest.len());
        length - usize::from(self.rest[..length].ends_with('\r'))
    }

    fn next_token(&mut self) {
        let Some(first) = self.rest.chars().next() else { return };
        let second = self.rest.chars().nth(1).unwrap_or(' ');
        match first {
            '\n' => self.push(1, IlTokenKind::Newline),
            ' ' | '\t' | '\r' | '\u{feff}' => self.skip(first.len_utf8()),
            '(' if second == '*' => match self.rest[2..].find("*)") {
                Some(length) => self.push(length + 4, IlTokenKind::Comment),
                None => self.push(self.rest.len(), IlTokenKind::Open),
            },
            '{' if is_pragma(self.rest) => match self.rest.find('}') {
                Some(length) => self.push(length + 1, IlTokenKind::Comment),
                None => self.push(self.rest.len(), IlTokenKind::Open),
            },
            '/' if second == '/' => self.push(self.line_length(), IlTokenKind::Comment),
            ';' if !self.in_variables => self.push(self.line_length(), IlTokenKind::Comment),
            '\'' | '"' => self.text(),
            '%' => {
                self.push(1 + self.length_from(1, |c| is_name_char(c) || matches!(c, '.' | '*')), IlTokenKind::Address)
            }
            '+' | '-' if second.is_ascii_digit() => self.number(1),
            _ if first.is_ascii_digit() => self.number(0),
            _ if is_name_char(first) => self.word(),
            ':' | '=' if self.rest.starts_with(":=") || self.rest.starts_with("=>") => {
                self.push(2, IlTokenKind::Symbol);
            }
            _ => self.push(first.len_utf8(), IlTokenKind::Symbol),
        }
    }

    /// Returns the number of bytes of the characters from `start` for which `holds` is true.
    fn length_from(&self, start: usize, holds: impl Fn(char) -> bool) -> usize {
        let rest = &self.rest[start..];
        rest.find(|c| !holds(c)).unwrap_or(rest.len())
    }

    /// Takes a string. `$` escapes the next character (IEC 61131-3, 2.2.2).
    fn text(&mut self) {
        let (length, is_closed) = self.text_length(0);
        self.push(length, if is_closed { IlTokenKind::Text } else { IlTokenKind::Open });
    }

    fn text_length(&self, start: usize) -> (usize, bool) {
        let line = &self.rest[..self.line_length()];
        let quote = line[start..].chars().next();
        let mut is_escaped = false;
        for (at, c) in line.char_indices().filter(|(at, _)| *at > start) {
            if !is_escaped && Some(c) == quote {
                return (at + c.len_utf8(), true);
            }
            is_escaped = !is_escaped && c == '$';
        }
        (line.len(), false)
    }

    fn number(&mut self, start: usize) {
        let length = start + self.value_length(start, true, false);
        self.push(length, IlTokenKind::Number);
    }

    /// Returns the length of the value of a literal: letters, digits, `_`, `#`, a full stop before a digit,
    /// the sign of an exponent, and for dates `-` and `:`.
    fn value_length(&self, start: usize, has_exponent: bool, is_date: bool) -> usize {
        let bytes = &self.rest.as_bytes()[start..];
        let mut has_base = false;
        let mut at = 0;
        while let Some(&byte) = bytes.get(at) {
            let next_is_digit = bytes.get(at + 1).is_some_and(u8::is_ascii_digit);
            let is_after_e = at > 0 && matches!(bytes[at - 1], b'e' | b'E');
            let belongs = match byte {
                b'#' => true,
                b'.' => next_is_digit,
                b'-' | b'+' if is_after_e && has_exponent && !has_base => next_is_digit,
                b'-' | b':' => is_date && next_is_digit,
                _ => is_name_char(char::from(byte)),
            };
            if !belongs {
                break;
            }
            has_base |= byte == b'#';
            at += 1;
        }
        at
    }

    fn word(&mut self) {
        let length = self.length_from(0, is_name_char);
        let word = &self.rest[..length];
        let after = self.rest[length..].chars().next();
        if after == Some('#') {
            let is_date = DATE_PREFIXES.iter().any(|prefix| prefix.eq_ignore_ascii_case(word));
            let is_real = ["REAL", "LREAL"].iter().any(|prefix| prefix.eq_ignore_ascii_case(word));
            let mut end = length + 1;
            if self.rest[end..].starts_with(['\'', '"']) {
                end = self.text_length(end).0;
            } else {
                end += usize::from(self.rest[end..].starts_with(['-', '+']));
                end += self.value_length(end, is_real, is_date);
            }
            return self.push(end, IlTokenKind::Typed);
        }
        let is_first = self.tokens.iter().rev().find(|t| t.kind != IlTokenKind::Comment);
        let is_first = is_first.is_none_or(|t| t.kind == IlTokenKind::Newline || t.is_word("END_VAR"));
        let upper = word.to_ascii_uppercase();
        if upper == "END_VAR" {
            self.in_variables = false;
        } else if is_first && (upper == "VAR" || upper.starts_with("VAR_")) {
            // `VAR_1: LD x` is a label.
            let next = self.rest[length..].trim_start_matches([' ', '\t']);
            self.in_variables |= !next.starts_with(':');
        }
        self.push(length, IlTokenKind::Word);
    }
}
