//! Periods longer than the range of the timers: image and evaluator agree, and every scan starts with its
//! timer match.

use crate::common;
use emu_check::{CheckOptions, check};

/// Rows are (chip, clock in Hz, cycle in microseconds).
#[rustfmt::skip]
const AGREE: &[(&str, u64, u64)] = &[
    ("8051",       12_000_000,     65_537),
    ("8051",       11_059_200,     70_000),
    ("8052",       12_000_000,    140_000),
    ("8052",       11_059_200,  1_000_000),
    ("8051",       12_000_000, 10_000_000),
    ("pic16f873",   4_000_000,     65_537),
    ("pic16f873",   4_000_000,     70_000),
    ("pic16f873",   3_579_545,    140_000),
    ("pic16f873",   4_000_000,  1_000_000),
    ("pic16f873",   3_579_545,  1_000_000),
    ("pic16f873",  20_000_000, 10_000_000),
    ("atmega328p", 16_000_000,     65_537),
    ("atmega328p", 11_059_200,     70_000),
    ("atmega328p", 16_000_000,    140_000),
    ("atmega328p", 16_000_000,  1_000_000),
    ("atmega328p",  4_000_000, 10_000_000),
];

/// Rows are (chip, clock in Hz, cycle in microseconds, part of the message with the longest possible period).
#[rustfmt::skip]
const REFUSED: &[(&str, u64, u64, &str)] = &[
    ("atmega328p", 16_000_000,    10_000_000, "at most 4194304 us"),
    ("8051",       12_000_000,    20_000_000, "at most 16711680 us"),
    ("pic16f873",   4_000_000, 4_300_000_000, "at most 4294967294 us"),
];

fn checked(mcu: &str, clock: u64, cycle: u64) -> Result<emu_check::CheckReport, Vec<diag::Diagnostic>> {
    let text = format!(
        "LDmicro0.1\nCYCLE={cycle}\nCRYSTAL={clock}\nIO LIST\nEND\nPROGRAM\nRUNG\nCONTACTS Xa 0\nTON Ta {}\nCOIL Yb 0 0 0\nEND\n\
         RUNG\nCONTACTS Xb 0\nOSR\nADD d d 3\nEND\nRUNG\nGRT d 6\nCOIL Yc 0 0 0\nEND\n",
        3 * cycle
    );
    let options = CheckOptions { mcu: mcu.to_owned(), scans: 5, ..CheckOptions::default() };
    check(&common::parse("period.ld", &text), &options, &mut |_, _| {})
}

#[test]
fn long_periods_agree() {
    for &(mcu, clock, cycle) in AGREE {
        let report =
            checked(mcu, clock, cycle).unwrap_or_else(|faults| panic!("{mcu}, {clock} Hz, {cycle} us: {faults:?}"));
        assert!(report.agreed, "{mcu}, {clock} Hz, {cycle} us: {}", report.text());
    }
}

#[test]
fn longer_ones_are_refused_with_the_longest() {
    for &(mcu, clock, cycle, words) in REFUSED {
        let Err(faults) = checked(mcu, clock, cycle) else { panic!("{mcu}, {clock} Hz, {cycle} us is not refused") };
        assert!(faults.iter().any(|fault| fault.cause.contains(words)), "{mcu}, {clock} Hz, {cycle} us: {faults:?}");
    }
}
