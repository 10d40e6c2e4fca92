//! `emu diff`: finds the first difference between two traces.

mod read;

use std::collections::VecDeque;

use clap::{Args, ValueEnum};
use serde::Serialize;
use serde_json::json;

use crate::shared::fail::{VerbFailure, exit};
use crate::shared::output;
use crate::shared::usage_error::UsageError;
use read::{TraceEntry, TraceReader};

const EXAMPLES: &str = "\
Examples:
  emu run old.hex --mcu atmega328p --for 1ms --trace old.trace
  emu run new.hex --mcu atmega328p --for 1ms --trace new.trace
  emu diff old.trace new.trace
  emu diff old.trace new.trace --ignore cycle --context 10

Exit codes: 0 they are equal, 1 they differ, 3 a file is not a trace.";

/// Maximum number of context lines.
const MAX_CONTEXT: usize = 10_000;

/// Flags of `emu diff`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct DiffArgs {
    /// A trace, as `emu run --trace` writes it, as text or JSON lines; - is standard input.
    #[arg(value_name = "A.trace")]
    a: String,
    /// The other trace.
    #[arg(value_name = "B.trace")]
    b: String,
    /// Ignore a field in the comparison: cycle, address, symbol, text, registers, memory, or chip (mcu and hz
    /// of the first line). Repeatable.
    #[arg(long, value_name = "FIELD", hide_possible_values = true)]
    ignore: Vec<IgnoredField>,
    /// Number of lines to show before and after the first difference.
    #[arg(long, value_name = "N", default_value = "3", value_parser = context)]
    context: usize,
    /// One JSON document: the place of the first difference, and the fields that differ.
    #[arg(long)]
    pub json: bool,
}

/// The fields that a comparison can ignore.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum IgnoredField {
    Cycle,
    Address,
    Symbol,
    Text,
    Registers,
    Memory,
    Chip,
}

fn context(text: &str) -> Result<usize, UsageError> {
    text.parse()
        .ok()
        .filter(|n| *n <= MAX_CONTEXT)
        .ok_or_else(|| UsageError::malformed(format!("write a number of lines, 0 to {MAX_CONTEXT}")))
}

/// Compares two traces.
pub fn diff(args: &DiffArgs) -> Result<u8, VerbFailure> {
    if args.a == "-" && args.b == "-" {
        return Err(VerbFailure::Usage("standard input (-) can be only one of the files".to_owned()));
    }
    let (mut a, mut b) = (TraceReader::new(&args.a)?, TraceReader::new(&args.b)?);
    let mut before = VecDeque::new();
    let mut fields = head_differences(args, &a, &b);
    let (mut x, mut y) = (None, None);
    while fields.is_empty() {
        (x, y) = (a.next()?, b.next()?);
        fields = match (&x, &y) {
            (None, None) => return report_equal(args, a.lines()),
            (Some(x), Some(y)) => entry_differences(args, x, y),
            (Some(_), None) => vec![field_difference("end", "continues", "ends here")],
            (None, Some(_)) => vec![field_difference("end", "ends here", "continues")],
        };
        if fields.is_empty() {
            before.extend(x.take().map(|entry| entry.raw));
            if before.len() > args.context {
                before.pop_front();
            }
        }
    }
    let place = (a.lines().max(1), b.lines().max(1));
    let (raw_a, raw_b) = (lines_after(args, &mut a, x)?, lines_after(args, &mut b, y)?);
    if args.json {
        output::print_json(&json!({
            "schema": 1, "equal": false, "differ": fields, "before": before,
            "a": { "file": args.a, "line": place.0, "lines": raw_a },
            "b": { "file": args.b, "line": place.1, "lines": raw_b },
        }))?;
        return Ok(exit::FAILED);
    }
    let mut out = format!("{}:{} and {}:{} differ\n", args.a, place.0, args.b, place.1);
    for FieldDifference { field, a, b } in &fields {
        out.push_str(&format!("  {field:<9}  {a} | {b}\n"));
    }
    before.iter().for_each(|line| out.push_str(&format!("  {line}\n")));
    raw_a.iter().for_each(|line| out.push_str(&format!("- {line}\n")));
    raw_b.iter().for_each(|line| out.push_str(&format!("+ {line}\n")));
    output::print(out)?;
    Ok(exit::FAILED)
}

/// Returns the number of lines of a trace.
pub fn lines_of(bytes: &[u8]) -> Result<u64, VerbFailure> {
    let mut reader = TraceReader::from_input("trace", Box::new(std::io::Cursor::new(bytes.to_vec())))?;
    while reader.next()?.is_some() {}
    Ok(reader.lines())
}

fn report_equal(args: &DiffArgs, lines: u64) -> Result<u8, VerbFailure> {
    if args.json {
        output::print_json(&json!({ "schema": 1, "equal": true, "lines": lines }))?;
    } else {
        output::print(format!("no difference in {lines} lines\n"))?;
    }
    Ok(exit::OK)
}

/// Returns a line that differs, and the lines after it. Errors in the later lines are ignored.
fn lines_after(
    args: &DiffArgs,
    reader: &mut TraceReader,
    first: Option<TraceEntry>,
) -> Result<Vec<String>, VerbFailure> {
    let mut lines: Vec<String> = first.map(|entry| entry.raw).into_iter().collect();
    while !lines.is_empty() && lines.len() <= args.context {
        match reader.next() {
            Ok(Some(entry)) => lines.push(entry.raw),
            Ok(None) | Err(_) => break,
        }
    }
    Ok(lines)
}

/// A field that differs, with its value in the first and in the second trace.
#[derive(Serialize)]
struct FieldDifference {
    field: &'static str,
    a: String,
    b: String,
}

fn field_difference(field: &'static str, a: &str, b: &str) -> FieldDifference {
    FieldDifference { field, a: a.to_owned(), b: b.to_owned() }
}

fn head_differences(args: &DiffArgs, a: &TraceReader, b: &TraceReader) -> Vec<FieldDifference> {
    let chip = [("mcu", &a.mcu, &b.mcu), ("hz", &a.hz, &b.hz)].into_iter();
    let chip = chip.filter(|(_, a, b)| a != b && !args.ignore.contains(&IgnoredField::Chip));
    chip.map(|(field, a, b)| field_difference(field, a, b)).collect()
}

fn entry_differences(args: &DiffArgs, a: &TraceEntry, b: &TraceEntry) -> Vec<FieldDifference> {
    let is_compared = |field: IgnoredField| !args.ignore.contains(&field);
    let mut all = Vec::new();
    let mut field = |field, name, a: &str, b: &str| {
        if is_compared(field) && a != b {
            let [a, b] = [a, b].map(|text| if text.is_empty() { "-" } else { text });
            all.push(field_difference(name, a, b));
        }
    };
    field(IgnoredField::Cycle, "cycle", &a.cycle.to_string(), &b.cycle.to_string());
    field(IgnoredField::Address, "address", &a.address, &b.address);
    // A symbol that only one trace knows is no difference of the programs.
    if !a.symbol.is_empty() && !b.symbol.is_empty() {
        field(IgnoredField::Symbol, "symbol", &a.symbol, &b.symbol);
    }
    field(IgnoredField::Text, "text", &a.text, &b.text);
    let list = |list: &[String]| list.join(" ");
    field(IgnoredField::Registers, "registers", &list(&a.registers), &list(&b.registers));
    field(IgnoredField::Memory, "memory", &list(&a.memory), &list(&b.memory));
    all
}
