//! Measures what a check finds: compilers with one fault each, for a chip of every family; a check with
//! default options must distinguish their images from correct ones. See `docs/kill.md`.
//!
//! `EMU_BLESS=1 cargo test --release --workspace --test kill -- --ignored` updates the
//! figures of docs/kill.md and the survivors in kill.txt. Known reasons are kept; a survivor without a reason
//! gets `?`.

#[path = "kill/campaign.rs"]
mod campaign;
mod common;
#[path = "kill/page.rs"]
mod page;
#[path = "kill/proof.rs"]
mod proof;

use std::fs;

use campaign::{FaultVerdict, SampleSize, run_campaign};
use emu_check::fuzz::FAMILIES;
use page::{SurvivorList, table};

/// The sample of the whole table.
const FULL_SIZE: SampleSize =
    SampleSize { per_kind: 3, random_programs: 200, kinds_per_random_program: 1, recheck_survivors: false };

/// The sample of an ordinary test run.
const QUICK_SIZE: SampleSize =
    SampleSize { per_kind: 1, random_programs: 12, kinds_per_random_program: 1, recheck_survivors: false };

/// Minimum number of faults per back end in the whole table.
const MIN_FAULTS: usize = 200;

/// Minimum share of faults that is found, in percent.
const MIN_SHARE_PERCENT: f64 = 97.0;

/// Some faults of every sort on every chip.
#[test]
fn faults_are_found() {
    let samples = run_campaign(&FAMILIES, QUICK_SIZE);
    let survivors = SurvivorList::read();
    for mcu in FAMILIES {
        let cases: Vec<_> = samples.iter().flat_map(|sample| &sample.cases).filter(|case| case.mcu == mcu).collect();
        let survive = cases.iter().filter(|case| case.verdict == FaultVerdict::Survives);
        let unknown: Vec<&str> =
            survive.map(|case| &*case.name).filter(|name| survivors.reason(name).is_none()).collect();
        println!("{mcu}: {} faults, {} of them not found and not listed", cases.len(), unknown.len());
        assert!(cases.len() >= 40, "{mcu}: only {} faults", cases.len());
        // The selection of faults depends on the image, so a new fault may be equivalent to the correct
        // compiler.
        assert!(unknown.len() * 100 <= cases.len() * 3, "{mcu}: not found, and not in kill.txt: {unknown:#?}");
    }
}

#[test]
#[ignore = "takes minutes; it is what writes the figures of docs/kill.md"]
fn kill_table() {
    let update = std::env::var("EMU_BLESS").is_ok();
    let samples = run_campaign(&FAMILIES, SampleSize { recheck_survivors: update, ..FULL_SIZE });
    let path = common::beside("../docs/kill.md");
    let page = fs::read_to_string(&path).expect("docs/kill.md");
    let mut survivors = SurvivorList::read();
    survivors.update(samples.iter().flat_map(|sample| &sample.cases));
    let shares = page::shares(&samples, &survivors);
    let table = table(&samples, &survivors);
    println!("{table}");
    if update {
        survivors.write();
        fs::write(&path, page::with_figures(&page, &table, &survivors)).expect("docs/kill.md");
    }
    for (mcu, (faults, share)) in shares {
        assert!(faults >= MIN_FAULTS, "{mcu}: {faults} faults");
        assert!(share >= MIN_SHARE_PERCENT, "{mcu}: {share:.1} % found");
        let stated = page::stated_share(&page, mcu);
        assert!(
            stated.is_none_or(|stated| share > stated - 0.1),
            "{mcu}: {share:.1} % found, docs/kill.md says {stated:?}"
        );
    }
    let unexplained = survivors.unexplained();
    assert!(unexplained.is_empty(), "not found, and without a reason in kill.txt: {unexplained:#?}");
}
