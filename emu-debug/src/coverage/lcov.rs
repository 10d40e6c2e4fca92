//! The coverage as an lcov tracefile (geninfo(1), "TRACEFILE FORMAT"), which `genhtml` and most coverage
//! tools read.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::CoveredInstruction;
use crate::names::program_source::ProgramSource;

/// A function, or a rung.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FunctionCount {
    /// Its first line.
    pub line: u32,
    /// Name.
    pub name: String,
    /// How often it was entered.
    pub count: u64,
}

/// The two outcomes of a branch.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BranchCount {
    /// Its line.
    pub line: u32,
    /// Distinguishes it from others on the line: the address of the instruction in program words, or the
    /// number of the element.
    pub block: u32,
    /// How often each outcome occurred; `None` if the branch was never executed.
    pub counts_by_outcome: Option<[u64; 2]>,
}

/// The record of a file.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct LcovRecord {
    /// Its name.
    pub file: String,
    /// Functions by line.
    pub functions: Vec<FunctionCount>,
    /// Branches by line.
    pub branches: Vec<BranchCount>,
    /// How often each line with code was executed: the highest count of its instructions.
    pub lines: BTreeMap<u32, u64>,
}

impl LcovRecord {
    /// Returns an empty record for a file.
    #[must_use]
    pub fn new(file: impl Into<String>) -> LcovRecord {
        LcovRecord { file: file.into(), ..LcovRecord::default() }
    }

    /// Adds an instruction to a line.
    pub fn add_instruction(&mut self, line: u32, reached: &CoveredInstruction) {
        let count = self.lines.entry(line).or_default();
        *count = (*count).max(reached.count);
        if let Some(ways) = reached.counts_by_outcome {
            let ways = (reached.count > 0).then_some(ways);
            self.branches.push(BranchCount { line, block: reached.instruction.pc, counts_by_outcome: ways });
        }
    }
}

/// Returns the records of a program's source files, by name. Empty if there is no line information.
#[must_use]
pub fn source_records(reached: &[CoveredInstruction], source: &ProgramSource<'_>) -> Vec<LcovRecord> {
    let mut files: BTreeMap<&str, LcovRecord> = BTreeMap::new();
    let functions = function_names(source);
    for one in reached {
        let Some(at) = source.line_at(one.instruction.pc) else { continue };
        let record = files.entry(&at.file).or_insert_with(|| LcovRecord::new(&*at.file));
        record.add_instruction(at.line, one);
        if let Some(name) = functions.get(&one.instruction.pc) {
            record.functions.push(FunctionCount { line: at.line, name: (*name).to_owned(), count: one.count });
        }
    }
    let mut records: Vec<LcovRecord> = files.into_values().collect();
    for record in &mut records {
        record.branches.sort_by_key(|branch| (branch.line, branch.block));
        record.functions.sort_by_key(|function| function.line);
    }
    records
}

/// Returns names of functions by program word: the symbols that have a size. Without sizes the result is
/// empty, because labels and functions cannot be distinguished.
pub(crate) fn function_names<'a>(source: &ProgramSource<'a>) -> BTreeMap<u32, &'a str> {
    let chip = source.names.chip;
    let sized = source.names.symbols.iter().filter(|symbol| symbol.space == chip.code_space && symbol.size > 0);
    sized.map(|symbol| (symbol.addr / chip.word_bytes.max(1), symbol.name.as_str())).collect()
}

/// A listing and its coverage record.
pub struct ListingWithRecord {
    /// The listing, with one line for each instruction.
    pub listing: String,
    /// The coverage of its lines.
    pub record: LcovRecord,
}

/// Returns a listing with one line per instruction, and its record as a file of this name.
#[must_use]
pub fn listing_record(reached: &[CoveredInstruction], source: &ProgramSource<'_>, file: &str) -> ListingWithRecord {
    let (mut text, mut record) = (String::new(), LcovRecord::new(file));
    let mut line = 0;
    let mut row = |text: &mut String, words: String| {
        text.push_str(&words);
        text.push('\n');
        line += 1;
        line
    };
    let chip = source.names.chip;
    for one in reached {
        let pc = one.instruction.pc;
        let byte = pc * chip.word_bytes;
        for symbol in source.names.symbols.iter().filter(|s| s.space == chip.code_space && s.addr == byte) {
            let line = row(&mut text, format!("{}:", symbol.name));
            record.functions.push(FunctionCount { line, name: symbol.name.clone(), count: one.count });
        }
        let line = row(&mut text, format!("  0x{:04x}  {}", chip.code_address(pc), one.instruction.text));
        record.add_instruction(line, one);
    }
    ListingWithRecord { listing: text, record }
}

/// Returns the tracefile.
#[must_use]
pub fn format_tracefile(records: &[LcovRecord]) -> String {
    let mut out = String::new();
    for record in records {
        // Writing to a string does not fail.
        let _ = write_record(&mut out, record);
    }
    out
}

fn write_record(out: &mut String, record: &LcovRecord) -> std::fmt::Result {
    // A name with a line break would be two lines.
    let plain = |text: &str| text.chars().filter(|c| !c.is_control()).collect::<String>();
    writeln!(out, "TN:\nSF:{}", plain(&record.file))?;
    for function in &record.functions {
        writeln!(out, "FN:{},{}", function.line, plain(&function.name))?;
    }
    for function in &record.functions {
        writeln!(out, "FNDA:{},{}", function.count, plain(&function.name))?;
    }
    if !record.functions.is_empty() {
        let hit = record.functions.iter().filter(|function| function.count > 0).count();
        writeln!(out, "FNF:{}\nFNH:{hit}", record.functions.len())?;
    }
    let mut hit = 0;
    for branch in &record.branches {
        for way in 0..2 {
            let count = branch.counts_by_outcome.map(|ways| ways[way]);
            hit += u32::from(count.is_some_and(|count| count > 0));
            let count = count.map_or("-".to_owned(), |count| count.to_string());
            writeln!(out, "BRDA:{},{},{way},{count}", branch.line, branch.block)?;
        }
    }
    if !record.branches.is_empty() {
        writeln!(out, "BRF:{}\nBRH:{hit}", 2 * record.branches.len())?;
    }
    for (line, count) in &record.lines {
        writeln!(out, "DA:{line},{count}")?;
    }
    let hit = record.lines.values().filter(|count| **count > 0).count();
    writeln!(out, "LF:{}\nLH:{hit}\nend_of_record", record.lines.len())
}
