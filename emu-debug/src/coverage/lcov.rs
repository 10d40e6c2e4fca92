//! The account as a tracefile of lcov (geninfo(1), "TRACEFILE FORMAT"), which `genhtml` and most tools for coverage read.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::Reached;
use crate::source::Source;

/// A function, or a rung.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Function {
    /// Line where it begins.
    pub line: u32,
    /// Name.
    pub name: String,
    /// How often it was entered.
    pub count: u64,
}

/// The two ways of something.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Branch {
    /// Its line.
    pub line: u32,
    /// Tells it from others of the line: the address of the instruction in program words, or the number of the element.
    pub block: u32,
    /// How often each way was gone; nothing where it never came to that.
    pub ways: Option<[u64; 2]>,
}

/// What is told of a file.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Record {
    /// Its name.
    pub file: String,
    /// Functions by line.
    pub functions: Vec<Function>,
    /// Branches by line.
    pub branches: Vec<Branch>,
    /// How often each line was executed that has code: as often as the instruction of it that was executed most often.
    pub lines: BTreeMap<u32, u64>,
}

impl Record {
    /// A file of which nothing is told yet.
    #[must_use]
    pub fn new(file: impl Into<String>) -> Record {
        Record { file: file.into(), ..Record::default() }
    }

    /// An instruction belongs to a line.
    pub fn add(&mut self, line: u32, reached: &Reached) {
        let count = self.lines.entry(line).or_default();
        *count = (*count).max(reached.count);
        if let Some(ways) = reached.ways {
            let ways = (reached.count > 0).then_some(ways);
            self.branches.push(Branch { line, block: reached.instruction.pc, ways });
        }
    }
}

/// The records of the source files of a program, by name. Empty where nothing is known of lines.
#[must_use]
pub fn by_source(reached: &[Reached], source: &Source<'_>) -> Vec<Record> {
    let mut files: BTreeMap<&str, Record> = BTreeMap::new();
    let functions = functions(source);
    for one in reached {
        let Some(at) = source.line_at(one.instruction.pc) else { continue };
        let record = files.entry(&at.file).or_insert_with(|| Record::new(&*at.file));
        record.add(at.line, one);
        if let Some(name) = functions.get(&one.instruction.pc) {
            record.functions.push(Function { line: at.line, name: (*name).to_owned(), count: one.count });
        }
    }
    let mut records: Vec<Record> = files.into_values().collect();
    for record in &mut records {
        record.branches.sort_by_key(|branch| (branch.line, branch.block));
        record.functions.sort_by_key(|function| function.line);
    }
    records
}

/// Names of functions by program word: symbols with a size, where the program has such; else none, since labels are not told
/// from functions.
pub(crate) fn functions<'a>(source: &Source<'a>) -> BTreeMap<u32, &'a str> {
    let chip = source.names.chip;
    let sized = source.names.symbols.iter().filter(|symbol| symbol.space == chip.code && symbol.size > 0);
    sized.map(|symbol| (symbol.addr / chip.word_bytes.max(1), symbol.name.as_str())).collect()
}

/// A listing with a line for each instruction, and what is told of it as of a file of this name.
#[must_use]
pub fn by_listing(reached: &[Reached], source: &Source<'_>, file: &str) -> (String, Record) {
    let (mut text, mut record) = (String::new(), Record::new(file));
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
        for symbol in source.names.symbols.iter().filter(|s| s.space == chip.code && s.addr == byte) {
            let line = row(&mut text, format!("{}:", symbol.name));
            record.functions.push(Function { line, name: symbol.name.clone(), count: one.count });
        }
        let line = row(&mut text, format!("  0x{:04x}  {}", chip.code_address(pc), one.instruction.text));
        record.add(line, one);
    }
    (text, record)
}

/// The tracefile.
#[must_use]
pub fn text(records: &[Record]) -> String {
    let mut out = String::new();
    for record in records {
        // Writing to a string does not fail.
        let _ = one(&mut out, record);
    }
    out
}

fn one(out: &mut String, record: &Record) -> std::fmt::Result {
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
            let count = branch.ways.map(|ways| ways[way]);
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
