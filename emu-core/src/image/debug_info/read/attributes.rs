//! Reads the values of DWARF attributes: numbers, constants, encodings, ranges and texts.

use std::ops::Range;

use gimli::{AttributeValue, DwAt};

use super::{DwarfEntry, DwarfSlice};
use crate::image::debug_info::BaseEncoding;

/// Maximum length of a name in bytes.
const MAX_NAME: usize = 1024;

/// An unsigned number or a file number that fits 32 bits.
pub(super) fn unsigned_attribute(entry: &DwarfEntry<'_>, name: DwAt) -> Option<u32> {
    let number = match entry.attr_value(name)? {
        AttributeValue::FileIndex(index) => index,
        value => value.udata_value()?,
    };
    u32::try_from(number).ok()
}

/// A constant as a signed number. Compilers write negative constants in the signed form, so all other forms
/// are unsigned.
pub(super) fn signed_value(value: &AttributeValue<DwarfSlice<'_>>) -> Option<i64> {
    Some(match value {
        AttributeValue::Sdata(value) => *value,
        AttributeValue::Udata(value) | AttributeValue::Data8(value) => *value as i64,
        AttributeValue::Data1(value) => i64::from(*value),
        AttributeValue::Data2(value) => i64::from(*value),
        AttributeValue::Data4(value) => i64::from(*value),
        _ => return None,
    })
}

/// The bytes of a constant. A number has 8 bytes with its sign, which is enough for any object.
pub(super) fn constant_bytes(value: &AttributeValue<DwarfSlice<'_>>) -> Option<Vec<u8>> {
    if let AttributeValue::Block(bytes) = value {
        return Some(bytes.slice().to_vec());
    }
    signed_value(value).map(|number| number.to_le_bytes().to_vec())
}

/// How a base type is interpreted; an unknown encoding is an unsigned number.
pub(super) fn encoding(value: Option<AttributeValue<DwarfSlice<'_>>>) -> BaseEncoding {
    match value {
        Some(AttributeValue::Encoding(gimli::DW_ATE_signed)) => BaseEncoding::Signed,
        Some(AttributeValue::Encoding(gimli::DW_ATE_signed_char)) => BaseEncoding::SignedChar,
        Some(AttributeValue::Encoding(gimli::DW_ATE_unsigned_char | gimli::DW_ATE_UTF)) => BaseEncoding::UnsignedChar,
        Some(AttributeValue::Encoding(gimli::DW_ATE_boolean)) => BaseEncoding::Boolean,
        Some(AttributeValue::Encoding(gimli::DW_ATE_float)) => BaseEncoding::Float,
        _ => BaseEncoding::Unsigned,
    }
}

/// A range of 32-bit addresses that is not empty.
pub(super) fn range(range: Range<u64>) -> Option<Range<u32>> {
    let (start, end) = (u32::try_from(range.start).ok()?, u32::try_from(range.end).ok()?);
    (start < end).then_some(start..end)
}

/// A text as UTF-8, at most [`MAX_NAME`] bytes of it, with control characters escaped.
pub(super) fn lossy_text(text: DwarfSlice<'_>) -> String {
    let bytes = text.slice();
    diag::text::printable(&String::from_utf8_lossy(bytes.get(..bytes.len().min(MAX_NAME)).unwrap_or_default())).into()
}
