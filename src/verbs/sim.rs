//! `emu sim`: runs a ladder program on the reference evaluator, scan by scan, without a chip.

mod scenario;
mod trace;

use std::io::{self, BufWriter, Write};

use clap::Args;
use emu_debug::text_escapes::unescape;
use ladder::{ChipPart, LadderProgram};
use ladder_eval::{Evaluator, UnsupportedElement};

use crate::shared::codes::UNSUPPORTED_ELEMENT;
use crate::shared::fail::{VerbFailure, exit};
use crate::shared::flags::LadderFlags;
use crate::shared::output::PendingFile;
use crate::shared::output::RequestedOutput;
use crate::shared::report::MessageStyle;
use crate::shared::scan_inputs::{InputTable, ScanChange, SimInput};
use crate::shared::usage_error::UsageError;
use crate::shared::{input, output, scan_bits, scan_inputs};
use crate::verbs::sim::trace::ScanTraceTable;

const EXAMPLES: &str = "\
Examples:
  emu sim examples/welder.ld --scans 10 --set Xtrigger=1
  emu sim examples/welder.ld --scans 320 --at 21:Xtrigger=1 --at 181:Xtrigger=0 --wave
  emu sim examples/modulo5.ld --scans 30 --at 3:Xpulse=1 --at 4:Xpulse=0 --csv trace.csv --vcd trace.vcd
  emu sim program.ld --set Alevel=512 --uart-in '5:start\\n' --json
  emu sim examples/traffic.ld --watch --realtime
  emu sim examples/welder.ld --scenario examples/welder.toml

Exit codes: 0 success; with --scenario 1 an expectation was not met, and 5 a step still waited at the limit.";

/// Maximum number of scans.
const MAX_SCANS: u64 = 1_000_000;

/// Default number of scans.
const DEFAULT_SCANS: u64 = 20;

/// Time of one byte (10 bits) on the serial line at 1 baud, in microseconds.
const BYTE_US: u128 = 10_000_000;

/// Flags of `emu sim`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct SimArgs {
    #[command(flatten)]
    program: LadderFlags,
    /// Number of scans, 1 to 1000000. Default: 20, or the last scan of --inputs.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=MAX_SCANS))]
    scans: Option<u64>,
    /// Set a symbol before the first scan: Xstart=1, Cparts=-5. For an analog input that READ_ADC reads, set
    /// its level, 0 to 1023: Alevel=512. For a cell of the EEPROM that PERSIST uses, set a byte:
    /// eeprom:0=0x12. Repeatable.
    #[arg(long, value_name = "NAME=VALUE")]
    set: Vec<String>,
    /// Set a symbol, an analog input or a cell before a scan, counted from 1: 5:Xstart=0. Repeatable.
    #[arg(long, value_name = "SCAN:NAME=VALUE")]
    at: Vec<String>,
    /// Values of inputs by scan, as --csv writes them: a header line `scan,NAME,..`, then scans in ascending
    /// order, each with its values. Columns of inputs X.. and analog inputs count, and an empty value changes
    /// nothing. - is standard input.
    #[arg(long, value_name = "FILE")]
    inputs: Option<String>,
    /// Bytes that arrive on the serial line: '5:hello\n' (escapes \n \r \t \0 \\ \" \xNN). The first byte is
    /// complete before that scan; the others follow at the speed of the line, or after earlier bytes.
    /// Repeatable.
    #[arg(long, value_name = "SCAN:TEXT")]
    uart_in: Vec<String>,
    /// Play a scenario: docs/scenario.md. Its verdict is the result. --csv, --vcd, --wave and --json write
    /// the scans too, and --scans sets its limit.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["set", "at", "inputs", "uart_in"])]
    scenario: Option<String>,
    /// Use a waveform (VCD) as stimulus: a wire with the name of an input X.. or of an analog input drives
    /// it, from the first scan that begins at or after the time of the change.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["set", "at", "inputs", "uart_in"])]
    stimulus: Option<String>,
    /// Write comma-separated values: a header line, then one line per scan; - is standard output.
    #[arg(long, value_name = "FILE")]
    csv: Option<String>,
    /// Write a waveform (VCD). The state after scan k starts at k cycle times; - is standard output.
    #[arg(long, value_name = "FILE")]
    vcd: Option<String>,
    /// Print a waveform as text: one line for each input, output and relay.
    #[arg(long, conflicts_with = "json")]
    wave: bool,
    /// One JSON document.
    #[arg(long)]
    pub json: bool,
    #[cfg(feature = "tui")]
    #[command(flatten)]
    watch: crate::shared::full_screen::WatchArgs,
}

/// Maximum number of values in a trace, which is kept in memory.
const MAX_VALUES: u64 = 20_000_000;

/// Runs a program on the reference evaluator and prints every symbol after every scan.
pub fn sim(args: &SimArgs, style: &MessageStyle) -> Result<u8, VerbFailure> {
    if args.inputs.as_deref() == Some("-") && args.program.file == "-" {
        return Err(VerbFailure::Usage("the program and --inputs cannot both be standard input".to_owned()));
    }
    let used = check_outputs(args)?;
    let read = input::read_program(&args.program.file, args.program.read.options(), true, style)?;
    if args.scenario.is_some() || args.stimulus.is_some() {
        return scenario::play(args, &read, &used, style);
    }
    let mut evaluator = match Evaluator::new(&read.program) {
        Ok(evaluator) => evaluator,
        Err(refusal) => return Err(VerbFailure::Refused(vec![unsupported(&read.program, &refusal)], read.texts)),
    };
    let (scans, changes) = planned_changes(args, &evaluator)?;
    #[cfg(feature = "tui")]
    if args.watch.is_requested() {
        return crate::shared::full_screen::show_panel(&args.watch, &read.program, evaluator, &changes, style);
    }
    let bytes = byte_arrivals(args, scans, &read.program)?;
    let symbols = evaluator.symbols().to_vec();
    let mut trace = ScanTraceTable::new(&symbols, &evaluator, read.program.uses_part(ChipPart::Transmitter));
    let most = MAX_VALUES / (trace.width() as u64).max(1);
    if scans > most {
        let why = format!("with {} values a scan at most {most} scans are traced at once", trace.width());
        return Err(VerbFailure::invalid_flag_value("--scans <N>", &scans.to_string(), &why));
    }
    let (mut changes, mut bytes) = (changes.iter().peekable(), bytes.iter().peekable());
    for scan in 1..=scans {
        while let Some(change) = changes.next_if(|change| change.scan <= scan) {
            change.apply(&mut evaluator);
        }
        while let Some((_, byte)) = bytes.next_if(|(at, _)| *at <= scan) {
            if !evaluator.receive(*byte) {
                output::print_to_stderr(&format!(
                    "warning: byte 0x{byte:02X} arrived before scan {scan} while another waited: here it is lost, on a chip this is undefined\n"
                ));
            }
        }
        evaluator.scan();
        trace.note_scan(&evaluator);
    }
    write_results(args, &read.program, &trace, None)?;
    if used.is_empty() {
        output::print(trace.table())?;
    }
    Ok(exit::OK)
}

/// Writes the requested results. `played` is the verdict of a scenario.
fn write_results(
    args: &SimArgs,
    program: &LadderProgram,
    trace: &ScanTraceTable<'_>,
    played: Option<serde_json::Value>,
) -> Result<(), VerbFailure> {
    let (file, cycle_us) = (&args.program.file, program.settings.cycle_us);
    write(args.csv.as_deref(), |mut out| out.write_all(trace.csv().as_bytes()).and_then(|()| out.flush()))?;
    write(args.vcd.as_deref(), |out| trace.vcd(file, cycle_us, out))?;
    if args.json {
        let mut document = trace.json(file, cycle_us);
        played.into_iter().for_each(|played| document["scenario"] = played);
        output::print_json(&document)?;
    } else if args.wave {
        let bits = trace.symbols.iter().enumerate().filter(|(_, s)| s.kind.is_bit());
        output::print(scan_bits::draw_scan_bits(
            &bits.map(|(i, s)| (s.name.as_str(), i)).collect::<Vec<_>>(),
            &trace.rows,
        ))?;
    }
    Ok(())
}

/// Returns the requested results other than the table. Refuses two of them in one place.
fn check_outputs(args: &SimArgs) -> Result<Vec<RequestedOutput<'_>>, VerbFailure> {
    let printed = |flag| if flag { "-" } else { "" };
    let (csv, vcd) = (args.csv.as_deref().unwrap_or(""), args.vcd.as_deref().unwrap_or(""));
    let all = [("--json", printed(args.json)), ("--wave", printed(args.wave)), ("--csv", csv), ("--vcd", vcd)];
    let used: Vec<_> = all
        .into_iter()
        .filter(|(_, file)| !file.is_empty())
        .map(|(flag, file)| RequestedOutput::new(flag, file))
        .collect();
    output::check_distinct_outputs(&used)?;
    for input in std::iter::once(&args.program.file).chain(&args.inputs).chain(&args.scenario).chain(&args.stimulus) {
        output::check_input_not_overwritten(input, &used)?;
    }
    Ok(used)
}

/// Writes a requested result to a file, completely or not at all.
fn write(file: Option<&str>, body: impl FnOnce(Box<dyn Write>) -> io::Result<()>) -> Result<(), VerbFailure> {
    let Some(name) = file else { return Ok(()) };
    let failed = |error: io::Error| VerbFailure::write_failed(name, &error);
    if output::is_stdout(name) {
        return body(Box::new(BufWriter::new(io::stdout()))).map_err(failed);
    }
    let pending = PendingFile::new(name)?;
    body(pending.writer()?).map_err(failed)?;
    pending.complete()
}

/// Returns the refusal of an element, with its place in the program.
pub fn unsupported(program: &LadderProgram, refusal: &UnsupportedElement) -> diag::Diagnostic {
    let pos = program.find_element(refusal.element).map_or(diag::Pos::default(), |at| at.pos);
    let hint = "docs/semantics.md lists the elements that have a meaning";
    diag::Diagnostic::new(diag::Severity::Error, UNSUPPORTED_ELEMENT, &program.file, pos, refusal.to_string(), hint)
}

/// Returns the number of scans, and all changes in the order in which they are applied.
fn planned_changes(args: &SimArgs, evaluator: &Evaluator) -> Result<(u64, Vec<ScanChange>), VerbFailure> {
    let InputTable { last, mut changes } = match &args.inputs {
        Some(file) => scan_inputs::read_input_table(file, evaluator)?,
        None => InputTable { last: None, changes: Vec::new() },
    };
    let scans = args.scans.or(last).unwrap_or(DEFAULT_SCANS).min(MAX_SCANS);
    for text in &args.set {
        let what = SimInput::new(evaluator, text)
            .map_err(|why| VerbFailure::invalid_flag_value("--set <NAME=VALUE>", text, &why))?;
        changes.push(ScanChange { scan: 1, input: what });
    }
    for text in &args.at {
        let refuse = |why: UsageError| VerbFailure::invalid_flag_value("--at <SCAN:NAME=VALUE>", text, &why);
        let (scan, rest) = split_scan(scans, text, "5:Xstart=0").map_err(refuse)?;
        changes.push(ScanChange { scan, input: SimInput::new(evaluator, rest).map_err(refuse)? });
    }
    // The sort is stable: within a scan, changes from the command line follow those from the file, in the
    // order given.
    changes.sort_by_key(|change| change.scan);
    Ok((scans, changes))
}

/// Returns the bytes that arrive, each with the scan before which it is complete.
fn byte_arrivals(args: &SimArgs, scans: u64, program: &LadderProgram) -> Result<Vec<(u64, u8)>, VerbFailure> {
    let (mut bytes, mut free) = (Vec::new(), 1);
    let receives = program.uses_part(ChipPart::Receiver);
    if !args.uart_in.is_empty() && !receives {
        return Err(VerbFailure::Usage("--uart-in is for programs with UART_RECV; this one has none".to_owned()));
    }
    let (baud, cycle) = (program.settings.baud.unwrap_or(0).max(1), program.settings.cycle_us.max(1));
    let apart = BYTE_US.div_ceil(u128::from(baud) * u128::from(cycle)).try_into().unwrap_or(u64::MAX);
    for text in &args.uart_in {
        let refuse = |why: &dyn std::fmt::Display| VerbFailure::invalid_flag_value("--uart-in <SCAN:TEXT>", text, why);
        let (scan, rest) = split_scan(scans, text, "5:hello").map_err(|why| refuse(&why))?;
        let mut at = scan.max(free);
        for byte in unescape(rest).map_err(|why| refuse(&why))? {
            bytes.push((at, byte));
            at = at.saturating_add(apart);
        }
        free = at;
    }
    Ok(bytes)
}

/// Splits the scan number from the front of a text.
fn split_scan<'a>(scans: u64, text: &'a str, example: &str) -> Result<(u64, &'a str), UsageError> {
    let (scan, rest) =
        text.split_once(':').ok_or_else(|| UsageError::malformed(format!("give a scan, as in {example}")))?;
    match scan.trim().parse() {
        Ok(scan) if (1..=scans).contains(&scan) => Ok((scan, rest)),
        Ok(scan) => Err(UsageError::ScanNotRun { scan, scans }),
        Err(_) => Err(UsageError::MalformedPart {
            part: scan.to_owned(),
            wanted: "a scan",
            expected: format!("scans are 1 to {scans}").into(),
        }),
    }
}
