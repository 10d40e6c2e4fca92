//! All tests that compile and run programs, in one binary; `common` holds the shared helpers.

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
mod mutants;
mod pace;
mod pic16;
mod pic16_chip;
mod pic16_ladders;
mod random;
mod refusals;
mod scan;
