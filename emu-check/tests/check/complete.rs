//! A program is compiled completely or refused: on a chip of every family, optimised or not, the map contains
//! every element, rung and symbol of the examples and of random programs, in order and without gaps.
//! EMU_MAPS_SEED selects other random programs.

use crate::common;
use emu_check::fuzz::{FAMILIES, generate_program};
use ladder::{LadderProgram, ProgramElement};
use ladder_compile::{CompileOptions, CompiledProgram, ImageMap, compile};

/// Number of random programs.
const PROGRAMS: u64 = 300;

#[test]
fn every_element_of_the_examples_is_in_the_map() {
    let programs = common::folder("../examples").into_iter().chain(common::folder("tests/programs"));
    let programs: Vec<(String, LadderProgram)> =
        programs.map(|path| (path.display().to_string(), common::read(&path))).collect();
    assert!(programs.len() >= 9, "only {} programs", programs.len());
    for (name, program) in &programs {
        on_every_family(name, program);
    }
}

#[test]
fn every_element_of_random_programs_is_in_the_map() {
    let seed = std::env::var("EMU_MAPS_SEED").ok().and_then(|text| text.parse().ok()).unwrap_or(1);
    let mut complete = [0; FAMILIES.len()];
    for number in 0..PROGRAMS {
        let (program, _) = generate_program(seed, number);
        let compiled = on_every_family(&format!("seed {seed}, program {number}"), &program);
        complete.iter_mut().zip(compiled).for_each(|(all, one)| *all += u64::from(one));
    }
    println!("{FAMILIES:?}: {complete:?} of {PROGRAMS} complete, the others refused");
    // The AP101 has no integers, so it refuses more than half of the programs.
    for (mcu, (complete, least)) in FAMILIES.iter().zip(complete.into_iter().zip([150, 150, 150, 50])) {
        assert!(complete >= least, "seed {seed}, {mcu}: only {complete} are complete");
    }
}

/// Whether each family compiles the program, both with and without optimisation.
fn on_every_family(name: &str, program: &LadderProgram) -> [bool; FAMILIES.len()] {
    FAMILIES.map(|mcu| {
        [true, false].into_iter().all(|optimise| {
            let of = format!("{name} on {mcu}, optimised {optimise}\n{}", ladder::write(program));
            match compile(program, &CompileOptions { mcu: mcu.to_owned(), optimise, ..CompileOptions::default() }) {
                Ok(compiled) => {
                    complete(&of, program, &compiled);
                    true
                }
                Err(refusals) => {
                    assert!(!refusals.is_empty(), "{of}: refused without a reason");
                    let internal = refusals.iter().find(|refusal| refusal.code == "LC099");
                    assert_eq!(internal, None, "{of}");
                    false
                }
            }
        })
    })
}

fn complete(of: &str, program: &LadderProgram, compiled: &CompiledProgram) {
    let map = &compiled.map;
    let listed: Vec<(u32, u32, &str)> =
        map.elements.iter().map(|e| (e.rung - 1, e.element - 1, e.text.as_str())).collect();
    let texts: Vec<(u32, u32, String)> = program
        .elements()
        .map(|ProgramElement { id, element, .. }| (id.rung, id.index, ladder::element_text(element)))
        .collect();
    let wanted: Vec<(u32, u32, &str)> =
        texts.iter().map(|(rung, index, text)| (*rung, *index, text.as_str())).collect();
    assert_eq!(listed, wanted, "{of}: elements");
    let found: Vec<&str> = map.symbols.iter().map(|s| s.name.as_str()).collect();
    let symbols = program.symbols();
    assert_eq!(found, symbols.iter().map(|s| s.name.as_str()).collect::<Vec<_>>(), "{of}: symbols");
    assert_eq!(map.rungs.len(), program.rungs.len(), "{of}: rungs");
    let mut at = map.rungs.first().map_or(0, |rung| rung.start);
    assert!(map.scan_start <= at, "{of}: rungs before the scan");
    for rung in &map.rungs {
        assert_eq!(rung.start, at, "{of}: rung {} follows the one before", rung.rung);
        for element in map.elements.iter().filter(|element| element.rung == rung.rung) {
            assert_eq!(element.start, at, "{of}: {} follows the element before", element.text);
            assert!(element.end >= element.start, "{of}: {} ends before it begins", element.text);
            at = element.end;
        }
        assert_eq!(rung.end, at, "{of}: rung {} ends with its last element", rung.rung);
    }
    assert!(at <= map.scan_end && map.scan_end < map.code_bytes, "{of}: rungs behind the scan");
    let text = serde_json::to_string(map).expect("JSON");
    assert_eq!(&serde_json::from_str::<ImageMap>(&text).expect("reads back"), map, "{of}");
}
