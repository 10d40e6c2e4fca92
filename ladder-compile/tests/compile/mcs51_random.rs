//! Tests random intermediate code on the emulated chips of the 8051 family against the interpreter.

use crate::common::bench::{ImageBench, RunFailure};
use crate::common::ir::programs::{IrLimits, ops, random_ir};
use emu_8051::Mcs51;
use emu_core::rng::Rng;
use ladder_compile::mcs51::TARGETS;
use ladder_compile::target::{BuildRefusal, CompileTarget};

/// Runs programs with these limits on a chip: all must agree, and at most `misfits` of them may not fit.
fn agree(target: &'static CompileTarget, wish: IrLimits, seeds: std::ops::Range<u64>, misfits: usize) {
    let mut refused = 0;
    let (from, to) = (seeds.start, seeds.end);
    for seed in seeds {
        let ir = random_ir(&mut Rng::new(seed), wish);
        let baud = (ir.uart.send || ir.uart.receive).then_some(1200);
        let bench = ImageBench { target, clock_hz: 11_059_200, cycle_us: 50_000, baud };
        match bench.run(&ir, seed, 20, Mcs51::new) {
            Ok(_) => {}
            Err(RunFailure::Refused(BuildRefusal::CodeTooLarge { .. } | BuildRefusal::RamTooSmall { .. })) => {
                refused += 1
            }
            Err(why) => panic!("{}, seed {seed}: {why}", target.chip.name),
        }
    }
    assert!(refused <= misfits, "{}: {refused} of the seeds {from}..{to} do not fit", target.chip.name);
}

#[test]
fn bits() {
    for target in TARGETS {
        agree(target, IrLimits::BITS, 0..60, 0);
        agree(target, IrLimits { bits: 30, depth: 4, steps: 14, ..IrLimits::BITS }, 200..220, 0);
    }
}

#[test]
fn integers_of_two_bytes() {
    for target in TARGETS {
        agree(target, IrLimits::WORDS, 0..60, 0);
        agree(target, IrLimits { depth: 4, ..IrLimits::WORDS }, 200..212, 6);
    }
}

#[test]
fn integers_of_every_width() {
    for target in TARGETS {
        agree(target, IrLimits { rungs: 4, ..IrLimits::WIDTHS }, 0..60, 6);
    }
}

#[test]
fn plain_translation() {
    for target in TARGETS {
        agree(target, IrLimits { ops: ops::LOGIC | ops::IF | ops::MOVE, ..IrLimits::WORDS }, 0..30, 0);
    }
}

#[test]
fn bits_without_an_address_of_their_own() {
    for target in TARGETS {
        let wish = IrLimits {
            bits: 240,
            rungs: 3,
            steps: 40,
            ops: ops::IF | ops::ADD | ops::LOGIC,
            words: 3,
            ..IrLimits::BITS
        };
        agree(target, wish, 0..16, 2);
    }
}

#[test]
fn words_above_7f() {
    for target in TARGETS.iter().filter(|target| target.chip.ram_len > 128) {
        agree(target, IrLimits { words: 80, ..IrLimits::WORDS }, 0..25, 5);
        agree(target, IrLimits { words: 70, rungs: 4, ..IrLimits::WIDTHS }, 100..125, 8);
    }
}

#[test]
fn bytes_sent() {
    for target in TARGETS {
        agree(
            target,
            IrLimits { ops: ops::SEND | ops::RECEIVE | ops::ADD | ops::IF | ops::COMPARE, ..IrLimits::WORDS },
            0..30,
            0,
        );
    }
}
