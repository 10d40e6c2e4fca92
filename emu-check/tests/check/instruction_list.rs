//! The programs of the evaluator's traces, in Instruction List and in notations that draw networks, on all
//! families: chip and evaluator agree.

use emu_check::{CheckOptions, check};
use ladder::il::{il_settings, read, to_ladder};
use ladder::{LadderProgram, Notation, ReadOptions, read_program};

#[path = "../../../tests/ladder/il_programs.rs"]
mod il_programs;
#[path = "../../../tests/ladder/plcopen_text.rs"]
mod plcopen_text;

/// Tables of traces, with their notations.
const TABLES: [(&str, Notation); 7] = [
    ("operators.txt", Notation::InstructionList),
    ("numbers.txt", Notation::InstructionList),
    ("blocks.txt", Notation::InstructionList),
    ("programs.txt", Notation::InstructionList),
    ("standard.txt", Notation::InstructionList),
    ("plcopen.txt", Notation::PlcOpen),
    ("rockwell.txt", Notation::Rockwell),
];

/// Each title with its program, from the tables of traces.
pub fn programs() -> Vec<(String, LadderProgram)> {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../ladder-eval/tests/eval/il");
    let mut programs = Vec::new();
    for (name, notation) in TABLES {
        let text = std::fs::read_to_string(folder.join(name)).expect("the traces exist");
        for case in text.split("\n== ").skip(1) {
            let (title, body) = case.split_once('\n').expect("lines after the title");
            let (_, cycle) = title.split_once(" @ ").unwrap_or((title, "10"));
            let cycle_ms: u64 = cycle.trim().parse().expect("a cycle");
            let lines = body.lines().take_while(|line| !line.starts_with("-- "));
            let text: String = lines.filter(|line| !line.starts_with('#')).map(|line| format!("{line}\n")).collect();
            let text = if notation == Notation::PlcOpen { plcopen_text::project(&text) } else { text };
            let options = ReadOptions { notation: Some(notation), cycle_us: Some(1000 * cycle_ms), dialect: None };
            let read = read_program("trace", text.as_bytes(), options);
            let program = read.unwrap_or_else(|faults| panic!("{title}: {faults:?}")).program;
            programs.push((format!("{name}: {title}"), program));
        }
    }
    programs
}

fn differences(mcu: &str, clock_hz: u32) -> (usize, Vec<String>) {
    let (mut agreed, mut faults) = (0, Vec::new());
    for (title, program) in programs() {
        let options = CheckOptions {
            mcu: mcu.to_owned(),
            scans: 300,
            clock_hz: Some(clock_hz.into()),
            ..CheckOptions::default()
        };
        match check(&program, &options, &mut |_, _| {}) {
            Ok(report) if report.agreed => agreed += 1,
            Ok(report) => faults.push(format!("{mcu}: {title}\n{}", report.text())),
            // AP101 has no integers, and 100 jumps back take too long for the period of a slow chip.
            Err(refusals) if mcu == "ap101" && refusals.iter().all(|refusal| refusal.code == "LC007") => {}
            Err(refusals) if refusals.iter().all(|refusal| refusal.code == "LC022") && title.contains("loop") => {}
            Err(refusals) => faults.push(format!("{mcu}: {title}: {refusals:?}")),
        }
    }
    (agreed, faults)
}

#[test]
fn avr_agrees() {
    let (agreed, faults) = differences("atmega328p", 16_000_000);
    assert!(faults.is_empty() && agreed > 80, "{agreed}: {}", faults.join("\n"));
}

#[test]
fn mcs51_agrees() {
    let (agreed, faults) = differences("at89s52", 12_000_000);
    assert!(faults.is_empty() && agreed > 80, "{agreed}: {}", faults.join("\n"));
}

#[test]
fn pic16_agrees() {
    let (agreed, faults) = differences("pic16f877", 20_000_000);
    assert!(faults.is_empty() && agreed > 80, "{agreed}: {}", faults.join("\n"));
}

#[test]
fn ap101_agrees() {
    let (agreed, faults) = differences("ap101", 1_000_000);
    assert!(faults.is_empty() && agreed > 10, "{agreed}: {}", faults.join("\n"));
}

#[test]
fn initial_values_of_bits_agree_on_all_families() {
    let text = "VAR_INPUT a : BOOL; END_VAR\nVAR_OUTPUT q : BOOL := TRUE; END_VAR\nVAR f : BOOL := TRUE; END_VAR\n\
                LD f\nANDN a\nST q\nLD a\nR f\n";
    let parsed = read("initial.il", text).expect("a sound program");
    let program = to_ladder(&parsed.program, il_settings(10_000)).expect("a sound program").program;
    for mcu in ["atmega328p", "8052", "pic16f877", "ap101"] {
        let options = CheckOptions { mcu: mcu.to_owned(), scans: 200, ..CheckOptions::default() };
        let report = check(&program, &options, &mut |_, _| {}).expect("a program of single bits");
        assert!(report.agreed, "{mcu}: {}", report.text());
    }
}

/// Runs random programs on a chip; returns how many fit it.
fn random_programs(mcu: &str, clock_hz: u64, cycle_ms: u64) -> usize {
    let mut agreed = 0;
    for seed in 1..=40_u64 {
        let text = il_programs::program(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15));
        let parsed = read("random.il", &text).expect("accepted text");
        let program = to_ladder(&parsed.program, il_settings(1000 * cycle_ms)).expect("accepted text").program;
        let options =
            CheckOptions { mcu: mcu.to_owned(), scans: 120, seed, clock_hz: Some(clock_hz), ..CheckOptions::default() };
        match check(&program, &options, &mut |_, _| {}) {
            Ok(report) => assert!(report.agreed, "{mcu}, program {seed}:\n{text}\n{}", report.text()),
            Err(refusals) => {
                // The scan is too long, or the program or its data too large.
                let is_limit = |code: &str| ["LC022", "LC030", "LC031"].contains(&code);
                assert!(refusals.iter().all(|refusal| is_limit(refusal.code)), "{mcu}, program {seed}: {refusals:?}");
                continue;
            }
        }
        agreed += 1;
    }
    agreed
}

#[test]
fn random_programs_agree_on_avr() {
    assert!(random_programs("atmega328p", 16_000_000, 20) > 20);
}

#[test]
fn random_programs_agree_on_pic16() {
    assert!(random_programs("pic16f877", 20_000_000, 20) > 20);
}

#[test]
fn random_programs_agree_on_mcs51() {
    assert!(random_programs("8052", 12_000_000, 60) > 20);
}
