//! Separates rows of dropped functions from rows of real code at address 0.
//!
//! A linker that drops a section (`--gc-sections`) has no address for the debugging information of it. GNU ld
//! writes 0 in .debug_line, and 0 or 1 in lists of ranges. LLD writes the highest addresses, which `gimli`
//! leaves out. DWARF 5 gives such ranges their real length, so a dropped function seems to be at address 0,
//! on top of the vector table and the code after it. But code can really be there: vectors in assembler, or
//! the `main` of a program without vectors.
//!
//! The symbol table decides. A function that exists has a symbol at 0 and an entry of that name in its unit;
//! a dropped one has only the entry. Rows without an entry (assembler, files without symbols) are doubtful:
//! they are used only where no other line is.

use std::collections::HashSet;

use gimli::{AttributeValue, DebugInfoOffset, DebuggingInformationEntry, Dwarf, Reader as _, Section as _, Unit};

use super::{DwarfSlice, MAX_NAME};
use crate::image::elf;
use crate::image::source_lines::SourceLine;

/// The highest address that a linker writes for dropped code. Address 1 is never the start of an instruction
/// of its own.
const MAX_LOW_ADDRESS: u64 = 1;
/// Maximum number of references between entries that are followed to find a name.
const MAX_REFERENCES: usize = 4;

/// A sequence of rows with rising addresses in one section.
pub(super) struct LowSequence {
    start: u64,
    /// The address after the last row.
    pub end: u64,
    pub lines: Vec<SourceLine>,
}

impl LowSequence {
    /// Makes a sequence without lines that begins at an address.
    pub(super) fn new(start: u64) -> LowSequence {
        LowSequence { start, end: start, lines: Vec::new() }
    }

    /// Returns true if the sequence starts at an address that linkers use for dropped code.
    pub(super) fn is_low(&self) -> bool {
        self.start <= MAX_LOW_ADDRESS
    }
}

/// What is known about the code at address 0.
pub(super) struct DroppedScan<'a, 'b> {
    dwarf: &'a Dwarf<DwarfSlice<'b>>,
    elf: &'a [u8],
    /// Names of the symbols at address 0, read on first use.
    owners: Option<HashSet<Vec<u8>>>,
    /// Number of attributes that may still be read.
    budget: usize,
}

/// The functions of some units that start at address 0.
#[derive(Default)]
struct LinkedFunctions {
    /// Whether any of them has a name.
    named: bool,
    /// Sizes in bytes of those that have a symbol.
    alive: Vec<u64>,
}

/// Lines of sequences that begin at address 0.
#[derive(Default)]
pub(super) struct SplitLines {
    /// Those that are code.
    pub kept: Vec<SourceLine>,
    /// Those of which it is not known.
    pub unsure: Vec<SourceLine>,
}

impl<'a, 'b> DroppedScan<'a, 'b> {
    /// Prepares the search; the work is limited by the size of the file.
    pub(super) fn new(dwarf: &'a Dwarf<DwarfSlice<'b>>, elf: &'a [u8]) -> Self {
        let budget = dwarf.debug_info.reader().len() * 4 + (1 << 20);
        DroppedScan { dwarf, elf, owners: None, budget }
    }

    /// Separates lines of sequences that are code from those of unknown sequences.
    pub(super) fn split_dropped(&mut self, low: Vec<LowSequence>, units: &[Unit<DwarfSlice<'b>>]) -> SplitLines {
        let mut functions = LinkedFunctions::default();
        for unit in units {
            // A damaged unit gives no more functions.
            _ = self.functions(unit, units, &mut functions);
        }
        let nobody = self.linked_names().is_empty();
        if !functions.alive.is_empty() {
            // Of several sequences at 0 the real one is the one whose end fits the function best.
            let fits = |sequence: &LowSequence| {
                let sizes = functions.alive.iter().filter_map(|size| sequence.end.checked_sub(*size));
                sizes.min()
            };
            let best = low.into_iter().filter_map(|s| Some((fits(&s)?, s))).min_by_key(|(over, _)| *over);
            let kept = best.map(|(_, sequence)| sequence.lines).unwrap_or_default();
            return SplitLines { kept, unsure: Vec::new() };
        }
        if functions.named && !nobody {
            return SplitLines::default();
        }
        SplitLines { kept: Vec::new(), unsure: low.into_iter().flat_map(|sequence| sequence.lines).collect() }
    }

    fn linked_names(&mut self) -> &HashSet<Vec<u8>> {
        let elf = self.elf;
        self.owners.get_or_insert_with(|| {
            let mut owners = HashSet::new();
            for name in elf::code_names_at(elf, 0).into_iter().filter(|name| name.len() <= MAX_NAME) {
                // A clone that the compiler made has a suffix after a dot: `scale.constprop.0`.
                let stem = name.split(|byte| *byte == b'.').next().unwrap_or_default();
                owners.insert(stem.to_vec());
                owners.insert(name.to_vec());
            }
            owners
        })
    }

    /// Adds the functions of a unit that start at address 0.
    fn functions(
        &mut self,
        unit: &Unit<DwarfSlice<'b>>,
        units: &[Unit<DwarfSlice<'b>>],
        into: &mut LinkedFunctions,
    ) -> Result<(), gimli::Error> {
        let dwarf = self.dwarf;
        let mut entries = unit.entries();
        while let Some(entry) = entries.next_dfs()? {
            let Some(left) = self.budget.checked_sub(entry.attrs().len() + 1) else { return Ok(()) };
            self.budget = left;
            if entry.tag() != gimli::DW_TAG_subprogram {
                continue;
            }
            let Some(low) = entry.attr_value(gimli::DW_AT_low_pc) else { continue };
            if dwarf.attr_address(unit, low)?.is_none_or(|low| low > MAX_LOW_ADDRESS) {
                continue;
            }
            let size = match entry.attr_value(gimli::DW_AT_high_pc) {
                Some(AttributeValue::Udata(size)) => size,
                Some(value) => dwarf.attr_address(unit, value)?.unwrap_or(0),
                None => 0,
            };
            let names = linkage_names(dwarf, unit, units, entry);
            into.named |= !names.is_empty();
            if names.iter().any(|name| self.linked_names().contains(name.slice())) {
                into.alive.push(size);
            }
        }
        Ok(())
    }
}

/// The names under which a linker can know a function: its own, and those of entries that it refers to, in
/// its unit or in another unit of its line program.
fn linkage_names<'b>(
    dwarf: &Dwarf<DwarfSlice<'b>>,
    unit: &Unit<DwarfSlice<'b>>,
    units: &[Unit<DwarfSlice<'b>>],
    entry: &DebuggingInformationEntry<DwarfSlice<'b>>,
) -> Vec<DwarfSlice<'b>> {
    const NAME_ATTRIBUTES: [gimli::DwAt; 3] =
        [gimli::DW_AT_linkage_name, gimli::DW_AT_MIPS_linkage_name, gimli::DW_AT_name];
    const REFERENCE_ATTRIBUTES: [gimli::DwAt; 2] = [gimli::DW_AT_specification, gimli::DW_AT_abstract_origin];
    let (mut unit, mut entry, mut found) = (unit, entry.clone(), Vec::new());
    for _ in 0..MAX_REFERENCES {
        let here = NAME_ATTRIBUTES.into_iter().filter_map(|name| dwarf.attr_string(unit, entry.attr_value(name)?).ok());
        found.extend(here.filter(|name| name.len() <= MAX_NAME));
        let next = match REFERENCE_ATTRIBUTES.into_iter().find_map(|name| entry.attr_value(name)) {
            Some(AttributeValue::UnitRef(offset)) => unit.entry(offset).ok(),
            Some(AttributeValue::DebugInfoRef(offset)) => {
                referenced_entry(units, offset).and_then(|ReferencedEntry { unit: other, offset }| {
                    unit = other;
                    unit.entry(offset).ok()
                })
            }
            _ => None,
        };
        match next {
            Some(next) => entry = next,
            None => break,
        }
    }
    found
}

/// An entry of .debug_info as its unit and the offset there.
struct ReferencedEntry<'u, 'b> {
    /// The unit that contains the entry.
    unit: &'u Unit<DwarfSlice<'b>>,
    /// The offset of the entry in the unit.
    offset: gimli::UnitOffset,
}

/// Finds the unit that contains the entry at an offset of .debug_info.
fn referenced_entry<'u, 'b>(
    units: &'u [Unit<DwarfSlice<'b>>],
    offset: DebugInfoOffset,
) -> Option<ReferencedEntry<'u, 'b>> {
    const MAX_DEPTH: usize = 256;
    units
        .iter()
        .take(MAX_DEPTH)
        .find_map(|unit| Some(ReferencedEntry { unit, offset: offset.to_unit_offset(&unit.header)? }))
}

/// Adds doubtful lines whose start no other line covers; each ends at the latest where the next line starts.
pub(super) fn add_where_free(lines: &mut Vec<SourceLine>, doubtful: Vec<SourceLine>) {
    if doubtful.is_empty() {
        return;
    }
    let mut covered: Vec<(u32, u32)> =
        lines.iter().map(|line| (line.addr, line.addr.saturating_add(line.len))).collect();
    covered.sort_unstable();
    // The end of what starts before an address is the largest of the ends.
    let mut end = 0;
    for (_, own) in &mut covered {
        end = end.max(*own);
        *own = end;
    }
    for mut line in doubtful {
        let behind = covered.partition_point(|(start, _)| *start <= line.addr);
        let free = behind.checked_sub(1).and_then(|at| covered.get(at)).is_none_or(|(_, end)| *end <= line.addr);
        if free {
            let next = covered.get(behind).map_or(u32::MAX, |(start, _)| *start);
            line.len = line.len.min(next - line.addr);
            lines.push(line);
        }
    }
}
