//! The report of a check as text and JSON, and the reasons for refusals.

use crate::common;
use emu_check::{CODES, CheckOptions, check};
use ladder_compile::PinAssignment;

const TOGGLE: &str = "RUNG\n CONTACTS Xa 0\n OSR\n COIL Ypulse 0 0 0\nEND";

#[test]
fn text_of_an_agreement() {
    let report =
        common::report(&common::rungs("toggle.ld", TOGGLE), &CheckOptions { scans: 100, ..CheckOptions::default() });
    let text = report.text();
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines[0].starts_with("toggle.ld on atmega328p agrees: 100 scans in 4 runs from reset, "), "{text}");
    assert!(lines[0].ends_with(" values compared, seed 1"), "{text}");
    assert_eq!(lines[1], "coverage: contacts 1/1 both ways, coils 1/1 both values, one-shots 1/1 fired");
    assert!(lines[2].starts_with("figures: ") && lines[2].contains("; period 1000 cycles, scan at most "), "{text}");
    assert_eq!(lines.len(), 3, "{text}");
}

#[test]
fn json_has_its_fields() {
    let report =
        common::report(&common::rungs("toggle.ld", TOGGLE), &CheckOptions { scans: 3, ..CheckOptions::default() });
    let json = serde_json::to_value(&report).expect("JSON");
    let keys: Vec<&str> = json.as_object().expect("an object").keys().map(String::as_str).collect();
    let wanted = "schema program mcu seed scans runs compared agreed difference coverage figures notes";
    assert_eq!(keys.join(" "), wanted);
    let figures: Vec<&str> = json["figures"].as_object().expect("an object").keys().map(String::as_str).collect();
    assert_eq!(
        figures.join(" "),
        "code_bytes ram_bytes period_cycles clocks_per_cycle scan_cycles_max scan_cycles_mean scan_cycles_bound slack_cycles rungs"
    );
    assert_eq!((&json["schema"], &json["agreed"], &json["scans"]), (&2.into(), &true.into(), &3.into()));
    // Three scans with the input off leave most goals open, and a note reports that.
    assert_eq!(json["coverage"]["full"], false);
    assert!(report.notes.iter().any(|note| note.code == "EC006"), "{:?}", report.notes);
    // From the start of the scan to the written output: at least the latching and a write, at most the
    // period.
    assert!((2..1000).contains(&report.figures.scan_cycles_max));
    // Per scan: start time, stack depth, one pin twice, two symbols, and the behaviour of 22 pins (RESET is
    // left out). Before the first scan of a run in addition: the output, and the behaviour of the pins.
    assert_eq!(report.compared, 3 * (6 + 22) + 1 + 22);
}

/// Rows are (program, options, code of the refusal).
#[test]
fn refusals() {
    let good = common::rungs("toggle.ld", TOGGLE);
    let cases = [
        (&good, CheckOptions { scans: 0, ..CheckOptions::default() }, "EC001"),
        (&good, CheckOptions { mcu: "z80".to_owned(), ..CheckOptions::default() }, "LC"),
        (&good, CheckOptions { pins: vec![PinAssignment::new("Xa", "PZ9")], ..CheckOptions::default() }, "LC"),
    ];
    for (program, options, code) in cases {
        let faults = check(program, &options, &mut |_, _| {}).expect_err("a refusal");
        assert!(faults.iter().any(|fault| fault.code.starts_with(code)), "wanted {code}: {faults:?}");
    }
}

#[test]
fn maps_that_do_not_fit_are_refused() {
    let program = common::rungs("toggle.ld", TOGGLE);
    let target = ladder_compile::CompileOptions { mcu: "atmega328p".to_owned(), ..Default::default() };
    let compiled = ladder_compile::compile(&program, &target).expect("an image");
    type BreakImage = fn(&mut ladder_compile::CompiledProgram);
    let cases: [(&str, BreakImage); 3] = [
        ("EC004", |c| c.hex = "oops".to_owned()),
        ("EC005", |c| c.map.symbols.clear()),
        ("EC005", |c| c.map.pins.clear()),
    ];
    for (code, change) in cases {
        let mut broken = compiled.clone();
        change(&mut broken);
        let faults = emu_check::check_compiled(&program, &broken, &CheckOptions::default(), &mut |_, _| {});
        let faults = faults.expect_err("a refusal");
        assert!(faults.iter().any(|fault| fault.code == code), "wanted {code}: {faults:?}");
    }
    let z80 = CheckOptions { mcu: "z80".to_owned(), ..CheckOptions::default() };
    let faults = emu_check::check_compiled(&program, &compiled, &z80, &mut |_, _| {}).expect_err("a refusal");
    assert!(faults.iter().any(|fault| fault.code == "EC003"), "{faults:?}");
}

#[test]
fn progress_ends_with_all_scans() {
    let program = common::rungs("toggle.ld", TOGGLE);
    let mut reported = Vec::new();
    let options = CheckOptions { scans: 200, ..CheckOptions::default() };
    check(&program, &options, &mut |done, total| reported.push((done, total))).expect("a report");
    assert_eq!((reported.first(), reported.last()), (Some(&(0, 200)), Some(&(200, 200))));
    assert!(reported.is_sorted());
}

#[test]
fn codes_are_in_order_and_explained() {
    assert!(CODES.is_sorted_by_key(|row| row.code));
    assert!(CODES.iter().all(|row| row.code.starts_with("EC") && row.explain.len() > 60));
}

/// Without a stop at every rung, the report has no rung times.
#[test]
fn rungs_that_were_not_timed_have_no_time() {
    let text = "RUNG\n CONTACTS Xa 0\n COIL Yb 0 0 0\nEND\nRUNG\n CONTACTS Xb 0\n OSR\n ADD n n 1\nEND";
    for mcu in ["atmega328p", "at89s52", "pic16f873", "pic16f877"] {
        for rungs in [true, false] {
            let options = CheckOptions { mcu: mcu.to_owned(), scans: 30, rungs, ..CheckOptions::default() };
            let report = common::report(&common::rungs("timed.ld", text), &options);
            let timed = report.figures.rungs.iter().filter(|rung| rung.cycles_max.is_some()).count();
            assert_eq!(timed, if rungs { 2 } else { 0 }, "{mcu}, timed {rungs}");
            assert_eq!(report.text().contains("longest rung"), rungs, "{mcu}");
        }
    }
}
