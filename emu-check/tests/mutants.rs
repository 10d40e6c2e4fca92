//! Compilers with one fault each: a check with default options finds them. `mutants.txt` lists the faults
//! that are not found, with the reason why the image has the same meaning. The test fails for an unlisted
//! fault that is not found, and for a listed fault that is found.

mod common;

use std::collections::{BTreeMap, BTreeSet};

use emu_check::fuzz::generate_program;
use emu_check::{CheckOptions, check_compiled};
use emu_test_support::case_lines;
use ladder::LadderProgram;
use ladder_compile::{Mutant, MutantKind, compile_mutant, mutants};

/// Rows are `file | element | fault | reason`.
const LISTED: &str = include_str!("mutants.txt");

#[test]
fn faults_of_the_compiler_are_found() {
    let mut listed: BTreeMap<String, &str> = BTreeMap::new();
    for line in case_lines(LISTED) {
        let (fault, reason) = line.rsplit_once(" | ").expect("file | element | fault | reason");
        listed.insert(fault.trim().to_owned(), reason);
    }
    let (mut tried, mut survived) = (0, Vec::new());
    for path in common::folder("tests/programs").into_iter().chain(common::folder("../examples")) {
        let program = common::read(&path);
        let file = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let target = ladder_compile::CompileOptions { mcu: options().mcu, ..Default::default() };
        let of_rungs = |mutant: &Mutant| mutant.kind == MutantKind::Operation;
        for mutant in mutants(&program, &target).into_iter().filter(of_rungs) {
            tried += 1;
            if agrees(&program, &mutant) {
                let element = mutant.element.map_or_else(String::new, |id| id.to_string());
                survived.push(format!("{file} | {element} | {}", mutant.description));
            }
        }
    }
    println!("{tried} faults, {} found, {} listed", tried - survived.len(), listed.len());
    let unlisted: Vec<&String> = survived.iter().filter(|fault| !listed.contains_key(*fault)).collect();
    let stale: Vec<&String> = listed.keys().filter(|fault| !survived.contains(fault)).collect();
    assert!(tried >= 40, "only {tried} faults");
    assert!(unlisted.is_empty() && stale.is_empty(), "not found: {unlisted:#?}\nlisted, but found: {stale:#?}");
}

/// Elements that become no operation of the intermediate code, so that no fault is theirs.
const NO_FAULT: [&str; 9] =
    ["COMMENT", "SHORT", "PLACEHOLDER", "LABEL", "SUBPROG", "STRING", "DELAY", "SLEEP", "CLRWDT"];

/// The faults from which the kill table is drawn are faults of every element.
#[test]
fn every_element_has_faults() {
    let mut missing: BTreeSet<&str> = ladder::element_keywords().collect();
    assert!(NO_FAULT.iter().all(|keyword| missing.remove(keyword)), "a listed element does not exist");
    // No random program has LOCK, after which nothing happens.
    let lock =
        "LDmicro0.2\nCYCLE=10000\nCRYSTAL=16000000\nIO LIST\nXa at 4\nEND\nPROGRAM\nRUNG\nCONTACTS Xa 0\nLOCK\nEND\n";
    let lock = common::parse("lock", lock);
    for program in (0..3_000).map(|number| generate_program(1, number).0).chain([lock]) {
        if !program.elements().any(|at| missing.contains(at.element.facts().keyword)) {
            continue;
        }
        let target = ladder_compile::CompileOptions { mcu: "atmega328p".to_owned(), ..Default::default() };
        for id in mutants(&program, &target).into_iter().filter_map(|mutant| mutant.element) {
            program.find_element(id).iter().for_each(|at| _ = missing.remove(at.element.facts().keyword));
        }
    }
    assert!(missing.is_empty(), "no fault in {missing:?}");
}

/// The default options; EMU_MUTANTS_SEED sets another seed, to see that the outcome does not depend on it.
fn options() -> CheckOptions {
    let seed = std::env::var("EMU_MUTANTS_SEED").ok().and_then(|text| text.parse().ok());
    CheckOptions { seed: seed.unwrap_or(CheckOptions::default().seed), ..CheckOptions::default() }
}

/// True if a check of the faulty image finds nothing. An image that the compiler itself refuses counts as
/// found.
fn agrees(program: &LadderProgram, mutant: &Mutant) -> bool {
    let options = options();
    let target = ladder_compile::CompileOptions { mcu: options.mcu.clone(), ..Default::default() };
    let Ok(compiled) = compile_mutant(program, &target, mutant.id) else { return false };
    let report = check_compiled(program, &compiled, &options, &mut |_, _| {}).expect("a report");
    if let Some(difference) = &report.difference {
        // The report must contain all that is needed to analyse the fault.
        assert!(difference.expected != difference.found, "{}", report.text());
        assert!(!difference.smallest.is_empty() && difference.smallest.len() as u64 <= difference.scan_of_run);
    }
    report.agreed
}
