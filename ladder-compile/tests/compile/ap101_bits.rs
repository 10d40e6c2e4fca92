//! Tests random intermediate code of bits on AP101 against the interpreter, also in unoptimised form.

use crate::common::bench::{ImageBench, RunFailure};
use crate::common::ir::programs::{IrLimits, ops, random_ir};
use emu_ap101::Ap101;
use emu_core::rng::Rng;
use ladder_compile::ap101::TARGETS;
use ladder_compile::ir::Ir;
use ladder_compile::target::BuildRefusal;

const BENCH: ImageBench = ImageBench { target: &TARGETS[0], clock_hz: 1_000_000, cycle_us: 10_000, baud: None };

/// Returns the longest scan in machine cycles; `None` if the code does not fit.
fn run(ir: &Ir, seed: u64, scans: u32) -> Option<u64> {
    match BENCH.run(ir, seed, scans, |_, image, _| Ap101::new(image)) {
        Ok(longest) => Some(longest),
        Err(RunFailure::Refused(BuildRefusal::CodeTooLarge { .. })) => None,
        Err(why) => panic!("seed {seed}: {why}"),
    }
}

#[test]
fn random_bits() {
    let table = [
        (IrLimits::BITS, 80),
        (IrLimits { ops: 0, ..IrLimits::BITS }, 30),
        (IrLimits { ops: ops::IF | ops::LOGIC, ..IrLimits::BITS }, 30),
        (IrLimits { ops: ops::LOGIC, rungs: 12, bits: 60, ..IrLimits::BITS }, 30),
        (IrLimits { rungs: 8, steps: 20, depth: 3, inputs: 20, outputs: 16, bits: 200, ..IrLimits::BITS }, 20),
    ];
    for (wish, programs) in table {
        let fitting =
            (0..programs).filter(|&seed| run(&random_ir(&mut Rng::new(seed), wish), seed, 20).is_some()).count();
        assert!(2 * fitting > programs as usize, "{fitting} of {programs} fit: {wish:?}");
    }
}
