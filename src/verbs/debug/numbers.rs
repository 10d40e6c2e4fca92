//! Numbers as people read them.

/// A number in hex with at least so many digits; a negative one with its sign.
pub(super) fn hex(value: i64, digits: usize) -> String {
    let sign = if value < 0 { "-" } else { "" };
    format!("{sign}0x{:0digits$x}", value.unsigned_abs())
}

/// A number as it is where it has one digit, else in hex.
pub(super) fn short_hex(value: i64) -> String {
    if (0..10).contains(&value) { value.to_string() } else { hex(value, 2) }
}

/// Most units that one `x` shows.
const MAX_UNITS: u32 = 1 << 16;

/// A count, a format and a unit, as `/8xb` gives them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct ExamineFormat {
    /// How many.
    pub count: Option<u32>,
    /// They lie before the place.
    pub before: bool,
    /// `x z d u o t c a f s i`.
    pub letter: Option<char>,
    /// Bytes of a unit.
    pub unit: Option<u32>,
}

impl ExamineFormat {
    /// Takes a format off the front of the words behind a command.
    ///
    /// # Errors
    /// A letter that is none.
    pub fn parse_front(args: &str) -> Result<(ExamineFormat, &str), String> {
        let Some(rest) = args.strip_prefix('/') else { return Ok((ExamineFormat::default(), args)) };
        let end = rest.find(char::is_whitespace).unwrap_or(rest.len());
        let (text, rest) = rest.split_at(end);
        let (text, before) = text.strip_prefix('-').map_or((text, false), |text| (text, true));
        let digits = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
        let mut format = ExamineFormat { before, ..ExamineFormat::default() };
        if digits > 0 {
            let (count, most) = (&text[..digits], MAX_UNITS);
            let found = count.parse().ok().filter(|count| (1..=most).contains(count));
            format.count = Some(found.ok_or_else(|| format!("`{count}` is no count; write 1 to {most}"))?);
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
                        "`{letter}` is no format; there are x z d u o t c a f s i, and the units b h w g"
                    ));
                }
            }
        }
        Ok((format, rest.trim_start()))
    }
}
