//! Small random programs on all four families: image and evaluator agree. In contrast to `random.rs`,
//! proptest shrinks a program that fails, and prints the smallest one.

use crate::common;
use emu_check::{CheckOptions, check};
use proptest::prelude::*;
use proptest::sample::select;

const INPUTS: &[&str] = &["Xa", "Xb", "Xc"];
const COILS: &[&str] = &["Ya", "Yb", "Ra"];
/// One chip of each family.
const CHIPS: &[&str] = &["atmega328p", "pic16f877", "at89s52", "ap101"];

/// Returns contacts and elements that all families have, as `.ld` text of one element.
fn condition() -> impl Strategy<Value = String> {
    let names = select([INPUTS, COILS].concat());
    let contact = (names, 0..2u8).prop_map(|(name, negated)| format!("CONTACTS {name} {negated}"));
    let edge = select(vec!["OSR", "OSF"]).prop_map(str::to_owned);
    // Timers and counters get names of their own by `number_instances`.
    let timer =
        (select(vec!["TON", "TOF", "RTO"]), 2..5u32).prop_map(|(kind, scans)| format!("{kind} T# {}", scans * 1000));
    let counter = (select(vec!["CTU", "CTD"]), 1..4i32).prop_map(|(kind, max)| format!("{kind} C# {max}"));
    prop_oneof![6 => contact, 1 => edge, 1 => timer, 1 => counter]
}

/// Returns elements in series, some of which are parallel circuits.
fn series() -> impl Strategy<Value = String> {
    let leaf = condition().prop_map(|text| text + "\n");
    leaf.prop_recursive(3, 12, 3, |inner| {
        let series = prop::collection::vec(inner.clone(), 1..3).prop_map(|parts| parts.concat());
        let parallel = prop::collection::vec(series, 2..4).prop_map(|branches| {
            let branches: String = branches.iter().map(|branch| format!("SERIES\n{branch}END\n")).collect();
            format!("PARALLEL\n{branches}END\n")
        });
        (inner, parallel).prop_map(|(first, rest)| first + &rest)
    })
}

fn rung() -> impl Strategy<Value = String> {
    let coil = (select(COILS), select(vec!["0 0 0", "1 0 0", "0 1 0", "0 0 1"]));
    (series(), coil).prop_map(|(series, (name, kind))| format!("RUNG\n{series}COIL {name} {kind}\nEND\n"))
}

/// Replaces each `#` in the names of timers and counters by a number of its own.
fn number_instances(text: &str) -> String {
    let mut parts = text.split('#');
    let first = parts.next().unwrap_or_default().to_owned();
    parts.enumerate().fold(first, |text, (n, part)| format!("{text}{n}{part}"))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn small_programs_agree_on_all_families(rungs in prop::collection::vec(rung(), 1..4), seed in any::<u64>()) {
        let text = number_instances(&rungs.concat());
        let program = common::rungs("small.ld", &text);
        for chip in CHIPS {
            let clock_hz = Some(if *chip == "ap101" { 1_000_000 } else { 16_000_000 });
            let options = CheckOptions { mcu: (*chip).to_owned(), scans: 60, seed, clock_hz, ..CheckOptions::default() };
            let report = check(&program, &options, &mut |_, _| {});
            let report = report.map_err(|faults| TestCaseError::fail(format!("{chip}: {faults:?}\n{text}")))?;
            prop_assert!(report.agreed, "{}:\n{}\n{}", chip, text, report.text());
        }
    }
}
