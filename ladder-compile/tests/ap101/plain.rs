//! Tests programs with known instructions, the traces for all chips, and the examples.

use emu_ap101::chips::{CLEAR_PIN, POWER_PIN};
use emu_core::rng::Rng;
use emu_core::{Cpu, CycleTime, PinLevel, StopReason};
use ladder_compile::target::CodeMark;
use ladder_compile::{CompileOptions, compile};

use crate::machine_pair::{MachinePair, build, lower_program, program};
use crate::table::{self, Column};

#[test]
fn instructions_are_those_of_the_table() {
    let cases = include_str!("plain.txt").split("\n== ").skip(1);
    for case in cases {
        let (name, body) = case.split_once('\n').expect("a case has lines");
        let (rungs, wanted) = body.split_once("\n--\n").expect("rungs and instructions");
        let program = program(rungs);
        let built = build(&program, &lower_program(&program)).expect("an image");
        let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
        let found: Vec<String> = built.lines.iter().map(|line| words(&line.text)).collect();
        assert_eq!(found.join("\n"), wanted.trim_end(), "{name}");
        let at = |mark| built.marks.iter().find(|(m, _)| *m == mark).map(|(_, at)| *at as usize);
        assert_eq!((at(CodeMark::ScanStart), at(CodeMark::ScanEnd)), (Some(0), Some(found.len() - 1)), "{name}");
    }
}

/// Compares the machine with the traces of `tests/ladder`, for programs that have an image.
#[test]
fn the_machine_gives_every_line_of_the_traces() {
    let (mut lines, mut faults) = (0, Vec::new());
    for case in table::cases() {
        let program = program(&case.program);
        let options = CompileOptions { mcu: "ap101".to_owned(), ..CompileOptions::default() };
        if compile(&program, &options).is_err() {
            continue;
        }
        let mut pair = MachinePair::new(&program).unwrap_or_else(|why| panic!("{}: {why:?}", case.name));
        for row in &case.rows {
            for _ in 0..row.times {
                let given: Vec<(&str, i32)> = case
                    .given
                    .iter()
                    .zip(&row.given)
                    .filter_map(|(column, value)| match column {
                        Column::Symbol(name) => Some((name.as_str(), (*value)?)),
                        _ => None,
                    })
                    .collect();
                given.iter().filter(|(name, _)| name.starts_with('X')).for_each(|(n, v)| pair.drive(n, *v != 0));
                let begun = pair.begin();
                given.iter().filter(|(name, _)| !name.starts_with('X')).for_each(|(n, v)| pair.set(n, *v));
                if let Err(how) = begun.and_then(|()| pair.end()) {
                    faults.push(format!("{}: {}: {how}", case.name, row.text));
                }
            }
            lines += 1;
            for (column, wanted) in case.wanted.iter().zip(&row.wanted) {
                if let (Column::Symbol(name), Some(wanted)) = (column, wanted)
                    && pair.get(name) != *wanted
                {
                    faults.push(format!("{}: {}: {name} is {}", case.name, row.text, pair.get(name)));
                }
            }
        }
    }
    assert!(faults.is_empty(), "{faults:#?}");
    assert!(lines > 200, "{lines} lines");
}

const EXAMPLES: &[(&str, &str, bool)] = &[
    ("blinker", include_str!("../../../examples/blinker.ld"), true),
    ("boolean", include_str!("../../../examples/boolean.ld"), true),
    ("garage", include_str!("../../../examples/garage.ld"), true),
    ("modulo5", include_str!("../../../examples/modulo5.ld"), false),
    ("press", include_str!("../../../examples/press.ld"), true),
    ("relays", include_str!("../../../examples/relays.ld"), true),
    ("tank", include_str!("../../../examples/tank.ld"), true),
    ("traffic", include_str!("../../../examples/traffic.ld"), false),
    ("welder", include_str!("../../../examples/welder.ld"), true),
];

#[test]
fn examples_agree() {
    for (seed, (name, text, fits)) in (0..).zip(EXAMPLES) {
        let program = program(text);
        let pair = MachinePair::new(&program);
        assert_eq!(pair.is_ok(), *fits, "{name}: {:?}", pair.err());
        let Ok(mut pair) = MachinePair::new(&program) else { continue };
        let mut rng = Rng::new(seed);
        let inputs: Vec<String> = pair.eval.symbols().iter().map(|s| s.name.clone()).collect();
        for scan in 1..=400 {
            for input in inputs.iter().filter(|name| name.starts_with('X')) {
                if rng.one_in(20) {
                    pair.drive(input, rng.one_in(2));
                }
            }
            pair.scan().unwrap_or_else(|how| panic!("{name}, scan {scan}: {how}\n{}", pair.listing()));
        }
        println!("{name}: {} words, {} cycles", pair.built.lines.len(), pair.built.worst_scan_cycles);
    }
}

/// A warm start keeps M and restarts timers and counters; the scans continue (docs/compile-ap101.md).
#[test]
fn a_failure_of_the_supply_keeps_bits() {
    let rungs = "RUNG\nCONTACTS Xa 0\nCOIL Ra 0 1 0\nEND\nRUNG\nCONTACTS Ra 0\nCOIL Ya 0 0 0\nEND\n\
        RUNG\nCONTACTS Ra 0\nTON Ta 50000\nCOIL Yb 0 0 0\nEND\nRUNG\nCONTACTS Ra 0\nOSR\nCTU Ca 9\nEND";
    for (cold, kept) in [(false, 1), (true, 0)] {
        let mut pair = MachinePair::new(&program(rungs)).expect("an image");
        pair.drive("Xa", true);
        (0..9).for_each(|_| pair.scan().expect("the same"));
        pair.drive("Xa", false);
        pair.scan().expect("the same");
        assert_eq!(["Ra", "Ya", "Yb", "Ta", "Ca"].map(|name| pair.get(name)), [1, 1, 1, 4, 1]);
        let now = pair.cpu.cycle();
        for (pin, cycle, level) in
            [(POWER_PIN, now + 20, false), (CLEAR_PIN, now + 50, cold), (POWER_PIN, now + 100, true)]
        {
            pair.cpu.drive(CycleTime::at(cycle), pin, PinLevel::from_bit(level));
        }
        // Two outputs are loaded, then the scans begin. A preserved edge memory sees no edge.
        assert_eq!(pair.cpu.run(now + 103, &mut ()), StopReason::Breakpoint { pc: 0 });
        assert_eq!(pair.cpu.cycle(), now + 102);
        assert_eq!(["Ra", "Ya", "Yb", "Ta", "Ca"].map(|name| pair.get(name)), [kept, kept, kept, 0, 0]);
        pair.cpu.run(now + 5101, &mut ());
        pair.cpu.run(now + 5101, &mut ());
        assert_eq!(["Ra", "Ya", "Yb", "Ta", "Ca"].map(|name| pair.get(name)), [kept, kept, 0, kept, 0]);
    }
}
