//! The case studies of reference 003 as grids: traces worked by hand, and chips that agree.

use emu_check::{CheckOptions, check};
use ladder::{LadderProgram, ReadOptions, read_program};
use ladder_eval::Evaluator;

fn example(name: &str) -> LadderProgram {
    let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples").join(name);
    let bytes = std::fs::read(&file).expect("the example exists");
    let options = ReadOptions { cycle_us: Some(100_000), ..ReadOptions::default() };
    read_program(name, &bytes, options).unwrap_or_else(|faults| panic!("{faults:?}")).program
}

/// Each line: scans, inputs that are 1, and the outputs that are 1 after these scans.
fn assert_trace(name: &str, trace: &str) {
    let mut evaluator = Evaluator::new(&example(name)).unwrap_or_else(|fault| panic!("{fault}"));
    let symbols = evaluator.symbols().to_vec();
    let mut scan = 0_u32;
    for line in trace.lines().map(str::trim).filter(|line| !line.is_empty()) {
        let mut parts = line.split(':').map(|part| part.split_whitespace().collect::<Vec<_>>());
        let mut part = || parts.next().unwrap_or_default();
        let (scans, inputs, outputs) = (part(), part(), part());
        for (index, symbol) in symbols.iter().enumerate().filter(|(_, symbol)| symbol.is_given) {
            evaluator.set(index, i32::from(inputs.contains(&symbol.name.as_str())));
        }
        for _ in 0..scans[0].parse().expect("a number of scans") {
            evaluator.scan();
            scan += 1;
        }
        let is_output = |name: &str| name.starts_with('S');
        let mut found: Vec<&str> = Vec::new();
        for (index, symbol) in symbols.iter().enumerate().filter(|(_, symbol)| is_output(&symbol.name)) {
            if evaluator.get(index) != 0 {
                found.push(&symbol.name);
            }
        }
        assert_eq!(found, outputs, "{name}, scan {scan}: {line}");
    }
}

#[test]
fn tank_opens_below_b_and_closes_at_a() {
    let trace = "
        1:                : S10 S8
        1: EN3            : S10 S11 S8
        1: EN3 EN2        : S11 S8
        1: EN3 EN2 EN1    : S11 S8 S9
        1: EN3 EN2 EN1 EN0: S11 S9
        1: EN3 EN2 EN1    : S11 S9
        1: EN3 EN2        : S11 S8
        1: EN3            : S10 S11 S8";
    assert_trace("tank.grid", trace);
}

#[test]
fn second_relay_needs_the_first_to_switch_on() {
    let trace = "
        1: EN2     :
        1: EN0     : S11
        1:         : S11
        1: EN2     : S11 S12
        1: EN1     : S12
        1: EN2     : S12
        1: EN3     :
        1: EN2     :
        1: EN0 EN1 : ";
    assert_trace("relays.grid", trace);
}

/// 1 s is 10 scans. The timers end in the scan 1 s after that of their edge.
#[test]
fn welder_starts_and_stops_a_second_apart() {
    let trace = "
        1:     :
        1: EN5 : S8
        9: EN5 : S8
        1: EN5 : S10 S8
        30: EN5: S10 S8
        1:     : S8
        10:    : S8
        1:     : ";
    assert_trace("welder.grid", trace);
}

/// The timer of 2 s ends in scan 21; the lamp changes a scan later, and the timer begins again a scan after
/// that, so the lamp changes every 22 scans: it has a period of 4 s, although the text wants 2 s.
#[test]
fn lamp_changes_each_time_that_the_timer_ends() {
    let trace = "
        21: :
        1: : S8
        21: : S8
        1: :
        21: :
        1: : S8";
    assert_trace("blinker.grid", trace);
}

/// A pulse is 21 scans of 42: T0 ends in scan 21, 2 s after its beginning.
#[test]
fn fifth_pulse_lights_the_lamp_when_it_ends() {
    let mut evaluator = Evaluator::new(&example("modulo5.grid")).unwrap_or_else(|fault| panic!("{fault}"));
    let index = |name: &str| evaluator.index(name).expect("a symbol");
    let (pulse, lamp) = (index("S13"), index("S12"));
    let (mut was, mut pulses, mut seen) = (0, 0, Vec::new());
    for _ in 0..700 {
        evaluator.scan();
        let now = evaluator.get(pulse);
        pulses += i32::from(was == 0 && now == 1);
        // The lamp is lit between the end of a fifth pulse and the scan after the beginning of the sixth.
        let begins = was == 0 && now == 1;
        if evaluator.get(lamp) == 1 && !begins {
            seen.push((pulses, now));
        }
        was = now;
    }
    assert!(pulses > 10, "{pulses}");
    assert!(!seen.is_empty() && seen.iter().all(|(pulses, now)| *pulses % 5 == 0 && *now == 0), "{seen:?}");
    let lit: std::collections::BTreeSet<i32> = seen.iter().map(|(pulses, _)| *pulses).collect();
    assert_eq!(lit.into_iter().collect::<Vec<_>>(), [5, 10, 15]);
}

#[test]
fn chips_agree() {
    for mcu in ["atmega328p", "pic16f876", "at89s52", "ap101"] {
        for name in ["tank.grid", "relays.grid", "welder.grid", "blinker.grid", "modulo5.grid"] {
            let clock_hz = Some(4_000_000);
            let options = CheckOptions { mcu: mcu.to_owned(), scans: 200, clock_hz, ..CheckOptions::default() };
            match check(&example(name), &options, &mut |_, _| {}) {
                Ok(report) => assert!(report.agreed, "{mcu} {name}: {}", report.text()),
                // AP101 has no integers: timers of 100 ms and counters of IL need them.
                Err(faults) => assert!(
                    mcu == "ap101" && faults.iter().all(|fault| fault.code == "LC007"),
                    "{mcu} {name}: {faults:?}"
                ),
            }
        }
    }
}

/// The diagrams of the page: each has a grid of its outputs in this test, and a row for each symbol.
#[test]
fn diagrams_of_the_page_are_right() {
    let page = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/languages/grid.md");
    let page = std::fs::read_to_string(page).expect("the page exists");
    for (title, grids) in [
        ("TON:T0:0.03 on EN0", "GRID\nEN0 - TON:T0:0.03\nEND\n"),
        ("CTU:C0:2 on EN0", "GRID\nEN0 - CTU:C0:2\nEND\nGRID\nEN1 - RES:C0\nEND\n"),
    ] {
        let diagram = page.split(title).nth(1).expect("the diagram").lines().skip(1);
        let rows: Vec<(&str, &str)> = diagram.map_while(|line| line.trim().split_once(' ')).collect();
        let program = read_program("page.grid", format!("CSLADDER\n{grids}").as_bytes(), ReadOptions::default());
        let mut evaluator = Evaluator::new(&program.expect("sound grids").program).expect("elements with a meaning");
        let scans = rows.first().map_or(0, |(_, row)| row.trim().len());
        assert!(scans > 5 && rows.len() > 1, "{title}");
        for scan in 0..scans {
            let wanted = |row: &str| i32::from(row.trim().as_bytes()[scan] == b'-');
            for (name, row) in rows.iter().filter(|(name, _)| name.starts_with("EN")) {
                evaluator.set(evaluator.index(name).expect("an input"), wanted(row));
            }
            evaluator.scan();
            for (name, row) in rows.iter().filter(|(name, _)| !name.starts_with("EN")) {
                let output = evaluator.index(&format!("{name}.Q")).expect("an output of a block");
                assert_eq!(evaluator.get(output), wanted(row), "{title}, scan {scan}");
            }
        }
    }
}
