//! Tests every diagnostic of the checks with a table.

use crate::common;
use std::collections::BTreeSet;

use ladder::{LadderDialect, ParseOptions, parse_with};

const TABLE: &str = include_str!("tables/check.txt");

#[test]
fn every_row_reports_what_is_written() {
    let mut wrong = Vec::new();
    for (number, row) in common::rows(TABLE) {
        let (expected, rest) = row.split_once('|').expect("a row has a bar");
        let (body, cause) = rest.split_once(" => ").unwrap_or((rest, ""));
        let text = common::text(body);
        // Under the old header the rows are about release 2.3, also where only LDmicro 5 can have written the
        // program.
        let dialect = text.starts_with("LDmicro0.1").then_some(LadderDialect::Ldmicro23);
        let program = match parse_with("t.ld", &text, ParseOptions { dialect }) {
            Ok(parsed) => parsed.program,
            Err(errors) => {
                wrong.push(format!("line {number}: does not read: {}", common::diagnostic_codes(&errors).join(" ")));
                continue;
            }
        };
        let found = ladder::check(&program);
        let expected: Vec<&str> = expected.split_whitespace().filter(|w| *w != "ok").collect();
        if common::diagnostic_codes(&found) != expected {
            wrong.push(format!("line {number}: expected {expected:?}, found {:?}", common::diagnostic_codes(&found)));
        } else if !cause.is_empty() && !found.iter().any(|d| d.cause.contains(cause)) {
            wrong.push(format!("line {number}: no cause contains `{cause}`: {found:?}"));
        }
        if expected.is_empty() != cause.is_empty() {
            wrong.push(format!("line {number}: a complaint needs a cause, and only a complaint"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_code_of_the_checks_has_a_row() {
    let words: BTreeSet<&str> = common::rows(TABLE).flat_map(|(_, row)| row.split([' ', '@'])).collect();
    let missing: Vec<&str> =
        ladder::CODES.iter().map(|c| c.code).filter(|c| c.starts_with("LD1") && !words.contains(c)).collect();
    assert!(missing.is_empty(), "no row for {missing:?}");
}

#[test]
fn the_dialect_can_be_chosen() {
    let text = "LDmicro0.2\nCYCLE=10000\nCRYSTAL=4000000\nPROGRAM\nRUNG\nTON Ta 20000\nEND\n";
    let program = |dialect| parse_with("t", text, ParseOptions { dialect }).expect("reads").program;
    assert_eq!(program(None).dialect, LadderDialect::Ldmicro5);
    assert_eq!(program(Some(LadderDialect::Ldmicro23)).dialect, LadderDialect::Ldmicro23);
    assert!(ladder::check(&program(Some(LadderDialect::Ldmicro23))).is_empty());
    let old = parse_with("t", &text.replace("0.2", "0.1"), ParseOptions::default()).expect("reads").program;
    assert_eq!(old.dialect, LadderDialect::Ldmicro23);
}
