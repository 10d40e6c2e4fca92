//! Numbers in the formats of `print` and `x`, as gdb prints them.

/// Formats a value of `bytes` bytes, with leading zeros up to its size if `padded` or with the format `z`;
/// `None` for a format that does not apply to single values.
#[must_use]
pub fn format_number(value: i64, letter: char, bytes: u32, padded: bool) -> Option<String> {
    let bits = 8 * bytes.clamp(1, 8);
    let unsigned = if bits < 64 { (value & ((1 << bits) - 1)) as u64 } else { value as u64 };
    let signed = value << (64 - bits) >> (64 - bits);
    let width = |digits: u32| if padded || letter == 'z' { digits as usize } else { 0 };
    Some(match letter {
        'x' | 'z' => format!("0x{unsigned:0digits$x}", digits = width(2 * bytes)),
        'd' => signed.to_string(),
        'u' => unsigned.to_string(),
        'o' if unsigned == 0 => "0".to_owned(),
        'o' => format!("0{unsigned:o}"),
        't' => format!("{unsigned:0width$b}", width = width(bits)),
        // A value that is no character is truncated to one byte; a negative one keeps its sign.
        'c' => {
            let number = if value < 0 { i64::from(value as i8) } else { i64::from(value as u8) };
            format!("{number} '{}'", format_character(value as u8, '\''))
        }
        _ => return None,
    })
}

/// Formats a byte as a C character.
pub(crate) fn format_character(byte: u8, quote: char) -> String {
    match byte {
        b'\n' => "\\n".to_owned(),
        b'\r' => "\\r".to_owned(),
        b'\t' => "\\t".to_owned(),
        7 => "\\a".to_owned(),
        8 => "\\b".to_owned(),
        11 => "\\v".to_owned(),
        12 => "\\f".to_owned(),
        27 => "\\033".to_owned(),
        b'\\' => "\\\\".to_owned(),
        b' '..=b'~' if char::from(byte) == quote => format!("\\{quote}"),
        b' '..=b'~' => char::from(byte).to_string(),
        _ => format!("\\{byte:03o}"),
    }
}
