//! Comparisons of the assembler with external ones: as31 and sdas8051 for the 8051, gpasm for the PIC16,
//! avr-as and avra for the AVR.
//!
//! A plain `cargo test` ignores the tests that need them; `.ci/peers` installs them and runs these tests.
//! Random tests take their seed from the variable EMU_SEED and print it.

#[path = "peers/asm/atmel.rs"]
mod atmel;
#[path = "peers/asm/corpus.rs"]
mod corpus;
#[path = "peers/asm/emitted.rs"]
mod emitted;
#[path = "peers/asm/faults.rs"]
mod faults;
#[path = "peers/asm/hex.rs"]
mod hex;
#[path = "peers/asm/judges.rs"]
mod judges;
#[path = "peers/asm/modules.rs"]
mod modules;
#[path = "peers/asm/ours.rs"]
mod ours;
#[path = "peers/asm/random.rs"]
mod random;
#[path = "peers/asm/text.rs"]
mod text;
