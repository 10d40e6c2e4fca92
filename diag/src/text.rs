//! Decodes the bytes of a text file into characters, and encodes them back into the same bytes.
//!
//! Sources, ladder programs and HEX files are written in UTF-8 or in the 8-bit code pages of old editors, and
//! a string literal goes to a chip byte by byte. Every reader of text therefore decodes with this module. A
//! file that is valid UTF-8 as a whole is decoded as UTF-8. Any other file is decoded byte by byte: bytes
//! 0x80 to 0xFF become the characters U+EF80 to U+EFFF, which Unicode reserves for private use. No byte is
//! lost, and a column is a byte. A file that contains one of these characters itself, as UTF-8, is also
//! decoded byte by byte, so [`encode_text`] is the exact inverse of [`decode_text`]. [`to_display_text`]
//! shows such a byte as in the Windows code page 1252, which agrees with Latin-1 from 0xA0 on.

use std::borrow::Cow;

/// The private-use character of the byte 0x80; the characters of 0x81 to 0xFF follow it.
const FIRST_BYTE_CHAR: u32 = 0xEF80;

/// The UTF-8 encoding of the byte order mark U+FEFF.
pub const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// The characters of the bytes 0x80 to 0x9F in code page 1252 (Unicode,
/// MAPPINGS/VENDORS/MICSFT/WINDOWS/CP1252.TXT). Five of them are not defined there and map to the control
/// characters with the same numbers, as in browsers (WHATWG Encoding, 9.1, index windows-1252).
#[rustfmt::skip]
const CP1252: [char; 32] = [
    '€', '\u{81}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{8D}', 'Ž', '\u{8F}',
    '\u{90}', '‘', '’', '“', '”', '•', '–', '—', '\u{2DC}', '™', 'š', '›', 'œ', '\u{9D}', 'ž', 'Ÿ',
];

/// How a file encodes its characters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TextEncoding {
    /// UTF-8.
    Utf8,
    /// One byte per character, in a code page that the file does not name.
    Bytes,
}

/// Returns the encoding that [`decode_text`] uses for these bytes.
#[must_use]
pub fn encoding(bytes: &[u8]) -> TextEncoding {
    match std::str::from_utf8(bytes) {
        Ok(text) if !text.contains(|c| byte_of(c).is_some()) => TextEncoding::Utf8,
        _ => TextEncoding::Bytes,
    }
}

/// Decodes the bytes of a file; [`byte_of`] recognises characters that represent a single byte.
#[must_use]
pub fn decode_text(bytes: &[u8]) -> Cow<'_, str> {
    match (encoding(bytes), std::str::from_utf8(bytes)) {
        (TextEncoding::Utf8, Ok(text)) => Cow::Borrowed(text),
        _ => Cow::Owned(bytes.iter().map(|&byte| char_of_byte(byte)).collect()),
    }
}

/// Returns the bytes from which [`decode_text`] made a text or a part of it.
#[must_use]
pub fn encode_text(text: &str) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(text.len());
    for c in text.chars() {
        match byte_of(c) {
            Some(byte) => bytes.push(byte),
            None => bytes.extend_from_slice(c.encode_utf8(&mut [0; 4]).as_bytes()),
        }
    }
    bytes
}

/// Returns the byte that a private-use character of [`decode_text`] represents, or `None` for any other
/// character.
#[must_use]
pub fn byte_of(c: char) -> Option<u8> {
    let above = u32::from(c).checked_sub(FIRST_BYTE_CHAR)?;
    u8::try_from(above + 0x80).ok()
}

/// Returns the character that represents a byte.
fn char_of_byte(byte: u8) -> char {
    match byte {
        0..0x80 => char::from(byte),
        _ => char::from_u32(FIRST_BYTE_CHAR + u32::from(byte) - 0x80).unwrap_or(char::REPLACEMENT_CHARACTER),
    }
}

/// Makes a text of [`decode_text`] readable: single bytes are shown as in code page 1252. The result contains
/// none of the private-use characters U+EF80 to U+EFFF.
#[must_use]
pub fn to_display_text(text: &str) -> Cow<'_, str> {
    if !text.contains(|c| byte_of(c).is_some()) {
        return Cow::Borrowed(text);
    }
    let shown = |c: char| match byte_of(c) {
        Some(byte) => CP1252.get(usize::from(byte - 0x80)).copied().unwrap_or(char::from(byte)),
        None => c,
    };
    Cow::Owned(text.chars().map(shown).collect())
}

/// Encodes a text of [`to_display_text`] in code page 1252, or returns `None` if it has a character that the
/// code page lacks.
#[must_use]
pub fn to_code_page(text: &str) -> Option<Vec<u8>> {
    text.chars().map(code_page_byte).collect()
}

/// Returns the byte of a character in code page 1252; a character up to U+00FF that the table lacks gives its
/// number.
#[must_use]
pub fn code_page_byte(c: char) -> Option<u8> {
    let within = CP1252.iter().position(|known| *known == c).map(|at| at as u8 + 0x80);
    within.or_else(|| u8::try_from(u32::from(c)).ok()).or_else(|| byte_of(c))
}

/// Removes what other systems add around and between lines. It removes the byte order mark of UTF-8, and a
/// final ^Z (0x1A) that only zeros, ^Z and white space follow. A CR that ends a line alone becomes LF. Line
/// numbers stay the same.
#[must_use]
pub fn strip_line_decorations(bytes: &[u8]) -> Cow<'_, [u8]> {
    let bytes = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
    let filler = |c: &u8| matches!(c, 0 | 0x1A) || c.is_ascii_whitespace();
    let end = bytes.iter().rposition(|c| !filler(c)).map_or(0, |at| at + 1);
    let end = bytes.iter().skip(end).position(|c| *c == 0x1A).map_or(bytes.len(), |at| end + at);
    let bytes = bytes.get(..end).unwrap_or_default();
    if !bytes.contains(&b'\r') {
        return Cow::Borrowed(bytes);
    }
    let mut text = bytes.to_vec();
    // Several CR in front of one LF are one line end.
    let mut before_lf = true;
    for c in text.iter_mut().rev() {
        match *c {
            b'\r' if before_lf => {}
            b'\r' => *c = b'\n',
            other => before_lf = other == b'\n',
        }
    }
    Cow::Owned(text)
}

/// Decodes a file for display. Lines and columns are numbered as its reader counts them.
#[must_use]
pub fn readable(bytes: &[u8]) -> String {
    to_display_text(&decode_text(&strip_line_decorations(bytes))).into_owned()
}

/// Escapes control characters (Unicode, general category Cc) other than tab as `\x1b`, so that a file cannot
/// move the cursor of a terminal or send it commands.
#[must_use]
pub fn printable(text: &str) -> Cow<'_, str> {
    if !text.contains(is_escaped) {
        return Cow::Borrowed(text);
    }
    let mut clean = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        match c {
            c if is_escaped(c) => clean.push_str(&format!("\\x{:02x}", u32::from(c))),
            c => clean.push(c),
        }
    }
    Cow::Owned(clean)
}

/// Escapes what cannot be printed, as [`printable`] does, but returns the `String` itself if nothing is
/// escaped.
#[must_use]
pub fn into_printable(text: String) -> String {
    match printable(&text) {
        Cow::Owned(clean) => clean,
        Cow::Borrowed(_) => text,
    }
}

fn is_escaped(c: char) -> bool {
    c.is_control() && c != '\t'
}

/// Returns the name of a two-byte encoding, recognised by its byte order mark or by zeros between the first
/// letters, or `None`. The readers reject such a text with a hint, because no other part of the project
/// decodes it.
#[must_use]
pub fn wide_encoding(bytes: &[u8]) -> Option<&'static str> {
    match bytes.get(..4).unwrap_or(bytes) {
        [0xFF, 0xFE, ..] => Some("UTF-16 (low byte first)"),
        [0xFE, 0xFF, ..] => Some("UTF-16 (high byte first)"),
        &[a, 0, b, 0] if is_letter(a) && is_letter(b) => Some("UTF-16 (low byte first)"),
        &[0, a, 0, b] if is_letter(a) && is_letter(b) => Some("UTF-16 (high byte first)"),
        _ => None,
    }
}

fn is_letter(byte: u8) -> bool {
    byte.is_ascii_graphic() || byte.is_ascii_whitespace()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// UTF-8 is kept as it is; any other text gives back its bytes, and is displayed in code page 1252.
    #[test]
    fn no_byte_is_lost() {
        let all: Vec<u8> = (0..=255).collect();
        let private = "a\u{EF80}\u{EFFF}".as_bytes();
        let texts: [(&[u8], TextEncoding); 6] = [
            (b"plain", TextEncoding::Utf8),
            ("dt \"\u{e9}\u{20ac}\u{1F600}\"".as_bytes(), TextEncoding::Utf8),
            (b"dt \"\xBFA\"", TextEncoding::Bytes),
            (b"\xC3\xA9 and \xE9", TextEncoding::Bytes),
            (&all, TextEncoding::Bytes),
            (private, TextEncoding::Bytes),
        ];
        for (bytes, wanted) in texts {
            let text = decode_text(bytes);
            assert_eq!((encoding(bytes), encode_text(&text)), (wanted, bytes.to_vec()));
            if wanted == TextEncoding::Bytes {
                assert_eq!(text.chars().count(), bytes.len(), "a column is a byte");
                assert_eq!(to_code_page(&to_display_text(&text)).as_deref(), Some(bytes));
            }
        }
    }

    #[test]
    fn people_see_code_page_1252() {
        assert_eq!(
            to_display_text(&decode_text(b"sem\xE1foro \x80 \x95 \xFF")),
            "sem\u{e1}foro \u{20ac} \u{2022} \u{ff}"
        );
        assert_eq!(to_code_page("\u{21b}"), None, "a letter that the code page lacks");
    }

    #[test]
    fn control_characters_are_escaped() {
        assert!(matches!(printable("pop\t\u{e9} \\x1b"), Cow::Borrowed("pop\t\u{e9} \\x1b")));
        assert_eq!(printable("\u{1b}]0;a\u{7}b\0c\nd\u{9b}31m\u{7f}"), "\\x1b]0;a\\x07b\\x00c\\x0ad\\x9b31m\\x7f");
        assert_eq!(into_printable("a\rb".to_owned()), "a\\x0db");
    }

    #[test]
    fn what_is_around_lines_is_left_out() {
        let cases: &[(&[u8], &[u8])] = &[
            (b"a\nb", b"a\nb"),
            (b"\xEF\xBB\xBFa", b"a"),
            (b"a\rb\r\nc\r\r\nd\r", b"a\nb\r\nc\r\r\nd\r"),
            (b"a\n\x1A\0\0\r\n", b"a\n"),
            (b"a\x1Ab", b"a\x1Ab"),
            (b"", b""),
        ];
        for (bytes, wanted) in cases {
            assert_eq!(&*strip_line_decorations(bytes), *wanted, "{bytes:?}");
        }
    }

    #[test]
    fn text_with_two_bytes_per_character_is_reported() {
        assert!(wide_encoding(b"\xFF\xFE;\0").is_some() && wide_encoding(b"\xFE\xFF\0;").is_some());
        assert!(wide_encoding(b"L\0D\0").is_some() && wide_encoding(b"\0L\0D").is_some());
        assert!(wide_encoding(b"LDmicro0.1").is_none() && wide_encoding(b"").is_none());
    }
}
