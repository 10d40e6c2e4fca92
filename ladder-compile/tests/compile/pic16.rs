//! Tests PIC16 images of random intermediate code on the emulated chips against the interpreter.

use crate::common::bench::{ImageBench, RunFailure};
use crate::common::ir::programs::{IrLimits, ops, random_ir};
use emu_core::rng::Rng;
use emu_pic16::Pic16;
use ladder_compile::ir::Ir;
use ladder_compile::lower::lower;
use ladder_compile::optimise::optimise;
use ladder_compile::target::BuildRefusal;

/// Runs programs with these limits on a chip, one per seed; returns how many fit the chip.
fn check_programs(chip: &str, wish: IrLimits, seeds: std::ops::Range<u64>, scans: u32) -> u32 {
    let target = ladder_compile::find_target(chip).expect("a target");
    let bench = ImageBench { target, clock_hz: 20_000_000, cycle_us: 100_000, baud: Some(9600) };
    let mut held = 0;
    for seed in seeds {
        let ir = random_ir(&mut Rng::new(seed), wish);
        match bench.run(&ir, seed, scans, Pic16::new) {
            Ok(_) => held += 1,
            Err(RunFailure::Refused(
                refusal @ (BuildRefusal::RamTooSmall { .. } | BuildRefusal::CodeTooLarge { .. }),
            )) => {
                println!("{chip}, seed {seed}: {refusal:?}")
            }
            Err(RunFailure::Refused(refusal)) => panic!("{chip}, seed {seed}: {refusal:?}"),
            Err(RunFailure::Differs(how)) => panic!("{chip}, seed {seed}: {how}"),
        }
    }
    held
}

#[test]
fn bits() {
    assert_eq!(check_programs("pic16f877", IrLimits::BITS, 0..40, 20), 40);
    assert_eq!(check_programs("pic16f873", IrLimits { bits: 60, rungs: 12, ..IrLimits::BITS }, 0..20, 20), 20);
}

#[test]
fn integers() {
    assert_eq!(check_programs("pic16f877", IrLimits::WORDS, 0..40, 20), 40);
    assert_eq!(check_programs("pic16f873", IrLimits::WORDS, 0..20, 20), 20);
}

#[test]
fn integers_of_every_width() {
    assert_eq!(check_programs("pic16f877a", IrLimits::WIDTHS, 0..25, 20), 25);
    assert_eq!(check_programs("pic16f873a", IrLimits::WIDTHS, 100..115, 20), 15);
}

#[test]
fn integers_in_every_bank() {
    let words = IrLimits { words: 120, rungs: 10, ..IrLimits::WORDS };
    assert_eq!(check_programs("pic16f876", words, 0..8, 6), 8);
    assert_eq!(check_programs("pic16f88", words, 20..24, 6), 4);
    assert_eq!(check_programs("pic16f873", IrLimits { words: 75, ..words }, 0..8, 6), 8);
    assert_eq!(check_programs("pic16f819", IrLimits { words: 95, ..words }, 0..4, 6), 4);
    assert_eq!(check_programs("pic16f628", IrLimits { words: 85, ..words }, 0..4, 6), 4);
    let widths = IrLimits { widths: &[1, 2, 3, 4], words: 100, ..words };
    assert_eq!(check_programs("pic16f876a", widths, 0..8, 6), 8);
    assert_eq!(check_programs("pic16f874", IrLimits { words: 55, ..widths }, 0..8, 6), 8);
}

#[test]
fn programs_of_several_pages() {
    // Three to four pages on chips with 8 K words, two pages on chips with 4 K words.
    let large = IrLimits { rungs: 58, words: 20, ..IrLimits::WORDS };
    assert_eq!(check_programs("pic16f877", large, 0..6, 4), 6);
    assert_eq!(check_programs("pic16f876a", IrLimits { rungs: 40, widths: &[1, 2, 4], ..large }, 0..4, 4), 4);
    assert_eq!(check_programs("pic16f873", IrLimits { rungs: 26, ..large }, 0..4, 4), 4);
}

#[test]
fn code_that_is_not_optimised() {
    let plain = IrLimits { ops: ops::INTEGERS | ops::LOGIC, ..IrLimits::WORDS };
    assert_eq!(check_programs("pic16f874a", plain, 0..40, 20), 40);
}

#[test]
fn peripherals() {
    let uart = IrLimits { ops: ops::INTEGERS | ops::SEND, byte_scans: 1, ..IrLimits::WORDS };
    for chip in ["pic16f873", "pic16f877a", "pic16f628", "pic16f628a", "pic16f88"] {
        assert_eq!(check_programs(chip, uart, 0..8, 20), 8, "{chip}");
    }
    let adc = IrLimits { ops: ops::INTEGERS | ops::ADC, adcs: 2, ..IrLimits::WORDS };
    for chip in ["pic16f874", "pic16f873a", "pic16f819", "pic16f88"] {
        assert_eq!(check_programs(chip, adc, 0..8, 20), 8, "{chip}");
    }
    let eeprom = IrLimits { ops: ops::INTEGERS | ops::EEPROM, widths: &[1, 2, 4], ..IrLimits::WORDS };
    for chip in ["pic16f873", "pic16f873a", "pic16f876", "pic16f628", "pic16f628a", "pic16f88", "pic16f819"] {
        assert_eq!(check_programs(chip, eeprom, 0..8, 20), 8, "{chip}");
    }
}

#[test]
fn every_chip() {
    for target in ladder_compile::pic16::TARGETS {
        assert_eq!(check_programs(target.chip.name, IrLimits::WORDS, 500..505, 10), 5, "{}", target.chip.name);
    }
    assert_eq!(ladder_compile::pic16::TARGETS.len(), 12);
}

/// Rungs with conditionally executed code after formulas that have not been computed yet.
///
/// See `Pic16Selector::compute_before_branch`.
#[rustfmt::skip]
const WAITING: &[(&str, &str)] = &[
    ("what a branch left in the accumulator's own bit, and a counter",
     "LEQ 0 Ta\nPARALLEL\nCTU Cb 127\nSERIES\nOSR\nCONTACTS Yb 0\nEND\nCTC Ca 128\nEND\nCOIL Ya 1 0 0"),
    ("the same, and a counter of falling edges",
     "PARALLEL\nSERIES\nCONTACTS Xb 0\nPARALLEL\nCONTACTS Ya 0\nOSF\nEND\nEND\nSERIES\nCONTACTS Rb 0\nCTU Ca 1024 0 \\\nEND\nEND\nCONTACTS Yb 0\nCOIL Ya 0 1 0"),
    ("an edge after another, and a counter that starts over",
     "OSR\nPARALLEL\nCONTACTS Ra 0\nOSR\nCTC Ca 32766\nEND\nMOVE Tb 3"),
    ("a byte that came, and a counter",
     "CONTACTS Ra 0\nPARALLEL\nCONTACTS Rd 0\nUART_RECV Aa\nSERIES\nCTC Cd 32766 0 \\\nCONTACTS Xb 0\nEND\nEND\nCOIL Rc 0 0 0"),
    ("a counter, and one below it",
     "PARALLEL\nCTU Ca 2\nSERIES\nCONTACTS Ye 1\nCTU Cb -255\nCONTACTS Xa 0\nEND\nEND\nCONTACTS Rc 0\nPARALLEL\nSERIES\nCONTACTS Xa 0\nCONTACTS Yc 0\nPARALLEL\nCONTACTS Ra 1\nOSF\nEND\nEND\nCTC Ca 7\nEND\nDIV nd 0 0"),
    ("shift register behind an edge",
     "PARALLEL\nSERIES\nOSR\nCONTACTS Xa 0\nEND\nSERIES\nOSF\nCONTACTS Xb 1\nEND\nSHIFT_REGISTER s 3\nEND\nCOIL Ya 0 0 0"),
];

/// Lowers a program of one rung, for any chip.
fn lower_rungs(rungs: &str) -> Ir {
    let head = "LDmicro0.2\nCYCLE=10000\nCRYSTAL=4000000\nBAUD=2400\nIO LIST\nEND\nVAR LIST\nEND\nPROGRAM\n";
    optimise(lower(&crate::common::program(&format!("{head}RUNG\n{rungs}\nEND\n"))))
}

#[test]
fn code_that_is_not_always_executed() {
    let target = ladder_compile::find_target("pic16f873").expect("a target");
    let bench = ImageBench { target, clock_hz: 4_000_000, cycle_us: 10_000, baud: Some(2400) };
    for (what, rung) in WAITING {
        for seed in 0..8 {
            if let Err(how) = bench.run(&lower_rungs(rung), seed, 60, Pic16::new) {
                panic!("{what}, seed {seed}: {how:?}");
            }
        }
    }
}
