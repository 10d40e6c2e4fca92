//! The text of FORMATTED_STRING taken apart. Escapes are syntax: what the places of a number mean, and when a character is
//! sent, is told elsewhere.

use diag::text::code_page_byte;

/// What stands for one character that is sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum StringPiece {
    /// This byte.
    Byte(u8),
    /// The sign place of the number; the digit places follow it at once.
    Sign,
    /// A digit place of the number.
    Digit {
        /// The power of ten of this place, 10^0 to 10^4.
        divisor: i32,
        /// The place on the left.
        first: bool,
        /// The place of the ones, on the right.
        last: bool,
    },
}

/// An escape that means nothing, or a second number.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{cause}")]
pub struct BadEscape {
    /// The characters before its backslash.
    pub char_offset: usize,
    /// What is wrong.
    pub cause: String,
    /// What may stand there.
    pub hint: &'static str,
}

const ESCAPES: &str =
    "escapes are \\r \\n \\b \\f \\t \\v \\a \\\\ \\xHH, and \\1 to \\5 or \\-1 to \\-5 for the digits of a number";

/// Most digit places of a number.
const MAX_DIGITS: u32 = 5;

/// The pieces of a text, one for each character that is sent; at most one number is among them.
///
/// `quoted` tells LDmicro 5's spelling; in the other one a character under 32 stands for the letter X. A character is
/// its byte in code page 1252, in which LDmicro's users write, so up to U+00FF mostly its number.
///
/// # Errors
/// The first escape that means nothing, a second number, or a character that code page 1252 lacks.
///
/// ```
/// use ladder::format::{StringPiece, split_format_string};
/// let digit = |divisor, first, last| StringPiece::Digit { divisor, first, last };
/// let wanted = [StringPiece::Byte(b'='), StringPiece::Sign, digit(10, true, false), digit(1, false, true), StringPiece::Byte(13)];
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
                cause: format!("`{c}` is no single byte"),
                hint: "write the bytes of the character as \\xHH",
            })?;
            out.push(StringPiece::Byte(byte));
            continue;
        }
        let Some((_, letter)) = chars.next() else {
            return Err(bad("a backslash stands at the end".to_owned()));
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
                    return Err(bad(format!("`{found}` is no escape")));
                };
                if std::mem::replace(&mut number, true) {
                    return Err(bad("a second number stands in the text".to_owned()));
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
