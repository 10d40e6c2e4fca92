//! The kill table: compilers with one fault each, for every family, and which of them a check with its defaults finds.
//!
//! `UPDATE=1 cargo test --release -p emu-check --features mutants --test kill -- --ignored` writes docs/kill.md anew; without
//! UPDATE the page must be what is found. Reasons for survivors stand in kill.txt: `chip | program | fault | reason`.
#![cfg(feature = "mutants")]

mod common;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::fs;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use emu_check::fuzz::{FAMILIES, own_seed, program};
use emu_check::{Options, check_compiled};
use ladder::Program;
use ladder_compile::{Mutant, MutantKind, compile, compile_mutant, mutants, target};

/// Faults of one sort that are taken from one example, spread evenly.
const EACH: usize = 6;

/// Random programs, with one fault each.
const RANDOM: usize = 200;

/// Least faults of a back end, and least share of them that is found, in percent.
const LEAST: (usize, usize) = (200, 97);

/// Seed of the random programs.
const SEED: u64 = 1;

const REASONS: &str = include_str!("kill.txt");

/// One fault of one program on one chip.
struct Case<'a> {
    mcu: &'static str,
    program: &'a Program,
    seed: u64,
    mutant: Mutant,
}

/// What a check says to it.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Verdict {
    Found,
    Survives,
    /// The image is that of the sound compiler, so there is no fault.
    Same,
}

fn target_options(mcu: &str) -> ladder_compile::Options {
    ladder_compile::Options { mcu: mcu.to_owned(), ..Default::default() }
}

/// The cases of one chip: some faults of every sort of each example, and one fault of each random program.
fn cases<'a>(mcu: &'static str, examples: &'a [Program], random: &'a [(u64, Program)]) -> Vec<Case<'a>> {
    let mut cases = Vec::new();
    for program in examples {
        let mut sorts: BTreeMap<MutantKind, Vec<Mutant>> = BTreeMap::new();
        mutants(program, &target_options(mcu)).into_iter().for_each(|m| sorts.entry(m.kind).or_default().push(m));
        for all in sorts.into_values() {
            let step = all.len().div_ceil(EACH).max(1);
            let some = all.into_iter().step_by(step);
            cases.extend(some.map(|mutant| Case { mcu, program, seed: Options::default().seed, mutant }));
        }
    }
    for (number, program) in random {
        let seed = own_seed(SEED, *number);
        let all = mutants(program, &target_options(mcu));
        let at = (seed % all.len().max(1) as u64) as usize;
        cases.extend(all.into_iter().nth(at).map(|mutant| Case { mcu, program, seed, mutant }));
    }
    cases
}

fn verdict(case: &Case<'_>) -> Verdict {
    let target = target_options(case.mcu);
    // What the compiler itself refuses is found.
    let Ok(faulty) = compile_mutant(case.program, &target, case.mutant.id) else { return Verdict::Found };
    let sound = compile(case.program, &target).expect("it has mutants");
    if (&sound.hex, &sound.map) == (&faulty.hex, &faulty.map) {
        return Verdict::Same;
    }
    let options = Options { mcu: case.mcu.to_owned(), seed: case.seed, ..Options::default() };
    match check_compiled(case.program, &faulty, &options, &mut |_, _| {}) {
        Ok(report) if report.agreed => Verdict::Survives,
        _ => Verdict::Found,
    }
}

/// The verdicts, in the order of the cases.
fn verdicts(cases: &[Case<'_>]) -> Vec<Verdict> {
    let (next, found) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                while let Some((at, case)) =
                    Some(next.fetch_add(1, Ordering::Relaxed)).and_then(|at| Some((at, cases.get(at)?)))
                {
                    let verdict = verdict(case);
                    found.lock().expect("a lock").push((at, verdict));
                }
            });
        }
    });
    let mut found = found.into_inner().expect("a lock");
    found.sort_unstable();
    found.into_iter().map(|(_, verdict)| verdict).collect()
}

/// The first random programs that a chip can express.
fn random(mcu: &str) -> Vec<(u64, Program)> {
    let target = target(mcu).expect("a chip");
    let drawn = (0..).map(|number| (number, program(SEED, number)));
    let fits = drawn.filter(|(_, (_, profile))| profile.fits(target)).map(|(number, (drawn, _))| {
        let name = format!("random {number}");
        (number, common::parse(&name, &ladder::write(&drawn)))
    });
    fits.filter(|(_, program)| compile(program, &target_options(mcu)).is_ok()).take(RANDOM).collect()
}

#[test]
#[ignore = "takes minutes; it is what writes docs/kill.md"]
fn kill_table() {
    let examples: Vec<Program> = common::folder("../examples")
        .iter()
        .map(|path| {
            let mut program = common::read(path);
            program.file = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
            program
        })
        .collect();
    let mut page = HEAD.to_owned();
    let (mut survivors, mut listed) = (String::new(), BTreeSet::new());
    let mut low = Vec::new();
    for mcu in FAMILIES {
        let random = random(mcu);
        let cases = cases(mcu, &examples, &random);
        let verdicts = verdicts(&cases);
        let mut sorts: BTreeMap<String, [usize; 3]> = BTreeMap::new();
        for (case, verdict) in cases.iter().zip(&verdicts) {
            let name = format!("{:?}", case.mutant.kind);
            [name, "all".to_owned()]
                .into_iter()
                .for_each(|name| sorts.entry(name).or_default()[*verdict as usize] += 1);
            if *verdict == Verdict::Survives {
                let Mutant { element, what, .. } = &case.mutant;
                let place = element.map_or_else(String::new, |id| format!("{id}: "));
                let fault = format!("{mcu} | {} | {place}{what}", case.program.file);
                let reason = REASONS.lines().find_map(|line| line.strip_prefix(&fault)?.strip_prefix(" | "));
                listed.insert(fault.clone());
                let reason = reason.unwrap_or("not explained: a gap until it is");
                _ = writeln!(survivors, "| {} | {reason} |", fault.replace(" | ", " / ").replace('|', "\\|"));
            }
        }
        for (sort, [found, survive, same]) in &sorts {
            let faults = found + survive;
            let share = 100.0 * *found as f64 / faults.max(1) as f64;
            _ = writeln!(page, "| {mcu} | {sort} | {faults} | {found} | {share:.1} | {same} |");
        }
        let [found, survive, _] = sorts.get("all").copied().unwrap_or_default();
        if found + survive < LEAST.0 || found * 100 < (found + survive) * LEAST.1 {
            low.push(format!("{mcu}: {found} of {}", found + survive));
        }
    }
    let stale = REASONS.lines().filter(|line| !line.is_empty() && !line.starts_with('#'));
    let stale: Vec<&str> = stale.filter(|line| !listed.iter().any(|fault| line.starts_with(fault.as_str()))).collect();
    page += &format!("{SURVIVORS}{survivors}\n{HISTORY}");
    page.extend(history());
    page += OTHERS;
    let path = common::beside("../docs/kill.md");
    if std::env::var("UPDATE").is_ok() {
        fs::write(&path, &page).expect("docs/kill.md");
    }
    assert_eq!(fs::read_to_string(&path).unwrap_or_default(), page, "docs/kill.md; UPDATE=1 writes it");
    assert!(low.is_empty() && stale.is_empty(), "too few: {low:?}\nlisted, but found: {stale:#?}");
}

/// The rows of kill_history.txt for people.
fn history() -> impl Iterator<Item = String> {
    let rows = include_str!("kill_history.txt").lines().filter(|row| !row.is_empty() && !row.starts_with('#'));
    rows.filter_map(|row| {
        let mut columns = row.split(" | ").map(str::trim);
        let (id, what, chip) = (columns.next()?, columns.next()?, columns.next()?);
        // As in kill_history.rs, which fails when this is no longer so.
        let found = if id == "L7" { "a gap" } else { "found" };
        Some(format!("| {id} | {what} | {found}, on {chip} |\n"))
    })
}

const HEAD: &str = "# What a check finds

Compilers with one fault each, enumerated mechanically (`ladder_compile::mutants`), and what `emu check` with its defaults says to their images. Written by

```
UPDATE=1 cargo test --release -p emu-check --features mutants --test kill -- --ignored
```

For each family's chip: of every sort of fault six of each example that the chip can hold, spread over all of them, and one fault of each of 200 random programs
(`emu fuzz`, seed 1), each checked for 2,000 scans or to the first difference. A fault after which the image and its map are the same, bit for bit, is no
fault and counts in the last column only.

| chip | sort | faults | found | % | same image |
|---|---|---|---|---|---|
";

const SURVIVORS: &str = "
## Survivors

| fault | reason |
|---|---|
";

const HISTORY: &str = "## Historic faults

Faults that ladder compilers have had, made again: `emu-check/tests/kill_history.txt` holds for each a program and what the faulty compiler made of it, and the test beside
it checks that the one's image does not pass for the other's.

| id | fault | here |
|---|---|---|
";

const OTHERS: &str = "| L4 | a failed compile leaves a HEX file without its end | no mutant: results are written whole or not at all, and an image that does not load is refused (EC) |
| L10 | outputs glitch high at start-up | found: mutants that leave out instructions of reset; a pin is compared before the first scan |
| L11 | the serial line locks after a framing error | a gap: no framing errors are driven |
| L12 | directions of a port are never set | found: `no-direction` in `emu-check/tests/faults.txt`, and mutants of reset |
| L16 | a scan is one tick short | found: mutants of the period |
| L20 | banks of RAM are not cleared | found: mutants of reset; RAM is random at power-up |
| L21 | jumps across pages | checked by programs over 2K words in every campaign; no mutant |
| L22 | bit instructions on registers beyond their reach | checked on the chips that have such ports (`emu check --mcu all`); no mutant |
| L23 | half of a large HEX file is lost | no mutant: programs of that size need more than the campaign's chips |
| M2, V2, S1 to S6 | steps, blocks with reload, texts of reference documents | not expressible in the language, or facts of documents |
";
