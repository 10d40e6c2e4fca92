//! Compares the evaluator with the hand-worked traces of programs in Instruction List and in notations that
//! draw networks, in `il/*.txt`.
//!
//! A case is `== title` (with `@ 20` for a cycle of 20 ms), the program, and `-- inputs >> results`. Each row
//! after it is a scan: values that are set before it, `>>`, values after it. `.` keeps an input, or is any
//! result. `x5` before a row repeats its scan, and the results are those of the last one. The numbers in
//! brackets are the rules of `docs/semantics.md`, section 6.

use ladder::{Notation, ReadOptions};
use ladder_eval::Evaluator;

#[path = "../../../tests/ladder/plcopen_text.rs"]
mod plcopen_text;

struct Case {
    title: String,
    /// Name of the file for the reader, which decides by its content.
    file: &'static str,
    cycle_ms: u64,
    program: String,
    inputs: Vec<String>,
    results: Vec<String>,
    rows: Vec<String>,
}

/// Tables of traces, and the names of files for their notations.
const TABLES: [(&str, &str); 7] = [
    ("operators.txt", "t.il"),
    ("numbers.txt", "t.il"),
    ("blocks.txt", "t.il"),
    ("programs.txt", "t.il"),
    ("standard.txt", "t.il"),
    ("plcopen.txt", "t.xml"),
    ("rockwell.txt", "t.txt"),
];

fn words(text: &str) -> Vec<String> {
    text.split_whitespace().map(str::to_owned).collect()
}

fn cases() -> Vec<Case> {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/eval/il");
    let mut cases: Vec<Case> = Vec::new();
    for (name, file) in TABLES {
        let text = std::fs::read_to_string(folder.join(name)).expect("the traces exist");
        for line in text.lines().filter(|line| !line.starts_with('#') && !line.trim().is_empty()) {
            if let Some(title) = line.strip_prefix("== ") {
                let (title, cycle) = title.split_once(" @ ").unwrap_or((title, "10"));
                let (title, cycle_ms) = (format!("{name}: {title}"), cycle.parse().expect("a cycle"));
                let (program, inputs, results, rows) = Default::default();
                cases.push(Case { title, file, cycle_ms, program, inputs, results, rows });
                continue;
            }
            let case = cases.last_mut().expect("a title");
            if let Some(head) = line.strip_prefix("-- ") {
                let (inputs, results) = head.split_once(">>").expect("inputs >> results");
                (case.inputs, case.results) = (words(inputs), words(results));
            } else if case.results.is_empty() {
                case.program += line;
                case.program.push('\n');
            } else {
                case.rows.push(line.to_owned());
            }
        }
    }
    cases
}

fn evaluator(case: &Case) -> Evaluator {
    let notation = (case.file == "t.txt").then_some(Notation::Rockwell);
    let options = ReadOptions { cycle_us: Some(1_000 * case.cycle_ms), notation, ..ReadOptions::default() };
    let text = match case.file {
        "t.xml" => plcopen_text::project(&case.program),
        _ => case.program.clone(),
    };
    let read = ladder::read_program(case.file, text.as_bytes(), options);
    let program = read.unwrap_or_else(|faults| panic!("{}: {faults:#?}\n{text}", case.title)).program;
    Evaluator::new(&program).unwrap_or_else(|refusal| panic!("{}: {refusal}", case.title))
}

/// Runs the rows of a case; returns those that differ.
fn differences(case: &Case) -> Vec<String> {
    let mut eval = evaluator(case);
    let index =
        |eval: &Evaluator, name: &str| eval.index(name).unwrap_or_else(|| panic!("{}: there is no {name}", case.title));
    let mut faults = Vec::new();
    for row in &case.rows {
        let (given, wanted) = row.split_once(">>").expect("values >> values");
        let mut given = words(given);
        let times = given.first().and_then(|first| first.strip_prefix('x')?.parse::<u32>().ok());
        given.drain(..usize::from(times.is_some()));
        let wanted = words(wanted);
        assert_eq!((given.len(), wanted.len()), (case.inputs.len(), case.results.len()), "{}: {row}", case.title);
        for _ in 0..times.unwrap_or(1) {
            for (name, value) in case.inputs.iter().zip(&given).filter(|(_, value)| *value != ".") {
                let value: i64 = value.parse().expect("a number");
                let symbol = index(&eval, name);
                eval.set(symbol, value as i32);
            }
            eval.scan();
        }
        let shown = |name: &String| {
            let symbol = index(&eval, name);
            eval.symbols()[symbol].shown_value(eval.get(symbol)).to_string()
        };
        let found: Vec<String> = case.results.iter().map(shown).collect();
        if found.iter().zip(&wanted).any(|(found, wanted)| wanted != "." && found != wanted) {
            faults.push(format!("{}: {row}: found {}", case.title, found.join(" ")));
        }
    }
    faults
}

#[test]
fn every_row_of_every_trace() {
    let cases = cases();
    assert!(cases.len() >= 30, "{} cases", cases.len());
    assert!(cases.iter().all(|case| !case.rows.is_empty()));
    let faults: Vec<String> = cases.iter().flat_map(differences).collect();
    assert!(faults.is_empty(), "{faults:#?}");
}

#[test]
fn every_rule_of_the_semantics_has_a_trace() {
    let titles: String = cases().iter().map(|case| case.title.clone() + " ").collect();
    let is_cited =
        |rule: &u32| titles.split(|c: char| !c.is_ascii_alphanumeric()).any(|word| word == format!("I{rule}"));
    let missing: Vec<u32> = (1..=33).filter(|rule| !is_cited(rule)).collect();
    assert_eq!(missing, [0; 0], "rules without a trace");
}

#[test]
fn the_rung_bit_is_whether_the_current_result_is_not_zero() {
    let program = "VAR n : INT := 3; m : INT; END_VAR\nLD n\nSUB 3\nST m\nGE 0\nRETC\nLD n\n".to_owned();
    let (title, inputs, results, rows) = ("watch".to_owned(), Vec::new(), Vec::new(), Vec::new());
    let mut eval = evaluator(&Case { title, file: "t.il", cycle_ms: 10, program, inputs, results, rows });
    for _ in 0..2 {
        let mut seen = Vec::new();
        eval.scan_watched(&mut |id, before, after| seen.push((id.rung, id.index, before, after)));
        let first = [(0, 0, false, true), (0, 1, true, false), (0, 2, false, false), (0, 3, false, true)];
        assert_eq!(seen, [&first[..], &[(0, 4, true, true)]].concat());
    }
}

/// Runs a diagram of the page on the language: a line with the block, then a line for each part, in which a
/// character is a scan.
fn run_diagram(diagram: &str) -> Vec<String> {
    let mut lines = diagram.lines();
    let block = lines.next().and_then(|head| head.split(':').next()).expect("a block");
    let rows: Vec<(&str, Vec<char>)> = lines
        .filter_map(|line| line.split_whitespace().collect::<Vec<_>>().try_into().ok())
        .map(|[part, wave]: [&str; 2]| (part, wave.chars().collect()))
        .collect();
    let known = ladder::il::StandardBlock::from_keyword(block).expect("a standard block");
    let is_input = |part: &str| known.part(part).expect("a part").is_input;
    let preset = known.preset().map_or(String::new(), |part| match part.name {
        "PT" => "PT := T#30ms".to_owned(),
        name => format!("{name} := 2"),
    });
    let program = format!("VAR x : {block}; END_VAR\nCAL x({preset})\n").replace("()", "");
    let (title, inputs, results, cases) = (block.to_owned(), Vec::new(), Vec::new(), Vec::new());
    let mut eval = evaluator(&Case { title, file: "t.il", cycle_ms: 10, program, inputs, results, rows: cases });
    let mut found: Vec<String> = vec![String::new(); rows.len()];
    for scan in 0..rows.iter().map(|(_, wave)| wave.len()).max().unwrap_or(0) {
        for (part, wave) in rows.iter().filter(|(part, _)| is_input(part)) {
            let symbol = eval.index(&format!("x.{part}")).expect("a symbol");
            eval.set(symbol, i32::from(wave[scan] == '-'));
        }
        eval.scan();
        for ((part, _), found) in rows.iter().zip(&mut found) {
            let symbol = eval.index(&format!("x.{part}")).expect("a symbol");
            match (eval.get(symbol), eval.symbols()[symbol].kind.is_bit()) {
                (value, true) => found.push(if value == 1 { '-' } else { '_' }),
                (value, false) => *found += &value.to_string(),
            }
        }
    }
    let differs = rows.iter().zip(&found).filter(|((_, wave), found)| wave.iter().collect::<String>() != **found);
    differs.map(|((part, _), found)| format!("{block} {part} {found}")).collect()
}

#[test]
fn the_diagrams_of_the_page_are_what_the_blocks_do() {
    let page = include_str!("../../../docs/languages/il.md");
    let (_, blocks) = page.split_once("## Blocks").expect("the section");
    let diagrams: Vec<&str> = blocks.split("```").nth(1).expect("the diagrams").trim().split("\n\n").collect();
    assert_eq!(diagrams.len(), ladder::il::StandardBlock::ALL.len(), "a diagram for each block");
    let wrong: Vec<String> = diagrams.into_iter().flat_map(run_diagram).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}
