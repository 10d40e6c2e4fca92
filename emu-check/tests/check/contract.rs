//! Compilers with an error in time or pins that their map repeats: the check must follow the program, not the
//! map.

use crate::common;
use emu_check::{CheckOptions, CheckReport, DifferenceKind, check_compiled};
use ladder::LadderProgram;
use ladder_compile::{CompiledProgram, compile};

const RUNGS: &str = "
    RUNG\n CONTACTS Xa 0\n TON Ta 50000\n COIL Ya 0 0 0\n END
    RUNG\n CONTACTS Xb 0\n COIL Yb 0 0 0\n END";

/// A program with a clock of 1 MHz and pins PB0, PD2 and PC0 in its IO LIST; Yb has no pin.
fn program(cycle_us: u64) -> LadderProgram {
    let io = "Xa at 14\n Xb at 4\n Ya at 23\n Yb at 0";
    let head = format!("LDmicro0.1\nMICRO=Atmel AVR ATmega328 28-PDIP\nCYCLE={cycle_us}\nCRYSTAL=1000000");
    common::parse("pace.ld", &format!("{head}\nIO LIST\n{io}\nEND\nPROGRAM\n{RUNGS}\n"))
}

fn compiled(program: &LadderProgram, pins: &[(&str, &str)], clock_hz: Option<u64>) -> CompiledProgram {
    let pins = pins.iter().map(|(symbol, pin)| ladder_compile::PinAssignment::new(symbol, pin)).collect();
    let options = ladder_compile::CompileOptions { mcu: "atmega328p".to_owned(), pins, clock_hz, optimise: true };
    compile(program, &options).unwrap_or_else(|faults| panic!("{faults:?}"))
}

fn checked(image: &CompiledProgram, options: &CheckOptions) -> CheckReport {
    check_compiled(&program(10_000), image, options, &mut |_, _| {}).unwrap_or_else(|faults| panic!("{faults:?}"))
}

type FalsifyMap = fn(&mut CompiledProgram);

/// A change to the map of a correct image, with the report's (expected, found).
const MAPS: &[(FalsifyMap, &str, &str)] = &[
    (|c| c.map.mcu = "atmega8".to_owned(), "the chip atmega328p", "atmega8"),
    (|c| c.map.clock_hz = 2_000_000, "a clock of 1000000 Hz", "2000000 Hz"),
    (|c| c.map.cycle.num = 20_000, "a period of 10000 cycles (10000 us at 1000000 Hz)", "20000 cycles"),
    (|c| c.map.cycle.den = 0, "a period of 10000 cycles (10000 us at 1000000 Hz)", "10000/0 cycles"),
    (|c| c.map.tick = 3, "a tick of the timer of at most 1 cycles", "3 cycles"),
    (|c| c.map.poll_cycles = 1_000_000, "at most 5 cycles from a match to the start of its scan", "1000000 cycles"),
    (|c| move_pin(c, "Xa", "PB1"), "Xa at PB0", "at PB1"),
    (|c| move_pin(c, "Yb", "PB0"), "a pin of its own for Yb", "PB0 as Xa"),
    (|c| c.map.pins.push(duplicate_pin(c, "Xb", "PD5")), "one pin for Xb; Xb at PD2", "2 pins PD2 PD5; at PD2 PD5"),
    (|c| c.map.pins.push(duplicate_pin(c, "Yz", "PD5")), "pins for inputs and outputs only", "PD5 for `Yz`"),
];

fn move_pin(compiled: &mut CompiledProgram, name: &str, pin: &str) {
    let found = compiled.map.pins.iter_mut().find(|p| p.name == name);
    found.expect("a symbol with a pin").pin = pin.to_owned();
}

fn duplicate_pin(compiled: &CompiledProgram, name: &str, pin: &str) -> ladder_compile::PinMap {
    let first = compiled.map.pins.first().expect("a pin").clone();
    ladder_compile::PinMap { name: name.to_owned(), pin: pin.to_owned(), ..first }
}

#[test]
fn a_map_that_says_otherwise_is_a_difference() {
    let good = compiled(&program(10_000), &[], None);
    assert!(checked(&good, &CheckOptions::default()).agreed);
    for (fake, expected, found) in MAPS {
        let mut image = good.clone();
        fake(&mut image);
        let report = checked(&image, &CheckOptions::default());
        let difference = report.difference.as_ref().unwrap_or_else(|| panic!("agrees instead of {expected}"));
        assert_eq!((difference.what, difference.code), (DifferenceKind::Map, "EC016"), "{expected}");
        assert_eq!((difference.expected.as_str(), difference.found.as_str()), (*expected, *found));
        assert!(report.text().contains("  what      the compiler's map [EC016]\n"), "{}", report.text());
        assert!(!report.agreed && difference.smallest.is_empty(), "{}", report.text());
    }
}

#[test]
fn whole_compilers_that_are_wrong_are_found() {
    // Twice the cycle, another clock, other pins: in each case image and map agree with each other.
    let slow = compiled(&program(20_000), &[], None);
    let fast_clock = compiled(&program(10_000), &[], Some(16_000_000));
    let moved = compiled(&program(10_000), &[("Xa", "PB3")], None);
    for image in [&slow, &fast_clock, &moved] {
        let report = checked(image, &CheckOptions::default());
        assert_eq!(report.difference.map(|d| d.what), Some(DifferenceKind::Map));
    }
    // If the map is correct, the check finds the error on the chip.
    let mut lies = slow.clone();
    lies.map.cycle = compiled(&program(10_000), &[], None).map.cycle;
    let report = checked(&lies, &CheckOptions::default());
    assert_eq!(report.difference.map(|d| (d.what, d.scan)), Some((DifferenceKind::Period, 1)));
    // Options of the command line override the program.
    let pins = vec![ladder_compile::PinAssignment::new("Xa", "pb3")];
    assert!(checked(&moved, &CheckOptions { pins: pins.clone(), ..CheckOptions::default() }).agreed);
    assert!(!checked(&compiled(&program(10_000), &[], None), &CheckOptions { pins, ..CheckOptions::default() }).agreed);
    assert!(checked(&fast_clock, &CheckOptions { clock_hz: Some(16_000_000), ..CheckOptions::default() }).agreed);
}
