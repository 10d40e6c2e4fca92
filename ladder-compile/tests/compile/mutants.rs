//! Enumerates the mutants of the table programs and counts how many of them the tables detect.
//!
//! Some faults change nothing (such as a constant one off in a comparison that is decided elsewhere), so not
//! all can be detected. The detected share must not fall.

use std::collections::BTreeSet;

use crate::common::{CompiledChip, cases, options, pairs, program};
use emu_core::RamInit;
use ladder_compile::{CompiledProgram, MutantKind, compile, compile_mutant, mutants};

#[test]
fn faults_are_many_and_the_tables_find_most() {
    let (mut all, mut found) = (0u32, 0u32);
    let mut kinds = BTreeSet::new();
    for table in [include_str!("data/bits.txt"), include_str!("data/timers.txt"), include_str!("data/integers.txt")] {
        for (name, sections) in cases(table) {
            let program = program(&sections[0]);
            let sound = compile(&program, &options()).expect("compiles");
            assert!(agrees(&sound, &sections[1]), "{name}");
            let list = mutants(&program, &options());
            for (n, mutant) in list.iter().enumerate() {
                assert_eq!(mutant.id as usize, n, "{name}: ids count from 0");
                kinds.insert(mutant.kind);
                // The tables test only rungs, scan by scan, and every third fault is sufficient.
                if mutant.kind != MutantKind::Operation || n % 3 != 0 {
                    continue;
                }
                let faulty = compile_mutant(&program, &options(), mutant.id).expect("compiles");
                all += 1;
                let hit = !agrees(&faulty, &sections[1]);
                found += u32::from(hit);
                if !hit {
                    println!("not found: {name}, {:?}: {}", mutant.element, mutant.description);
                }
            }
            let unknown = compile_mutant(&program, &options(), list.len() as u32).expect("compiles");
            assert_eq!(unknown.code, sound.code, "{name}: a number beyond the last changes nothing");
        }
    }
    println!("{found} of {all} faults are found by the tables");
    assert_eq!(kinds.len(), 8, "every kind of fault: {kinds:?}");
    assert!(all >= 150, "{all} faults");
    assert!(found * 100 >= all * 85, "{found} of {all}");
}

fn agrees(compiled: &CompiledProgram, scans: &str) -> bool {
    let mut chip = CompiledChip::new(compiled, RamInit::Random(7));
    scans.lines().filter(|l| !l.trim().is_empty()).all(|line| {
        let (given, wanted) = line.split_once("->").expect("an arrow");
        chip.scan(&pairs(given));
        pairs(wanted).iter().all(|(symbol, value)| chip.get(symbol) == *value)
    })
}
