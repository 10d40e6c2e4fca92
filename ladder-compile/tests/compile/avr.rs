//! Tests random intermediate code on every AVR chip against the interpreter.

use crate::common::bench::{ImageBench, RunFailure};
use crate::common::ir::programs::{IrLimits, ops, random_ir};
use emu_avr::{Avr, Options};
use emu_core::rng::Rng;
use ladder_compile::avr::TARGETS;
use ladder_compile::target::CompileTarget;

fn options(hz: u64) -> Options {
    Options::at_hz(hz)
}

/// Runs `each` seeds on every chip, with different seeds per chip, starting at `first`.
fn run_all(wish: IrLimits, first: u64, each: u64) {
    for (target, n) in TARGETS.iter().zip(0..) {
        run(target, wish, first + n * each..first + (n + 1) * each);
    }
}

fn run(target: &'static CompileTarget, wish: IrLimits, seeds: std::ops::Range<u64>) {
    for seed in seeds {
        let mut ir = random_ir(&mut Rng::new(seed), wish);
        let clock_hz = if seed % 3 == 0 { 1_000_000 } else { 1_843_200 };
        // A frequency that every timer 2 can generate.
        ir.pwms.iter_mut().for_each(|output| output.hertz = (clock_hz / (256 * 8)) as u32);
        let bench = ImageBench { target, clock_hz, cycle_us: 50_000, baud: Some(9600) };
        // Use the shortest cycle that the program allows, but leave time for the EEPROM and the serial line.
        let built = bench.build(&ir).unwrap_or_else(|why| panic!("{} seed {seed}: {why:?}", target.chip.name));
        let least = (built.worst_scan_cycles + built.poll_cycles + 64) * 1_000_000 / clock_hz;
        let cycle_us = least.max(if ir.eeprom_bytes > 0 { 10_000 } else { 1_100 });
        let bench = ImageBench { cycle_us, ..bench };
        match bench.run(&ir, seed, 15, |chip, image, init| Avr::with(chip, image, init, options(clock_hz))) {
            Ok(_) => {}
            Err(RunFailure::Refused(refusal)) => panic!("{} seed {seed}: {refusal:?}", target.chip.name),
            Err(RunFailure::Differs(how)) => panic!("{} seed {seed}: {how}", target.chip.name),
        }
    }
}

#[test]
fn bits() {
    run_all(IrLimits::BITS, 0, 6);
}

#[test]
fn integers_of_two_bytes() {
    run_all(IrLimits::WORDS, 1000, 12);
}

#[test]
fn integers_of_every_width() {
    run_all(IrLimits::WIDTHS, 2000, 8);
    // With only narrow integers, the registers for wide ones hold other cells.
    run_all(IrLimits { widths: &[1, 2], ..IrLimits::WIDTHS }, 3000, 6);
}

/// Programs with more cells than registers, more RAM than one-word accesses reach, and branches and jumps of
/// every length.
#[test]
fn programs_that_fill_the_chip() {
    let many = IrLimits { bits: 200, words: 60, rungs: 30, steps: 12, ..IrLimits::WORDS };
    for target in TARGETS.iter().filter(|target| target.chip.flash_bytes > 0x2000) {
        run(target, many, 300..301);
    }
    let long = IrLimits { rungs: 150, depth: 4, ..many };
    for target in TARGETS.iter().filter(|target| target.chip.flash_bytes > 0x8000) {
        run(target, long, 310..312);
    }
}

/// Unoptimised code uses a fixed template for every operation.
#[test]
fn templates() {
    run_all(IrLimits { ops: ops::LOGIC | ops::IF, ..IrLimits::BITS }, 4000, 5);
}

#[test]
fn peripherals() {
    for (target, n) in TARGETS.iter().zip(0..) {
        let adc = if target.adc.is_empty() { 0 } else { ops::ADC };
        let all = ops::PWM | ops::SEND | ops::RECEIVE | ops::EEPROM | adc;
        for adcs in 1..3 {
            let adcs = if adc == 0 { 0 } else { adcs };
            let wish = IrLimits { ops: ops::MOVE | ops::ADD | all, words: 6, adcs, ..IrLimits::BITS };
            run(target, wish, 5000 + 10 * n..5004 + 10 * n);
            run(target, IrLimits { widths: &[1, 2, 3, 4], ..wish }, 5004 + 10 * n..5007 + 10 * n);
        }
    }
}
