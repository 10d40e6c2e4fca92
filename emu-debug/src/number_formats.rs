//! Numbers in the formats of `print` and `x`.

/// A value of so many bytes as a format has it; nothing for one that is not of single values.
#[must_use]
pub fn format_number(value: i64, letter: char, bytes: u32) -> Option<String> {
    let bits = 8 * bytes.clamp(1, 8);
    let unsigned = if bits < 64 { (value & ((1 << bits) - 1)) as u64 } else { value as u64 };
    let signed = value << (64 - bits) >> (64 - bits);
    Some(match letter {
        'x' => format!("0x{unsigned:0digits$x}", digits = 2 * bytes as usize),
        'd' => signed.to_string(),
        'u' => unsigned.to_string(),
        'o' => format!("0{unsigned:o}"),
        't' => format!("0b{unsigned:0width$b}", width = bits as usize),
        'c' => format!("{unsigned} '{}'", crate::text_escapes::escape(&[unsigned as u8]).trim_matches('"')),
        _ => return None,
    })
}
