//! Random intermediate code on emulated chips, against the interpreter.

use crate::common::bench::{Bench, Failed};
use crate::common::ir::programs::{Wish, ops, random};
use emu_avr::Avr;
use emu_core::rng::Rng;

#[test]
fn avr_does_what_the_interpreter_does() {
    let words = Wish { ops: ops::INTEGERS & !ops::LOOKUP, tables: 0, ..Wish::WORDS };
    for seed in 0..200 {
        let wish = if seed % 2 == 0 { Wish::BITS } else { words };
        let mut ir = random(&mut Rng::new(seed), wish);
        ir.words.iter_mut().for_each(|cell| cell.initial = 0);
        let target = ladder_compile::target("atmega328p").expect("a target");
        let bench = Bench { target, clock_hz: 16_000_000, cycle_us: 20_000, baud: None };
        match bench.run(&ir, seed, 20, Avr::new) {
            Ok(_) => {}
            Err(Failed::Refused(refusal)) => panic!("seed {seed}: {refusal:?}"),
            Err(Failed::Differs(how)) => panic!("seed {seed}: {how}"),
        }
    }
}
