//! Members of structs and unions, constants of enums.

use super::{POINTER_BYTES, StabTypes, TypeNaming, TypeText, readable};
use crate::image::debug_info::{BitRange, BitsInByte, CType, StructMember, TypeId};

/// An enum: `IDLE:0,OPEN:3,;`.
pub(super) fn read_enum(text: &mut TypeText<'_>, size: Option<u32>) -> Option<CType> {
    let mut values = Vec::new();
    while !text.skip(b';') {
        let name = text.name()?;
        let value = text.until(b',')?;
        values.push((name, constant(value)?));
    }
    Some(CType::Enum { name: None, bytes: size.unwrap_or(POINTER_BYTES).min(8), values })
}

/// A constant of an enum: large ones are written in octal.
fn constant(digits: &[u8]) -> Option<i64> {
    let digits = std::str::from_utf8(digits).ok()?;
    match digits.strip_prefix('0').filter(|rest| !rest.is_empty()) {
        Some(octal) => u64::from_str_radix(octal, 8).ok().map(u64::cast_signed),
        None => digits.parse().ok(),
    }
}

impl StabTypes {
    /// A struct or union: its bytes, classes that it is derived from, its members.
    pub(super) fn record(&mut self, text: &mut TypeText<'_>, keyword: &'static str) -> Option<CType> {
        let bytes = u32::try_from(text.number()?).ok()?;
        let mut members = Vec::new();
        if text.skip(b'!') {
            let count = text.number()?;
            text.expect(b',')?;
            for _ in 0..count {
                members.push(self.base_class(text)?);
            }
        }
        while !text.skip(b';') {
            // The class whose table of virtual functions it has, at its end.
            if text.skip(b'~') {
                if text.skip(b'%') {
                    self.read(text, TypeNaming::None)?;
                }
                text.until(b';')?;
                break;
            }
            self.field(text, &mut members)?;
        }
        Some(CType::Record { keyword, name: None, bytes, members })
    }

    /// A class that another is derived from: virtual or not, visibility, bits before it, type.
    fn base_class(&mut self, text: &mut TypeText<'_>) -> Option<StructMember> {
        text.take()?;
        text.take()?;
        let bits = u32::try_from(text.number()?).ok()?;
        text.expect(b',')?;
        let of = self.read(text, TypeNaming::None)?;
        text.expect(b';')?;
        Some(StructMember { name: None, offset: bits / 8, bit_range: None, member_type: of })
    }

    fn field(&mut self, text: &mut TypeText<'_>, members: &mut Vec<StructMember>) -> Option<()> {
        let mut ahead = text.clone();
        let name = ahead.until(b':')?;
        if ahead.skip(b':') {
            *text = ahead;
            return self.methods(text);
        }
        *text = ahead;
        let name = Some(readable(name)).filter(|name| !name.is_empty());
        if text.skip(b'/') {
            _ = text.take()?;
        }
        let of = self.read(text, TypeNaming::None)?;
        // A member that all objects share is a variable.
        if text.skip(b':') {
            text.until(b';')?;
            return Some(());
        }
        text.expect(b',')?;
        let first = u32::try_from(text.number()?).ok()?;
        text.expect(b',')?;
        let size = u32::try_from(text.number()?).ok()?;
        text.expect(b';')?;
        let BitsInByte { offset, bits } = BitRange { first, size }.in_byte(0);
        let bit_range = bits.filter(|_| self.is_bit_field(of, first, size));
        members.push(StructMember { name, offset, bit_range, member_type: of });
        Some(())
    }

    /// The bits of a member are not all those of its type.
    fn is_bit_field(&self, of: Option<TypeId>, first: u32, size: u32) -> bool {
        let mut at = of;
        for _ in 0..64 {
            match self.get(at) {
                Some(CType::Named { of, .. } | CType::Qualified { of, .. }) => at = *of,
                Some(CType::Base { bytes, .. } | CType::Enum { bytes, .. }) => {
                    return size > 0 && (size != bytes.saturating_mul(8) || !first.is_multiple_of(8));
                }
                _ => return false,
            }
        }
        false
    }

    /// The methods of a name: for each its type, its symbol, visibility and kind.
    fn methods(&mut self, text: &mut TypeText<'_>) -> Option<()> {
        while !text.skip(b';') {
            self.read(text, TypeNaming::None)?;
            text.expect(b':')?;
            text.until(b';')?;
            text.take()?;
            text.take()?;
            match text.take()? {
                b'*' => {
                    text.until(b';')?;
                    self.read(text, TypeNaming::None)?;
                    text.expect(b';')?;
                }
                b'?' | b'.' => {}
                _ => return None,
            }
        }
        Some(())
    }
}
