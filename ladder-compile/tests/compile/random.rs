//! Tests random intermediate code on emulated chips against the interpreter.

use crate::common::bench::{ImageBench, RunFailure};
use crate::common::ir::programs::{IrLimits, ops, random_ir};
use emu_avr::Avr;
use emu_core::rng::Rng;

#[test]
fn avr_does_what_the_interpreter_does() {
    let words = IrLimits { ops: ops::INTEGERS & !ops::LOOKUP, tables: 0, ..IrLimits::WORDS };
    for seed in 0..200 {
        let wish = if seed % 2 == 0 { IrLimits::BITS } else { words };
        let mut ir = random_ir(&mut Rng::new(seed), wish);
        ir.words.iter_mut().for_each(|cell| cell.initial = 0);
        let target = ladder_compile::find_target("atmega328p").expect("a target");
        let bench = ImageBench { target, clock_hz: 16_000_000, cycle_us: 20_000, baud: None };
        match bench.run(&ir, seed, 20, Avr::new) {
            Ok(_) => {}
            Err(RunFailure::Refused(refusal)) => panic!("seed {seed}: {refusal:?}"),
            Err(RunFailure::Differs(how)) => panic!("seed {seed}: {how}"),
        }
    }
}
