//! Hand-written traces of small ladder programs: `tests/ladder/*.txt`. The evaluator must give them, and so must every chip.
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
//! Left of the bar: values given before the scan (`.` leaves a symbol alone); right: values wanted after it. Every case
//! starts at power-up with a cycle of 10 ms. Every line of values cites a section of `docs/semantics.md`.

/// The tables.
pub const FILES: &[(&str, &str)] = &[
    ("bits.txt", include_str!("bits.txt")),
    ("timers.txt", include_str!("timers.txt")),
    ("counters.txt", include_str!("counters.txt")),
    ("integers.txt", include_str!("integers.txt")),
];

/// One case.
pub struct Case {
    /// File and name, for messages.
    pub name: String,
    /// A whole `.ld` text.
    pub program: String,
    /// Symbols given before a scan.
    pub given: Vec<String>,
    /// Symbols wanted after it.
    pub wanted: Vec<String>,
    /// The lines of values.
    pub rows: Vec<Row>,
}

/// One line of values.
pub struct Row {
    /// As written, with file and line.
    pub text: String,
    /// How many scans.
    pub times: u32,
    /// Given values; `None` leaves a symbol alone.
    pub given: Vec<Option<i32>>,
    /// Wanted values.
    pub wanted: Vec<i32>,
}

/// All cases of all tables.
pub fn cases() -> Vec<Case> {
    let mut cases: Vec<Case> = Vec::new();
    for (file, text) in FILES {
        let (mut rungs, mut name) = (String::new(), String::new());
        for (i, line) in text.lines().enumerate() {
            let place = format!("{file}:{}: {}", i + 1, line.trim());
            if line.trim().is_empty() || line.starts_with('#') {
                continue;
            }
            if let Some(title) = line.strip_prefix("case ") {
                (name, rungs) = (format!("{file}: {title}"), String::new());
            } else if let Some(columns) = line.strip_prefix("scan ") {
                let names = |text: &str| text.split_whitespace().map(str::to_owned).collect();
                let (given, wanted) = columns.split_once('|').unwrap_or_else(|| panic!("{place}: no bar"));
                let program = format!("LDmicro0.1\nCYCLE=10000\nCRYSTAL=4000000\nIO LIST\nEND\nPROGRAM\n{rungs}\n");
                let (name, rows) = (std::mem::take(&mut name), Vec::new());
                cases.push(Case { name, program, given: names(given), wanted: names(wanted), rows });
            } else if name.is_empty() {
                let case = cases.last_mut().unwrap_or_else(|| panic!("{place}: outside of a case"));
                let row = row(&place, line);
                assert_eq!(
                    (row.given.len(), row.wanted.len()),
                    (case.given.len(), case.wanted.len()),
                    "{place}: columns"
                );
                case.rows.push(row);
            } else {
                rungs += line;
                rungs.push('\n');
            }
        }
    }
    assert!(cases.iter().all(|c| !c.rows.is_empty()) && cases.iter().map(|c| c.rows.len()).sum::<usize>() > 300);
    cases
}

fn row(place: &str, line: &str) -> Row {
    let (values, rule) = line.split_once('#').unwrap_or_else(|| panic!("{place}: cites no rule"));
    assert!(rule.trim().starts_with(['1', '2', '3']), "{place}: cites no section");
    let (left, right) = values.split_once('|').unwrap_or_else(|| panic!("{place}: no bar"));
    let (times, left) = match left.trim().strip_prefix('*') {
        Some(rest) => rest.split_once(' ').unwrap_or((rest, "")),
        None => ("1", left),
    };
    let number = |text: &str| text.parse::<i32>().unwrap_or_else(|_| panic!("{place}: `{text}` is no number"));
    Row {
        text: place.to_owned(),
        times: number(times) as u32,
        given: left.split_whitespace().map(|v| (v != ".").then(|| number(v))).collect(),
        wanted: right.split_whitespace().map(number).collect(),
    }
}
