//! Traces written by hand from the rules of `docs/semantics.md`: `tests/traces/*.txt`.
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
//! starts at power-up with a cycle of 10 ms. Every line of values cites a section.

mod common;

use std::fmt::Write as _;

const FILES: &[(&str, &str)] = &[
    ("bits.txt", include_str!("traces/bits.txt")),
    ("timers.txt", include_str!("traces/timers.txt")),
    ("counters.txt", include_str!("traces/counters.txt")),
    ("integers.txt", include_str!("traces/integers.txt")),
];

#[test]
fn every_line_of_every_trace() {
    let mut faults = String::new();
    let mut rows = 0;
    for (file, text) in FILES {
        let mut lines = text.lines().enumerate().map(|(i, l)| (i + 1, l)).peekable();
        while let Some((number, line)) = lines.next() {
            if line.trim().is_empty() || line.starts_with('#') {
                continue;
            }
            let name = line.strip_prefix("case ").unwrap_or_else(|| panic!("{file}:{number}: wanted a case: {line}"));
            let mut program = String::new();
            let (_, columns) = loop {
                let (n, line) = lines.next().unwrap_or_else(|| panic!("{file}:{number}: no line `scan`"));
                if let Some(columns) = line.strip_prefix("scan ") {
                    break (n, columns);
                }
                program += line;
                program.push('\n');
            };
            let mut values = Vec::new();
            while let Some((n, row)) = lines.next_if(|(_, l)| !l.trim().is_empty() && !l.starts_with("case ")) {
                if !row.starts_with('#') {
                    values.push((n, row));
                }
            }
            assert!(!values.is_empty(), "{file}:{number}: case without a scan");
            rows += values.len();
            run(&format!("{file}: {name}"), &program, columns, &values, &mut faults);
        }
    }
    assert!(rows > 300, "only {rows} lines of values read");
    assert!(faults.is_empty(), "\n{faults}");
}

/// Runs one case and writes down every value that differs.
fn run(name: &str, program: &str, columns: &str, rows: &[(usize, &str)], faults: &mut String) {
    let mut eval = common::evaluator(&common::rungs(program));
    let (given, wanted) = columns.split_once('|').unwrap_or_else(|| panic!("{name}: no bar in `{columns}`"));
    let given: Vec<usize> = given.split_whitespace().map(|n| common::index(&eval, n)).collect();
    let wanted: Vec<usize> = wanted.split_whitespace().map(|n| common::index(&eval, n)).collect();
    for (number, row) in rows {
        let (values, rule) = row.split_once('#').unwrap_or_else(|| panic!("{name}: line {number} cites no rule"));
        assert!(rule.trim().starts_with(['1', '2', '3']), "{name}: line {number} cites no section");
        let (left, right) = values.split_once('|').unwrap_or_else(|| panic!("{name}: line {number} has no bar"));
        let (times, left) = match left.trim().strip_prefix('*') {
            Some(rest) => {
                let (n, rest) = rest.split_once(' ').unwrap_or((rest, ""));
                (n.parse::<u32>().unwrap_or_else(|_| panic!("{name}: line {number}: `{n}`")), rest)
            }
            None => (1, left),
        };
        let left: Vec<&str> = left.split_whitespace().collect();
        let right: Vec<i32> = right.split_whitespace().map(|v| v.parse().expect("a number")).collect();
        assert_eq!((left.len(), right.len()), (given.len(), wanted.len()), "{name}: line {number}: columns");
        for _ in 0..times {
            for (symbol, value) in given.iter().zip(&left).filter(|(_, v)| **v != ".") {
                eval.set(*symbol, value.parse().expect("a number"));
            }
            eval.scan();
        }
        let found: Vec<i32> = wanted.iter().map(|&symbol| eval.get(symbol)).collect();
        if found != right {
            let _ = writeln!(faults, "{name}, line {number}: found {found:?}, wanted {right:?}: {}", row.trim());
        }
    }
}
