//! Runs programs on the emulated core scan by scan and compares them with a table, written by hand from the
//! meaning of the elements.

use crate::common::{CompiledChip, cases, compiled, pairs, program};
use emu_core::RamInit;

#[test]
fn every_scan_leaves_what_the_table_says() {
    for table in [include_str!("data/bits.txt"), include_str!("data/timers.txt"), include_str!("data/integers.txt")] {
        for (name, sections) in cases(table) {
            let [text, scans] = sections.as_slice() else { panic!("{name}: a program and its scans") };
            let compiled = compiled(&program(text));
            let mut chip = CompiledChip::new(&compiled, RamInit::Random(7));
            for symbol in &compiled.map.symbols {
                assert_eq!(chip.get(&symbol.name), 0, "{name}: {} after reset", symbol.name);
            }
            for (number, line) in scans.lines().filter(|l| !l.trim().is_empty()).enumerate() {
                let (given, wanted) = line.split_once("->").unwrap_or_else(|| panic!("{name}: `{line}` has an arrow"));
                let (times, given) = match given.trim().split_once('*') {
                    Some((times, rest)) => (times.trim().parse().expect("a number of scans"), rest),
                    None => (1, given),
                };
                for _ in 0..times {
                    let clocks = chip.scan(&pairs(given));
                    let worst = u64::from(compiled.map.worst_scan_cycles);
                    assert!(clocks <= worst, "{name}, line {}: {clocks} clocks, worst is {worst}", number + 1);
                }
                for (symbol, value) in pairs(wanted) {
                    assert_eq!(chip.get(&symbol), value, "{name}, line {}: {symbol} in `{line}`", number + 1);
                }
            }
        }
    }
}
