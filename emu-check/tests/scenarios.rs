//! Scenarios give the same verdict on the reference evaluator and on a chip of each family: `scenarios.txt`.

use std::fs;
use std::path::{Path, PathBuf};

use emu_check::{CheckOptions, ScenarioResult, outcome_name, play_on_chip, play_on_evaluator};

/// A chip of each family.
const CHIPS: [&str; 4] = ["atmega328p", "at89s52", "pic16f877", "ap101"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The verdict as in the table: outcome, step, tick, such as `failed 2 51`.
fn verdict_line(played: &ScenarioResult) -> String {
    if let Some(differs) = &played.difference {
        return format!("differs: {differs}");
    }
    let Some(verdict) = &played.verdict else { return "no verdict".to_owned() };
    let step = verdict.step.map_or_else(|| "-".to_owned(), |step| step.to_string());
    format!("{} {step} {}", outcome_name(verdict.outcome), verdict.tick)
}

#[test]
fn verdicts_are_the_same_everywhere() {
    let text = fs::read_to_string(root().join("emu-check/tests/scenarios.txt")).expect("the table");
    let mut wrong = Vec::new();
    let (mut played, mut refused) = ([0; 4], Vec::new());
    for block in text.split("\n== ").skip(1) {
        let (head, body) = block.split_once('\n').expect("a head line");
        let cells: Vec<&str> = head.split('|').map(str::trim).collect();
        let (file, wanted) = (cells[0], cells[1]);
        let body = match body.trim().strip_prefix("include ") {
            Some(name) => fs::read_to_string(root().join(name.trim())).expect(name),
            None => body.to_owned(),
        };
        let source = fs::read(root().join(file)).expect(file);
        let program = ladder::parse_bytes(file, &source, ladder::ParseOptions::default()).expect(file).program;
        let scenario = scenario::parse("scenario", &body).unwrap_or_else(|faults| panic!("{head}: {faults:?}"));
        let reference = play_on_evaluator(&program, &scenario).unwrap_or_else(|faults| panic!("{head}: {faults:?}"));
        if verdict_line(&reference) != wanted {
            wrong.push(format!(
                "{head}: evaluator {} {:?}",
                verdict_line(&reference),
                reference.verdict.map(|v| v.why)
            ));
            continue;
        }
        for (mcu, count) in CHIPS.iter().zip(&mut played) {
            let options = CheckOptions { mcu: (*mcu).to_owned(), ..CheckOptions::default() };
            match play_on_chip(&program, &scenario, &options) {
                Ok(found) => {
                    *count += 1;
                    if !reference.has_same_verdict(&found) {
                        wrong.push(format!(
                            "{head}: {mcu} {} {:?}",
                            verdict_line(&found),
                            found.verdict.map(|v| v.why)
                        ));
                    }
                    if found.log != reference.log {
                        wrong.push(format!("{head}: {mcu} logs {:?}, not {:?}", found.log, reference.log));
                    }
                }
                Err(faults) => refused.push(format!("{head}: {mcu}: {}", faults[0])),
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    // The 8051 has no converter; AP101 has no serial line, converter or EEPROM, and does not support all
    // elements of the examples.
    let refuses =
        |line: &String| line.contains(": ap101: ") || line.contains("parts.ld") && line.contains(": at89s52: ");
    assert!(refused.iter().all(refuses), "{refused:#?}");
    assert!(played.iter().all(|count| *count > 8), "{played:?} {refused:#?}");
}
