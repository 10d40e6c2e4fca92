//! Tests the pacing timer on the emulated chip, without any drift.
//!
//! The k-th scan starts no earlier than the k-th match, at floor(k P) within one tick, and no later than the
//! longest iteration of the poll loop after it.

use crate::common::{CompiledChip, program};
use emu_core::{Cpu, RamInit};
use ladder_compile::{CompileOptions, compile};

/// Clock in Hz, cycle in microseconds, clocks per tick, whole ticks per period, remaining fraction of a tick.
type PacingCase = (u64, u64, u32, u32, Option<(u32, u32)>);

#[rustfmt::skip]
const CASES: &[PacingCase] = &[
    ( 4_000_000,      10_000,    1, 40_000, None),
    // 65,536 clocks are the maximum without a prescaler; one more needs the next prescaler.
    ( 1_000_000,      65_536,    1, 65_536, None),
    ( 1_000_000,      65_537,    8,  8_192, Some((1, 8))),
    (16_000_000,      10_000,    8, 20_000, None),
    (10_000_000,      50_000,    8, 62_500, None),
    // 11,059.2 and 36,863.998 clocks; 17,899.5147725 ticks; 32,767.96723.. clocks; 3,543.319.. ticks.
    (11_059_200,       1_000,    1, 11_059, Some((1, 5))),
    (15_999_999,       2_000,    1, 31_999, Some((499, 500))),
    (14_318_180,      10_001,    8, 17_899, Some((205_909, 400_000))),
    (   32_768,      999_999,    1, 32_767, Some((15_113, 15_625))),
    ( 3_579_545,       7_919,    1, 28_346, Some((83_371, 200_000))),
    // Slow ticks, whole and fractional.
    (16_000_000,     200_000,   64, 50_000, None),
    (14_000_000,   1_000_000,  256, 54_687, Some((1, 2))),
    ( 4_000_000,   4_194_304,  256, 65_536, None),
    ( 4_000_000,   4_194_305, 1024, 16_384, Some((1, 256))),
    ( 4_000_000,  16_777_216, 1024, 65_536, None),
];

#[test]
fn the_timer_is_set_as_the_table_says() {
    for &(clock, cycle, prescale, ticks, fraction) in CASES {
        let pace = ladder_compile::avr::pacing::plan_pacing(clock, cycle, 2).expect("can be paced");
        let found = (pace.prescale, pace.ticks, pace.fraction.map(|f| (f.numerator, f.denominator)));
        assert_eq!(found, (prescale, ticks, fraction), "{clock} Hz, {cycle} us");
    }
}

/// One chip of each kind: timer by STS and flags by SBIS; by OUT and IN; with other bits in its flag
/// register.
#[test]
fn scans_start_with_their_match_without_drift() {
    for mcu in ["atmega328p", "atmega8", "atmega128", "atmega162"] {
        for &(clock, cycle, ..) in CASES {
            check_scan_starts(mcu, clock, cycle);
        }
    }
}

fn check_scan_starts(mcu: &str, clock: u64, cycle: u64) {
    let text = format!(
        "LDmicro0.1\nCYCLE={cycle}\nCRYSTAL={clock}\nIO LIST\nEND\nPROGRAM\nRUNG\nCONTACTS Xa 0\nDIV a b c\nEND\n"
    );
    let compiled = compile(&program(&text), &CompileOptions { mcu: mcu.to_owned(), ..CompileOptions::default() })
        .expect("compiles");
    let mut chip = CompiledChip::new(&compiled, RamInit::Random(1));
    let map = chip.map.clone();
    // Every iteration of the poll loop is executed, so slow cases have fewer scans. Cases with over 2,000,000
    // clocks per scan have none and are only in the table above.
    let scans = (2_000_000 * map.cycle.den / map.cycle.num).min(2_000);
    // The poll loop follows the start of the timer.
    let start = chip.cpu.cycle();
    let starts = if mcu == "atmega328p" { 4 } else { 2 };
    assert_eq!(map.poll, map.timer_start + starts);
    for k in 1..=scans {
        chip.run_to(map.scan_start);
        let now = chip.cpu.cycle() - start;
        let exact = (u128::from(k) * u128::from(map.cycle.num) / u128::from(map.cycle.den)) as u64;
        let earliest = exact.saturating_sub(u64::from(map.tick) - 1);
        let latest = exact + u64::from(map.poll_cycles);
        assert!(
            (earliest..=latest).contains(&now),
            "{mcu}, {clock} Hz, {cycle} us: scan {k} starts at {now}, wanted {earliest} to {latest}"
        );
        chip.run_to(map.scan_end);
    }
}
