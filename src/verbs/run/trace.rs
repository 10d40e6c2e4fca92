//! `emu run --trace` and `--vcd-add`: what the run records instruction by instruction.

use std::io::{BufWriter, Write, stdout};

use clap::{Args, ValueEnum};
use emu_core::chip::Chip;
use emu_core::cpu::Cpu;
use emu_core::image::SymbolAt;
use emu_debug::trace::{TraceFormat, TraceLineWriter, TraceOutput, TraceProbe, TraceSignals, TraceSink, WordSet};
use emu_debug::waveform::WaveSignal;
use emu_debug::{ProgramSource, RunResult};
use ladder_compile::{ImageMap, SCHEMA};

use super::signals::parse_signal;
use crate::shared::codes::{NOT_A_MAP, file_error};
use crate::shared::fail::VerbFailure;
use crate::shared::output::PendingFile;
use crate::shared::report::FileTexts;
use crate::shared::usage_error::UsageError;
use crate::shared::{input, output};
use crate::verbs::run::summary;

/// Maximum value of `--trace-last`, in lines.
const MAX_TRACE_LAST: usize = 1_000_000;

/// Flags of traces and of signals in addition to the pins.
#[derive(Debug, Args)]
#[group(id = "tracing")]
pub struct TraceFlags {
    /// Write one line for each instruction: machine cycle, address, symbol, text, changed registers, memory
    /// reads and writes; and one for each interrupt entry. Each line is a JSON document if the name ends in
    /// .jsonl; - is standard output. Every iteration of a polling loop gives lines: limit the trace with
    /// --for or one of the next two flags.
    #[arg(long, value_name = "FILE")]
    pub trace: Option<String>,
    /// Trace only instructions at these addresses: 0x80..0x100 (end excluded; bytes, on PIC16 and AP101
    /// words), a symbol (main, the whole function), source lines (main.c:10..20), or with --map a rung of a
    /// ladder program (rung:3). Repeatable.
    #[arg(long, value_name = "RANGE", requires = "trace")]
    trace_only: Vec<String>,
    /// Keep only the last N lines of the trace: the history before a fault.
    #[arg(long, value_name = "N", requires = "trace", value_parser = parse_trace_last)]
    trace_last: Option<usize>,
    /// The format of the trace, text or json, whatever the file name.
    #[arg(long, value_name = "FORMAT", requires = "trace", hide_possible_values = true)]
    trace_format: Option<TraceFormatFlag>,
    /// The map of a ladder program, as `emu compile --map` writes it. --trace-only, --vcd-add, --coverage and
    /// --profile then know its rungs and symbols.
    #[arg(long, value_name = "FILE")]
    pub map: Option<String>,
    /// Add a signal to the pins of --vcd: a register of the core (r16, ACC, W) or of the chip (TCNT0, P1),
    /// memory (data:0x100, a symbol; at most 8 bytes), a bit of either (PORTB.5), or with --map a symbol of
    /// the ladder program (Ymotor). Repeatable.
    #[arg(long, value_name = "WHAT", requires = "vcd")]
    vcd_add: Vec<String>,
    /// Write only single bits to --vcd: each bit of a wider signal becomes a separate wire (TCNT0_3). For
    /// viewers without support for vectors, such as sigrok.
    #[arg(long, requires = "vcd")]
    pub vcd_bits: bool,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum TraceFormatFlag {
    Text,
    Json,
}

fn parse_trace_last(text: &str) -> Result<usize, UsageError> {
    let lines = text.parse().ok().filter(|lines| (1..=MAX_TRACE_LAST).contains(lines));
    lines.ok_or_else(|| UsageError::malformed(format!("write a number of lines, 1 to {MAX_TRACE_LAST}")))
}

/// The flags of traces, resolved for the chosen machine.
pub struct TraceRequest {
    traced_words: Option<WordSet>,
    signals: Option<TraceSignals>,
}

impl TraceFlags {
    /// Returns the input files.
    pub fn inputs(&self) -> impl Iterator<Item = &String> {
        self.map.iter()
    }

    /// Reads the map, and resolves all names.
    pub fn resolve<C: Cpu>(&self, cpu: &C, source: &ProgramSource<'_>) -> Result<TraceRequest, VerbFailure> {
        let map = self.map.as_deref().map(|file| read_map(file, cpu.chip())).transpose()?;
        let mut traced_words = WordSet::none(cpu.chip().flash_bytes / cpu.chip().word_bytes);
        for text in &self.trace_only {
            let result = self::add_trace_range(&mut traced_words, text, source, map.as_ref());
            result.map_err(|why| VerbFailure::invalid_flag_value("--trace-only <RANGE>", text, &why))?;
        }
        let signals = self.vcd_add.iter().map(|text| {
            let result = parse_signal(text, cpu, source, map.as_ref());
            result.map_err(|why| VerbFailure::invalid_flag_value("--vcd-add <WHAT>", text, &why))
        });
        let signals = signals.collect::<Result<Vec<_>, _>>()?;
        for (i, signal) in signals.iter().enumerate() {
            if signals.iter().take(i).any(|other| other.name == signal.name) {
                return Err(VerbFailure::Usage(format!("--vcd-add {} is given twice", signal.name)));
            }
        }
        Ok(TraceRequest {
            traced_words: (!self.trace_only.is_empty()).then_some(traced_words),
            signals: (!signals.is_empty()).then(|| TraceSignals::new(signals, cpu)),
        })
    }

    /// Opens the trace file, unless it is standard output.
    pub fn pending(&self) -> Result<Option<PendingFile>, VerbFailure> {
        self.trace.as_deref().filter(|file| !output::is_stdout(file)).map(PendingFile::new).transpose()
    }

    /// Returns the probe for the run, or `None` if nothing is requested.
    pub fn trace_probe<'a>(
        &self,
        request: TraceRequest,
        pending: Option<&PendingFile>,
        (source, hz): (ProgramSource<'a>, u64),
    ) -> Result<Option<TraceProbe<'a>>, VerbFailure> {
        let Some(file) = self.trace.as_deref() else {
            return Ok(request.signals.map(|signals| TraceProbe::new(None, None, Some(signals))));
        };
        let json = match self.trace_format {
            Some(format) => matches!(format, TraceFormatFlag::Json),
            None => file.to_ascii_lowercase().ends_with(".jsonl"),
        };
        let out: Box<dyn Write> = match pending {
            Some(pending) => pending.writer()?,
            None => Box::new(BufWriter::new(stdout())),
        };
        let lines = TraceLineWriter::new(source, if json { TraceFormat::Json } else { TraceFormat::Text });
        let trace = TraceOutput::new(lines, out, self.trace_last.map_or(TraceSink::All, TraceSink::Last), hz);
        Ok(Some(TraceProbe::new(Some(trace), request.traced_words, request.signals)))
    }

    /// Ends the trace and renames its file to the final name.
    pub fn finish_trace(
        &self,
        probe: TraceProbe<'_>,
        pending: Option<PendingFile>,
        cycle: u64,
        result: &RunResult,
    ) -> Result<(), VerbFailure> {
        let name = self.trace.as_deref().unwrap_or_default();
        if let Some(trace) = probe.trace {
            let why = summary::reason_word(result.reason);
            trace.finish(cycle, why).map_err(|error| VerbFailure::write_failed(name, &error))?;
        }
        pending.map_or(Ok(()), PendingFile::complete)
    }
}

impl TraceRequest {
    /// Returns the signals of the waveform in addition to the pins.
    pub fn wave_signals(&self) -> Vec<WaveSignal> {
        self.signals.as_ref().map_or_else(Vec::new, TraceSignals::wave_signals)
    }
}

/// Reads a map for a chip.
pub fn read_map(file: &str, chip: &Chip) -> Result<ImageMap, VerbFailure> {
    let refuse = |cause: String| {
        let hint = "give the file that `emu compile --map` wrote together with the image";
        VerbFailure::Refused(vec![file_error(NOT_A_MAP, file, cause, hint)], FileTexts::default())
    };
    let map: ImageMap = serde_json::from_slice(&input::read_bytes(file)?)
        .map_err(|why| refuse(format!("is not a map of an image: {why}")))?;
    if map.schema != SCHEMA {
        return Err(refuse(format!("is a map of version {}; this emu reads version {SCHEMA}", map.schema)));
    }
    if !map.mcu.eq_ignore_ascii_case(chip.name) {
        return Err(refuse(format!("is a map for {}, and the chip is {}", map.mcu, chip.name)));
    }
    Ok(map)
}

/// Adds the program words of a `--trace-only` range.
fn add_trace_range(
    words: &mut WordSet,
    text: &str,
    source: &ProgramSource<'_>,
    map: Option<&ImageMap>,
) -> Result<(), UsageError> {
    let (names, chip) = (&source.names, source.names.chip);
    if let Some(number) = text.trim().strip_prefix("rung:") {
        let Some(map) = map else { return Err(UsageError::RungWithoutMap) };
        let rung = number.trim().parse().ok().and_then(|n: u32| map.rungs.iter().find(|rung| rung.rung == n));
        let rung = rung.ok_or(UsageError::UnknownRung { count: map.rungs.len() })?;
        words.add(rung.start / chip.word_bytes, rung.end.div_ceil(chip.word_bytes));
        if rung.start >= rung.end {
            return Err(UsageError::RungWithoutCode);
        }
        return Ok(());
    }
    let is_symbol = names.symbols.iter().any(|symbol| symbol.is_named(text.trim()));
    let (start, end) = match text.split_once("..").filter(|_| !is_symbol) {
        Some((start, end)) => (start.trim(), Some(end.trim())),
        None => (text.trim(), None),
    };
    let line = start.rsplit_once(':').filter(|(file, _)| !file.ends_with(':'));
    if let Some((file, first)) = line {
        return add_line_words(words, (file, first), end, source);
    }
    let first = names.parse_program_word(start)?;
    let last = match end {
        Some(end) => names.parse_program_end(end)?,
        None => {
            let byte = first * chip.word_bytes;
            let code = || names.symbols.iter().filter(|symbol| symbol.space == chip.code_space);
            let matches_name = |s: &SymbolAt| s.is_named(start) || s.is_shortened_to(start).is_some();
            let symbols_here =
                code().filter(|s| s.addr == byte && (matches_name(s) || start.starts_with(char::is_numeric)));
            let size = symbols_here.map(|symbol| symbol.size).max().unwrap_or(0);
            let is_symbol_name = code().any(matches_name);
            // A function without a size extends to the next symbol.
            let next = code().map(|s| s.addr).filter(|&addr| addr > byte).min();
            match (size, is_symbol_name) {
                (0, true) => next.map_or(chip.flash_bytes / chip.word_bytes, |next| next.div_ceil(chip.word_bytes)),
                (0, false) => first + 1,
                (size, _) => (byte + size).div_ceil(chip.word_bytes),
            }
        }
    };
    if first >= last {
        return Err(UsageError::EmptyRange { what: "instruction" });
    }
    words.add(first, last);
    Ok(())
}

/// Adds the words of source lines from the first to the one before the end. Without an end, adds those of the
/// first line.
fn add_line_words(
    words: &mut WordSet,
    (file, first): (&str, &str),
    end: Option<&str>,
    source: &ProgramSource<'_>,
) -> Result<(), UsageError> {
    let number = |text: &str| {
        text.parse::<u32>().map_err(|_| UsageError::MalformedPart {
            part: text.to_owned(),
            wanted: "a line",
            expected: "write main.c:10..20".into(),
        })
    };
    let first = number(first)?;
    let end = end.map_or(Ok(first.saturating_add(1)), number)?;
    if first >= end {
        return Err(UsageError::EmptyRange { what: "line" });
    }
    let known = (first..end).take(1 << 16).find_map(|line| source.lines.addresses_of_line(file, line).ok());
    if known.is_none() {
        // If no line of the range has code, report why the first one has none.
        source.lines.addresses_of_line(file, first)?;
        return Ok(());
    }
    let chip = source.names.chip;
    let is_file = |path: &str| path == file || path.ends_with(&format!("/{file}"));
    for word in 0..chip.flash_bytes / chip.word_bytes {
        let line = source.line_at(word);
        if line.is_some_and(|at| is_file(&at.file) && (first..end).contains(&at.line)) {
            words.add(word, word + 1);
        }
    }
    Ok(())
}
