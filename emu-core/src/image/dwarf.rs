//! Source lines out of the debugging information of ELF files: DWARF 2 to 5, parsed by `gimli`, and stabs
//! (`stabs.rs`).
//!
//! ```text
//!   .debug_info   units: where each has code, the folder of its compilation, its line program
//!   .debug_line   line programs: rows of address, file, line
//! ```
//!
//! A linker that drops a section leaves its rows in the file, at address 0. Rows outside of the ranges of
//! their unit are left out; `dropped.rs` judges rows that the ranges do not decide. Several units can refer
//! to one line program: AVR-LibC describes the chip in a unit without code, which refers to the first line
//! program of the file. A line program is therefore read once, with the ranges of all its units.
//!
//! Reading ends for any input: every table is read once, and whatever can be referred to repeatedly (line
//! programs, ranges) has a budget in the order of the file size.

mod dropped;

use crate::image::elf::NamedSection;
use crate::image::stabs::StabLines;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::ops::Range;
use std::sync::Arc;

use diag::{Diagnostic, Pos, Severity};
use gimli::{
    AttributeValue, DebugAbbrev, DebugAbbrevOffset, DebugLineOffset, Dwarf, EndianSlice, Error, IncompleteLineProgram,
    LineProgramHeader, LittleEndian as Le, Reader as _, Section as _, SectionId, Unit,
};

use super::elf::{self, DebugSection};
use super::source_lines::{LineTable, SourceFileNames, SourceLine, join_path, source_kind};
use super::stabs;
use dropped::{DroppedScan, LowSequence};

type DwarfSlice<'b> = EndianSlice<'b, Le>;

/// Code of the warning about damaged debugging information.
const DAMAGED: &str = "ELF012";
/// Code of the warning about compressed debugging information.
const COMPRESSED: &str = "ELF013";
/// Code of the warning about stabs that are damaged.
const DAMAGED_STABS: &str = "ELF014";
/// Longest name of a source file; longer ones are of a damaged file.
const MAX_NAME: usize = 4096;

/// Reads the source lines of an ELF file. A file without debugging information gives no lines and no warning.
pub(super) fn read_line_table(file: &str, bytes: &[u8]) -> LineTable {
    let warn = |code, cause, hint| Diagnostic::new(Severity::Warning, code, file, Pos::default(), cause, hint);
    let bytes = elf::aligned(bytes);
    let sections = elf::debug_sections(&bytes);
    let Some(sections) = sections else {
        let hint = "the file is cut off or damaged: build or get it again";
        return with_only_warning(warn(DAMAGED, "the debugging information cannot be found".to_owned(), hint));
    };
    if sections.iter().any(|NamedSection { section, .. }| matches!(section, DebugSection::Compressed)) {
        let cause = "the debugging information is compressed, so source lines are not known".to_owned();
        let hint = "link without -gz, or avr-objcopy --decompress-debug-sections";
        return with_only_warning(warn(COMPRESSED, cause, hint));
    }
    let section = |id: SectionId| -> Result<DwarfSlice<'_>, Error> {
        let named = sections.iter().find(|NamedSection { name, .. }| *name == id.name());
        Ok(EndianSlice::new(named.map_or(&[], |NamedSection { section, .. }| section.bytes()), Le))
    };
    let mut reader = DwarfLineReader::default();
    if let Ok(dwarf) = Dwarf::load(section) {
        reader.read_units(&dwarf, &bytes);
    }
    let damaged = reader.fault.map(|fault| {
        let cause = format!("the debugging information is damaged, so source lines may be missing: {fault}");
        warn(DAMAGED, cause, "build the program again")
    });
    let StabLines { lines, fault } = stabs::read_stab_lines(&sections, &bytes, &mut reader.names, &mut reader.doubled);
    reader.lines.extend(lines);
    let stabs = fault.map(|fault| {
        let cause = format!("the debugging information (stabs) is damaged, so source lines may be missing: {fault}");
        warn(DAMAGED_STABS, cause, "build the program again")
    });
    let warnings = damaged.into_iter().chain(stabs).collect();
    let mut found = LineTable::from_lines(reader.lines, reader.names.folders, warnings);
    (found.doubled, found.parts) = (reader.doubled, reader.parts);
    found
}

/// A table without lines and with one warning.
fn with_only_warning(warning: Diagnostic) -> LineTable {
    LineTable::from_lines(Vec::new(), Vec::new(), vec![warning])
}

/// A line program that units refer to.
struct LineProgram<'b> {
    program: IncompleteLineProgram<DwarfSlice<'b>>,
    folder: String,
    /// Ranges of code of the units; empty if the units do not give any.
    ranges: Vec<Range<u64>>,
    /// Whether a unit gives ranges of code, even if they are empty.
    has_ranges: bool,
    /// The units that refer to it.
    units: Vec<Unit<DwarfSlice<'b>>>,
}

/// A row of a line program.
#[derive(Debug, Clone, Copy)]
struct InstructionRow {
    addr: u64,
    file: u64,
    line: u32,
    is_statement: bool,
}

#[derive(Default)]
struct DwarfLineReader {
    lines: Vec<SourceLine>,
    /// Byte addresses at which two rows begin: no code belongs to the first.
    doubled: BTreeSet<u32>,
    /// Byte addresses of rows that do not start a statement.
    parts: BTreeSet<u32>,
    /// Names of files that occurred.
    names: SourceFileNames,
    /// The first thing that was wrong.
    fault: Option<String>,
}

impl DwarfLineReader {
    fn warn_damaged(&mut self, why: impl ToString) {
        self.fault.get_or_insert_with(|| why.to_string());
    }

    fn read_units(&mut self, dwarf: &Dwarf<DwarfSlice<'_>>, elf: &[u8]) {
        let mut programs: BTreeMap<usize, LineProgram<'_>> = BTreeMap::new();
        let mut budget = ReadBudget { heads: dwarf.debug_line.reader().len() * 4 + (1 << 20), ranges: 1 << 16 };
        each_unit(dwarf, &mut |unit| {
            if let Err(error) = unit.and_then(|unit| add_unit(dwarf, unit, &mut programs, &mut budget)) {
                self.warn_damaged(error);
            }
            if budget.is_spent() {
                self.warn_damaged("its units have more ranges, or heads of line programs, than a program can have");
            }
            !budget.is_spent()
        });
        let mut rows = dwarf.debug_line.reader().len();
        let (mut scan, mut doubtful) = (DroppedScan::new(dwarf, elf), Vec::new());
        for mut program in programs.into_values() {
            let units = std::mem::take(&mut program.units);
            let mut low = Vec::new();
            if let Err(error) = self.read_line_program(dwarf, program, &mut rows, &mut low) {
                self.warn_damaged(error);
            }
            if !low.is_empty() {
                let split = scan.split_dropped(low, &units);
                self.lines.extend(split.kept);
                doubtful.extend(split.unsure);
            }
        }
        dropped::add_where_free(&mut self.lines, doubtful);
    }

    /// Adds the rows of a line program. Rows of sequences that start where dropped code is placed go to
    /// `low`. A row takes at least one byte of the program, so the number of rows `most` for all programs
    /// cannot be exceeded by undamaged files.
    fn read_line_program(
        &mut self,
        dwarf: &Dwarf<DwarfSlice<'_>>,
        program: LineProgram<'_>,
        most: &mut usize,
        low: &mut Vec<LowSequence>,
    ) -> Result<(), Error> {
        let LineProgram { program, folder, ranges, has_ranges, .. } = program;
        let mut files: HashMap<u64, Option<Arc<str>>> = HashMap::new();
        let mut rows = program.rows();
        let mut last: Option<InstructionRow> = None;
        let mut parts = false;
        let mut sequence: Option<LowSequence> = None;
        while let Some((header, row)) = rows.next_row()? {
            let Some(left) = most.checked_sub(1) else {
                self.warn_damaged("its line programs overlap");
                return Ok(());
            };
            *most = left;
            let (addr, index) = (row.address(), row.file_index());
            let line = row.line().map_or(0, |line| u32::try_from(line.get()).unwrap_or(0));
            let is_same = last.is_some_and(|last| (last.file, last.line) == (index, line));
            // Parts of one line are one row if the compiler has numbered them with discriminators, as in gdb.
            parts = row.discriminator() != 0 || is_same && parts;
            if is_same && parts && !row.end_sequence() {
                continue;
            }
            if last.is_some_and(|last| last.addr == addr) && !row.end_sequence() {
                self.doubled.extend(u32::try_from(addr));
            }
            let current = sequence.get_or_insert_with(|| LowSequence::new(addr));
            current.end = addr;
            if let Some(InstructionRow { addr: start, file, line, is_statement }) =
                last.take().filter(|last| last.addr < addr)
            {
                let known = !has_ranges || ranges.iter().any(|range| range.contains(&start));
                let name = files.entry(file).or_insert_with(|| self.file_name(dwarf, header, file, &folder));
                if let (true, Some(file), Ok(at), Ok(len)) =
                    (known && line > 0, name, u32::try_from(start), u32::try_from(addr - start))
                {
                    let (kind, file) = (source_kind(file), Arc::clone(file));
                    let into = if current.is_low() { &mut current.lines } else { &mut self.lines };
                    into.push(SourceLine { addr: at, kind, file, line, len });
                    self.parts.extend((!is_statement).then_some(at));
                }
            }
            // Of several rows at one address the last one applies to the code.
            let is_statement = row.is_stmt();
            last = (!row.end_sequence()).then_some(InstructionRow { addr, file: index, line, is_statement });
            if row.end_sequence() {
                low.extend(sequence.take().filter(|sequence| !sequence.lines.is_empty()));
            }
        }
        Ok(())
    }

    /// The name of a file of a line program, relative to the folder of the compilation or absolute.
    fn file_name(
        &mut self,
        dwarf: &Dwarf<DwarfSlice<'_>>,
        header: &LineProgramHeader<DwarfSlice<'_>>,
        index: u64,
        folder: &str,
    ) -> Option<Arc<str>> {
        let text = |value| dwarf.attr_line_string(value).ok().map(lossy_text);
        let file = header.file(index)?;
        let name = text(file.path_name())?;
        // Folder 0 is the folder of the compilation; before DWARF 5 it is not in the table.
        let inner = match (file.directory_index(), header.version()) {
            (0, _) => String::new(),
            _ => file.directory(header).and_then(text)?,
        };
        Some(self.names.intern(&join_path(&inner, &name), folder))
    }
}

/// Calls `each` for every unit, or for the error of a damaged one, until `each` returns false.
pub(super) fn each_unit<'b>(
    dwarf: &Dwarf<DwarfSlice<'b>>,
    each: &mut dyn FnMut(Result<Unit<DwarfSlice<'b>>, Error>) -> bool,
) {
    let mut headers = Vec::new();
    let mut units = dwarf.units();
    let damaged = loop {
        match units.next() {
            Ok(Some(header)) => headers.push(header),
            Ok(None) => break None,
            Err(error) => break Some(error),
        }
    };
    if damaged.is_some_and(|error| !each(Err(error))) {
        return;
    }
    // The abbreviations of a unit end at the latest where those of another one start.
    let starts: BTreeSet<usize> = headers.iter().map(|header| header.debug_abbrev_offset().0).collect();
    let mut abbreviations = HashMap::new();
    let all = dwarf.debug_abbrev.reader().slice();
    for header in headers {
        let DebugAbbrevOffset(start) = header.debug_abbrev_offset();
        let end = starts.range(start.saturating_add(1)..).next().copied().unwrap_or(all.len());
        let table = abbreviations.entry(start).or_insert_with(|| {
            let table = all.get(start..end.min(all.len())).unwrap_or_default();
            DebugAbbrev::from(EndianSlice::new(table, Le)).abbreviations(DebugAbbrevOffset(0)).map(Arc::new)
        });
        let unit = match table {
            Ok(table) => Unit::new_with_abbreviations(dwarf, header, Arc::clone(table)),
            Err(error) => Err(*error),
        };
        if !each(unit) {
            return;
        }
    }
}

/// Limits for what all units together may refer to.
struct ReadBudget {
    /// Bytes of line program headers, which are read once per unit.
    heads: usize,
    /// Number of code ranges.
    ranges: usize,
}

impl ReadBudget {
    fn is_spent(&self) -> bool {
        self.heads == 0 || self.ranges == 0
    }
}

/// Adds a unit to its line program.
fn add_unit<'b>(
    dwarf: &Dwarf<DwarfSlice<'b>>,
    unit: Unit<DwarfSlice<'b>>,
    programs: &mut BTreeMap<usize, LineProgram<'b>>,
    budget: &mut ReadBudget,
) -> Result<(), Error> {
    let Some(program) = unit.line_program.clone() else { return Ok(()) };
    let DebugLineOffset(offset) = program.header().offset();
    budget.heads = budget.heads.saturating_sub(program.header().header_length());
    let folder = unit.comp_dir.map(lossy_text).unwrap_or_default();
    let ranges = ranges(dwarf, &unit, budget)?;
    let known = programs.entry(offset).or_insert_with(|| LineProgram {
        program,
        folder: String::new(),
        ranges: Vec::new(),
        has_ranges: false,
        units: Vec::new(),
    });
    if ranges.is_some() || known.folder.is_empty() {
        known.folder = folder;
    }
    known.has_ranges |= ranges.is_some();
    known.ranges.extend(ranges.unwrap_or_default());
    known.units.push(unit);
    Ok(())
}

/// The code ranges of a unit, or `None` if it does not give any.
fn ranges(
    dwarf: &Dwarf<DwarfSlice<'_>>,
    unit: &Unit<DwarfSlice<'_>>,
    budget: &mut ReadBudget,
) -> Result<Option<Vec<Range<u64>>>, Error> {
    let mut entries = unit.entries();
    let Some(root) = entries.next_dfs()? else { return Ok(None) };
    if let Some(value) = root.attr_value(gimli::DW_AT_ranges)
        && let Some(mut list) = dwarf.attr_ranges(unit, value)?
    {
        let mut ranges = Vec::new();
        while let Some(range) = list.next()? {
            ranges.push(range.begin..range.end);
            budget.ranges = budget.ranges.saturating_sub(1);
            if budget.is_spent() {
                break;
            }
        }
        return Ok(Some(ranges));
    }
    let Some(low) = root.attr_value(gimli::DW_AT_low_pc).and(Some(unit.low_pc)) else { return Ok(None) };
    let high = match root.attr_value(gimli::DW_AT_high_pc) {
        Some(AttributeValue::Udata(size)) => low.checked_add(size),
        Some(value) => dwarf.attr_address(unit, value)?,
        None => None,
    };
    Ok(high.map(|high| std::iter::once(low..high).collect()))
}

fn lossy_text(text: DwarfSlice<'_>) -> String {
    let bytes = text.slice();
    String::from_utf8_lossy(bytes.get(..bytes.len().min(MAX_NAME)).unwrap_or_default()).into_owned()
}
