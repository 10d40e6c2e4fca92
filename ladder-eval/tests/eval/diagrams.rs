//! The page of timing diagrams: the evaluator gives its rows, and every element is on it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use ladder::LadderProgram;
use ladder_eval::Evaluator;

const PAGE: &str = include_str!("../../../docs/languages/ldmicro-timing.md");
const HEAD: &str = "LDmicro0.2\nCYCLE=10000\nCRYSTAL=4000000\nBAUD=600\nIO LIST\nEND\nPROGRAM\nRUNG\n";

/// Elements without a diagram: a comment is no part of the circuit, and a placeholder is refused.
const NO_DIAGRAM: [&str; 2] = ["COMMENT", "PLACEHOLDER"];

/// What all devices on the buses answer.
const ANSWER: u8 = 60;

/// The blocks of the page: program and rows.
fn blocks() -> impl Iterator<Item = (LadderProgram, &'static str)> {
    PAGE.split("```\n").skip(1).step_by(2).map(|block| {
        let (text, rows) = block.split_once("\n\n").expect("a blank line follows the program");
        let text = format!("{HEAD}{}\nEND\n", text.replace("RUNG", "END\nRUNG"));
        let parsed = ladder::parse("page", &text).unwrap_or_else(|e| panic!("{e:?}\n{text}"));
        (parsed.program, rows)
    })
}

/// The values of a row that is given; `None` for a row that is computed.
fn given(label: &str, cells: &str) -> Option<Vec<String>> {
    if !label.starts_with('X') && !label.ends_with('=') {
        return None;
    }
    let words: Vec<String> = cells.split_whitespace().map(str::to_owned).collect();
    Some(if words.len() > 1 { words } else { cells.trim().chars().map(String::from).collect() })
}

/// Sets what a given row says for the next scan.
fn set(eval: &mut Evaluator, label: &str, value: &str) {
    let number = || value.parse().unwrap_or_else(|_| panic!("{label} is {value}"));
    match label.trim_end_matches('=') {
        "received" => assert!(value == "." || eval.receive(value.as_bytes()[0])),
        name => {
            let symbol = eval.index(name).unwrap_or_else(|| panic!("no symbol {name}"));
            match label.ends_with('=') {
                false => eval.set(symbol, i32::from(value == "#")),
                true if name.starts_with('A') => eval.set_adc(symbol, number() as u16),
                true => eval.set(symbol, number()),
            }
        }
    }
}

/// The value of a computed row after a scan; `powers` has the power behind the first element of each keyword.
fn seen(eval: &Evaluator, label: &str, powers: &BTreeMap<&str, bool>) -> String {
    let bit = |value: bool| if value { "#" } else { "_" }.to_owned();
    let is_keyword = ladder::element_keywords().any(|keyword| keyword == label);
    match label {
        "sent" => eval.sent().map_or(".".to_owned(), |byte| char::from(byte).to_string()),
        "duty" => eval.pwm_percent().map_or(".".to_owned(), |percent| percent.to_string()),
        "eeprom" => eval.eeprom().iter().map(u8::to_string).collect::<Vec<_>>().join("/"),
        _ if is_keyword => powers.get(label).map_or(".".to_owned(), |power| bit(*power)),
        name => {
            let value = eval.get(eval.index(name).unwrap_or_else(|| panic!("no symbol {name}")));
            if name.starts_with(['Y', 'R']) { bit(value != 0) } else { value.to_string() }
        }
    }
}

fn rows_of(program: &LadderProgram, rows: &'static str) -> String {
    let split = |row: &'static str| row.split_once(' ').unwrap_or((row, ""));
    let rows: Vec<(&str, Option<Vec<String>>)> =
        rows.lines().map(|row| (split(row).0, given(split(row).0, split(row).1))).collect();
    let scans = rows.iter().filter_map(|(_, cells)| Some(cells.as_ref()?.len())).min().expect("a row is given");
    let mut eval = Evaluator::new(program).unwrap_or_else(|e| panic!("{e:?}"));
    eval.set_bus_answer(ANSWER);
    let mut table: Vec<Vec<String>> = vec![Vec::new(); rows.len()];
    for scan in 0..scans {
        for (label, cells) in &rows {
            cells.iter().for_each(|cells| set(&mut eval, label, &cells[scan]));
        }
        let mut powers = BTreeMap::new();
        eval.scan_watched(&mut |id, _, power| {
            let keyword = program.find_element(id).map_or("", |at| at.element.facts().keyword);
            powers.entry(keyword).or_insert(power);
        });
        for ((label, cells), out) in rows.iter().zip(&mut table) {
            out.push(cells.as_ref().map_or_else(|| seen(&eval, label, &powers), |cells| cells[scan].clone()));
        }
    }
    let label = rows.iter().map(|(label, _)| label.len()).max().unwrap_or(0);
    let width = table.iter().flatten().map(String::len).max().unwrap_or(0);
    let cell = |value: &String| if width > 1 { format!(" {value:<width$}") } else { value.clone() };
    let line = |name: &str, values: &Vec<String>| {
        let gap = if width > 1 { "" } else { " " };
        let cells: String = values.iter().map(cell).collect();
        format!("{name:<label$}{gap}{}\n", cells.trim_end())
    };
    rows.iter().zip(&table).map(|((name, _), values)| line(name, values)).collect()
}

#[test]
fn the_rows_are_those_of_the_evaluator() {
    let mut parts = PAGE.split("```\n");
    let mut page = parts.next().unwrap_or("").to_owned();
    for ((block, between), (program, rows)) in parts.clone().step_by(2).zip(parts.skip(1).step_by(2)).zip(blocks()) {
        let (text, _) = block.split_once("\n\n").expect("a blank line follows the program");
        page += &format!("```\n{text}\n\n{}```\n{between}", rows_of(&program, rows));
    }
    if std::env::var_os("EMU_BLESS").is_some() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/languages/ldmicro-timing.md");
        std::fs::write(path, &page).expect("the page is written");
        return;
    }
    for (found, computed) in PAGE.lines().zip(page.lines()) {
        assert_eq!(found, computed, "EMU_BLESS=1 writes the page");
    }
    assert_eq!(PAGE.len(), page.len());
}

#[test]
fn every_element_has_a_diagram() {
    let mut missing: BTreeSet<&str> = ladder::element_keywords().collect();
    assert!(NO_DIAGRAM.iter().all(|keyword| missing.remove(keyword)), "a listed element does not exist");
    for (program, _) in blocks() {
        program.elements().for_each(|at| _ = missing.remove(at.element.facts().keyword));
    }
    assert!(missing.is_empty(), "docs/languages/ldmicro-timing.md has no {missing:?}");
}
