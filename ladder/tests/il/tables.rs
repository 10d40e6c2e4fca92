//! Tests with tables. A row is `source >> result`; ` | ` separates the lines of the source. `EMU_BLESS=1`
//! writes the results that are found.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::PathBuf;

use diag::Diagnostic;
use ladder::{ProgramElement, il};

/// Runs `result` for each row of a table and compares.
fn check_table(name: &str, result: impl Fn(&str) -> String) {
    let path: PathBuf = [env!("CARGO_MANIFEST_DIR"), "tests", "il", name].iter().collect();
    let table = std::fs::read_to_string(&path).expect("the table exists");
    let (mut written, mut wrong) = (String::new(), String::new());
    for (index, row) in table.lines().enumerate() {
        let Some((source, expected)) = row.split_once(">>").filter(|_| !row.starts_with('#')) else {
            writeln!(written, "{row}").expect("a string");
            continue;
        };
        let found = result(&source.trim().replace(" | ", "\n").replace("\\t", "\t").replace("\\r", "\r"));
        let found = found.trim();
        if found != expected.trim() {
            writeln!(
                wrong,
                "{name}:{}: {}\n  expected {}\n  found    {found}",
                index + 1,
                source.trim(),
                expected.trim()
            )
            .expect("a string");
        }
        writeln!(written, "{} >> {found}", source.trim_end()).expect("a string");
    }
    if std::env::var_os("EMU_BLESS").is_some() {
        std::fs::write(&path, written).expect("the table is written");
        return;
    }
    assert!(wrong.is_empty(), "{wrong}");
}

fn rows(name: &str) -> Vec<(String, String)> {
    let path: PathBuf = [env!("CARGO_MANIFEST_DIR"), "tests", "il", name].iter().collect();
    let table = std::fs::read_to_string(path).expect("the table exists");
    let rows = table.lines().filter(|row| !row.starts_with('#')).filter_map(|row| row.split_once(">>"));
    rows.map(|(source, expected)| (source.trim().replace(" | ", "\n"), expected.trim().to_owned())).collect()
}

fn codes(diagnostics: &[Diagnostic]) -> String {
    let place = |d: &Diagnostic| {
        let severity = if d.is_error() { "" } else { "~" };
        format!("{severity}{}@{}:{}+{}", d.code, d.pos.line, d.pos.column, d.pos.width)
    };
    diagnostics.iter().map(place).collect::<Vec<_>>().join(" ")
}

fn read(source: &str) -> Result<il::IlProgram, Vec<Diagnostic>> {
    il::read("t.il", source).map(|parsed| parsed.program)
}

/// Asserts that the canonical text reads as the same program and is its own canonical text.
fn assert_round_trip(program: &il::IlProgram) {
    let text = il::write(program);
    let again = il::read("t.il", &text).unwrap_or_else(|d| panic!("not read again: {d:?}\n{text}")).program;
    assert_eq!(again.clone().without_positions(), program.clone().without_positions(), "{text}");
    assert_eq!(il::write(&again), text);
}

#[test]
fn each_source_has_its_canonical_text() {
    check_table("write.txt", |source| match read(source) {
        Ok(program) => {
            assert_round_trip(&program);
            il::write(&program).trim_end().replace('\n', " | ")
        }
        Err(diagnostics) => codes(&diagnostics),
    });
}

#[test]
fn each_faulty_source_has_its_diagnostics() {
    check_table("read.txt", |source| match read(source) {
        Ok(program) => {
            assert_round_trip(&program);
            "ok".to_owned()
        }
        Err(diagnostics) => codes(&diagnostics),
    });
}

#[test]
fn each_source_has_its_types_or_faults() {
    check_table("check.txt", |source| match read(source) {
        Ok(program) => codes(&il::check(&program)),
        Err(diagnostics) => format!("not read: {}", codes(&diagnostics)),
    });
    check_table("types.txt", |source| {
        let program = read(source).expect("reads");
        il::result_types(&program).iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
    });
}

/// The program as rungs, at a cycle of 10 ms.
fn resolved(source: &str) -> Result<il::ResolvedIlProgram, Vec<Diagnostic>> {
    il::to_ladder(&read(source)?, il::il_settings(10_000))
}

#[test]
fn each_source_has_its_networks_and_symbols() {
    let type_name = |of: &Option<il::IecType>| of.as_ref().map_or("-".to_owned(), |t| t.keyword().to_owned());
    check_table("networks.txt", |source| match resolved(source) {
        Ok(found) => {
            let mut rungs: Vec<Vec<String>> = vec![Vec::new(); found.program.rungs.len()];
            for ProgramElement { id, element, .. } in found.program.elements() {
                let text = match element {
                    ladder::Element::Instruction(step) => {
                        format!("{step} {}>{}", type_name(&step.before), type_name(&step.after))
                    }
                    other => ladder::element_text(other),
                };
                rungs[id.rung as usize].push(text);
            }
            rungs.iter().map(|rung| rung.join("; ")).collect::<Vec<_>>().join(" | ")
        }
        Err(diagnostics) => codes(&diagnostics),
    });
    check_table("symbols.txt", |source| match resolved(source) {
        Ok(found) => {
            let symbols = found.program.symbols().into_iter().map(|symbol| {
                let letter = &format!("{:?}", symbol.kind)[..1];
                format!("{letter} {} {}{}", symbol.name, type_name(&symbol.iec_type), symbol.bytes)
            });
            let notes = codes(&found.warnings);
            format!("{} {notes}", symbols.collect::<Vec<_>>().join(", "))
        }
        Err(diagnostics) => codes(&diagnostics),
    });
}

/// The action of the last line, with what is resolved in it.
#[test]
fn each_line_has_its_action() {
    check_table("actions.txt", |source| match resolved(source) {
        Ok(found) => {
            let last = found.program.elements().last().map(|at| at.element.clone());
            let Some(ladder::Element::Instruction(step)) = last else { return "none".to_owned() };
            let text = format!("{:?}", step.action);
            text.replace("TypedSymbol ", "").replace("iec_type: ", "").replace("kind: ", "").replace("name: ", "")
        }
        Err(diagnostics) => codes(&diagnostics),
    });
}

#[test]
fn the_written_program_is_the_same_program() {
    for table in ["networks.txt", "symbols.txt", "actions.txt"] {
        for (source, _) in rows(table) {
            let Ok(found) = resolved(&source) else { continue };
            let text = ladder::write(&found.program);
            let again = resolved(&text).unwrap_or_else(|d| panic!("{}\n{text}", codes(&d))).program;
            assert_eq!(ladder::write(&again), text);
            let lines = |program: &ladder::LadderProgram| -> Vec<(ladder::ElementId, ladder::Element)> {
                program.elements().map(|at| (at.id, at.element.clone())).collect()
            };
            assert_eq!(lines(&again), lines(&found.program), "{text}");
            assert_eq!(again.symbols(), found.program.symbols(), "{text}");
        }
    }
}

/// What an operator with a modifier gives: its canonical text, or the code of the error.
fn with_modifier(operator: &str, operand: &str, modifier: &str) -> String {
    let close = if modifier.ends_with('(') { "\n)" } else { "" };
    let source = format!("LD a\n{operator}{modifier} {operand}{close}\nx:\n");
    match read(&source) {
        Ok(program) => {
            assert_round_trip(&program);
            il::instruction_text(program.instructions[1].operation.as_ref().expect("an operation"))
        }
        Err(diagnostics) => diagnostics[0].code.to_owned(),
    }
}

const MODIFIERS: [&str; 7] = ["", "N", "C", "CN", "NC", "(", "N("];

#[test]
fn each_operator_takes_the_modifiers_of_the_standard() {
    check_table("modifiers.txt", |row| {
        let (operator, operand) = row.split_once(' ').unwrap_or((row, ""));
        MODIFIERS.map(|modifier| with_modifier(operator, operand, modifier)).join("; ")
    });
    let listed: BTreeSet<String> =
        rows("modifiers.txt").iter().map(|(row, _)| row.split(' ').next().unwrap_or("").to_owned()).collect();
    let binary = il::IlBinaryOperator::ALL.iter().map(|(_, keyword)| *keyword);
    let inputs = il::IlBlockInput::ALL.iter().map(|(_, keyword)| *keyword);
    let blocks = il::StandardBlock::ALL.iter().map(|block| block.keyword());
    let others = ["LD", "ST", "S", "R", "NOT", "&", "JMP", "CAL", "RET"];
    let missing: Vec<&str> =
        others.into_iter().chain(binary).chain(inputs).chain(blocks).filter(|name| !listed.contains(*name)).collect();
    assert!(missing.is_empty(), "no row for {missing:?}");
}

#[test]
fn keywords_have_no_case() {
    let upper = "LDN A\nANDN( B\nORN C\n)\nST Q\n";
    let (lower, upper) = (read(&upper.to_lowercase()).expect("reads"), read(upper).expect("reads"));
    assert_eq!(il::write(&lower).to_uppercase(), il::write(&upper).to_uppercase());
}

#[test]
fn every_code_has_a_row() {
    let written: String = ["read.txt", "check.txt", "symbols.txt", "actions.txt"]
        .iter()
        .flat_map(|t| rows(t))
        .map(|(_, expected)| expected + " ")
        .collect();
    // The tests of limits below have the codes about size and cycle.
    let elsewhere = ["IL001", "IL002", "IL034", "IL203"];
    let codes = il::IL_CODES.iter().map(|c| c.code);
    let missing: Vec<&str> = codes.filter(|c| !written.contains(c) && !elsewhere.contains(c)).collect();
    assert!(missing.is_empty(), "no row for {missing:?}");
}

#[test]
fn timers_need_a_cycle_of_whole_milliseconds() {
    let fault = |source: &str, cycle_us: u64| {
        let program = read(source).expect("reads");
        il::to_ladder(&program, il::il_settings(cycle_us)).map_or_else(|faults| codes(&faults), |_| String::new())
    };
    let timer = "LD a\nTON T1,100\n";
    assert_eq!([1_000, 1_500, 500].map(|cycle| fault(timer, cycle)), ["", "IL203@2:1+3", "IL203@2:1+3"]);
    assert_eq!(fault("LD a\nCTU C1,100\n", 1_500), "");
}

#[test]
fn codes_are_unique_and_explained() {
    let mut seen = BTreeSet::new();
    for code in il::IL_CODES {
        assert!(seen.insert(code.code), "{} twice", code.code);
        assert!(!code.title.is_empty() && code.explain.len() > 40, "{} has no text", code.code);
    }
}

#[test]
fn every_message_has_a_cause_a_hint_and_a_row_in_the_table_of_codes() {
    for (source, _) in ["read.txt", "check.txt"].iter().flat_map(|t| rows(t)) {
        let found = read(&source).map_or_else(|d| d, |program| il::check(&program));
        for d in found {
            assert!(!d.cause.is_empty() && !d.hint.is_empty() && d.file == "t.il", "{source}: {d:?}");
            assert!(il::IL_CODES.iter().any(|c| c.code == d.code), "{d:?}");
        }
    }
}

/// The first diagnostic of a source that is refused.
fn first_fault(source: &str) -> Diagnostic {
    read(source).expect_err("refused").remove(0)
}

#[test]
fn hints_name_what_was_meant() {
    for (source, words) in [
        ("LD a\nANDM b", "did you mean AND?"),
        ("LD a\nNA b", "write ANDN"),
        ("LD a\nLDC b", "LD has the modifier N"),
        ("LD a\nJMP lop\nloop:", "did you mean loop?"),
        ("LD a\nST", "write ST and a variable"),
        ("LD a\nLD NOT b", "write LDN"),
    ] {
        let fault = first_fault(source);
        assert!(fault.hint.contains(words), "{source}: {fault}");
    }
}

#[test]
fn causes_of_the_check_name_both_sides() {
    for (source, words) in [
        ("VAR n : INT; END_VAR\nLD n\nEQ 40000", "EQ: the number 40000 does not fit INT"),
        ("VAR n : INT; END_VAR\nLD 40000\nEQ n", "EQ: the number 40000 does not fit INT"),
        ("VAR n : INT; d : DINT; END_VAR\nLD n\nADD d", "ADD needs INT, but finds DINT"),
        ("VAR n : INT; END_VAR\nCAL T1", "declare it, for example `T1 : TON;`"),
        ("VAR motor : BOOL; END_VAR\nLD mtor", "did you mean motor?"),
    ] {
        let found = il::check(&read(source).expect("reads"));
        assert!(found.len() == 1 && found[0].to_string().contains(words), "{source}: {found:?}");
    }
}

fn nested(depth: usize) -> String {
    format!("LD a\n{}{}", "AND( b\n".repeat(depth), ")\n".repeat(depth))
}

#[test]
fn parentheses_have_a_limit_and_no_stack_overflow() {
    let program = read(&nested(il::MAX_IL_DEPTH)).expect("the greatest depth");
    assert_round_trip(&program);
    assert!(il::check(&program).is_empty());
    assert_eq!(codes(&read(&nested(il::MAX_IL_DEPTH + 1)).expect_err("refused")), "IL034@66:1+3");
    assert_eq!(first_fault(&nested(9_000)).code, "IL034");
    let parameters = format!("CAL t(x := {}", "(".repeat(100_000));
    assert_eq!(first_fault(&parameters).code, "IL006");
}

#[test]
fn sizes_have_limits() {
    let long = "LD a\n".repeat(il::MAX_IL_LINES);
    assert!(read(&long).is_ok());
    assert_eq!(first_fault(&format!("{long}LD a\nLD a\n")).code, "IL001");
    assert_eq!(first_fault(&" ".repeat(5 << 20)).code, "IL001");
    let faults = read(&"LDX\n".repeat(500)).expect_err("refused");
    assert_eq!((faults.len(), faults[100].code), (101, "IL002"));
}

#[test]
fn checking_a_long_chain_of_jumps_is_fast() {
    let jumps: String = (0..9_000).rev().map(|i| format!("l{i}: LD a\nJMPC l{}\n", i / 2)).collect();
    assert!(il::check(&read(&jumps).expect("reads")).is_empty());
}
