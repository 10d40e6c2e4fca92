//! `emu migrate`: what changes when a ladder program is opened by the other release of LDmicro.

use std::io::Write;

use clap::Args;
use emu_check::{
    DialectComparison, InputRow, MeaningChange, SERIAL_LINE, SymbolDifference, compare_dialects, meaning_changes,
};
use ladder::{LadderDialect, LadderProgram, ReadOptions};
use serde_json::{Value, json};

use crate::shared::fail::{VerbFailure, exit};
use crate::shared::flags::{LadderFlags, parse_dialect};
use crate::shared::input;
use crate::shared::output::RequestedOutput;
use crate::shared::output::{self, PendingFile};
use crate::shared::report::{MessageStyle, report_diagnostics};
use crate::verbs::sim;

const EXAMPLES: &str = "\
Examples:
  emu migrate old.ld
  emu migrate new.ld --to ldmicro-2.3
  emu migrate old.ld --scans 1000000 --inputs first.csv

Exit codes: 0 no symbol differs; 1 a symbol differs; 3 the other release refuses the program.";

/// Flags of `emu migrate`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct MigrateArgs {
    #[command(flatten)]
    program: LadderFlags,
    /// The dialect of the other release: ldmicro-2.3 or ldmicro-5. By default the one that the program is not
    /// in.
    #[arg(long, value_name = "DIALECT", value_parser = parse_dialect)]
    to: Option<LadderDialect>,
    /// Number of scans to execute in both dialects, with random inputs; 1 to 100000000.
    #[arg(long, value_name = "N", default_value_t = 100_000, value_parser = clap::value_parser!(u64).range(1..=100_000_000))]
    scans: u64,
    /// Seed of the random inputs.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Write the inputs up to the first difference to this file, as `emu sim --inputs` reads them.
    #[arg(long, value_name = "FILE")]
    inputs: Option<String>,
    /// One JSON document.
    #[arg(long)]
    pub json: bool,
}

/// Compares a program in two dialects and prints what differs.
pub fn migrate(args: &MigrateArgs, style: &MessageStyle) -> Result<u8, VerbFailure> {
    let file = &args.program.file;
    let text = input::read_bytes(file)?;
    let (read, notes) = input::parse_program(file, text.clone(), args.program.read.options(), true)?;
    report_diagnostics(style, &notes, &read.texts);
    let before = &read.program;
    if before.dialect == LadderDialect::Iec {
        let why = format!("{file} is a program of IEC 61131-3, and emu migrate compares the releases of LDmicro");
        return Err(VerbFailure::Usage(why));
    }
    let to = args.to.unwrap_or(match before.dialect {
        LadderDialect::Ldmicro23 => LadderDialect::Ldmicro5,
        LadderDialect::Ldmicro5 | LadderDialect::Iec => LadderDialect::Ldmicro23,
    });
    if to == before.dialect {
        return Err(VerbFailure::Usage(format!("{file} is a program of {to} already; --to names the other dialect")));
    }
    if let Some(csv) = &args.inputs {
        output::check_input_not_overwritten(file, &[RequestedOutput::new("--inputs", csv)])?;
    }
    // Its notes are those of the first reading; only what the other release refuses is of interest.
    let (after, _) =
        input::parse_program(file, text, ReadOptions { dialect: Some(to), ..args.program.read.options() }, true)
            .inspect_err(|_| {
                output::print_to_stderr(&format!("note: {to} refuses {file}:\n"));
            })?;
    let after = &after.program;
    let comparison = match compare_dialects(before, after, args.scans, args.seed) {
        Ok(comparison) => comparison,
        Err(refusal) => return Err(VerbFailure::Refused(vec![sim::unsupported(before, &refusal)], read.texts)),
    };
    let changes = meaning_changes(before, after);
    if let Some(csv) = &args.inputs {
        write_inputs(csv, &comparison)?;
    }
    if args.json {
        output::print_json(&json_report(before, to, &changes, &comparison))?;
    } else {
        output::print(text_report(args, before, to, &changes, &comparison))?;
    }
    Ok(if comparison.differences.is_empty() { exit::OK } else { exit::FAILED })
}

/// The place of a change: rung and element, or the line.
fn change_line(file: &str, change: &MeaningChange) -> String {
    let place = change.element.map_or(String::new(), |element| format!("{element}, "));
    format!("  {place}{file}:{}:{}: {}\n", change.pos.line, change.pos.column, change.text)
}

fn text_report(
    args: &MigrateArgs,
    program: &LadderProgram,
    to: LadderDialect,
    changes: &[MeaningChange],
    comparison: &DialectComparison,
) -> String {
    let (file, from) = (&program.file, program.dialect);
    let mut out = format!("{file}: {from} to {to}\n");
    if !changes.is_empty() {
        out.push_str("has another meaning:\n");
        changes.iter().for_each(|change| out.push_str(&change_line(file, change)));
    }
    let runs = format!("{} scans in {} runs from reset, seed {}", comparison.scans, comparison.runs, args.seed);
    if comparison.differences.is_empty() {
        out.push_str(&format!("no symbol differs: {runs}\n"));
        return out;
    }
    out.push_str(&format!("differs ({runs}), the first scan of each symbol:\n"));
    for difference in &comparison.differences {
        out.push_str(&format!(
            "  scan {}: {} is {} in {from}, {} in {to}\n",
            difference.scan,
            difference.name,
            value_text(&difference.name, difference.before),
            value_text(&difference.name, difference.after),
        ));
    }
    let scans = comparison.stimulus.len();
    let bytes = comparison.stimulus.iter().filter(|row| row.byte.is_some()).count();
    match &args.inputs {
        Some(csv) => {
            out.push_str(&format!("to replay it, with {to} too:\n"));
            let received = replay_bytes(comparison);
            out.push_str(&format!("  emu sim {file} --dialect {from} --inputs {csv} --scans {scans}{received}\n"));
        }
        None if bytes + comparison.inputs.len() == 0 => {
            out.push_str(&format!("to replay it: emu sim {file} --dialect {from} --scans {scans}, and with {to}\n"));
        }
        None => out.push_str("--inputs FILE writes the inputs up to the first difference\n"),
    }
    out
}

/// The value of a symbol; for the serial line the byte, if one was sent.
fn value_text(name: &str, value: i32) -> String {
    match (name, value) {
        (SERIAL_LINE, -1) => "silent".to_owned(),
        (SERIAL_LINE, byte) => format!("0x{byte:02X}"),
        _ => value.to_string(),
    }
}

/// The flags of `emu sim` that send the bytes of the stimulus.
fn replay_bytes(comparison: &DialectComparison) -> String {
    let rows = (1..).zip(&comparison.stimulus);
    rows.filter_map(|(scan, row)| Some(format!(" --uart-in '{scan}:\\x{:02X}'", row.byte?))).collect()
}

/// Writes the inputs up to the first difference as CSV; only the head line if there is none.
fn write_inputs(file: &str, comparison: &DialectComparison) -> Result<(), VerbFailure> {
    let mut text = format!("scan,{}\n", comparison.inputs.join(","));
    for (scan, row) in (1..).zip(&comparison.stimulus) {
        let values: Vec<String> = row.values.iter().map(i32::to_string).collect();
        text.push_str(&format!("{scan},{}\n", values.join(",")));
    }
    let pending = PendingFile::new(file)?;
    pending.writer()?.write_all(text.as_bytes()).map_err(|error| VerbFailure::write_failed(file, &error))?;
    pending.complete()
}

fn json_report(
    program: &LadderProgram,
    to: LadderDialect,
    changes: &[MeaningChange],
    comparison: &DialectComparison,
) -> Value {
    let change = |change: &MeaningChange| {
        json!({
            "element": change.element.map(|element| element.to_string()),
            "line": change.pos.line,
            "column": change.pos.column,
            "text": change.text,
        })
    };
    let difference = |found: &SymbolDifference| json!({ "name": found.name, "scan": found.scan, "before": found.before, "after": found.after });
    let row = |row: &InputRow| json!({ "values": row.values, "byte": row.byte });
    json!({
        "program": program.file,
        "from": program.dialect.to_string(),
        "to": to.to_string(),
        "scans": comparison.scans,
        "runs": comparison.runs,
        "changes": changes.iter().map(change).collect::<Vec<_>>(),
        "differences": comparison.differences.iter().map(difference).collect::<Vec<_>>(),
        "inputs": comparison.inputs,
        "stimulus": comparison.stimulus.iter().map(row).collect::<Vec<_>>(),
    })
}
