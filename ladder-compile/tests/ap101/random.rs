//! Tests random programs with random inputs and random values set between scans.

use emu_core::rng::Rng;
use ladder::LadderDialect::{Ldmicro5, Ldmicro23};
use ladder::SymbolKind;
use ladder_compile::lower_for_target;
use ladder_compile::target::BuildRefusal;

use crate::machine_pair::{MachinePair, TARGET, program_in};
use crate::program_generator::{ProgramLimits, generate_program as text};

const SMALL: ProgramLimits = ProgramLimits { rungs: 4, max_series: 3, depth: 1, modules: 3, dialect: Ldmicro23 };
const LARGE: ProgramLimits = ProgramLimits { rungs: 14, max_series: 5, depth: 3, modules: 12, dialect: Ldmicro23 };

const FIVE: ProgramLimits = ProgramLimits { rungs: 6, max_series: 4, depth: 1, modules: 8, dialect: Ldmicro5 };

/// Runs the program of a seed for some scans; returns false if its code is too large.
fn agree(seed: u64, wish: ProgramLimits, optimised: bool, scans: u64) -> bool {
    let mut rng = Rng::new(seed);
    let text = text(&mut rng, wish);
    let program = program_in(&text, wish.dialect);
    let ir = lower_for_target(&program, TARGET, optimised);
    let mut pair = match MachinePair::of(&program, ir) {
        Ok(pair) => pair,
        Err(BuildRefusal::CodeTooLarge { .. }) => return false,
        Err(why) => panic!("seed {seed}: {why:?}\n{text}"),
    };
    let symbols = pair.eval.symbols().to_vec();
    // Timers with a preset at power-up, which are the TOF of ldmicro-5: their modules hold it only from the
    // first execution on (docs/compile-ap101.md).
    let at_power_up = symbols.iter().enumerate().filter(|(index, _)| pair.eval.get(*index) != 0);
    let timers = at_power_up.filter(|(_, symbol)| symbol.kind == SymbolKind::Timer);
    let late: Vec<String> = timers.map(|(_, symbol)| symbol.name.clone()).collect();
    for scan in 1..=scans {
        for symbol in symbols.iter().filter(|symbol| symbol.kind == SymbolKind::Input) {
            if rng.one_in(3) {
                pair.drive(&symbol.name, rng.one_in(2));
            }
        }
        let mut done = pair.begin();
        if done.is_ok() {
            for symbol in symbols.iter().filter(|symbol| symbol.kind != SymbolKind::Input) {
                let is_early = scan == 1 && late.contains(&symbol.name);
                if rng.one_in(12) && !is_early {
                    let unused = 32 - 8 * u32::from(symbol.bytes.max(1));
                    let value =
                        if symbol.kind.is_bit() { rng.below(2) as i32 } else { near(&mut rng) << unused >> unused };
                    pair.set(&symbol.name, value);
                }
            }
            done = pair.end();
        }
        done.unwrap_or_else(|how| panic!("seed {seed}, scan {scan}: {how}\n{text}\n{}", pair.listing()));
    }
    true
}

/// A count, usually near a limit.
fn near(rng: &mut Rng) -> i32 {
    match rng.below(4) {
        0 => [0, 1, -1, 32_767, 32_766, -32_768, -32_767][rng.below(7) as usize],
        1 => rng.next_u64() as i16 as i32,
        _ => rng.below(8) as i32 - 2,
    }
}

#[test]
fn small_programs_agree() {
    assert_eq!((0..250).filter(|seed| agree(*seed, SMALL, true, 60)).count(), 250);
}

#[test]
fn large_programs_agree() {
    assert!((1000..1050).filter(|seed| agree(*seed, LARGE, true, 300)).count() > 40);
}

/// Dialect ldmicro-5: bounded counters that count on either edge or by level.
#[test]
fn bounded_counters_agree() {
    assert_eq!((2000..2100).filter(|seed| agree(*seed, FIVE, true, 100)).count(), 100);
}

/// Repeats the tests with unoptimised code.
#[test]
fn unoptimised_programs_agree() {
    for wish in [SMALL, FIVE] {
        assert_eq!((3000..3060).filter(|seed| agree(*seed, wish, false, 60)).count(), 60);
    }
}
