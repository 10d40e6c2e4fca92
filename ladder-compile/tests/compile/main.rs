//! Everything that is compiled and run here, in one program: what the tests share stands in `common`.

mod common;

mod ap101_bits;
mod asm;
mod avr;
mod avr_devices;
mod evaluator_agreement;
mod huge;
mod image;
mod ir;
mod layout;
mod mcs51;
mod mcs51_random;
#[cfg(feature = "mutants")]
mod mutants;
mod pace;
mod pic16;
mod pic16_chip;
mod pic16_ladders;
mod random;
mod refusals;
mod scan;
