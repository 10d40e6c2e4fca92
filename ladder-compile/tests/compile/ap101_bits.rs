//! AP101: random intermediate code of bits on the machine, against the interpreter; also in the form that is not optimised.

use crate::common::bench::{Bench, Failed};
use crate::common::ir::programs::{Wish, ops, random};
use emu_ap101::Ap101;
use emu_core::rng::Rng;
use ladder_compile::ap101::TARGETS;
use ladder_compile::ir::Ir;
use ladder_compile::target::Refusal;

const BENCH: Bench = Bench { target: &TARGETS[0], clock_hz: 1_000_000, cycle_us: 10_000, baud: None };

/// The longest scan, or nothing where the code does not fit.
fn run(ir: &Ir, seed: u64, scans: u32) -> Option<u64> {
    match BENCH.run(ir, seed, scans, |_, image, _| Ap101::new(image)) {
        Ok(longest) => Some(longest),
        Err(Failed::Refused(Refusal::Code { .. })) => None,
        Err(why) => panic!("seed {seed}: {why}"),
    }
}

#[test]
fn random_bits() {
    let table = [
        (Wish::BITS, 80),
        (Wish { ops: 0, ..Wish::BITS }, 30),
        (Wish { ops: ops::IF | ops::LOGIC, ..Wish::BITS }, 30),
        (Wish { ops: ops::LOGIC, rungs: 12, bits: 60, ..Wish::BITS }, 30),
        (Wish { rungs: 8, steps: 20, depth: 3, inputs: 20, outputs: 16, bits: 200, ..Wish::BITS }, 20),
    ];
    for (wish, programs) in table {
        let fitting = (0..programs).filter(|&seed| run(&random(&mut Rng::new(seed), wish), seed, 20).is_some()).count();
        assert!(2 * fitting > programs as usize, "{fitting} of {programs} fit: {wish:?}");
    }
}
