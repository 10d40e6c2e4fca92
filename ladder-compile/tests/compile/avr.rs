//! Random intermediate code on every chip of the family, against the interpreter.

use crate::common::bench::{Bench, Failed};
use crate::common::ir::programs::{Wish, ops, random};
use emu_avr::{Avr, Options};
use emu_core::rng::Rng;
use ladder_compile::avr::TARGETS;
use ladder_compile::target::Target;

fn options(hz: u64) -> Options {
    Options::at(hz)
}

/// Every chip with seeds of its own, `each` of them from `first` on.
fn run_all(wish: Wish, first: u64, each: u64) {
    for (target, n) in TARGETS.iter().zip(0..) {
        run(target, wish, first + n * each..first + (n + 1) * each);
    }
}

fn run(target: &'static Target, wish: Wish, seeds: std::ops::Range<u64>) {
    for seed in seeds {
        let mut ir = random(&mut Rng::new(seed), wish);
        let clock_hz = if seed % 3 == 0 { 1_000_000 } else { 1_843_200 };
        // A frequency that every timer 2 can make.
        ir.pwm_hz = ir.pwm_hz.map(|_| (clock_hz / (256 * 8)) as u32);
        let bench = Bench { target, clock_hz, cycle_us: 50_000, baud: Some(9600) };
        // As short a cycle as the program leaves, but for the EEPROM and the serial line.
        let built = bench.build(&ir).unwrap_or_else(|why| panic!("{} seed {seed}: {why:?}", target.chip.name));
        let least = (built.worst + built.poll + 64) * 1_000_000 / clock_hz;
        let cycle_us = least.max(if ir.eeprom > 0 { 10_000 } else { 1_100 });
        let bench = Bench { cycle_us, ..bench };
        match bench.run(&ir, seed, 15, |chip, image, init| Avr::with(chip, image, init, options(clock_hz))) {
            Ok(_) => {}
            Err(Failed::Refused(refusal)) => panic!("{} seed {seed}: {refusal:?}", target.chip.name),
            Err(Failed::Differs(how)) => panic!("{} seed {seed}: {how}", target.chip.name),
        }
    }
}

#[test]
fn bits() {
    run_all(Wish::BITS, 0, 6);
}

#[test]
fn integers_of_two_bytes() {
    run_all(Wish::WORDS, 1000, 12);
}

#[test]
fn integers_of_every_width() {
    run_all(Wish::WIDTHS, 2000, 8);
    // Narrow ones alone leave the registers of the wide ones to others.
    run_all(Wish { widths: &[1, 2], ..Wish::WIDTHS }, 3000, 6);
}

/// More bits and integers than registers, more RAM than one-word accesses reach, branches and jumps of every length.
#[test]
fn programs_that_fill_the_chip() {
    let many = Wish { bits: 200, words: 60, rungs: 30, steps: 12, ..Wish::WORDS };
    for target in TARGETS.iter().filter(|target| target.chip.flash > 0x2000) {
        run(target, many, 300..301);
    }
    let long = Wish { rungs: 150, depth: 4, ..many };
    for target in TARGETS.iter().filter(|target| target.chip.flash > 0x8000) {
        run(target, long, 310..312);
    }
}

/// Code that is not optimised: a template for every operation.
#[test]
fn templates() {
    run_all(Wish { ops: ops::LOGIC | ops::IF, ..Wish::BITS }, 4000, 5);
}

#[test]
fn peripherals() {
    for (target, n) in TARGETS.iter().zip(0..) {
        let adc = if target.adc.is_empty() { 0 } else { ops::ADC };
        let all = ops::PWM | ops::SEND | ops::RECEIVE | ops::EEPROM | adc;
        for adcs in 1..3 {
            let adcs = if adc == 0 { 0 } else { adcs };
            let wish = Wish { ops: ops::MOVE | ops::ADD | all, words: 6, adcs, ..Wish::BITS };
            run(target, wish, 5000 + 10 * n..5004 + 10 * n);
            run(target, Wish { widths: &[1, 2, 3, 4], ..wish }, 5004 + 10 * n..5007 + 10 * n);
        }
    }
}
