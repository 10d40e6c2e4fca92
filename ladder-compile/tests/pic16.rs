//! PIC16 images of random intermediate code on the emulated chips, against the interpreter.

mod common;

use common::bench::{Bench, Failed};
use common::programs::{Wish, ops, random};
use emu_core::rng::Rng;
use emu_pic16::Pic16;

/// Programs of a wish on a chip, from the seeds given; says how many the chip held.
fn hold(chip: &str, wish: Wish, seeds: std::ops::Range<u64>, scans: u32) -> u32 {
    let target = ladder_compile::target(chip).expect("a target");
    let bench = Bench { target, clock_hz: 20_000_000, cycle_us: 100_000, baud: Some(9600) };
    let mut held = 0;
    for seed in seeds {
        let ir = random(&mut Rng::new(seed), wish);
        match bench.run(&ir, seed, scans, Pic16::new) {
            Ok(_) => held += 1,
            Err(Failed::Refused(refusal)) => println!("{chip}, seed {seed}: {refusal:?}"),
            Err(Failed::Differs(how)) => panic!("{chip}, seed {seed}: {how}"),
        }
    }
    held
}

#[test]
fn bits() {
    assert_eq!(hold("pic16f877", Wish::BITS, 0..150, 20), 150);
    assert_eq!(hold("pic16f873", Wish { bits: 60, rungs: 12, ..Wish::BITS }, 0..50, 20), 50);
}

#[test]
fn integers() {
    assert_eq!(hold("pic16f877", Wish::WORDS, 0..150, 20), 150);
    assert_eq!(hold("pic16f873", Wish::WORDS, 0..50, 20), 50);
}
