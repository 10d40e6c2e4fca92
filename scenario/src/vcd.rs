//! Reads a waveform (VCD, IEEE 1364-2005, section 18) as a scenario of stimuli.

use std::collections::{HashMap, HashSet};
use std::io::{self, BufReader, Read};

use diag::{Diagnostic, Pos, Severity};
use vcd::{Command, IdCode, Parser, TimescaleUnit};

use crate::codes::{AMBIGUOUS_WIRES, NOT_VCD, UNKNOWN_WIRES};
use crate::model::{Assignment, LocatedText, Scenario, ScenarioStep, ScenarioValue, StepAction, StepTime};
use crate::time::{TimeSpan, TimeUnit};

/// Maximum number of value changes, to limit the memory that a file needs.
const MAX_CHANGES: usize = 5_000_000;

/// A parsed waveform.
#[derive(Debug, Clone, Default)]
pub struct Waveform {
    file: String,
    /// The names of the wires, in file order.
    pub wires: Vec<String>,
    /// The line on which each wire is declared.
    lines: Vec<u32>,
    changes: Vec<WireChange>,
    /// The time unit of the file: a number, and the exponent of 10 below the second.
    scale: (u64, u32),
    /// True if some changes were skipped: x, real numbers or texts.
    has_skipped_values: bool,
}

/// A value change of a wire.
#[derive(Debug, Clone)]
struct WireChange {
    /// Time in units of the file.
    time: u64,
    /// Index of the wire.
    wire: usize,
    value: ScenarioValue,
    line: u32,
}

/// The wires that share an identifier code.
#[derive(Default)]
struct WireCode {
    bits: u32,
    /// Indices of the wires.
    wires: Vec<usize>,
}

/// A reader that appends a space if the last line does not end with a newline; the VCD parser requires white
/// space after every word.
#[derive(Debug)]
pub struct NewlineTerminated<R> {
    input: R,
    last: u8,
}

impl<R: Read> NewlineTerminated<R> {
    /// Wraps `input`.
    pub fn new(input: R) -> NewlineTerminated<R> {
        NewlineTerminated { input, last: b'\n' }
    }
}

impl<R: Read> Read for NewlineTerminated<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.input.read(buffer)?;
        if let Some(last) = buffer.get(..count).and_then(|read| read.last()) {
            self.last = *last;
        } else if let Some(place) = buffer.first_mut().filter(|_| self.last != b'\n') {
            (*place, self.last) = (b' ', b'\n');
            return Ok(1);
        }
        Ok(count)
    }
}

/// Parses a waveform.
///
/// # Errors
/// The first line that cannot be parsed.
pub fn read_vcd(file: &str, bytes: &[u8]) -> Result<Waveform, Diagnostic> {
    let mut wave = Waveform { file: file.to_owned(), scale: (1, 9), ..Waveform::default() };
    let mut codes: HashMap<IdCode, WireCode> = HashMap::new();
    let mut known: HashSet<(IdCode, String)> = HashSet::new();
    let mut parser = Parser::new(BufReader::new(NewlineTerminated::new(bytes)));
    let (mut now, mut defined, mut depth) = (0, false, 0u32);
    let fault = |line: u64, cause: String| {
        let pos = Pos::new(u32::try_from(line).unwrap_or(0), 0, 0);
        let hint = "give a value change dump, as --vcd writes one";
        Diagnostic::new(Severity::Error, NOT_VCD, file, pos, cause, hint)
    };
    if bytes.starts_with(b"\xEF\xBB\xBF") {
        return Err(fault(1, "the file begins with the mark U+FEFF, which is not a part of a waveform".to_owned()));
    }
    loop {
        let command = match parser.next() {
            None => break,
            Some(Ok(command)) => command,
            Some(Err(error)) => {
                let text = error.to_string();
                let why = text.split(" at line").next().unwrap_or(&text).to_lowercase();
                return Err(fault(parser.line(), format!("this is not a waveform: {why}")));
            }
        };
        let (code, value) = match command {
            Command::Timescale(0, _) => return Err(fault(parser.line(), "the time scale is 0".to_owned())),
            Command::Timescale(number, unit) => {
                wave.scale = (u64::from(number), decimal_places(unit));
                continue;
            }
            Command::ScopeDef(..) => {
                depth += 1;
                continue;
            }
            Command::Upscope => {
                let why = || fault(parser.line(), "$upscope leaves a scope that was not entered".to_owned());
                depth = depth.checked_sub(1).ok_or_else(why)?;
                continue;
            }
            Command::VarDef(..) if defined => {
                return Err(fault(parser.line(), "a wire is declared after $enddefinitions".to_owned()));
            }
            Command::VarDef(_, bits, code, name, _) => {
                let same = codes.entry(code).or_default();
                same.bits = same.bits.max(bits).max(1);
                // One signal can be declared in several scopes.
                if known.insert((code, name.clone())) {
                    same.wires.push(wave.wires.len());
                    wave.wires.push(name);
                    wave.lines.push(u32::try_from(parser.line()).unwrap_or(0));
                }
                continue;
            }
            Command::Enddefinitions => {
                defined = true;
                continue;
            }
            Command::Timestamp(time) if time < now => {
                return Err(fault(parser.line(), format!("time goes back from {now} to {time}")));
            }
            Command::Timestamp(time) => {
                now = time;
                continue;
            }
            Command::ChangeScalar(code, value) => (code, to_level(value)),
            Command::ChangeVector(code, vector) => {
                let bits: Vec<vcd::Value> = vector.iter().collect();
                let front = bits.len().saturating_sub(codes.get(&code).map_or(0, |coded| coded.bits as usize));
                if bits.iter().take(front).any(|bit| *bit != vcd::Value::V0) {
                    let cause = format!("a value of {} bits for a wire that has fewer", bits.len());
                    return Err(fault(parser.line(), cause));
                }
                match bits.get(front..) {
                    Some(&[bit]) => (code, to_level(bit)),
                    bits => (code, bits.and_then(to_integer)),
                }
            }
            Command::ChangeReal(code, _) | Command::ChangeString(code, _) => (code, None),
            _ => continue,
        };
        let Some(WireCode { wires, .. }) = codes.get(&code).filter(|_| defined) else {
            return Err(fault(parser.line(), "a wire changes that was not declared".to_owned()));
        };
        match value {
            Some(value) => {
                let line = u32::try_from(parser.line()).unwrap_or(0);
                wave.changes.extend(wires.iter().map(|wire| WireChange {
                    time: now,
                    wire: *wire,
                    value: value.clone(),
                    line,
                }));
            }
            None => wave.has_skipped_values = true,
        }
        if wave.changes.len() > MAX_CHANGES {
            return Err(fault(parser.line(), format!("there are more than {MAX_CHANGES} changes")));
        }
    }
    if !defined {
        return Err(fault(parser.line(), "this is not a waveform: it has no $enddefinitions".to_owned()));
    }
    Ok(wave)
}

impl Waveform {
    /// Makes a scenario from the wires for which `wanted` is true, with warnings about wires and values that
    /// are skipped.
    ///
    /// # Errors
    /// Two wanted wires with different signals have the same name.
    pub fn to_scenario(
        &self,
        wanted: &mut dyn FnMut(&str) -> bool,
    ) -> Result<(Scenario, Vec<Diagnostic>), Vec<Diagnostic>> {
        let takes: Vec<bool> = self.wires.iter().map(|wire| wanted(wire)).collect();
        let twice = self.duplicate_wires(&takes);
        if !twice.is_empty() {
            return Err(twice);
        }
        let other = self.wires.iter().zip(&takes).filter(|(_, takes)| !**takes).map(|(wire, _)| wire.as_str());
        let other: Vec<&str> = other.collect();
        let mut warnings = Vec::new();
        let mut warn = |cause: String, hint: &str| {
            warnings.push(Diagnostic::new(Severity::Warning, UNKNOWN_WIRES, &self.file, Pos::default(), cause, hint));
        };
        if !other.is_empty() {
            let some = other.iter().take(8).copied().collect::<Vec<_>>().join(", ");
            let more = other.len().saturating_sub(8);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            warn(format!("wires that drive nothing here: {some}{more}"), "name wires as what they are to drive");
        }
        if self.has_skipped_values {
            warn("some changes to x, to real numbers or texts are ignored".to_owned(), "use 0, 1 and z");
        }
        let steps = self.changes.iter().filter(|change| takes.get(change.wire) == Some(&true));
        let steps = steps.map(|WireChange { time, wire, value, line }| {
            let pos = Pos::new(*line, 0, 0);
            let name = LocatedText { text: self.wires.get(*wire).cloned().unwrap_or_default(), pos };
            let verb = StepAction::Set(vec![Assignment { name, value: value.clone(), pos }]);
            ScenarioStep {
                pos,
                name: None,
                time: StepTime::At(self.to_time_span(*time)),
                repetition: None,
                action: verb,
            }
        });
        Ok((Scenario { file: self.file.clone(), steps: steps.collect(), ..Scenario::default() }, warnings))
    }

    /// Diagnostics for wanted wires that have the name of an earlier one.
    fn duplicate_wires(&self, takes: &[bool]) -> Vec<Diagnostic> {
        let mut first: HashMap<&str, u32> = HashMap::new();
        let mut faults = Vec::new();
        for ((wire, line), _) in self.wires.iter().zip(&self.lines).zip(takes).filter(|(_, takes)| **takes) {
            if let Some(before) = first.get(wire.as_str()) {
                let cause = format!("`{wire}` is the name of two wires, of this and of that of line {before}");
                let (pos, hint) = (Pos::new(*line, 0, 0), "rename the one that is not to drive it");
                faults.push(Diagnostic::new(Severity::Error, AMBIGUOUS_WIRES, &self.file, pos, cause, hint));
            } else {
                first.insert(wire, *line);
            }
        }
        faults
    }

    /// A time of the file, rounded up to the next tick.
    fn to_time_span(&self, time: u64) -> TimeSpan {
        let mantissa = time.saturating_mul(self.scale.0);
        let text = format!("#{time}");
        TimeSpan {
            mantissa,
            decimals: 0,
            unit: TimeUnit::Second(self.scale.1),
            text,
            pos: Pos::default(),
            round_up: true,
        }
    }
}

fn decimal_places(unit: TimescaleUnit) -> u32 {
    match unit {
        TimescaleUnit::S => 0,
        TimescaleUnit::MS => 3,
        TimescaleUnit::US => 6,
        TimescaleUnit::NS => 9,
        TimescaleUnit::PS => 12,
        TimescaleUnit::FS => 15,
    }
}

fn to_level(value: vcd::Value) -> Option<ScenarioValue> {
    match value {
        vcd::Value::V0 => Some(ScenarioValue::Number(0)),
        vcd::Value::V1 => Some(ScenarioValue::Number(1)),
        vcd::Value::Z => Some(ScenarioValue::Text("z".to_owned())),
        vcd::Value::X => None,
    }
}

/// An unsigned integer from bits, the highest first; `None` if a bit is x or z, or if there are too many
/// bits.
fn to_integer(bits: &[vcd::Value]) -> Option<ScenarioValue> {
    let number = bits.iter().try_fold(0i64, |number, bit| match bit {
        vcd::Value::V0 => number.checked_mul(2),
        vcd::Value::V1 => number.checked_mul(2)?.checked_add(1),
        vcd::Value::X | vcd::Value::Z => None,
    });
    number.map(ScenarioValue::Number)
}
