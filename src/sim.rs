//! `emu sim`: what a ladder program means, scan by scan, without any chip.

use clap::Args;
use ladder::Program;
use ladder_eval::{Evaluator, Unsupported};
use serde_json::json;

use crate::args::Ladder;
use crate::codes::NO_MEANING;
use crate::fail::{Failure, exit};
use crate::report::Terminal;
use crate::{input, output, wave};

const EXAMPLES: &str = "\
Examples:
  emu sim examples/welder.ld --scans 10 --set Xtrigger=1
  emu sim examples/welder.ld --scans 320 --at 21:Xtrigger=1 --at 181:Xtrigger=0 --wave
  emu sim examples/modulo5.ld --scans 30 --at 3:Xpulse=1 --at 4:Xpulse=0 --csv > trace.csv";

/// Most scans.
const MAX_SCANS: u64 = 1_000_000;

/// Flags of `emu sim`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct SimArgs {
    #[command(flatten)]
    program: Ladder,
    /// Number of scans, 1 to 1000000.
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u64).range(1..=MAX_SCANS))]
    scans: u64,
    /// Give a symbol a value before the first scan: Xstart=1, Cparts=-5. Repeatable.
    #[arg(long, value_name = "NAME=VALUE")]
    set: Vec<String>,
    /// Give a symbol a value before a scan, counted from 1: 5:Xstart=0. Repeatable.
    #[arg(long, value_name = "SCAN:NAME=VALUE")]
    at: Vec<String>,
    /// Comma-separated values: a head line, then a line for each scan.
    #[arg(long, conflicts_with = "json")]
    csv: bool,
    /// A waveform in text: a line for each input, output and relay.
    #[arg(long, conflicts_with_all = ["json", "csv"])]
    wave: bool,
    /// One JSON document.
    #[arg(long)]
    pub json: bool,
}

/// Most values of a trace, which is held in memory as a whole.
const MAX_VALUES: u64 = 20_000_000;

/// A symbol is given a value before a scan.
struct Change {
    scan: u64,
    symbol: usize,
    value: i32,
}

/// Runs a program on the reference evaluator and prints every symbol after every scan.
pub fn sim(args: &SimArgs, terminal: &Terminal) -> Result<u8, Failure> {
    let read = input::program(&args.program.file, args.program.dialect, true, terminal)?;
    let mut evaluator = match Evaluator::new(&read.program) {
        Ok(evaluator) => evaluator,
        Err(refusal) => return Err(Failure::Refused(vec![unsupported(&read.program, &refusal)], read.texts)),
    };
    let changes = changes(args, &evaluator)?;
    let count = evaluator.symbols().len();
    let most = MAX_VALUES / (count as u64).max(1);
    if args.scans > most {
        let why = format!("with {count} symbols at most {most} scans are traced at once");
        return Err(Failure::value("--scans <N>", &args.scans.to_string(), &why));
    }
    let mut rows: Vec<Vec<i32>> = Vec::new();
    for scan in 1..=args.scans {
        for change in changes.iter().filter(|c| c.scan == scan) {
            evaluator.set(change.symbol, change.value);
        }
        evaluator.scan();
        rows.push((0..count).map(|symbol| evaluator.get(symbol)).collect());
    }
    let symbols = evaluator.symbols();
    if args.json {
        let list: Vec<_> = symbols.iter().map(|s| json!({ "name": s.name, "kind": s.kind })).collect();
        let file = &args.program.file;
        output::json(&json!({
            "schema": 1, "program": file, "cycle_us": read.program.settings.cycle_us, "symbols": list, "scans": rows,
        }))?;
    } else if args.wave {
        let bits = symbols.iter().enumerate().filter(|(_, s)| s.kind.is_bit());
        output::print(wave::draw(&bits.map(|(i, s)| (s.name.as_str(), i)).collect::<Vec<_>>(), &rows))?;
    } else {
        let names: Vec<&str> = symbols.iter().map(|s| s.name.as_str()).collect();
        output::print(if args.csv { csv(&names, &rows) } else { table(&names, &rows) })?;
    }
    Ok(exit::OK)
}

/// The refusal of an element with its place.
fn unsupported(program: &Program, refusal: &Unsupported) -> diag::Diagnostic {
    let pos = program.elements().find(|(id, ..)| *id == refusal.element).map_or(diag::Pos::default(), |(.., pos)| pos);
    let hint = "docs/semantics.md lists the elements that have a meaning";
    diag::Diagnostic::new(diag::Severity::Error, NO_MEANING, &program.file, pos, refusal.to_string(), hint)
}

fn changes(args: &SimArgs, evaluator: &Evaluator) -> Result<Vec<Change>, Failure> {
    let mut changes = Vec::new();
    for text in &args.set {
        let made = change(evaluator, 1, text).map_err(|why| Failure::value("--set <NAME=VALUE>", text, &why))?;
        changes.push(made);
    }
    for text in &args.at {
        let made = timed(evaluator, args.scans, text);
        changes.push(made.map_err(|why| Failure::value("--at <SCAN:NAME=VALUE>", text, &why))?);
    }
    Ok(changes)
}

fn timed(evaluator: &Evaluator, scans: u64, text: &str) -> Result<Change, String> {
    let (scan, rest) = text.split_once(':').ok_or("give a scan, as in 5:Xstart=0")?;
    match scan.trim().parse() {
        Ok(scan) if (1..=scans).contains(&scan) => change(evaluator, scan, rest),
        Ok(scan) => Err(format!("scan {scan} does not run; scans are 1 to {scans} (--scans)")),
        Err(_) => Err(format!("`{scan}` is no scan; scans are 1 to {scans}")),
    }
}

fn change(evaluator: &Evaluator, scan: u64, text: &str) -> Result<Change, String> {
    let (name, value) = text.split_once('=').ok_or("give a value, as in Xstart=1")?;
    let name = name.trim();
    let symbol = evaluator.index(name).ok_or_else(|| {
        let names: Vec<&str> = evaluator.symbols().iter().map(|s| s.name.as_str()).collect();
        format!("the program has no symbol `{name}`; it has {}", names.join(", "))
    })?;
    let bit = evaluator.symbols().get(symbol).is_some_and(|s| s.kind.is_bit());
    let allowed = if bit { 0..=1 } else { -32_768..=32_767 };
    match value.trim().parse() {
        Ok(value) if allowed.contains(&value) => Ok(Change { scan, symbol, value }),
        _ => Err(format!("`{name}` takes {} to {}, not `{value}`", allowed.start(), allowed.end())),
    }
}

fn csv(names: &[&str], rows: &[Vec<i32>]) -> String {
    let mut out = format!("scan,{}\n", names.join(",")).replace(",\n", "\n");
    for (scan, row) in rows.iter().enumerate() {
        out.push_str(&(scan + 1).to_string());
        row.iter().for_each(|value| out.push_str(&format!(",{value}")));
        out.push('\n');
    }
    out
}

fn table(names: &[&str], rows: &[Vec<i32>]) -> String {
    let digits = |column: usize| rows.iter().filter_map(|r| r.get(column)).map(|v| v.to_string().len()).max();
    let widths: Vec<usize> =
        names.iter().enumerate().map(|(i, name)| name.chars().count().max(digits(i).unwrap_or(0))).collect();
    let first = rows.len().to_string().len().max(4);
    let mut out = format!("{:>first$}", "scan");
    for (name, &width) in names.iter().zip(&widths) {
        out.push_str(&format!("  {name:>width$}"));
    }
    out.push('\n');
    for (scan, row) in rows.iter().enumerate() {
        out.push_str(&format!("{:>first$}", scan + 1));
        for (value, &width) in row.iter().zip(&widths) {
            out.push_str(&format!("  {value:>width$}"));
        }
        out.push('\n');
    }
    out
}
