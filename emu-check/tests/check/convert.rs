//! Programs of LDmicro as Instruction List compute the same bits in every scan.

use std::collections::{BTreeMap, HashSet};

use diag::Pos;
use emu_check::fuzz::generate_program;
use emu_core::rng::Rng;
use ladder::convert::{ConvertedLadder, to_instruction_list, to_ldmicro};
use ladder::il::{IlProgram, il_settings, read, to_ladder, write};
use ladder::{Element, LadderDialect, LadderProgram, ParseOptions, RungNode, SymbolKind};
use ladder_eval::Evaluator;

const SEED: u64 = 27;
const SCANS: usize = 300;

/// Reads what the generator wrote, so that every element has its position.
fn generated(number: u64) -> LadderProgram {
    let program = generate_program(SEED, number).0;
    let text = ladder::write(&program);
    let options = ParseOptions { dialect: Some(program.dialect) };
    ladder::parse_with("random.ld", &text, options)
        .unwrap_or_else(|faults| panic!("{number}: {faults:?}\n{text}"))
        .program
}

/// Puts SHORT in the place of the elements at some positions.
fn shorten(series: &mut [RungNode], positions: &HashSet<Pos>) {
    for node in series {
        match node {
            RungNode::Leaf(element, pos) if positions.contains(pos) => *element = Element::Short,
            RungNode::Leaf(..) => {}
            RungNode::Parallel(branches, _) => branches.iter_mut().for_each(|branch| shorten(branch, positions)),
        }
    }
}

/// Converts a program; elements that cannot be expressed become SHORT.
fn converted(program: &mut LadderProgram) -> (ladder::convert::ConvertedProgram, usize) {
    let mut refused = 0;
    loop {
        match to_instruction_list(program) {
            Ok(converted) => return (converted, refused),
            Err(faults) => {
                let positions: HashSet<Pos> =
                    faults.iter().filter(|fault| fault.is_error()).map(|fault| fault.pos).collect();
                refused += positions.len();
                assert!(refused < 10_000, "{faults:?}");
                program.rungs.iter_mut().for_each(|rung| shorten(&mut rung.series, &positions));
            }
        }
    }
}

fn resolved(program: &IlProgram, cycle_us: u64) -> LadderProgram {
    let faults = |faults| panic!("{faults:?}\n{}", write(program));
    to_ladder(program, il_settings(cycle_us)).unwrap_or_else(faults).program
}

/// Returns the first difference between a program and its conversion over random inputs.
fn first_difference(
    source: &LadderProgram,
    il: &LadderProgram,
    renamed: &[(String, String)],
    seed: u64,
) -> Option<String> {
    let mut first = Evaluator::new(source).unwrap_or_else(|fault| panic!("{fault}"));
    let mut second = Evaluator::new(il).unwrap_or_else(|fault| panic!("{fault}"));
    let name = |name: &str| renamed.iter().find(|(from, _)| from == name).map_or(name.to_owned(), |(_, to)| to.clone());
    let pairs: Vec<(usize, usize)> = first
        .symbols()
        .iter()
        .enumerate()
        .filter_map(|(index, symbol)| Some((index, second.index(&name(&symbol.name))?)))
        .collect();
    // A relay that only conditions without effect read may be gone.
    for (index, symbol) in first.symbols().iter().enumerate() {
        let is_pin = matches!(symbol.kind, SymbolKind::Input | SymbolKind::Output);
        assert!(!is_pin || pairs.iter().any(|(from, _)| *from == index), "{} is not in the result", symbol.name);
    }
    let mut rng = Rng::new(seed);
    for scan in 0..SCANS {
        let period = 1 + rng.below(6);
        for (from, to) in &pairs {
            if first.symbols()[*from].is_given && rng.one_in(period) {
                let value = rng.below(2) as i32;
                first.set(*from, value);
                second.set(*to, value);
            }
        }
        first.scan();
        second.scan();
        for (from, to) in &pairs {
            let (a, b) = (first.get(*from), second.get(*to));
            if a != b {
                let symbol = &first.symbols()[*from];
                return Some(format!("scan {scan}: {} is {a} in LDmicro and {b} in Instruction List", symbol.name));
            }
        }
    }
    None
}

/// Converts some programs, and compares the results with what they were made of. Returns how many elements
/// were compared, and how many had none like them.
fn compare(numbers: impl Iterator<Item = u64>, accept: impl Fn(&LadderProgram) -> bool) -> (usize, usize) {
    let (mut compared, mut all_refused) = (0, 0);
    for number in numbers {
        let mut program = generated(number);
        if !accept(&program) {
            continue;
        }
        let (il, refused) = converted(&mut program);
        all_refused += refused;
        // The text is read back, so its syntax and its types are checked too.
        let text = write(&il.program);
        let again = read("random.il", &text).unwrap_or_else(|faults| panic!("{number}: {faults:?}\n{text}")).program;
        assert_eq!(again.clone().without_positions(), il.program.clone().without_positions(), "{number}");
        let result = resolved(&again, program.settings.cycle_us);
        if let Some(difference) = first_difference(&program, &result, &il.renamed, number) {
            panic!("seed {SEED}, program {number}: {difference}\n{}\n{text}", ladder::write(&program));
        }
        compared += program.elements().count() - refused;
    }
    (compared, all_refused)
}

#[test]
fn release_2_3_keeps_its_meaning() {
    let (compared, refused) = compare(0..400, |program| program.dialect == LadderDialect::Ldmicro23);
    assert!(compared > 2000 && refused < compared / 4, "{compared}, {refused}");
}

#[test]
fn ldmicro_5_keeps_its_meaning() {
    let (compared, refused) = compare(0..400, |program| program.dialect == LadderDialect::Ldmicro5);
    assert!(compared > 2000 && refused < compared / 4, "{compared}, {refused}");
}

/// Writes a program of LDmicro, reads it back and compares it with a source over random inputs.
fn compare_ladder(title: &str, source: &LadderProgram, ladder: &ConvertedLadder, renamed: &[(String, String)]) {
    let text = ladder::write(&ladder.program);
    let again = ladder::parse("back.ld", &text).unwrap_or_else(|faults| panic!("{title}: {faults:?}\n{text}")).program;
    assert!(
        ladder::check(&again).iter().all(|fault| !fault.is_error()),
        "{title}: {:?}\n{text}",
        ladder::check(&again)
    );
    if let Some(difference) = first_difference(source, &again, renamed, 1) {
        panic!("{title}: {difference}\n{}\n{text}", ladder::write(source));
    }
}

#[test]
fn back_from_instruction_list_keeps_its_meaning() {
    let mut elements = 0;
    'programs: for number in 0..300 {
        let mut program = generated(number);
        // What either direction cannot express becomes SHORT.
        let (there, back) = loop {
            let (there, _) = converted(&mut program);
            let result = to_ldmicro(&resolved(&there.program, program.settings.cycle_us));
            match result {
                Ok(back) => break (there, back),
                Err(faults) => {
                    let positions: HashSet<Pos> = faults.iter().map(|fault| fault.pos).collect();
                    if faults.iter().any(|fault| fault.cause.contains("more than 2000 rungs")) {
                        continue 'programs;
                    }
                    let before = program.clone();
                    program.rungs.iter_mut().for_each(|rung| shorten(&mut rung.series, &positions));
                    // A fault of a declaration has no element: without counters everything begins with 0.
                    assert!(
                        program != before || positions.contains(&Pos::default()),
                        "{faults:?}{}{}",
                        ladder::write(&program),
                        write(&there.program)
                    );
                    if program == before {
                        program.rungs.iter_mut().for_each(|rung| rung.series.retain(|node| !is_counter(node)));
                    }
                }
            }
        };
        let both = |name: &String| {
            let il = there.renamed.iter().find(|(from, _)| from == name).map_or(name, |(_, to)| to);
            back.renamed.iter().find(|(from, _)| from == il).map_or(il, |(_, to)| to).clone()
        };
        let names =
            program.symbols().into_iter().map(|symbol| (symbol.name.clone(), both(&symbol.name))).collect::<Vec<_>>();
        compare_ladder(&format!("program {number}"), &program, &back, &names);
        elements += program.elements().filter(|at| *at.element != Element::Short).count();
    }
    assert!(elements > 1000, "{elements}");
}

fn is_counter(node: &RungNode) -> bool {
    match node {
        RungNode::Leaf(Element::Counter { .. } | Element::Timer { .. }, _) => true,
        RungNode::Leaf(..) => false,
        RungNode::Parallel(branches, _) => branches.iter().flatten().any(is_counter),
    }
}

#[test]
fn instruction_list_as_ladder_keeps_its_meaning() {
    let (mut converted, mut refused) = (0, BTreeMap::new());
    for (title, program) in super::instruction_list::programs() {
        match to_ldmicro(&program) {
            Ok(ladder) => {
                compare_ladder(&title, &program, &ladder, &ladder.renamed);
                converted += 1;
            }
            Err(faults) => *refused.entry(faults[0].cause.clone()).or_insert(0) += 1,
        }
    }
    assert!(converted >= 40, "{converted} {refused:#?}");
}
