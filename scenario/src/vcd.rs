//! A waveform (VCD, IEEE 1364-2005, section 18) as a scenario of stimuli.

use std::collections::HashMap;

use diag::{Diagnostic, Pos, Severity};
use vcd::{Command, IdCode, Parser, TimescaleUnit};

use crate::codes::{NO_VCD, STRANGE_WIRES, TWO_WIRES};
use crate::model::{Assign, Named, Scenario, Step, Value, Verb, When};
use crate::time::{Span, Unit};

/// Changes at most, so that a file of any size fits in memory.
const MAX_CHANGES: usize = 5_000_000;

/// A waveform that was read.
#[derive(Debug, Clone, Default)]
pub struct Waveform {
    file: String,
    /// The wires by name, in the order of the file.
    pub wires: Vec<String>,
    /// The line on which each is declared.
    lines: Vec<u32>,
    /// Time in units of the file, wire by position, value.
    changes: Vec<(u64, usize, Value)>,
    /// A unit of the file: a number, and 10 to minus this many seconds.
    scale: (u64, u32),
    /// Something of it was passed over: x, a real number or a text.
    unclear: bool,
}

/// Reads a waveform.
///
/// # Errors
/// The first line that cannot be read.
pub fn read_vcd(file: &str, bytes: &[u8]) -> Result<Waveform, Diagnostic> {
    let mut wave = Waveform { file: file.to_owned(), scale: (1, 9), ..Waveform::default() };
    let mut codes: HashMap<IdCode, Vec<usize>> = HashMap::new();
    let mut parser = Parser::new(bytes);
    let (mut now, mut defined) = (0, false);
    let fault = |line: u64, cause: String| {
        let pos = Pos::new(u32::try_from(line).unwrap_or(0), 0, 0);
        let hint = "give a value change dump, as --vcd writes one";
        Diagnostic::new(Severity::Error, NO_VCD, file, pos, cause, hint)
    };
    loop {
        let command = match parser.next() {
            None => break,
            Some(Ok(command)) => command,
            Some(Err(error)) => {
                let text = error.to_string();
                let why = text.split(" at line").next().unwrap_or(&text).to_lowercase();
                return Err(fault(parser.line(), format!("this is no waveform: {why}")));
            }
        };
        let (code, value) = match command {
            Command::Timescale(number, unit) => {
                wave.scale = (u64::from(number), places(unit));
                continue;
            }
            Command::VarDef(_, _, code, name, _) => {
                let same = codes.entry(code).or_default();
                // One signal is seen from several scopes.
                if !same.iter().any(|wire| wave.wires.get(*wire) == Some(&name)) {
                    same.push(wave.wires.len());
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
            Command::ChangeScalar(code, value) => (code, level(value)),
            Command::ChangeVector(code, vector) => {
                let bits: Option<Vec<bool>> = vector.iter().map(bit).collect();
                (code, bits.and_then(|bits| integer(&bits)))
            }
            Command::ChangeReal(code, _) | Command::ChangeString(code, _) => (code, None),
            _ => continue,
        };
        let Some(wires) = codes.get(&code).filter(|_| defined) else {
            return Err(fault(parser.line(), "a wire changes that was not declared".to_owned()));
        };
        match value {
            Some(value) => wave.changes.extend(wires.iter().map(|wire| (now, *wire, value.clone()))),
            None => wave.unclear = true,
        }
        if wave.changes.len() > MAX_CHANGES {
            return Err(fault(parser.line(), format!("there are more than {MAX_CHANGES} changes")));
        }
    }
    if !defined {
        return Err(fault(parser.line(), "this is no waveform: it has no $enddefinitions".to_owned()));
    }
    Ok(wave)
}

impl Waveform {
    /// The stimuli of the wires that are `wanted`, and a warning where others are passed over.
    ///
    /// # Errors
    /// Two signals of one name are wanted.
    pub fn scenario(
        &self,
        wanted: &mut dyn FnMut(&str) -> bool,
    ) -> Result<(Scenario, Vec<Diagnostic>), Vec<Diagnostic>> {
        let takes: Vec<bool> = self.wires.iter().map(|wire| wanted(wire)).collect();
        let twice = self.twice(&takes);
        if !twice.is_empty() {
            return Err(twice);
        }
        let other = self.wires.iter().zip(&takes).filter(|(_, takes)| !**takes).map(|(wire, _)| wire.as_str());
        let other: Vec<&str> = other.collect();
        let mut told = Vec::new();
        let mut tell = |cause: String, hint: &str| {
            told.push(Diagnostic::new(Severity::Warning, STRANGE_WIRES, &self.file, Pos::default(), cause, hint));
        };
        if !other.is_empty() {
            let some = other.iter().take(8).copied().collect::<Vec<_>>().join(", ");
            let more = other.len().saturating_sub(8);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            tell(format!("wires that drive nothing here: {some}{more}"), "name wires as what they are to drive");
        }
        if self.unclear {
            tell("some changes to x, to real numbers or texts are passed over".to_owned(), "use 0, 1 and z");
        }
        let steps = self.changes.iter().filter(|(_, wire, _)| takes.get(*wire) == Some(&true));
        let steps = steps.map(|(time, wire, value)| {
            let name = self.wires.get(*wire).cloned().unwrap_or_default();
            let name = Named { text: name, pos: Pos::default() };
            Step {
                pos: Pos::default(),
                name: None,
                when: When::At(self.span(*time)),
                every: None,
                verb: Verb::Set(vec![Assign { name, value: value.clone(), pos: Pos::default() }]),
            }
        });
        Ok((Scenario { file: self.file.clone(), steps: steps.collect(), ..Scenario::default() }, told))
    }

    /// Wires that are taken and have the name of one before them.
    fn twice(&self, takes: &[bool]) -> Vec<Diagnostic> {
        let mut first: HashMap<&str, u32> = HashMap::new();
        let mut faults = Vec::new();
        for ((wire, line), _) in self.wires.iter().zip(&self.lines).zip(takes).filter(|(_, takes)| **takes) {
            if let Some(before) = first.get(wire.as_str()) {
                let cause = format!("`{wire}` is the name of two wires, of this and of that of line {before}");
                let (pos, hint) = (Pos::new(*line, 0, 0), "rename the one that is not to drive it");
                faults.push(Diagnostic::new(Severity::Error, TWO_WIRES, &self.file, pos, cause, hint));
            } else {
                first.insert(wire, *line);
            }
        }
        faults
    }

    /// A moment of the file: it counts from the first tick on that does not begin before it.
    fn span(&self, time: u64) -> Span {
        let mantissa = time.saturating_mul(self.scale.0);
        let text = format!("#{time}");
        Span { mantissa, decimals: 0, unit: Unit::Second(self.scale.1), text, pos: Pos::default(), up: true }
    }
}

fn places(unit: TimescaleUnit) -> u32 {
    match unit {
        TimescaleUnit::S => 0,
        TimescaleUnit::MS => 3,
        TimescaleUnit::US => 6,
        TimescaleUnit::NS => 9,
        TimescaleUnit::PS => 12,
        TimescaleUnit::FS => 15,
    }
}

fn level(value: vcd::Value) -> Option<Value> {
    match value {
        vcd::Value::V0 => Some(Value::Number(0)),
        vcd::Value::V1 => Some(Value::Number(1)),
        vcd::Value::Z => Some(Value::Text("z".to_owned())),
        vcd::Value::X => None,
    }
}

fn bit(value: vcd::Value) -> Option<bool> {
    match value {
        vcd::Value::V0 => Some(false),
        vcd::Value::V1 => Some(true),
        vcd::Value::X | vcd::Value::Z => None,
    }
}

/// Bits, the highest first, without a sign.
fn integer(bits: &[bool]) -> Option<Value> {
    let significant = bits.iter().skip_while(|bit| !**bit).count();
    let number = bits.iter().fold(0i64, |number, bit| number.wrapping_mul(2).wrapping_add((*bit).into()));
    (significant < 63).then_some(Value::Number(number))
}
