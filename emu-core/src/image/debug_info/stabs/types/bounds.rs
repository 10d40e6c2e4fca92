//! Numbers: base types by the range of their values, and those that the compiler calls by numbers below 0.

use crate::image::debug_info::{BaseEncoding, CType};

/// Bytes of `int`.
const INT_BYTES: u32 = 2;

/// A bound of a range. One in octal is given by its bits, so it is never below 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Bound {
    amount: u128,
    negative: bool,
}

/// Bounds that do not fit have more bits than any type.
fn bound(text: &[u8]) -> Option<Bound> {
    let (negative, digits) = match text.split_first()? {
        (b'-', digits) => (true, digits),
        _ => (false, text),
    };
    let radix = if digits.first() == Some(&b'0') && digits.len() > 1 { 8 } else { 10 };
    let amount = digits.iter().try_fold(0u128, |all, byte| {
        let digit = char::from(*byte).to_digit(radix)?;
        Some(all.saturating_mul(radix.into()).saturating_add(digit.into()))
    })?;
    (!digits.is_empty()).then_some(Bound { amount, negative })
}

/// The type of the numbers from a bound to another, as gdb takes them; nothing where it is a part of another
/// type.
pub(super) fn range_type(low: &[u8], high: &[u8], size: Option<u32>, of_itself: bool) -> Option<CType> {
    let (low, high) = (bound(low)?, bound(high)?);
    let base = |bytes: u32, encoding| {
        let encoding = match (bytes, encoding) {
            (1, BaseEncoding::Signed) => BaseEncoding::SignedChar,
            (1, BaseEncoding::Unsigned) => BaseEncoding::UnsignedChar,
            (_, encoding) => encoding,
        };
        Some(CType::Base { name: String::new(), bytes: bytes.min(16), encoding })
    };
    // All bits set, of so many bytes.
    let ones = |bits: u32| if bits >= 128 { u128::MAX } else { (1u128 << bits) - 1 };
    if let Some(bytes) = size {
        return base(bytes, if low.amount == 0 { BaseEncoding::Unsigned } else { BaseEncoding::Signed });
    }
    match (low, high) {
        // A number with a point gives its bytes instead of its lowest value.
        (Bound { amount: bytes, negative: false }, Bound { amount: 0, .. }) if bytes > 0 => {
            base(u32::try_from(bytes).ok()?, BaseEncoding::Float)
        }
        (Bound { amount: 0, .. }, Bound { amount: 127, negative: false }) if of_itself => base(1, BaseEncoding::Signed),
        (Bound { amount: 0, .. }, Bound { amount: 1, negative: true }) => base(INT_BYTES, BaseEncoding::Unsigned),
        (Bound { amount: 0, .. }, high) if !high.negative => {
            let bytes = (1..=16).find(|bytes| high.amount == ones(bytes * 8))?;
            base(bytes, BaseEncoding::Unsigned)
        }
        (low, high) => {
            let bytes = (1..=16).find(|bytes| high.amount == ones(bytes * 8 - 1))?;
            (low.amount == high.amount + 1).then(|| base(bytes, BaseEncoding::Signed)).flatten()
        }
    }
}

/// A type of the compiler's own (manual "STABS", "Negative Type Numbers"); nothing is `void`.
pub(super) fn builtin(number: i64) -> Option<CType> {
    use BaseEncoding::{Boolean, Float, Signed, SignedChar, Unsigned, UnsignedChar};
    let (name, bytes, encoding) = match number {
        -1 => ("int", 4, Signed),
        -2 => ("char", 1, SignedChar),
        -3 => ("short", 2, Signed),
        -4 => ("long", 4, Signed),
        -5 => ("unsigned char", 1, UnsignedChar),
        -6 => ("signed char", 1, SignedChar),
        -7 => ("unsigned short", 2, Unsigned),
        -8 => ("unsigned int", 4, Unsigned),
        -9 => ("unsigned", 4, Unsigned),
        -10 => ("unsigned long", 4, Unsigned),
        -12 => ("float", 4, Float),
        -13 => ("double", 8, Float),
        -14 => ("long double", 8, Float),
        -15 => ("integer", 4, Signed),
        -16 => ("boolean", 4, Boolean),
        -17 => ("short real", 4, Float),
        -18 => ("real", 8, Float),
        -20 => ("character", 1, UnsignedChar),
        -21 => ("logical*1", 1, Boolean),
        -22 => ("logical*2", 2, Boolean),
        -23 => ("logical*4", 4, Boolean),
        -24 => ("logical", 4, Boolean),
        -27 => ("integer*1", 1, SignedChar),
        -28 => ("integer*2", 2, Signed),
        -29 => ("integer*4", 4, Signed),
        -30 => ("wchar", 2, UnsignedChar),
        -31 => ("long long", 8, Signed),
        -32 => ("unsigned long long", 8, Unsigned),
        -33 => ("logical*8", 8, Boolean),
        -34 => ("integer*8", 8, Signed),
        _ => return None,
    };
    Some(CType::Base { name: name.to_owned(), bytes, encoding })
}
