//! Splits `.ld` text into lines and tokens, and parses numbers and names.

use diag::Pos;

/// A word of a line, with its position.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LdToken<'a> {
    pub text: &'a str,
    /// Byte offset in the text of the line.
    pub byte_offset: usize,
    pub pos: Pos,
}

/// A line that is not blank, without white space at its ends.
#[derive(Debug, Clone)]
pub(crate) struct LdLine<'a> {
    pub text: &'a str,
    pub pos: Pos,
    /// Words of the line, at least one.
    pub tokens: Vec<LdToken<'a>>,
}

impl<'a> LdLine<'a> {
    /// The first word.
    pub(crate) fn keyword(&self) -> &'a str {
        self.tokens.first().map_or("", |t| t.text)
    }
    /// The text after the first word, trimmed.
    pub(crate) fn rest(&self) -> &'a str {
        self.text.get(self.keyword().len()..).unwrap_or("").trim()
    }
}

/// Iterates over the lines that are neither blank nor begin with `;`.
pub(crate) fn split_lines(text: &str) -> impl Iterator<Item = LdLine<'_>> {
    text.lines().zip(1u32..).filter_map(|(raw, number)| {
        let text = raw.trim();
        if text.is_empty() || text.starts_with(';') {
            return None;
        }
        let indent = raw.chars().take_while(|c| c.is_whitespace()).count() as u32;
        let pos = Pos::new(number, indent + 1, text.chars().count() as u32);
        Some(LdLine { text, pos, tokens: split_tokens(text, number, indent + 1) })
    })
}

/// Splits a line at white space, but keeps a quoted space (`' '`) as one token.
fn split_tokens(text: &str, line: u32, first_column: u32) -> Vec<LdToken<'_>> {
    let mut found = Vec::new();
    let mut chars = text.char_indices().zip(first_column..).peekable();
    while let Some(((at, first), column)) = chars.next() {
        if first.is_whitespace() {
            continue;
        }
        let mut end = at + first.len_utf8();
        let mut width = 1;
        let quoted = text.get(at..).is_some_and(|t| t.starts_with("' '"));
        while let Some(((i, c), _)) = chars.next_if(|((_, c), _)| !c.is_whitespace() || (quoted && width == 1)) {
            end = i + c.len_utf8();
            width += 1;
        }
        found.push(LdToken {
            text: text.get(at..end).unwrap_or(""),
            byte_offset: at,
            pos: Pos::new(line, column, width),
        });
    }
    found
}

/// Parses a number in any of its spellings (decimal, hexadecimal, octal, binary, character).
///
/// Returns `None` if the text is not a number. Values beyond 64 bits saturate, which is outside every allowed
/// range.
pub(crate) fn parse_number(text: &str) -> Option<i64> {
    if let Some(quoted) = text.strip_prefix('\'') {
        return parse_character(quoted.strip_suffix('\'')?);
    }
    let (negative, digits) = match text.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, text),
    };
    let (radix, digits) = match digits.get(..2) {
        Some("0x" | "0X") => (16, digits.get(2..)?),
        Some("0o" | "0O") => (8, digits.get(2..)?),
        Some("0b" | "0B") => (2, digits.get(2..)?),
        _ => (10, digits),
    };
    if digits.is_empty() || !digits.chars().all(|c| c.is_digit(radix)) {
        return None;
    }
    let value = i64::from_str_radix(digits, radix).unwrap_or(i64::MAX);
    Some(if negative { -value } else { value })
}

/// Splits a text after the number at its beginning, which C's `strtol` with base 0 reads: decimal, octal
/// after a `0`, or hexadecimal after `0x`, with an optional sign.
///
/// Returns `None` if the text does not begin with a number. Values beyond 64 bits saturate.
pub(crate) fn split_c_number(text: &str) -> Option<(i64, &str)> {
    let unsigned = text.strip_prefix(['-', '+']).unwrap_or(text);
    let hexadecimal = unsigned.strip_prefix("0x").or_else(|| unsigned.strip_prefix("0X"));
    let (radix, digits) = match hexadecimal {
        Some(digits) if digits.starts_with(|c: char| c.is_ascii_hexdigit()) => (16, digits),
        _ => (if unsigned.starts_with('0') { 8 } else { 10 }, unsigned),
    };
    split_digits(digits, radix, text.starts_with('-'))
}

/// Splits a text after the decimal number at its beginning, as `%d` of C's `scanf` reads it.
pub(crate) fn split_decimal(text: &str) -> Option<(i64, &str)> {
    split_digits(text.strip_prefix(['-', '+']).unwrap_or(text), 10, text.starts_with('-'))
}

fn split_digits(text: &str, radix: u32, negative: bool) -> Option<(i64, &str)> {
    let rest = text.trim_start_matches(|c: char| c.is_digit(radix));
    let digits = text.strip_suffix(rest).filter(|digits| !digits.is_empty())?;
    let value = i64::from_str_radix(digits, radix).unwrap_or(i64::MAX);
    Some((if negative { -value } else { value }, rest))
}

/// Parses the text between the quotes of a character constant.
fn parse_character(text: &str) -> Option<i64> {
    let mut chars = text.chars();
    let value = match (chars.next()?, chars.next(), chars.as_str()) {
        (c, None, _) if c.is_ascii() && !c.is_ascii_control() => c as u32,
        ('\\', Some('x'), hex) if !hex.is_empty() && hex.len() <= 2 && hex.chars().all(|c| c.is_ascii_hexdigit()) => {
            u32::from_str_radix(hex, 16).ok()?
        }
        ('\\', Some(c), "") => match c {
            '0' => 0,
            'a' => 7,
            'b' => 8,
            't' => 9,
            'n' => 10,
            'v' => 11,
            'f' => 12,
            'r' => 13,
            '\\' | '\'' => c as u32,
            _ => return None,
        },
        _ => return None,
    };
    Some(i64::from(value))
}

/// True for a word that begins like a number, so that it cannot be a name even if it is malformed.
pub(crate) fn looks_like_number(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '-' | '+' | '\''))
}

/// True for a valid name: 1 to 127 letters, digits and underscores, not beginning with a digit.
pub(crate) fn is_name(text: &str) -> bool {
    !text.is_empty()
        && text.len() <= 127
        && !text.starts_with(|c: char| c.is_ascii_digit())
        && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}
