//! Assigns values to C objects: the bytes and bits that a new value changes.

use emu_core::image::{BaseEncoding, BitRange, CType};

use super::{ObjectByteLocation, ObjectExpr};
use crate::debug::dyn_machine::DynMachine;
use crate::debug::error::DebugError;
use crate::debug::expression_place::ExpressionPlace;
use crate::debug::expression_value::ExpressionValue;

/// A write that is a part of an assignment.
#[derive(Debug, Clone)]
pub(in crate::debug) struct PlaceWrite {
    /// The byte or bit to write.
    pub(in crate::debug) place: ExpressionPlace,
    /// Its new value.
    pub(in crate::debug) value: i64,
}

impl ObjectExpr {
    /// Returns the writes that assign a value: single bytes and bits, with their new values.
    ///
    /// # Errors
    /// It cannot be set, or not to this value.
    pub(in crate::debug) fn writes_for(
        &self,
        machine: &dyn DynMachine,
        value: ExpressionValue,
    ) -> Result<Vec<PlaceWrite>, DebugError> {
        match self.resolved_type() {
            Some(CType::Record { keyword, .. }) => {
                return Err(DebugError::NoSingleValue { what: format!("a {keyword}"), parts: "members" });
            }
            Some(CType::Function { .. }) => return Err(DebugError::FunctionNotSettable),
            Some(CType::Array { .. }) => {
                return Err(DebugError::NoSingleValue { what: "an array".to_owned(), parts: "elements" });
            }
            _ => {}
        }
        let value = if self.is_real() { value.to_bits(self.bytes().unwrap_or(0)) } else { value.to_integer() };
        let value = self.without_link_offset(value);
        let cells = self.byte_locations(machine);
        let bits = self.bits.map_or(8 * cells.len() as u32, |bits| bits.size);
        let (least, most) = match bits {
            0..64 => (
                if self.is_signed() || self.bits.is_none() { -(1i64 << bits.saturating_sub(1)) } else { 0 },
                (1i64 << bits) - 1,
            ),
            _ => (i64::MIN, i64::MAX),
        };
        if !(least..=most).contains(&value) {
            return Err(DebugError::ValueOutOfRange { value, least, most });
        }
        let byte = |n: usize| match cells.get(n) {
            Some(ObjectByteLocation::Memory(space, addr)) => Ok((*space, *addr)),
            Some(ObjectByteLocation::OptimizedAway | ObjectByteLocation::Value(_)) => Err(DebugError::OptimizedAway),
            _ => Err(DebugError::InNoMemory),
        };
        if let Some(BitRange { first, size }) = self.bits {
            return (0..size)
                .map(|n| {
                    let (space, addr) = byte(((first + n) / 8) as usize)?;
                    let place = ExpressionPlace::Bit { space, addr, bit: ((first + n) % 8) as u8 };
                    Ok(PlaceWrite { place, value: value >> n & 1 })
                })
                .collect();
        }
        let bytes = value.to_le_bytes();
        (0..cells.len().min(8))
            .map(|n| {
                let (space, addr) = byte(n)?;
                Ok(PlaceWrite {
                    place: ExpressionPlace::Memory { space, addr, bytes: 1, signed: false },
                    value: bytes.get(n).copied().unwrap_or(0).into(),
                })
            })
            .collect()
    }

    /// Returns true if it has one value but no location of up to four bytes.
    pub(in crate::debug) fn is_wider_than_place(&self, machine: &dyn DynMachine) -> bool {
        match self.resolved_type() {
            Some(CType::Record { .. } | CType::Array { .. } | CType::Function { .. }) => true,
            Some(CType::Base { encoding: BaseEncoding::Float, .. }) => true,
            _ => self.bytes().is_none_or(|bytes| bytes > 4) || self.place(machine).is_none(),
        }
    }
}
