//! C strings, and sequences with equal elements, in the notation of gdb.

use crate::number_formats::format_character;

/// Equal elements in a row beyond this number are shown once, with their count.
pub(super) const REPEAT_THRESHOLD: usize = 10;

/// Formats bytes as a C string.
#[must_use]
pub fn c_text(bytes: &[u8]) -> String {
    text(bytes, false, REPEAT_THRESHOLD)
}

/// Formats bytes as a C string; more than `repeats` equal bytes in a row are printed once with their count.
pub(super) fn text(bytes: &[u8], more: bool, repeats: usize) -> String {
    let each: Vec<u8> = bytes.to_vec();
    let (mut parts, mut open): (Vec<String>, Option<String>) = (Vec::new(), None);
    let mut at = 0;
    while let Some(byte) = each.get(at) {
        let count = each.iter().skip(at).take_while(|other| *other == byte).count();
        if count > repeats {
            parts.extend(open.take().map(|text| format!("\"{text}\"")));
            parts.push(format!("'{}' <repeats {count} times>", format_character(*byte, '\'')));
            at += count;
        } else {
            open.get_or_insert_default().push_str(&format_character(*byte, '"'));
            at += 1;
        }
    }
    if parts.is_empty() || open.is_some() {
        parts.push(format!("\"{}\"", open.unwrap_or_default()));
    }
    format!("{}{}", parts.join(", "), if more { "..." } else { "" })
}

/// Returns the values in order; more than `repeats` equal values in a row become one.
pub(super) fn collapse_repeats(each: &[String], repeats: usize, many: impl Fn(&str, usize) -> String) -> Vec<String> {
    let (mut parts, mut at) = (Vec::new(), 0);
    while let Some(value) = each.get(at) {
        let count = each.iter().skip(at).take_while(|other| *other == value).count();
        if count > repeats {
            parts.push(many(value, count));
            at += count;
        } else {
            parts.push(value.clone());
            at += 1;
        }
    }
    parts
}
