//! Hand-written traces of small ladder programs: `tests/ladder/*.txt`. The evaluator and every chip must
//! reproduce them.
//!
//! A case is its name, rungs as `.ld` text, a line `scan` that names the columns, and one line per scan:
//!
//! ```text
//! case what it shows
//! RUNG
//!     CONTACTS Xa 0
//!     COIL Ya 0 0 0
//! END
//! scan Xa | Ya
//! 1 | 1       # 2.3 the rule that gives these values
//! *9 0 | 0    # nine scans; the values after the last
//! ```
//!
//! Left of the bar: values set before the scan (`.` leaves a symbol unchanged). Right: expected values after
//! it (`-` for none). Every case starts at power-up, with a cycle of 10 ms and 1000 baud. Lines before the
//! first RUNG go into the program header: another format line (LDmicro0.2), CYCLE=, BAUD=, a VAR LIST. Every
//! line of values cites a section of `docs/semantics.md`. A value is a number or a character in quotes.
//! Columns that are no symbols:
//!
//! ```text
//! level(Ain)   set: what the converter reads at Ain        sent     expected: the byte that the scan sent
//! received     set: a byte that has arrived                duty     expected: the PWM duty, in percent
//! cell(0)      set and expected: a cell of the EEPROM    duty(1)  expected: that of the second output
//! answer       set: the byte that devices on the buses answer from this scan on
//! bus(byte), bus(register), bus(device)   expected: of the last transfer on a bus; a read has no byte
//! ```

mod text;

use text::{Text, texts};

/// The meaning of a column.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Column {
    /// A symbol.
    Symbol(String),
    /// The converter's result for the input of this symbol.
    Level(String),
    /// A byte that has arrived on the serial line.
    Received,
    /// A sent byte.
    Sent,
    /// The duty of the PWM output.
    Duty,
    /// The duty of one of several PWM outputs.
    DutyOf(usize),
    /// The byte that devices on the buses answer.
    Answer,
    /// The last transfer on a bus: its byte, its register or its device.
    Bus(BusField),
    /// A cell of the EEPROM.
    Cell(usize),
}

/// A part of a transfer on a bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BusField {
    /// The byte that the chip sends.
    Byte,
    /// The register of an I2C device.
    Register,
    /// The address of an I2C device.
    Device,
}

impl Column {
    fn new(text: &str) -> Column {
        let inside = |name: &str| text.strip_prefix(name)?.strip_prefix('(')?.strip_suffix(')').map(str::to_owned);
        match (text, inside("level"), inside("cell")) {
            ("received", ..) => Column::Received,
            ("sent", ..) => Column::Sent,
            ("duty", ..) => Column::Duty,
            ("answer", ..) => Column::Answer,
            ("bus(byte)", ..) => Column::Bus(BusField::Byte),
            ("bus(register)", ..) => Column::Bus(BusField::Register),
            ("bus(device)", ..) => Column::Bus(BusField::Device),
            _ if inside("duty").is_some() => {
                Column::DutyOf(inside("duty").unwrap_or_default().parse().expect("the number of an output"))
            }
            (_, Some(name), _) => Column::Level(name),
            (_, _, Some(cell)) => Column::Cell(cell.parse().expect("the number of a cell")),
            _ => Column::Symbol(text.to_owned()),
        }
    }
}

/// One case of a table.
pub struct Case {
    /// File and name, for messages.
    pub name: String,
    /// A complete `.ld` text.
    pub program: String,
    /// The columns that are set before a scan.
    pub given: Vec<Column>,
    /// The columns that are expected after it.
    pub wanted: Vec<Column>,
    /// The lines of values.
    pub rows: Vec<Row>,
}

/// One line of values.
pub struct Row {
    /// The line as written, with file and line number.
    pub text: String,
    /// Number of scans.
    pub times: u32,
    /// Values to set; `None` leaves a symbol unchanged.
    pub given: Vec<Option<i32>>,
    /// Expected values; `None` if there must be none.
    pub wanted: Vec<Option<i32>>,
}

/// Returns all cases of all tables.
pub fn cases() -> Vec<Case> {
    let cases: Vec<Case> = texts().into_iter().map(case).collect();
    assert!(cases.iter().all(|c| !c.rows.is_empty()) && cases.iter().map(|c| c.rows.len()).sum::<usize>() > 500);
    cases
}

fn case((name, program, lines): Text) -> Case {
    let mut lines = lines.iter();
    let (place, columns) = lines.next().unwrap_or_else(|| panic!("{name}: no line `scan`"));
    let names = |text: &str| text.split_whitespace().map(Column::new).collect::<Vec<_>>();
    let (given, wanted) = columns.split_once('|').unwrap_or_else(|| panic!("{place}: no bar"));
    let (given, wanted) = (names(given), names(wanted));
    let rows = lines.map(|(place, line)| {
        let row = row(place, line);
        assert_eq!((row.given.len(), row.wanted.len()), (given.len(), wanted.len()), "{place}: columns");
        row
    });
    let rows = rows.collect();
    Case { name, program, given, wanted, rows }
}

fn row(place: &str, line: &str) -> Row {
    let (values, rule) = line.split_once("# ").unwrap_or_else(|| panic!("{place}: cites no rule"));
    assert!(rule.trim().starts_with(['1', '2', '3', '5']), "{place}: cites no section");
    let (left, right) = values.split_once('|').unwrap_or_else(|| panic!("{place}: no bar"));
    let (times, left) = match left.trim().strip_prefix('*') {
        Some(rest) => rest.split_once(' ').unwrap_or((rest, "")),
        None => ("1", left),
    };
    let number = |text: &str| text.parse::<i32>().unwrap_or_else(|_| panic!("{place}: `{text}` is not a number"));
    let value = |text: &str| match text.strip_prefix('\'').and_then(|t| t.strip_suffix('\'')) {
        Some(character) => i32::from(character.as_bytes()[0]),
        None => number(text),
    };
    // A quoted space is a value too.
    let words = |text: &str| -> Vec<String> {
        let text = text.replace("' '", "32");
        text.split_whitespace().map(str::to_owned).collect()
    };
    Row {
        text: place.to_owned(),
        times: number(times) as u32,
        given: words(left).iter().map(|v| (v != ".").then(|| value(v))).collect(),
        wanted: words(right).iter().map(|v| (v != "-").then(|| value(v))).collect(),
    }
}
