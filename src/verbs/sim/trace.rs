//! The trace of `emu sim`, written as a table, comma-separated values, JSON or a waveform.

use std::io::{self, Write};

use ladder_eval::{Evaluator, LadderSymbol, PwmChannel};
use serde_json::{Value as Json, json};
use vcd::{IdCode, TimescaleUnit, Value, VarType, Writer};

/// The trace of a program: a column for each symbol, then columns for sent bytes, duty and EEPROM cells.
pub struct ScanTraceTable<'a> {
    /// The symbols.
    pub symbols: &'a [LadderSymbol],
    /// Names of the additional columns. They contain characters that no symbol can have.
    extra_columns: Vec<String>,
    /// The PWM outputs.
    outputs: Vec<PwmChannel>,
    /// True if the program can send bytes.
    sends: bool,
    /// For each scan, the values of all columns; `None` if nothing was sent or set.
    pub rows: Vec<Vec<Option<i64>>>,
}

impl<'a> ScanTraceTable<'a> {
    /// Creates an empty trace. `sends` is true if the program has elements that send.
    pub fn new(symbols: &'a [LadderSymbol], evaluator: &Evaluator, sends: bool) -> ScanTraceTable<'a> {
        let outputs = evaluator.pwm_outputs().to_vec();
        let mut others: Vec<String> = Vec::new();
        others.extend(sends.then(|| "uart:sent".to_owned()));
        others.extend(outputs.iter().map(|output| match &output.name {
            Some(name) if outputs.len() > 1 => format!("pwm:{name}"),
            _ => "pwm:duty".to_owned(),
        }));
        others.extend((0..evaluator.eeprom().len()).map(|cell| format!("eeprom:{cell}")));
        ScanTraceTable { symbols, extra_columns: others, outputs, sends, rows: Vec::new() }
    }

    /// Returns the number of columns.
    pub fn width(&self) -> usize {
        self.symbols.len() + self.extra_columns.len()
    }

    /// Adds the state after a scan.
    pub fn note_scan(&mut self, evaluator: &Evaluator) {
        let mut row: Vec<Option<i64>> = self
            .symbols
            .iter()
            .enumerate()
            .map(|(index, symbol)| Some(symbol.shown_value(evaluator.get(index))))
            .collect();
        row.extend(self.sends.then(|| evaluator.sent().map(i64::from)));
        row.extend(evaluator.pwm_duties().iter().map(|duty| duty.map(i64::from)));
        row.extend(evaluator.eeprom().iter().map(|byte| Some(i64::from(*byte))));
        self.rows.push(row);
    }

    fn names(&self) -> impl Iterator<Item = &str> {
        self.symbols.iter().map(|s| s.name.as_str()).chain(self.extra_columns.iter().map(String::as_str))
    }

    /// Returns the JSON document: `scans` holds the symbols; each additional column has its own list with one
    /// value per scan.
    pub fn json(&self, file: &str, cycle_us: u64) -> Json {
        let list: Vec<_> = self.symbols.iter().map(symbol_json).collect();
        let count = self.symbols.len();
        let scans: Vec<_> = self.rows.iter().map(|row| row.get(..count)).collect();
        let mut out = json!({
            "schema": 1, "program": file, "cycle_us": cycle_us, "symbols": list, "scans": scans,
        });
        let column = |at: usize| -> Vec<_> { self.rows.iter().map(|row| row.get(at)).collect() };
        if self.sends {
            out["sent"] = json!(column(count));
        }
        let first = count + usize::from(self.sends);
        match &self.outputs[..] {
            [] => {}
            [output] => out["pwm"] = json!({ "hertz": output.hertz, "duty": column(first) }),
            outputs => {
                let list = outputs.iter().zip(first..);
                let list =
                    list.map(|(output, at)| json!({ "name": output.name, "hertz": output.hertz, "duty": column(at) }));
                out["pwm"] = json!(list.collect::<Vec<_>>());
            }
        }
        let cells = first + self.outputs.len();
        if cells < self.width() {
            out["eeprom"] = json!(self.rows.iter().map(|row| row.get(cells..)).collect::<Vec<_>>());
        }
        out
    }

    /// Returns comma-separated values: a header line, then one line per scan. A value is empty if nothing was
    /// sent or set.
    pub fn csv(&self) -> String {
        let mut out = "scan".to_owned();
        self.names().for_each(|name| out.push_str(&format!(",{name}")));
        out.push('\n');
        for (scan, row) in self.rows.iter().enumerate() {
            out.push_str(&(scan + 1).to_string());
            for value in row {
                out.push_str(&value.map_or(",".to_owned(), |value| format!(",{value}")));
            }
            out.push('\n');
        }
        out
    }

    /// Returns a table for people, with `-` if nothing was sent or set.
    pub fn table(&self) -> String {
        let text = |value: &Option<i64>| value.map_or("-".to_owned(), |value| value.to_string());
        let digits = |column: usize| self.rows.iter().filter_map(|r| r.get(column)).map(|v| text(v).len()).max();
        let widths: Vec<usize> =
            self.names().enumerate().map(|(i, name)| name.chars().count().max(digits(i).unwrap_or(0))).collect();
        let first = self.rows.len().to_string().len().max(4);
        let mut out = format!("{:>first$}", "scan");
        for (name, &width) in self.names().zip(&widths) {
            out.push_str(&format!("  {name:>width$}"));
        }
        out.push('\n');
        for (scan, row) in self.rows.iter().enumerate() {
            out.push_str(&format!("{:>first$}", scan + 1));
            for (value, &width) in row.iter().zip(&widths) {
                out.push_str(&format!("  {:>width$}", text(value)));
            }
            out.push('\n');
        }
        out
    }

    /// Writes a waveform file (IEEE 1364-2005, section 18) in microseconds: the state after scan k, from 1,
    /// starts at k cycle times.
    pub fn vcd(&self, program: &str, cycle_us: u64, out: Box<dyn Write>) -> io::Result<()> {
        let mut out = Writer::new(out);
        out.version(concat!("emu ", env!("CARGO_PKG_VERSION")))?;
        out.comment(&format!("{program}: reference, a scan every {cycle_us} us"))?;
        out.timescale(1, TimescaleUnit::US)?;
        out.add_module("program")?;
        let mut variables = Vec::new();
        for symbol in self.symbols {
            let bits = 8 * u32::from(symbol.bytes);
            variables.push(match bits {
                0 => (out.add_wire(1, &symbol.name)?, 0),
                _ => (out.add_var(VarType::Integer, bits, &symbol.name, None)?, bits),
            });
        }
        for name in &self.extra_columns {
            variables.push((out.add_var(VarType::Reg, 8, &name.replace(':', "_"), None)?, 8));
        }
        let event = self.sends.then(|| out.add_var(VarType::Event, 1, "uart_event", None)).transpose()?;
        out.upscope()?;
        out.enddefinitions()?;
        let mut last: Option<&Vec<Option<i64>>> = None;
        for (scan, row) in (1u64..).zip(&self.rows) {
            out.timestamp(scan.saturating_mul(cycle_us))?;
            for (column, (&value, &variable)) in row.iter().zip(&variables).enumerate() {
                if last.is_none_or(|last| last.get(column) != Some(&value)) {
                    change(&mut out, variable, value)?;
                }
            }
            let sent = row.get(self.symbols.len()).is_some_and(Option::is_some);
            if let (Some(event), true) = (event, sent) {
                out.change_scalar(event, Value::V1)?;
            }
            last = Some(row);
        }
        out.timestamp((self.rows.len() as u64 + 1).saturating_mul(cycle_us))?;
        out.flush()
    }
}

/// Returns the description of a symbol: name, kind, and the type in an IEC program.
fn symbol_json(symbol: &LadderSymbol) -> Json {
    let mut described = json!({ "name": symbol.name, "kind": symbol.kind });
    symbol.iec_type.iter().for_each(|iec_type| described["type"] = json!(iec_type));
    described
}

/// Writes a value. A byte that was not sent or set is x.
fn change(out: &mut Writer<Box<dyn Write>>, (id, bits): (IdCode, u32), value: Option<i64>) -> io::Result<()> {
    match (bits, value) {
        (0, value) => out.change_scalar(id, Value::from(value.is_some_and(|v| v != 0))),
        (_, None) => out.change_vector(id, (0..bits).map(|_| Value::X)),
        (_, Some(value)) => {
            let bit = |bit: u32| Value::from(value >> bit & 1 == 1);
            out.change_vector(id, (0..bits).rev().map(bit))
        }
    }
}
