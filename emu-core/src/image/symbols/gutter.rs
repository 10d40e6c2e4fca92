//! Splits a line of a listing of sdas8051 into the columns left of the source text: address or value, bytes,
//! cycles, line number.
//!
//! ```text
//!         000139 05 18            [12]   11         inc nudges      address, bytes, cycles, line
//!         000079                        539 _on_timer:              a label
//!                              000005     9 limit = 5               a value
//!                74 65 78 74                                        more bytes of the line before
//!         000002 E5*00            [12]   12 1$:     mov a, nudges   `*`: the linker will change the byte
//!      0139 AA F0               512         mov     r2,b            SDCC 2: 16-bit addresses, no cycles
//! ```

/// Column where the line number ends: with 24-bit addresses (SDCC 3 and 4) and with 16-bit addresses (SDCC
/// 2).
const GUTTER_WIDTHS: [usize; 2] = [39, 31];
/// An address starts before this column, a value after it.
const ADDRESS_COLUMN: usize = 10;
/// The first column in which bytes can be.
const BYTES_COLUMN: usize = 8;

/// One line of a listing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct GutterRow<'t> {
    pub address: Option<u32>,
    /// The value that the line gives to a symbol.
    pub value: Option<u32>,
    /// Whether there are bytes after the address.
    pub bytes: bool,
    /// Whether the linker will still change a byte.
    pub relocated: bool,
    /// Whether the line has no number and continues the bytes of the line before.
    pub more: bool,
    /// The source text.
    pub source: &'t str,
}

/// Finds the column where line numbers end, from the first line of a listing.
pub(super) fn gutter_width(first: &str) -> Option<usize> {
    GUTTER_WIDTHS.into_iter().find(|&width| {
        let (Some(gutter), Some(rest)) = (first.get(..width), first.get(width..)) else { return false };
        (gutter == "1" || gutter.ends_with(" 1"))
            && (rest.is_empty() || rest.starts_with([' ', '\t']))
            && split_gutter(first, width).is_some()
    })
}

/// Splits a line, or returns `None` if it is not a line of a listing.
pub(super) fn split_gutter(line: &str, width: usize) -> Option<GutterRow<'_>> {
    // A line number of more than five digits moves the source to the right.
    let digits = line.get(width..).map_or(0, |rest| rest.bytes().take_while(u8::is_ascii_digit).count());
    let at = (width + digits).min(line.len());
    let (gutter, source) = (line.get(..at)?, line.get(at..)?);
    let source = source.strip_prefix(' ').unwrap_or(source);
    let mut row = GutterRow { address: None, value: None, bytes: false, relocated: false, more: true, source };
    let body = gutter.trim_end();
    let start = body.len() - body.trim_start().len();
    let body = body.get(start..)?;
    let (body, number) = match body.rfind(' ') {
        _ if gutter.len() < width => (body, None),
        Some(at) => (body.get(..at)?.trim_end(), body.get(at + 1..)),
        None => ("", Some(body)),
    };
    if let Some(number) = number {
        number.parse::<u32>().ok()?;
        row.more = false;
    }
    if body.is_empty() {
        return (!row.more).then_some(row);
    }
    if row.more {
        (start >= BYTES_COLUMN && source.is_empty()).then_some(())?;
        row.bytes = true;
        row.relocated = is_byte_pairs(body)?;
        return Some(row);
    }
    let (first, rest) = body.split_once(' ').unwrap_or((body, ""));
    let number = parse_hex(first)?;
    if start < ADDRESS_COLUMN {
        let code = rest.split_once('[').map_or(rest, |(code, _)| code).trim();
        row.address = Some(number);
        row.bytes = !code.is_empty();
        row.relocated = row.bytes && is_byte_pairs(code)?;
    } else {
        rest.is_empty().then_some(())?;
        row.value = Some(number);
    }
    Some(row)
}

/// Checks that a text is two-digit bytes with one character between them. Returns true if one of these
/// characters is a mark of the linker.
fn is_byte_pairs(text: &str) -> Option<bool> {
    let mut marked = false;
    for group in text.as_bytes().chunks(3) {
        match group {
            [a, b, rest @ ..] if a.is_ascii_hexdigit() && b.is_ascii_hexdigit() => {
                marked |= rest.first().is_some_and(|mark| *mark != b' ');
            }
            _ => return None,
        }
    }
    Some(marked)
}

fn parse_hex(text: &str) -> Option<u32> {
    (text.len() >= 4 && text.bytes().all(|b| b.is_ascii_hexdigit())).then(|| u32::from_str_radix(text, 16).ok())?
}
