//! Source text: lines, the origin of their characters, and splitting them into pieces.

use std::ops::Range;
use std::rc::Rc;

use crate::dialect::AsmDialect;

/// The character for a backslash that begins no escape, from the private-use range that [`diag::text`] does
/// not use.
pub(crate) const BACKSLASH: char = '\u{EF5C}';

/// A line to read: of a file, or of a macro with its arguments substituted.
#[derive(Debug, Clone)]
pub(crate) struct AsmLine {
    /// The text.
    pub text: Rc<str>,
    /// Number of its file in the list of texts.
    pub file: u32,
    /// Its line in the file, from 1.
    pub number: u32,
    /// The origin of its pieces in the file, if the text was changed.
    pub map: Option<Rc<ColumnMap>>,
}

/// The origin of the pieces of a changed text: start in the new text, start in the old text, and whether the
/// piece was copied (otherwise substituted).
#[derive(Debug, Clone, Default)]
pub(crate) struct ColumnMap(Vec<(usize, usize, bool)>);

impl ColumnMap {
    /// Records that the piece at `new` came from `old`; character by character if it was copied.
    pub fn piece(&mut self, new: usize, old: usize, copied: bool) {
        self.0.push((new, old, copied));
    }

    /// Returns the old position of the byte at `at` of the new text.
    pub fn old(&self, at: usize) -> usize {
        let end = self.0.partition_point(|piece| piece.0 <= at);
        match end.checked_sub(1).and_then(|i| self.0.get(i)) {
            Some(&(new, old, true)) => old + (at - new),
            Some(&(_, old, false)) => old,
            None => at,
        }
    }

    /// Returns the map of this change applied after `first`.
    pub fn after(&self, first: &ColumnMap) -> ColumnMap {
        ColumnMap(self.0.iter().map(|&(new, old, copied)| (new, first.old(old), copied)).collect())
    }
}

/// A text with replaced pieces, and their origin.
#[derive(Debug, Default)]
pub(crate) struct RewrittenText {
    /// The new text.
    pub text: String,
    /// The origin of its pieces.
    pub map: ColumnMap,
}

impl RewrittenText {
    /// Copies a piece of the old text.
    pub fn copy(&mut self, old: &str, range: Range<usize>) {
        self.map.piece(self.text.len(), range.start, true);
        self.text.push_str(old.get(range).unwrap_or_default());
    }

    /// Appends a replacement for the text at `old`.
    pub fn put(&mut self, text: &str, old: usize) {
        self.map.piece(self.text.len(), old, false);
        self.text.push_str(text);
    }

    /// Returns the line with this text instead of its own.
    pub fn into_line(self, line: &AsmLine) -> AsmLine {
        let map = match &line.map {
            Some(first) => self.map.after(first),
            None => self.map,
        };
        AsmLine { text: self.text.into(), map: Some(map.into()), ..line.clone() }
    }
}

/// Returns the range of `text[range]` without surrounding white space.
pub(crate) fn trim(text: &str, range: Range<usize>) -> Range<usize> {
    let piece = text.get(range.clone()).unwrap_or_default();
    let start = range.start + (piece.len() - piece.trim_start().len());
    start..start + piece.trim().len()
}

/// Returns the byte at a position; 0 after the end.
pub(crate) fn byte(text: &str, at: usize) -> u8 {
    text.as_bytes().get(at).copied().unwrap_or(0)
}

/// Returns the position after the quoted text that begins at `at`; `None` if the line ends first.
///
/// A backslash escapes the next character, and a doubled single quote is one quote. A single quote may also
/// close after one character, or not at all.
pub(crate) fn behind_quote(text: &str, at: usize) -> Option<usize> {
    let quote = byte(text, at);
    let mut i = at + 1;
    while i < text.len() {
        match byte(text, i) {
            b'\\' => i += 1,
            b'\'' if quote == b'\'' && byte(text, i + 1) == quote => i += 1,
            c if c == quote => return Some(i + 1),
            _ => {}
        }
        i += 1;
    }
    None
}

/// Returns the position after the unit at `at` that must not be split: a quoted text, or one character.
pub(crate) fn step(d: &AsmDialect, text: &str, at: usize) -> usize {
    match byte(text, at) {
        b'"' => behind_quote(text, at).unwrap_or(text.len()),
        b'\'' => behind_char(d, text, at),
        c if c < 0x80 => at + 1,
        _ => at + text.get(at..).and_then(|rest| rest.chars().next()).map_or(1, char::len_utf8),
    }
}

/// Returns the position after a single quote and its text: `'c'`, `'\n'`, `'c` at the end, or a longer text
/// in single quotes. `'c` before a comma is one character, unless the dialect takes `'c, d'` as a text.
fn behind_char(d: &AsmDialect, text: &str, at: usize) -> usize {
    let alone = at + 1 + width(text, at + 1);
    match byte(text, alone) {
        b',' if d.hooks.commas_in_quotes => match behind_quote(text, at) {
            // `'a, 'b` has two characters.
            Some(end) if !begins_name(byte(text, end)) => end,
            _ => alone,
        },
        b',' => alone,
        b'\'' if byte(text, alone + 1) != b'\'' => alone + 1,
        _ => behind_quote(text, at).unwrap_or(alone),
    }
}

/// Returns the bytes of the character at `at`, counting an escape as one; 0 after the end.
pub(crate) fn width(text: &str, at: usize) -> usize {
    let mut chars = text.get(at..).unwrap_or_default().chars();
    match (chars.next(), chars.next()) {
        (Some('\\'), Some(next)) => 1 + next.len_utf8(),
        (Some(c), _) => c.len_utf8(),
        (None, _) => 0,
    }
}

/// Returns the pieces of `text[range]` between top-level commas, without surrounding white space; none if it
/// is blank.
pub(crate) fn cut(d: &AsmDialect, text: &str, range: Range<usize>) -> Vec<Range<usize>> {
    let mut pieces = Vec::new();
    if trim(text, range.clone()).is_empty() {
        return pieces;
    }
    let (mut start, mut at, mut depth) = (range.start, range.start, 0u32);
    while at < range.end {
        match byte(text, at) {
            b',' if depth == 0 => {
                pieces.push(piece(text, start..at));
                start = at + 1;
            }
            b'(' | b'[' | b'{' => depth += 1,
            b')' | b']' | b'}' => depth = depth.saturating_sub(1),
            _ => {}
        }
        at = step(d, text, at);
    }
    pieces.push(piece(text, start..range.end));
    pieces
}

/// Returns a piece without surrounding white space, but keeps a space after an unclosed quote.
pub(crate) fn piece(text: &str, range: Range<usize>) -> Range<usize> {
    let piece = trim(text, range.clone());
    if piece.len() == 1 && byte(text, piece.start) == b'\'' {
        piece.start..(piece.end + 1).min(range.end)
    } else {
        piece
    }
}

/// Reports whether an identifier may begin with this character; directives begin with a dot.
pub(crate) fn begins_name(c: u8) -> bool {
    c.is_ascii_alphabetic() || matches!(c, b'_' | b'.' | b'?') || c >= 0x80
}

/// Returns the position after the identifier at `at`, or `at` if none begins there. With `dots` it may
/// contain dots.
pub(crate) fn behind_name(text: &str, at: usize, dots: bool) -> usize {
    if !begins_name(byte(text, at)) {
        return at;
    }
    let mut end = at + 1;
    while end < text.len() {
        let c = byte(text, end);
        let inside = c.is_ascii_alphanumeric() || matches!(c, b'_' | b'?' | b'$') || c >= 0x80 || (dots && c == b'.');
        if !inside {
            break;
        }
        end += 1;
    }
    end
}

/// Returns the position of the first character from `at` on that is not white space.
pub(crate) fn skip_space(text: &str, at: usize) -> usize {
    let rest = text.get(at..).unwrap_or_default();
    at + (rest.len() - rest.trim_start().len())
}
