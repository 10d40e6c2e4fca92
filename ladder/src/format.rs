//! Splits the text of FORMATTED_STRING into the characters that it sends.
//!
//! This module handles only the syntax of escapes. The evaluator and the compiler define which digit of the
//! number goes where and when a character is sent.

use diag::text::code_page_byte;

/// One piece of the text, which represents one character that is sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum StringPiece {
    /// A fixed byte.
    Byte(u8),
    /// The sign of the number; its digits follow directly.
    Sign,
    /// One digit of the number.
    Digit {
        /// Weight of this digit: 10^0 to 10^4.
        divisor: i32,
        /// True for the leftmost digit.
        first: bool,
        /// True for the rightmost digit, the ones.
        last: bool,
    },
}

/// Error: an unknown escape, a second number, or a character outside code page 1252.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{cause}")]
pub struct BadEscape {
    /// Number of characters before the one that is wrong.
    pub char_offset: usize,
    /// What is wrong.
    pub cause: String,
    /// What is allowed instead.
    pub hint: &'static str,
}

const ESCAPES: &str =
    "escapes are \\r \\n \\b \\f \\t \\v \\a \\\\ \\xHH, and \\1 to \\5 or \\-1 to \\-5 for the digits of a number";

/// Maximum number of digits of a number.
const MAX_DIGITS: u32 = 5;

/// Splits a text into pieces, one for each character that is sent; at most one number is among them.
///
/// `quoted` selects LDmicro 5's quoted spelling. In the other spelling a character below 32 represents the
/// letter X. A character is sent as its byte in code page 1252, the encoding of LDmicro's users; up to U+00FF
/// this is mostly its code point.
///
/// # Errors
/// Fails at the first unknown escape, at a second number, and at a character that code page 1252 lacks.
///
/// ```
/// use ladder::format::{StringPiece, split_format_string};
/// let digit = |divisor, first, last| StringPiece::Digit { divisor, first, last };
/// let (tens, ones) = (digit(10, true, false), digit(1, false, true));
/// let wanted = [StringPiece::Byte(b'='), StringPiece::Sign, tens, ones, StringPiece::Byte(13)];
/// assert_eq!(split_format_string("=\\-2\\r", true).as_deref(), Ok(wanted.as_slice()));
/// assert!(split_format_string("\\q", true).is_err());
/// ```
pub fn split_format_string(text: &str, quoted: bool) -> Result<Vec<StringPiece>, BadEscape> {
    let mut out = Vec::new();
    let mut chars = text.chars().enumerate().peekable();
    let mut number = false;
    while let Some((at, c)) = chars.next() {
        let bad = |cause: String| BadEscape { char_offset: at, cause, hint: ESCAPES };
        let code = u32::from(c);
        if code < 32 && !quoted {
            out.push(StringPiece::Byte(b'X'));
            continue;
        }
        if c != '\\' {
            let byte = code_page_byte(c).ok_or_else(|| BadEscape {
                char_offset: at,
                cause: format!("`{c}` is not a single byte"),
                hint: "write the bytes of the character as \\xHH",
            })?;
            out.push(StringPiece::Byte(byte));
            continue;
        }
        let Some((_, letter)) = chars.next() else {
            return Err(bad("a backslash is at the end".to_owned()));
        };
        let byte = match letter {
            'r' => 13,
            'n' => 10,
            'b' => 8,
            'f' => 12,
            't' => 9,
            'v' => 11,
            'a' => 7,
            '\\' => b'\\',
            'x' => {
                let mut digit = || chars.next_if(|(_, c)| c.is_ascii_hexdigit()).and_then(|(_, c)| c.to_digit(16));
                let pair = digit().zip(digit()).and_then(|(high, low)| u8::try_from(high * 16 + low).ok());
                pair.ok_or_else(|| bad("\\x needs two hexadecimal digits".to_owned()))?
            }
            _ => {
                let (sign, digits) = match letter {
                    '-' => (true, chars.next().map(|(_, c)| c)),
                    other => (false, Some(other)),
                };
                let digits = digits.and_then(|d| d.to_digit(10)).filter(|d| (1..=MAX_DIGITS).contains(d));
                let Some(digits) = digits else {
                    let found = crate::reader::message_text(&format!("\\{letter}"));
                    return Err(bad(format!("`{found}` is not an escape")));
                };
                if std::mem::replace(&mut number, true) {
                    return Err(bad("the text contains a second number".to_owned()));
                }
                if sign {
                    out.push(StringPiece::Sign);
                }
                out.extend((0..digits).map(|place| StringPiece::Digit {
                    divisor: 10_i32.pow(digits - 1 - place),
                    first: place == 0,
                    last: place + 1 == digits,
                }));
                continue;
            }
        };
        out.push(StringPiece::Byte(byte));
    }
    Ok(out)
}
