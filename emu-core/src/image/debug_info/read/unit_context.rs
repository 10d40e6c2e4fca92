//! The unit of an entry of `.debug_info`: its sections resolve the attributes of the entry.

use gimli::{AttributeValue, DwAt, Dwarf, Unit};

use super::attributes::{lossy_text, unsigned_attribute};
use super::{DwarfEntry, DwarfSlice};
use crate::image::debug_info::TypeId;

/// The unit to which an entry belongs.
pub(super) struct UnitContext<'a, 'b> {
    /// The sections of the file.
    pub dwarf: &'a Dwarf<DwarfSlice<'b>>,
    /// The unit.
    pub unit: &'a Unit<DwarfSlice<'b>>,
    /// Offset of the unit in `.debug_info`, in bytes.
    pub start: usize,
}

impl UnitContext<'_, '_> {
    /// The name of an entry.
    pub fn name(&self, entry: &DwarfEntry<'_>) -> Option<String> {
        self.text(entry, gimli::DW_AT_name)
    }

    /// A text attribute of an entry; `None` if it is missing or empty.
    pub fn text(&self, entry: &DwarfEntry<'_>, name: DwAt) -> Option<String> {
        let value = entry.attr_value(name)?;
        let name = match value {
            AttributeValue::String(name) => lossy_text(name),
            AttributeValue::DebugStrRef(offset) => lossy_text(self.dwarf.string(offset).ok()?),
            AttributeValue::DebugLineStrRef(offset) => lossy_text(self.dwarf.line_string(offset).ok()?),
            AttributeValue::DebugStrOffsetsIndex(index) => {
                let offset = self.dwarf.string_offset(self.unit, index).ok()?;
                lossy_text(self.dwarf.string(offset).ok()?)
            }
            _ => return None,
        };
        (!name.is_empty()).then_some(name)
    }

    /// The entry that an attribute refers to, by its offset.
    pub fn kind(&self, entry: &DwarfEntry<'_>, name: DwAt) -> Option<TypeId> {
        match entry.attr_value(name)? {
            AttributeValue::UnitRef(offset) => self.start.checked_add(offset.0).map(TypeId),
            AttributeValue::DebugInfoRef(offset) => Some(TypeId(offset.0)),
            _ => None,
        }
    }

    /// The name of a source file, given its number, without its folder.
    pub fn file(&self, number: u32) -> Option<String> {
        let header = self.unit.line_program.as_ref()?.header();
        let name = self.dwarf.attr_line_string(header.file(number.into())?.path_name()).ok().map(lossy_text)?;
        Some(name.rsplit('/').next().unwrap_or_default().to_owned())
    }

    /// Offset in bytes of a member.
    pub fn offset(&self, entry: &DwarfEntry<'_>) -> u32 {
        if let Some(offset) = unsigned_attribute(entry, gimli::DW_AT_data_member_location) {
            return offset;
        }
        let Some(AttributeValue::Exprloc(expression)) = entry.attr_value(gimli::DW_AT_data_member_location) else {
            return 0;
        };
        // In DWARF 2 the offset is an expression: add a constant.
        let mut operations = expression.operations(self.unit.encoding());
        match operations.next() {
            Ok(Some(gimli::Operation::PlusConstant { value })) => u32::try_from(value).unwrap_or(0),
            _ => 0,
        }
    }
}
