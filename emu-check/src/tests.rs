//! Tests of the stimulus, the coverage goals and the analysis of impossible outcomes, on the evaluator alone.

use std::collections::BTreeSet;
use std::fs;

use ladder::LadderProgram;
use ladder_eval::Evaluator;

use crate::coverage::goals::{CoverageGoals, EvaluatedScan};
use crate::stimulus::boundary_goals::BoundaryGoals;
use crate::stimulus::generator::{ScanStimulus, StimulusGenerator};
use crate::stimulus::stimulus_symbols::StimulusSymbols;

#[path = "../../tests/ladder/parse.rs"]
mod parse;

fn program(rungs: &str) -> LadderProgram {
    parse::parse("test.ld", &format!("LDmicro0.1\nCYCLE=1000\nCRYSTAL=1000000\nIO LIST\nEND\nPROGRAM\n{rungs}\n"))
}

/// The first `scans` stimuli with the seed of the run that each belongs to, and the goals after them.
fn drawn(program: &LadderProgram, seed: u64, scans: usize) -> (Vec<(u64, ScanStimulus)>, CoverageGoals) {
    let power_up = Evaluator::new(program).unwrap_or_else(|refusal| panic!("{refusal}"));
    let stimulus_symbols = StimulusSymbols::new(program, &power_up);
    let mut goals = CoverageGoals::new(program, &power_up);
    let mut generator = StimulusGenerator::new(seed, BoundaryGoals::new(program, &power_up));
    let (mut eval, mut run) = (power_up.clone(), 0);
    let mut stimuli = Vec::new();
    for _ in 0..scans {
        if let Some(ram_seed) = generator.begin_run(&stimulus_symbols) {
            (eval, run) = (power_up.clone(), ram_seed);
        }
        let stimulus = generator.next_stimulus(&stimulus_symbols, &eval, &goals);
        stimulus.apply_immediately(&stimulus_symbols, &mut eval);
        goals.mark_reached(&EvaluatedScan::run(&mut eval));
        stimuli.push((run, stimulus));
    }
    (stimuli, goals)
}

const THREE: &str = "
    RUNG\n CONTACTS Xa 0\n CONTACTS Xb 0\n TON Ta 9000\n COIL Rx 0 0 0\n END
    RUNG\n CONTACTS Xc 0\n CTU Cn 7\n COIL Yq 0 0 0\n END";

#[test]
fn the_same_seed_draws_the_same_and_less_is_a_part_of_more() {
    let program = program(THREE);
    let (more, _) = drawn(&program, 5, 900);
    assert_eq!(drawn(&program, 5, 900).0, more);
    assert_eq!(drawn(&program, 5, 333).0, more[..333]);
    assert_ne!(drawn(&program, 6, 900).0, more);
}

#[test]
fn few_inputs_see_every_combination_without_a_write() {
    let (stimuli, _) = drawn(&program(THREE), 1, 60);
    let seen: BTreeSet<&[bool]> = stimuli.iter().map(|(_, stimulus)| stimulus.inputs.as_slice()).collect();
    assert_eq!(seen.len(), 8);
    assert!(stimuli.iter().take(56).all(|(_, stimulus)| stimulus.writes.is_empty()));
}

/// Rows are (inputs, scans of the longest run of a default check): a drift of the period accumulates over
/// that run.
#[test]
fn the_longest_run_is_as_long_as_the_manual_says() {
    for (inputs, longest) in [(1, 320), (7, 320), (8, 256), (9, 320)] {
        let contacts: String = (0..inputs).map(|n| format!(" CONTACTS Xi{n} 0\n")).collect();
        let (stimuli, _) = drawn(&program(&format!("RUNG\n{contacts} COIL Ya 0 0 0\nEND")), 1, 2_000);
        assert_eq!(stimuli.chunk_by(|a, b| a.0 == b.0).map(<[_]>::len).max(), Some(longest), "{inputs} inputs");
    }
}

#[test]
fn all_boundaries_are_written_in_a_default_check() {
    let (stimuli, _) = drawn(&program(THREE), 1, 2_000);
    let written: BTreeSet<i32> = stimuli.iter().flat_map(|(_, s)| s.writes.iter().map(|w| w.1)).collect();
    // The general boundary values, and preset 8 and limit 7 with their neighbours.
    for value in [0, 1, -1, 100, 0x7FFF, -0x8000, 255, 256, 6, 7, 8, 9] {
        assert!(written.contains(&value), "{value} is never written");
    }
}

/// Rows are `rungs | outcomes that are not seen, with the reason`; several outcomes are joined by `;`.
#[rustfmt::skip]
const IMPOSSIBLE: &[(&str, &str)] = &[
    ("CONTACTS Xa 0\n COIL Ya 0 0 0", ""),
    ("COIL Ya 0 0 0", "1.1 stores 0: impossible, its rung is always true there"),
    ("OPEN\n CONTACTS Xa 0\n COIL Ya 0 0 0",
     "1.2 passes: impossible, its rung is never true there; 1.2 blocks: impossible, its rung is never true there; \
      1.3 stores 1: impossible, its rung is never true there"),
    ("LES 3 5\n COIL Ya 0 0 0",
     "1.1 is false: impossible, it passes whenever its rung is true; \
      1.2 stores 0: impossible, its rung is always true there"),
    ("GRT n 32767\n COIL Ya 0 0 0",
     "1.1 is true: impossible, it blocks whenever its rung is true; \
      1.2 stores 1: impossible, its rung is never true there"),
    ("CONTACTS Xa 0\n TON Ta 9000\n COIL Ya 0 0 0", ""),
    ("TON Ta 9000\n COIL Ya 0 0 0", "1.1 is reset: impossible, its rung is always true there"),
    ("OPEN\n OSF\n COIL Ya 0 0 0",
     "1.2 fires: impossible, its rung is never true there; 1.3 stores 1: impossible, its rung is never true there"),
    ("OPEN\n OSF\n OSF\n COIL Ya 0 0 0",
     "1.2 fires: impossible, its rung is never true there; 1.3 fires: impossible, its rung is never true there; \
      1.4 stores 1: impossible, its rung is never true there"),
    ("CONTACTS Xa 0\n OSF\n OSF\n COIL Ya 0 0 0", ""),
    ("CTU Cn -32768\n COIL Ya 0 0 0",
     "1.1 is below its limit: impossible, its limit leaves no other case; \
      1.2 stores 0: impossible, its rung is always true there"),
    // A correlation that does not come from an input is not detected, so the outcome is not called
    // impossible.
    ("CONTACTS Ra 0\n CONTACTS Ra 0\n COIL Ya 0 0 0", "1.2 blocks: not seen"),
    ("CONTACTS Xa 0\n CONTACTS Xa 0\n COIL Ya 0 0 0", "1.2 blocks: impossible, it passes whenever its rung is true"),
    ("PARALLEL\n SERIES\n MOVE n 4\n END\n RTO Ta 9000\n END\n END\nRUNG\n EQU n 4\n COIL Ya 0 0 0",
     "1.1 rests: impossible, its rung is always true there; 1.2 holds: impossible, its rung is always true there; \
      2.1 is false: impossible, it passes whenever its rung is true; \
      2.2 stores 0: impossible, its rung is always true there"),
];

#[test]
fn exceptions_have_a_name_and_a_reason() {
    for (rungs, wanted) in IMPOSSIBLE {
        let program = program(&format!("RUNG\n {rungs}\nEND"));
        let (_, goals) = drawn(&program, 1, 2_000);
        let coverage = goals.coverage(&program);
        let line = |m: &crate::MissingOutcome| {
            let why = m.impossible.as_ref().map_or("not seen".to_owned(), |why| format!("impossible, {why}"));
            format!("{}.{} {}: {why}", m.rung, m.element, m.what)
        };
        let found: Vec<String> = coverage.missing.iter().map(line).collect();
        assert_eq!(found.join("; "), *wanted, "{rungs}");
        assert_eq!(coverage.full, !wanted.contains("not seen"), "{rungs}");
    }
}

/// Rows are `rungs | the coverage line`; items with an impossible outcome are counted separately.
#[rustfmt::skip]
const LINES: &[(&str, &str)] = &[
    ("CONTACTS Xa 0\n COIL Ya 0 0 0", "contacts 1/1 both ways, coils 1/1 both values"),
    ("COIL Ya 0 0 0", "coils 0/0 both values (1 more cannot)"),
    ("PARALLEL\n COIL Ya 0 0 0\n MOVE n 4\n END\n END\nRUNG\n CONTACTS Xa 0\n COIL Yb 0 0 0",
     "contacts 1/1 both ways, coils 1/1 both values (1 more cannot), actions 0/0 both ways (1 more cannot)"),
    ("OPEN\n OSF\n COIL Ya 0 0 0\n END\nRUNG\n CONTACTS Xa 0\n OSF\n COIL Yb 0 0 0",
     "contacts 1/1 both ways, coils 1/1 both values (1 more cannot), one-shots 1/1 fired (1 more cannot)"),
    ("CTU Cn -32768\n COIL Ya 0 0 0",
     "coils 0/0 both values (1 more cannot), counters 0/0 in all states (1 more cannot)"),
    ("TON Ta 9000\n COIL Ya 0 0 0", "coils 1/1 both values, timers 0/0 expired and reset (1 more cannot)"),
    ("CONTACTS Ra 0\n CONTACTS Ra 0\n COIL Ya 0 0 0", "contacts 1/2 both ways, coils 1/1 both values"),
    ("SHORT", "nothing to cover"),
];

#[test]
fn the_coverage_line_is_true() {
    for (rungs, wanted) in LINES {
        let program = program(&format!("RUNG\n {rungs}\nEND"));
        let (_, goals) = drawn(&program, 1, 2_000);
        assert_eq!(goals.coverage(&program).summary_line(), format!("coverage: {wanted}\n"), "{rungs}");
    }
}

#[test]
fn nothing_called_impossible_ever_happens() {
    for folder in ["tests/programs", "../examples"] {
        let Ok(entries) = fs::read_dir(format!("{}/{folder}", env!("CARGO_MANIFEST_DIR"))) else { continue };
        let paths = entries.map(|entry| entry.expect("an entry").path());
        for path in paths.filter(|path| path.extension().is_some_and(|end| end == "ld")) {
            let text = fs::read_to_string(&path).expect("a program");
            let program = parse::parse("test.ld", &text);
            for seed in 0..6 {
                let (_, goals) = drawn(&program, seed, 2_000);
                assert_eq!(goals.contradictions(), 0, "{}, seed {seed}", path.display());
                assert!(
                    !goals.has_open_goals(),
                    "{}, seed {seed}: {:?}",
                    path.display(),
                    goals.coverage(&program).missing
                );
            }
        }
    }
}

/// Rows are `rungs | the coverage line`, for elements with more state than bits; the evaluator alone reaches
/// everything.
#[rustfmt::skip]
const PERIPHERALS: &[(&str, &str)] = &[
    ("CONTACTS Xa 0\n SHIFT_REGISTER s 4", "contacts 1/1 both ways, shift registers 1/1 shifted"),
    ("CONTACTS Xa 0\n LOOK_UP_TABLE d i 3 0 5 6 7", "contacts 1/1 both ways, tables 1/1 in all parts"),
    ("LOOK_UP_TABLE i i 3 0 5 6 7", "tables 1/1 in all parts"),
    ("PIECEWISE_LINEAR d i 3 0 0 10 100 20 0", "tables 1/1 in all parts"),
    ("PIECEWISE_LINEAR d i 2 -32768 0 -32760 100", "tables 1/1 in all parts"),
    ("CONTACTS Xa 0\n READ_ADC Ain\nEND\nRUNG\n EQU Ain 1023\n COIL Ya 0 0 0",
     "contacts 1/1 both ways, coils 1/1 both values, compares 1/1 both ways, peripherals 1/1 used"),
    ("CONTACTS Xa 0\n SET_PWM d 1000", "contacts 1/1 both ways, peripherals 1/1 used"),
    ("CONTACTS Xa 0\n PERSIST p", "contacts 1/1 both ways, peripherals 1/1 used"),
    ("CONTACTS Xa 0\n UART_SEND v\n COIL Ya 0 0 0", "contacts 1/1 both ways, coils 1/1 both values, serial 1/1 with bytes and without"),
    ("CONTACTS Xa 0\n UART_RECV v\n COIL Ya 0 0 0", "contacts 1/1 both ways, coils 1/1 both values, serial 1/1 with bytes and without"),
    ("CONTACTS Xa 0\n FORMATTED_STRING v 6 97 92 45 51 13 10", "contacts 1/1 both ways, serial 1/1 with bytes and without"),
];

#[test]
fn peripherals_are_covered() {
    for (rungs, wanted) in PERIPHERALS {
        for baud in [2_400, 115_200] {
            let mut program = program(&format!("RUNG\n {rungs}\nEND"));
            program.settings.baud = Some(baud);
            let (_, goals) = drawn(&program, 1, 2_000);
            let coverage = goals.coverage(&program);
            assert_eq!(coverage.summary_line(), format!("coverage: {wanted}\n"), "{rungs}: {:?}", coverage.missing);
            assert!(coverage.full && goals.contradictions() == 0, "{rungs}: {:?}", coverage.missing);
        }
    }
}
