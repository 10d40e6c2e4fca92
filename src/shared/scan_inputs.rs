//! Inputs of `emu sim`: from the command line, and from a table of inputs by scan.

use diag::{Diagnostic, Pos, Severity};
use ladder_eval::Evaluator;

use crate::shared::codes::INPUT_TABLE;
use crate::shared::fail::VerbFailure;
use crate::shared::input;
use crate::shared::report::FileTexts;
use diag::nearest;

use crate::shared::usage_error::UsageError;

/// A value that is set before a scan.
pub struct ScanChange {
    /// The scan, counted from 1.
    pub scan: u64,
    /// What is set, and its value.
    pub input: SimInput,
}

/// An input and its value.
#[derive(Debug, Clone, Copy)]
pub enum SimInput {
    /// A symbol, by its index.
    Symbol(usize, i32),
    /// The level of an analog input, by the index of its symbol.
    Level(usize, u16),
    /// A cell of the EEPROM, by its address.
    Cell(usize, u8),
}

impl ScanChange {
    /// Applies the change to an evaluator.
    pub fn apply(&self, evaluator: &mut Evaluator) {
        match self.input {
            SimInput::Symbol(symbol, value) => evaluator.set(symbol, value),
            SimInput::Level(symbol, level) => evaluator.set_adc(symbol, level),
            SimInput::Cell(cell, byte) => evaluator.set_eeprom(cell, byte),
        }
    }
}

impl SimInput {
    /// Parses `NAME=VALUE`.
    pub fn new(evaluator: &Evaluator, text: &str) -> Result<SimInput, UsageError> {
        let (name, value) =
            text.split_once('=').ok_or_else(|| UsageError::malformed("give a value, as in Xstart=1"))?;
        SimInput::of(evaluator, name.trim(), value.trim())
    }

    /// Returns the input `name` with `value`, or the reason why it is invalid.
    fn of(evaluator: &Evaluator, name: &str, value: &str) -> Result<SimInput, UsageError> {
        let number = |low: i64, high: i64| {
            let number = value.strip_prefix("0x").map_or_else(|| value.parse(), |hex| i64::from_str_radix(hex, 16));
            let number = number.ok().filter(|number| (low..=high).contains(number));
            number.ok_or_else(|| UsageError::OutOfRange {
                name: name.to_owned(),
                range: low..=high,
                value: value.to_owned(),
            })
        };
        if let Some(cell) = name.strip_prefix("eeprom:") {
            let count = evaluator.eeprom().len();
            let cell = cell.parse().ok().filter(|cell| *cell < count);
            let cell = cell.ok_or_else(|| UsageError::NoCell { name: name.to_owned(), count })?;
            return Ok(SimInput::Cell(cell, number(0, 255)? as u8));
        }
        let index = evaluator.index(name);
        let Some((index, symbol)) = index.and_then(|i| Some((i, evaluator.symbols().get(i)?))) else {
            let known = evaluator.symbols().iter().map(|s| s.name.clone()).collect();
            return Err(UsageError::UnknownSymbol { name: name.to_owned(), known });
        };
        if evaluator.adc_symbols().any(|adc| adc == index) {
            return Ok(SimInput::Level(index, number(0, 1023)? as u16));
        }
        let (low, high) = symbol.range().into_inner();
        Ok(SimInput::Symbol(index, number(low, high)? as i32))
    }
}

/// A table of inputs by scan.
pub struct InputTable {
    /// The last scan, if there is one.
    pub last: Option<u64>,
    /// The changes in order.
    pub changes: Vec<ScanChange>,
}

/// Reads a table of inputs by scan. Columns of inputs X.. and of analog inputs count. Returns the last scan,
/// if there is one, and the changes in order. Errors carry their place in the file.
pub fn read_input_table(file: &str, evaluator: &Evaluator) -> Result<InputTable, VerbFailure> {
    let bytes = input::read_bytes(file)?;
    let text = diag::text::readable(&bytes);
    read(file, &text, evaluator).map_err(|fault| VerbFailure::Refused(vec![*fault], FileTexts::one(file, bytes)))
}

fn read(file: &str, text: &str, evaluator: &Evaluator) -> Result<InputTable, Box<Diagnostic>> {
    let mut lines = (1u32..).zip(text.lines()).map(|(number, line)| (number, cells(line)));
    let fault = |pos: Pos, cause: String, hint: &str| {
        Box::new(Diagnostic::new(Severity::Error, INPUT_TABLE, file, pos, cause, hint))
    };
    let (_, head) = lines.next().unwrap_or((1, Vec::new()));
    let Some((("scan", _), columns)) = head.split_first() else {
        let hint = "begin with a line such as scan,Xa,Xb";
        return Err(fault(Pos::new(1, 1, 1), "the head line does not begin with `scan`".to_owned(), hint));
    };
    let names: Vec<&str> = evaluator.symbols().iter().map(|s| s.name.as_str()).collect();
    // In an IEC program the name does not show what is an input.
    let is_iec = evaluator.symbols().iter().any(|symbol| symbol.iec_type.is_some());
    for &(name, column) in columns {
        let input = is_iec || name.starts_with(['X', 'A']);
        if input && evaluator.index(name).is_none() {
            let near =
                nearest(name, names.iter().copied()).map_or(String::new(), |near| format!("; did you mean {near}?"));
            let cause = format!("the program has no symbol `{}`", shown(name));
            let pos = Pos::new(1, column, name.chars().count() as u32);
            return Err(fault(pos, cause, &format!("correct the name{near}")));
        }
    }
    let counts = |name: &str| {
        let symbol = evaluator.index(name).and_then(|i| Some((i, evaluator.symbols().get(i)?)));
        symbol.is_some_and(|(i, s)| s.is_given || evaluator.adc_symbols().any(|adc| adc == i))
    };
    let mut changes: Vec<ScanChange> = Vec::new();
    let mut before = 0;
    for (number, row) in lines.filter(|(_, row)| row.iter().any(|(cell, _)| !cell.is_empty())) {
        let place = |at: usize| {
            let (cell, column) = row.get(at).copied().unwrap_or(("", 1));
            Pos::new(number, column, cell.chars().count().max(1) as u32)
        };
        let scan = row.first().and_then(|(scan, _)| scan.parse().ok()).filter(|scan| *scan > before);
        let Some(scan) = scan else {
            let cause = format!("`{}` is not a scan after {before}", shown(row.first().map_or("", |(scan, _)| scan)));
            return Err(fault(place(0), cause, "number the scans from 1, rising"));
        };
        before = scan;
        if row.len() != columns.len() + 1 {
            let cause = format!("{} value(s), but the head line needs {}", row.len(), columns.len() + 1);
            return Err(fault(place(0), cause, "give every column a value, or leave it empty between its commas"));
        }
        for (at, (&(name, _), &(value, _))) in (1..).zip(columns.iter().zip(row.iter().skip(1))) {
            if value.is_empty() || !counts(name) {
                continue;
            }
            match SimInput::of(evaluator, name, value) {
                Ok(what) => changes.push(ScanChange { scan, input: what }),
                Err(cause) => {
                    return Err(fault(place(at), cause.to_string(), "write a number in that range, or nothing"));
                }
            }
        }
    }
    Ok(InputTable { last: (before > 0).then_some(before), changes })
}

/// Splits a line into trimmed values, each with its column, counted from 1.
fn cells(line: &str) -> Vec<(&str, u32)> {
    let mut column = 1;
    let mut out = Vec::new();
    for cell in line.split(',') {
        let indent = cell.chars().take_while(|c| c.is_whitespace()).count() as u32;
        out.push((cell.trim(), column + indent));
        column += cell.chars().count() as u32 + 1;
    }
    out
}

/// Returns a word of the file in a form that is safe in a message.
fn shown(text: &str) -> String {
    text.chars().take(40).map(|c| if c.is_control() { '?' } else { c }).collect()
}
