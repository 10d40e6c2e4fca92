//! Number formats of the debugger.

use super::command_error::CommandError;

/// Formats a number in hex with at least `digits` digits; a negative number has a minus sign.
pub(super) fn hex(value: i64, digits: usize) -> String {
    let sign = if value < 0 { "-" } else { "" };
    format!("{sign}0x{:0digits$x}", value.unsigned_abs())
}

/// Formats a number from 0 to 9 in decimal, any other in hex.
pub(super) fn short_hex(value: i64) -> String {
    if (0..10).contains(&value) { value.to_string() } else { hex(value, 2) }
}

/// Maximum number of units that one `x` prints.
const MAX_UNITS: u32 = 1 << 16;

/// A count, a format letter and a unit, as in `/8xb`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct ExamineFormat {
    /// Number of units.
    pub count: Option<u32>,
    /// The units are before the address (a negative count).
    pub before: bool,
    /// Format letter: one of `x z d u o t c a f s i`.
    pub letter: Option<char>,
    /// Bytes of a unit.
    pub unit: Option<u32>,
}

impl ExamineFormat {
    /// Parses a format at the front of the arguments of a command. Returns the rest.
    ///
    /// # Errors
    /// A letter is unknown, or the count is out of range.
    pub fn parse_front(args: &str) -> Result<(ExamineFormat, &str), CommandError> {
        let Some(rest) = args.strip_prefix('/') else { return Ok((ExamineFormat::default(), args)) };
        let end = rest.find(char::is_whitespace).unwrap_or(rest.len());
        let (text, rest) = rest.split_at(end);
        let (text, before) = text.strip_prefix('-').map_or((text, false), |text| (text, true));
        let digits = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
        let mut format = ExamineFormat { before, ..ExamineFormat::default() };
        if digits > 0 {
            let (count, most) = (&text[..digits], MAX_UNITS);
            let found = count.parse().ok().filter(|count| (1..=most).contains(count));
            format.count = Some(found.ok_or_else(|| format!("`{count}` is not a count; write 1 to {most}"))?);
        }
        for letter in text[digits..].chars() {
            match letter {
                'x' | 'z' | 'd' | 'u' | 'o' | 't' | 'c' | 'a' | 'f' | 's' | 'i' => format.letter = Some(letter),
                'b' => format.unit = Some(1),
                'h' => format.unit = Some(2),
                'w' => format.unit = Some(4),
                'g' => format.unit = Some(8),
                _ => {
                    return Err(format!(
                        "`{letter}` is not a format; the formats are x z d u o t c a f s i, and the units b h w g"
                    )
                    .into());
                }
            }
        }
        Ok((format, rest.trim_start()))
    }
}
