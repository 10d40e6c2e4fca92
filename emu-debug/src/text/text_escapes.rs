//! Bytes as text on a command line.

use crate::InputError;

/// Returns the bytes of a text in which `\n`, `\r`, `\t`, `\0`, `\\`, `\"` and `\xNN` are single bytes;
/// everything else is UTF-8.
///
/// # Errors
/// Another character after a backslash, not two hex digits after `\x`, or no bytes at all.
pub fn unescape(text: &str) -> Result<Vec<u8>, InputError> {
    let mut bytes = Vec::new();
    let mut chars = text.chars();
    while let Some(c) = chars.next() {
        if c != '\\' {
            bytes.extend_from_slice(c.encode_utf8(&mut [0; 4]).as_bytes());
            continue;
        }
        bytes.push(match chars.next() {
            Some('n') => b'\n',
            Some('r') => b'\r',
            Some('t') => b'\t',
            Some('0') => 0,
            Some(same @ ('\\' | '"')) => same as u8,
            Some('x') => {
                let digits: String = chars.by_ref().take(2).collect();
                let hex = digits.len() == 2 && digits.bytes().all(|b| b.is_ascii_hexdigit());
                let value = u8::from_str_radix(&digits, 16).ok().filter(|_| hex);
                value.ok_or(InputError::BadHexEscape { digits })?
            }
            Some(other) => return Err(InputError::UnknownEscape { letter: other }),
            None => return Err(InputError::BackslashAtEnd),
        });
    }
    if bytes.is_empty() { Err(InputError::EmptyText) } else { Ok(bytes) }
}

/// Returns bytes as a text in double quotes, for messages: bytes other than printable ASCII are escaped.
#[must_use]
pub fn escape(bytes: &[u8]) -> String {
    let mut text = String::from("\"");
    for &byte in bytes {
        match byte {
            b'\n' => text.push_str("\\n"),
            b'\r' => text.push_str("\\r"),
            b'\t' => text.push_str("\\t"),
            b'"' | b'\\' => text.extend(['\\', byte as char]),
            b' '..=b'~' => text.push(byte as char),
            _ => text.push_str(&format!("\\x{byte:02x}")),
        }
    }
    text.push('"');
    text
}
