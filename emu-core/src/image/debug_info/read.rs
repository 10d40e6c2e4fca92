//! Reads the entries of `.debug_info` as functions, blocks, variables and types.
//!
//! Entries come depth first. The next entry that is not deeper closes an open entry, which is then added to
//! the open entry around it. Reading ends for any input: each entry is read once, and location lists and
//! ranges have a budget in the order of the file size.

mod attributes;
mod unit_context;

use crate::image::debug_info::BitsInByte;
use crate::image::elf::NamedSection;
use std::collections::HashMap;
use std::ops::Range;

use gimli::{
    AttributeValue, DebuggingInformationEntry, DwAt, Dwarf, EndianSlice, Error, LittleEndian as Le, SectionId, Unit,
    UnitOffset,
};

use unit_context::UnitContext;

use attributes::{constant_bytes, encoding, lossy_text, range, signed_value, unsigned_attribute};

use super::{
    BitRange, BlockInfo, CType, DebugInfo, FunctionInfo, StructMember, TypeId, UnitInfo, VariableInfo,
    VariableLocation, stabs,
};
use crate::image::{dwarf, elf};

type DwarfSlice<'b> = EndianSlice<'b, Le>;
type DwarfEntry<'b> = DebuggingInformationEntry<DwarfSlice<'b>>;

/// Maximum nesting depth of entries inside which blocks and variables are kept.
const MAX_DEPTH: usize = 200;

/// Reads the debugging information of an ELF file; damaged parts are left out.
pub(super) fn read_debug_info(bytes: &[u8]) -> DebugInfo {
    let bytes = elf::aligned(bytes);
    let Some(sections) = elf::debug_sections(&bytes) else { return DebugInfo::default() };
    let named = |name: &str| {
        sections
            .iter()
            .find(|NamedSection { name: own, .. }| *own == name)
            .map_or(&[][..], |NamedSection { section, .. }| section.bytes())
    };
    let section = |id: SectionId| -> Result<DwarfSlice<'_>, Error> { Ok(EndianSlice::new(named(id.name()), Le)) };
    let mut info = Dwarf::load(section).map_or_else(|_| DebugInfo::default(), |dwarf| read_dwarf(&dwarf, &bytes));
    info.frames = named(".debug_frame").to_vec();
    info.addresses = named(".debug_addr").to_vec();
    let last = info.types.last_key_value().map_or(0, |(last, _)| last.saturating_add(1));
    stabs::add_stabs(&mut info, &sections, &bytes, last.max(named(".debug_info").len()));
    info
}

fn read_dwarf(dwarf: &Dwarf<DwarfSlice<'_>>, bytes: &[u8]) -> DebugInfo {
    let mut reader = DebugInfoReader { budget: bytes.len() * 4 + (1 << 20), ..DebugInfoReader::default() };
    dwarf::each_unit(dwarf, &mut |unit| {
        if let Ok(unit) = unit {
            // The header of a line program is read again for each unit that refers to it.
            let head = unit.line_program.as_ref().map_or(0, |program| program.header().header_length());
            reader.budget = reader.budget.saturating_sub(head);
            reader.unit(dwarf, &unit);
        }
        reader.budget > 0
    });
    reader.finish(&elf::code_names_at(bytes, 0))
}

/// An entry whose children are still being read.
enum OpenEntry {
    Function(FunctionInfo),
    Block(BlockInfo),
    /// A type whose members, counts, constants or parameters follow.
    Type(TypeId),
    /// A call, by the byte address behind it.
    Call(u32),
    Other,
}

/// Name and type of an entry that other entries refer to.
#[derive(Default, Clone)]
struct EntryFacts {
    name: Option<String>,
    of: Option<TypeId>,
    line: u32,
    external: bool,
    origin: Option<usize>,
}

#[derive(Default)]
struct DebugInfoReader {
    info: DebugInfo,
    open: Vec<(isize, OpenEntry)>,
    /// Variables and functions by the offsets of their entries.
    known: HashMap<usize, EntryFacts>,
    /// Whether GCC made the present unit.
    gcc: bool,
    /// Budget: bytes of line program headers, and entries of location lists and ranges, that may still be
    /// read.
    budget: usize,
}

impl DebugInfoReader {
    fn unit(&mut self, dwarf: &Dwarf<DwarfSlice<'_>>, unit: &Unit<DwarfSlice<'_>>) {
        let start = UnitOffset(0usize).to_debug_info_offset(&unit.header).map_or(0, |offset| offset.0);
        let text = |slice: Option<DwarfSlice<'_>>| slice.map(lossy_text).unwrap_or_default();
        self.info.units.push(UnitInfo {
            encoding: unit.encoding(),
            start,
            name: text(unit.name),
            folder: text(unit.comp_dir),
            addresses: unit.addr_base.0,
            ranges: Vec::new(),
            exact: false,
        });
        let mut entries = unit.entries();
        while let Ok(Some(entry)) = entries.next_dfs() {
            self.close_entries(entry.depth());
            let of = UnitContext { dwarf, unit, start };
            let open = self.entry(&of, entry);
            self.open.push((entry.depth(), open));
            if self.budget == 0 {
                break;
            }
        }
        self.close_entries(isize::MIN);
    }

    /// Closes all open entries at this depth or deeper.
    fn close_entries(&mut self, depth: isize) {
        while self.open.last().is_some_and(|(own, _)| *own >= depth) {
            match self.open.pop().map(|(_, open)| open) {
                Some(OpenEntry::Function(function)) if !function.block.ranges.is_empty() => {
                    self.info.functions.push(function)
                }
                Some(OpenEntry::Block(block)) => {
                    if let Some(around) = self.enclosing_block() {
                        around.blocks.push(block);
                    }
                }
                _ => {}
            }
        }
    }

    /// The innermost open block.
    fn enclosing_block(&mut self) -> Option<&mut BlockInfo> {
        if self.open.len() > MAX_DEPTH {
            return None;
        }
        self.open.iter_mut().rev().find_map(|(_, open)| match open {
            OpenEntry::Function(function) => Some(&mut function.block),
            OpenEntry::Block(block) => Some(block),
            OpenEntry::Type(_) | OpenEntry::Call(_) | OpenEntry::Other => None,
        })
    }

    fn entry(&mut self, of: &UnitContext<'_, '_>, entry: &DwarfEntry<'_>) -> OpenEntry {
        let id = TypeId(of.start.saturating_add(entry.offset().0));
        match entry.tag() {
            gimli::DW_TAG_compile_unit => {
                let ranges = self.ranges(of, entry);
                self.gcc = of.text(entry, gimli::DW_AT_producer).is_some_and(|name| name.starts_with("GNU "));
                if let Some(unit) = self.info.units.last_mut() {
                    unit.ranges = ranges;
                }
                OpenEntry::Other
            }
            gimli::DW_TAG_subprogram => {
                let known = self.record_facts(of, entry, id);
                let block = BlockInfo { ranges: self.ranges(of, entry), ..BlockInfo::default() };
                let frame_base = self.location(of, entry, gimli::DW_AT_frame_base);
                let name = known.name.unwrap_or_else(|| type_reference(known.origin));
                let (unit, line, external) = (self.info.units.len() - 1, known.line, known.external);
                let result = known.of;
                OpenEntry::Function(FunctionInfo { name, result, of: id, line, external, block, frame_base, unit })
            }
            gimli::DW_TAG_lexical_block => {
                OpenEntry::Block(BlockInfo { ranges: self.ranges(of, entry), ..BlockInfo::default() })
            }
            gimli::DW_TAG_inlined_subroutine => {
                let known = self.record_facts(of, entry, id);
                let inlined = Some(known.name.unwrap_or_else(|| type_reference(known.origin)));
                let file = unsigned_attribute(entry, gimli::DW_AT_call_file)
                    .and_then(|file| of.file(file))
                    .unwrap_or_default();
                let call = (file, unsigned_attribute(entry, gimli::DW_AT_call_line).unwrap_or(0));
                // If the call is unknown (DWARF 2), the entry is only a block, as in gdb.
                let inlined = inlined.filter(|_| call.1 > 0);
                OpenEntry::Block(BlockInfo {
                    ranges: self.ranges(of, entry),
                    inlined,
                    call_site: call,
                    ..BlockInfo::default()
                })
            }
            gimli::DW_TAG_variable | gimli::DW_TAG_formal_parameter => {
                self.variable(of, entry, id);
                OpenEntry::Other
            }
            gimli::DW_TAG_GNU_call_site | gimli::DW_TAG_call_site => {
                let behind = [gimli::DW_AT_call_return_pc, gimli::DW_AT_low_pc].into_iter();
                let address = |value| of.dwarf.attr_address(of.unit, value).ok().flatten();
                let behind = behind.filter_map(|name| entry.attr_value(name)).find_map(address);
                behind.and_then(|byte| u32::try_from(byte).ok()).map_or(OpenEntry::Other, OpenEntry::Call)
            }
            gimli::DW_TAG_GNU_call_site_parameter | gimli::DW_TAG_call_site_parameter => {
                self.call_parameter(entry);
                OpenEntry::Other
            }
            _ => self.read_type(of, entry, id),
        }
    }

    /// Adds a parameter to the call that is open.
    fn call_parameter(&mut self, entry: &DwarfEntry<'_>) {
        let Some((_, OpenEntry::Call(byte))) = self.open.last() else { return };
        let expression = |name: DwAt| match entry.attr_value(name)? {
            AttributeValue::Exprloc(expression) => Some(expression.0.slice().to_vec()),
            AttributeValue::Block(bytes) => Some(bytes.slice().to_vec()),
            _ => None,
        };
        let value = expression(gimli::DW_AT_call_value).or_else(|| expression(gimli::DW_AT_GNU_call_site_value));
        if let Some((location, value)) = expression(gimli::DW_AT_location).zip(value) {
            self.info.call_sites.add(*byte, &location, value);
        }
    }

    fn variable(&mut self, of: &UnitContext<'_, '_>, entry: &DwarfEntry<'_>, id: TypeId) {
        let parameter = entry.tag() == gimli::DW_TAG_formal_parameter;
        let known = self.record_facts(of, entry, id);
        if let (true, Some((_, OpenEntry::Type(function)))) = (parameter, self.open.last()) {
            if let Some(CType::Function { parameters, .. }) = self.info.types.get_mut(&function.0) {
                parameters.push(known.of);
            }
            return;
        }
        let declaration = entry.attr_value(gimli::DW_AT_declaration).is_some();
        let mut location = self.location(of, entry, gimli::DW_AT_location);
        if let Some(value) = entry.attr_value(gimli::DW_AT_const_value) {
            location = constant_bytes(&value).map_or(location, VariableLocation::Constant);
        }
        if let (true, VariableLocation::List(_), Some(unit)) = (self.gcc, &location, self.info.units.last_mut()) {
            unit.exact = true;
        }
        let name = known.name.unwrap_or_else(|| type_reference(known.origin));
        let unit = self.info.units.len() - 1;
        let variable = VariableInfo {
            name,
            variable_type: known.of,
            parameter,
            line: known.line,
            external: known.external,
            location,
            unit,
        };
        let outside = !self.open.iter().any(|(_, open)| matches!(open, OpenEntry::Function(_) | OpenEntry::Block(_)));
        match self.enclosing_block() {
            Some(block) if !declaration => block.variables.push(variable),
            None if outside && variable.location != VariableLocation::OptimizedOut => self.info.globals.push(variable),
            _ => {}
        }
    }

    /// Records name and type of a variable or function.
    fn record_facts(&mut self, of: &UnitContext<'_, '_>, entry: &DwarfEntry<'_>, id: TypeId) -> EntryFacts {
        let origin = [gimli::DW_AT_abstract_origin, gimli::DW_AT_specification].into_iter();
        let known = EntryFacts {
            name: of.name(entry),
            of: of.kind(entry, gimli::DW_AT_type),
            line: unsigned_attribute(entry, gimli::DW_AT_decl_line).unwrap_or(0),
            external: entry.attr_value(gimli::DW_AT_external).is_some(),
            origin: origin.filter_map(|name| of.kind(entry, name)).map(|id| id.0).next(),
        };
        self.known.insert(id.0, known.clone());
        known
    }

    fn read_type(&mut self, of: &UnitContext<'_, '_>, entry: &DwarfEntry<'_>, id: TypeId) -> OpenEntry {
        let (name, to) = (of.name(entry), of.kind(entry, gimli::DW_AT_type));
        let bytes = unsigned_attribute(entry, gimli::DW_AT_byte_size);
        let record =
            |keyword| CType::Record { keyword, name: name.clone(), bytes: bytes.unwrap_or(0), members: Vec::new() };
        let qualified = |word| CType::Qualified { word, of: to };
        let kind = match entry.tag() {
            gimli::DW_TAG_base_type => {
                let encoding = encoding(entry.attr_value(gimli::DW_AT_encoding));
                CType::Base { name: name.unwrap_or_default(), bytes: bytes.unwrap_or(0).min(16), encoding }
            }
            gimli::DW_TAG_pointer_type | gimli::DW_TAG_reference_type | gimli::DW_TAG_rvalue_reference_type => {
                CType::Pointer { to, bytes: bytes.unwrap_or(2).min(8) }
            }
            gimli::DW_TAG_array_type => CType::Array { of: to, counts: Vec::new() },
            gimli::DW_TAG_structure_type => record("struct"),
            gimli::DW_TAG_class_type => record("class"),
            gimli::DW_TAG_union_type => record("union"),
            gimli::DW_TAG_enumeration_type => {
                CType::Enum { name, bytes: bytes.unwrap_or(1).min(8), values: Vec::new() }
            }
            gimli::DW_TAG_typedef => CType::Named { name: name.unwrap_or_default(), of: to },
            gimli::DW_TAG_const_type => qualified("const"),
            gimli::DW_TAG_volatile_type => qualified("volatile"),
            gimli::DW_TAG_restrict_type => qualified("restrict"),
            gimli::DW_TAG_atomic_type => qualified("_Atomic"),
            gimli::DW_TAG_subroutine_type => {
                let prototyped = entry.attr_value(gimli::DW_AT_prototyped).is_some();
                CType::Function { result: to, parameters: Vec::new(), prototyped }
            }
            _ => {
                self.read_member(of, entry, name, to);
                return OpenEntry::Other;
            }
        };
        self.info.types.insert(id.0, kind);
        let file = unsigned_attribute(entry, gimli::DW_AT_decl_file).and_then(|file| of.file(file));
        let line = unsigned_attribute(entry, gimli::DW_AT_decl_line);
        self.info.definitions.extend(file.zip(line).map(|definition| (id.0, definition)));
        OpenEntry::Type(id)
    }

    /// Reads a member, count or constant of the type that is open.
    fn read_member(
        &mut self,
        of: &UnitContext<'_, '_>,
        entry: &DwarfEntry<'_>,
        name: Option<String>,
        to: Option<TypeId>,
    ) {
        let Some((_, OpenEntry::Type(id))) = self.open.last() else { return };
        let Some(kind) = self.info.types.get_mut(&id.0) else { return };
        match (entry.tag(), kind) {
            (gimli::DW_TAG_member, CType::Record { members, .. }) => {
                let offset = of.offset(entry);
                let bits = unsigned_attribute(entry, gimli::DW_AT_bit_size);
                let bits = bits.map(|size| match unsigned_attribute(entry, gimli::DW_AT_data_bit_offset) {
                    Some(first) => BitRange { first, size },
                    None => {
                        // DWARF 2 counts from the highest bit of the storage unit of the field.
                        let unit = unsigned_attribute(entry, gimli::DW_AT_byte_size).unwrap_or(1).min(8) * 8;
                        let above = unsigned_attribute(entry, gimli::DW_AT_bit_offset).unwrap_or(0);
                        BitRange { first: unit.saturating_sub(above.saturating_add(size)), size }
                    }
                });
                let whole = BitsInByte { offset, bits: None };
                let BitsInByte { offset, bits: bit_range } = bits.map_or(whole, |bits| bits.in_byte(offset));
                members.push(StructMember { name, offset, bit_range, member_type: to });
            }
            (gimli::DW_TAG_subrange_type, CType::Array { counts, .. }) => {
                let upper = unsigned_attribute(entry, gimli::DW_AT_upper_bound).and_then(|upper| upper.checked_add(1));
                counts.push(unsigned_attribute(entry, gimli::DW_AT_count).or(upper));
            }
            (gimli::DW_TAG_enumerator, CType::Enum { values, .. }) => {
                let value = entry.attr_value(gimli::DW_AT_const_value).and_then(|value| signed_value(&value));
                values.extend(name.zip(value));
            }
            _ => {}
        }
    }

    fn location(&mut self, of: &UnitContext<'_, '_>, entry: &DwarfEntry<'_>, name: DwAt) -> VariableLocation {
        let Some(value) = entry.attr_value(name) else { return VariableLocation::OptimizedOut };
        match value {
            AttributeValue::Exprloc(expression) => return VariableLocation::Expression(expression.0.slice().to_vec()),
            AttributeValue::Block(bytes) => return VariableLocation::Expression(bytes.slice().to_vec()),
            _ => {}
        }
        let Ok(Some(mut list)) = of.dwarf.attr_locations(of.unit, value) else { return VariableLocation::OptimizedOut };
        let mut found = Vec::new();
        while let Ok(Some(entry)) = list.next() {
            let bytes = entry.data.0.slice();
            let Some(left) = self.budget.checked_sub(bytes.len() + 1) else {
                self.budget = 0;
                break;
            };
            self.budget = left;
            found.extend(range(entry.range.begin..entry.range.end).map(|range| (range, bytes.to_vec())));
        }
        VariableLocation::List(found)
    }

    /// Byte addresses of the code of an entry.
    fn ranges(&mut self, of: &UnitContext<'_, '_>, entry: &DwarfEntry<'_>) -> Vec<Range<u32>> {
        let mut found = Vec::new();
        if let Some(value) = entry.attr_value(gimli::DW_AT_ranges)
            && let Ok(Some(mut list)) = of.dwarf.attr_ranges(of.unit, value)
        {
            while let Ok(Some(part)) = list.next() {
                self.budget = self.budget.saturating_sub(1);
                found.extend(range(part.begin..part.end));
                if self.budget == 0 {
                    break;
                }
            }
            return found;
        }
        let address = |value| of.dwarf.attr_address(of.unit, value).ok().flatten();
        let Some(low) = entry.attr_value(gimli::DW_AT_low_pc).and_then(address) else { return found };
        let high = match entry.attr_value(gimli::DW_AT_high_pc) {
            Some(value) => value.udata_value().and_then(|size| low.checked_add(size)).or_else(|| address(value)),
            None => None,
        };
        found.extend(high.and_then(|high| range(low..high)));
        found
    }

    /// Completes the result after all entries were read: names that refer to other entries are resolved.
    /// `zero` are the names of symbols at address 0.
    fn finish(self, zero: &[&[u8]]) -> DebugInfo {
        let DebugInfoReader { mut info, known, .. } = self;
        let find = |mut name: String, of: &mut Option<TypeId>, line: &mut u32, external: &mut bool| -> String {
            // A damaged file can have references in a cycle.
            for _ in 0..8 {
                let Some(at) = name.strip_prefix('\0').and_then(|at| at.parse().ok()) else { return name };
                let Some(other) = known.get(&at) else { break };
                (*of, *line) = (of.or(other.of), (*line).max(other.line));
                *external |= other.external;
                name = other.name.clone().unwrap_or_else(|| type_reference(other.origin));
            }
            if name.starts_with('\0') { String::new() } else { name }
        };
        let name = |name: &mut String, of: &mut Option<TypeId>, line: &mut u32, external: &mut bool| {
            *name = find(std::mem::take(name), of, line, external);
        };
        for function in &mut info.functions {
            name(&mut function.name, &mut function.result, &mut function.line, &mut function.external);
            let mut blocks = vec![&mut function.block];
            while let Some(block) = blocks.pop() {
                if let Some(inlined) = &mut block.inlined {
                    name(inlined, &mut None, &mut 0, &mut false);
                }
                for own in &mut block.variables {
                    name(&mut own.name, &mut own.variable_type, &mut own.line, &mut own.external);
                }
                block.variables.retain(|own| !own.name.is_empty());
                blocks.extend(&mut block.blocks);
            }
        }
        for own in &mut info.globals {
            name(&mut own.name, &mut own.variable_type, &mut own.line, &mut own.external);
        }
        // A linker that drops a function leaves its entry, at address 0.
        let kept = |function: &FunctionInfo| {
            let first = function.block.ranges.iter().map(|range| range.start).min();
            first != Some(0) || zero.contains(&function.name.as_bytes())
        };
        info.functions.retain(kept);
        finish_functions(&mut info);
        info
    }
}

/// Types of functions, by their parameters, and their order.
pub(super) fn finish_functions(info: &mut DebugInfo) {
    for function in &info.functions {
        let parameters = function.block.variables.iter().filter(|own| own.parameter).map(|own| own.variable_type);
        let (result, parameters) = (function.result, parameters.collect());
        info.types.insert(function.of.0, CType::Function { result, parameters, prototyped: true });
    }
    info.functions.sort_by_key(|function| function.block.ranges.iter().map(|range| range.start).min());
}

/// The placeholder of a name until all entries were read: none has such a character.
fn type_reference(origin: Option<usize>) -> String {
    origin.map_or(String::new(), |at| format!("\0{at}"))
}
