//! Source lines out of the debugging information of ELF files: DWARF 2 to 5, parsed by `gimli`, and stabs (`stabs.rs`).
//!
//! ```text
//!   .debug_info   units: where each has code, the folder of its compilation, its line program
//!   .debug_line   line programs: rows of address, file, line
//! ```
//!
//! A linker that drops a section leaves its rows behind, at address 0. Rows outside of the ranges of their unit are left out;
//! what the ranges do not tell is judged in `dropped.rs`. Several units may name one line program (AVR-LibC describes
//! the chip in a unit without code, which names whatever comes first), so it is read once, with the ranges of all of them.
//!
//! Whatever the bytes are, reading ends: every table is read once, and what could be named again and again (line programs,
//! ranges) has a budget of the order of the file's size.

mod dropped;

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

/// Code of the warning about what is damaged.
const DAMAGED: &str = "ELF012";
/// Code of the warning about what is compressed.
const COMPRESSED: &str = "ELF013";
/// Code of the warning about stabs that are damaged.
const DAMAGED_STABS: &str = "ELF014";
/// Longest name of a source file; longer ones are of a damaged file.
const MAX_NAME: usize = 4096;

/// The lines of an ELF file; none and no warning where it has none.
pub(super) fn read_line_table(file: &str, bytes: &[u8]) -> LineTable {
    let warn = |code, cause, hint| Diagnostic::new(Severity::Warning, code, file, Pos::default(), cause, hint);
    let bytes = elf::aligned(bytes);
    let sections = elf::debug_sections(&bytes);
    let Some(sections) = sections else {
        let hint = "the file is cut off or damaged: build or get it again";
        return with_only_warning(warn(DAMAGED, "the debugging information cannot be found".to_owned(), hint));
    };
    if sections.iter().any(|(_, section)| matches!(section, DebugSection::Compressed)) {
        let cause = "the debugging information is compressed, so source lines are not known".to_owned();
        let hint = "link without -gz, or avr-objcopy --decompress-debug-sections";
        return with_only_warning(warn(COMPRESSED, cause, hint));
    }
    let section = |id: SectionId| -> Result<DwarfSlice<'_>, Error> {
        let named = sections.iter().find(|(name, _)| *name == id.name());
        Ok(EndianSlice::new(named.map_or(&[], |(_, section)| section.bytes()), Le))
    };
    let mut reader = DwarfLineReader::default();
    if let Ok(dwarf) = Dwarf::load(section) {
        reader.read_units(&dwarf, &bytes);
    }
    let damaged = reader.fault.map(|fault| {
        let cause = format!("the debugging information is damaged, so source lines may be missing: {fault}");
        warn(DAMAGED, cause, "build the program anew")
    });
    let (lines, fault) = stabs::read_stab_lines(&sections, &bytes, &mut reader.names, &mut reader.doubled);
    reader.lines.extend(lines);
    let stabs = fault.map(|fault| {
        let cause = format!("the debugging information (stabs) is damaged, so source lines may be missing: {fault}");
        warn(DAMAGED_STABS, cause, "build the program anew")
    });
    let warnings = damaged.into_iter().chain(stabs).collect();
    let mut found = LineTable::from_lines(reader.lines, reader.names.folders, warnings);
    (found.doubled, found.parts) = (reader.doubled, reader.parts);
    found
}

/// No lines, and why.
fn with_only_warning(warning: Diagnostic) -> LineTable {
    LineTable::from_lines(Vec::new(), Vec::new(), vec![warning])
}

/// A line program that units name.
struct LineProgram<'b> {
    program: IncompleteLineProgram<DwarfSlice<'b>>,
    folder: String,
    /// Where the units have code; empty where they do not tell.
    ranges: Vec<Range<u64>>,
    /// True when a unit tells where it has code, be it nowhere.
    told: bool,
    /// The units.
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
    /// Byte addresses of rows that begin no statement.
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
                let (kept, unsure) = scan.split_dropped(low, &units);
                self.lines.extend(kept);
                doubtful.extend(unsure);
            }
        }
        dropped::add_where_free(&mut self.lines, doubtful);
    }

    /// Adds the rows of a line program; those of sequences that begin where dropped code is put go to `low`. A row takes a byte of the
    /// program at least, so that `most` rows of all programs suffice.
    fn read_line_program(
        &mut self,
        dwarf: &Dwarf<DwarfSlice<'_>>,
        program: LineProgram<'_>,
        most: &mut usize,
        low: &mut Vec<LowSequence>,
    ) -> Result<(), Error> {
        let LineProgram { program, folder, ranges, told, .. } = program;
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
            // Parts of one line are one row where the compiler has numbered them, as gdb has it.
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
                let known = !told || ranges.iter().any(|range| range.contains(&start));
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
            // Of several rows at one address the last is that of the code.
            let is_statement = row.is_stmt();
            last = (!row.end_sequence()).then_some(InstructionRow { addr, file: index, line, is_statement });
            if row.end_sequence() {
                low.extend(sequence.take().filter(|sequence| !sequence.lines.is_empty()));
            }
        }
        Ok(())
    }

    /// The name of a file of a line program, below the folder of the compilation or absolute.
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
        // Folder 0 is that of the compilation; before DWARF 5 it does not stand in the table.
        let inner = match (file.directory_index(), header.version()) {
            (0, _) => String::new(),
            _ => file.directory(header).and_then(text)?,
        };
        Some(self.names.intern(&join_path(&inner, &name), folder))
    }
}

/// Hands out the units one by one, and what is wrong with those that are damaged, until `each` answers with false.
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
    // The abbreviations of a unit end where those of another begin, at the latest.
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

/// What units together may still name.
struct ReadBudget {
    /// Bytes of heads of line programs, which are read once a unit.
    heads: usize,
    /// Ranges of code.
    ranges: usize,
}

impl ReadBudget {
    fn is_spent(&self) -> bool {
        self.heads == 0 || self.ranges == 0
    }
}

/// Adds what a unit says to its line program.
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
        told: false,
        units: Vec::new(),
    });
    if ranges.is_some() || known.folder.is_empty() {
        known.folder = folder;
    }
    known.told |= ranges.is_some();
    known.ranges.extend(ranges.unwrap_or_default());
    known.units.push(unit);
    Ok(())
}

/// Where a unit has code; nothing where it does not tell.
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
