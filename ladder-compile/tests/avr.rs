//! Random intermediate code on every chip of the family, against the interpreter.

mod common;

use common::bench::{Bench, Failed};
use common::programs::{Wish, ops, random};
use emu_avr::{Avr, Options};
use emu_core::rng::Rng;
use ladder_compile::avr::TARGETS;
use ladder_compile::target::Target;

fn options(hz: u64) -> Options {
    Options { hz, fuses: None, lock: None, start_up: false }
}

fn run(target: &'static Target, wish: Wish, seeds: std::ops::Range<u64>) {
    for seed in seeds {
        let mut ir = random(&mut Rng::new(seed), wish);
        let clock_hz = if seed % 3 == 0 { 8_000_000 } else { 11_059_200 };
        // A frequency that every timer 2 can make.
        ir.pwm_hz = ir.pwm_hz.map(|_| (clock_hz / (256 * 64)) as u32);
        let cycle_us = if ir.eeprom > 0 { 10_000 } else { 5_000 };
        let bench = Bench { target, clock_hz, cycle_us, baud: Some(9600) };
        match bench.run(&ir, seed, 15, |chip, image, init| Avr::with(chip, image, init, options(clock_hz))) {
            Ok(_) => {}
            Err(Failed::Refused(refusal)) => panic!("{} seed {seed}: {refusal:?}", target.chip.name),
            Err(Failed::Differs(how)) => panic!("{} seed {seed}: {how}", target.chip.name),
        }
    }
}

#[test]
fn bits() {
    TARGETS.iter().for_each(|target| run(target, Wish::BITS, 0..20));
}

#[test]
fn integers_of_two_bytes() {
    TARGETS.iter().for_each(|target| run(target, Wish::WORDS, 100..130));
}

#[test]
fn integers_of_every_width() {
    TARGETS.iter().for_each(|target| run(target, Wish::WIDTHS, 200..230));
}

#[test]
fn templates() {
    TARGETS.iter().for_each(|target| run(target, Wish { ops: ops::LOGIC | ops::IF, ..Wish::BITS }, 300..320));
}

#[test]
fn peripherals() {
    for target in TARGETS {
        let adc = if target.adc.is_empty() { 0 } else { ops::ADC };
        let all = ops::PWM | ops::SEND | ops::RECEIVE | ops::EEPROM | adc;
        for adcs in 1..3 {
            let adcs = if adc == 0 { 0 } else { adcs };
            let wish = Wish { ops: ops::MOVE | ops::ADD | all, words: 6, adcs, ..Wish::BITS };
            run(target, wish, 400..415);
        }
    }
}
