//! Emitted sources compiled by other compilers: C by gcc, avr-gcc and sdcc, byte code with its interpreter,
//! sketches by avr-g++ with the Arduino core. Each must agree with the evaluator.
//!
//! A plain `cargo test` ignores all of it; `.ci/peers` installs the compilers and runs it. Random tests take
//! their seed from the variable EMU_SEED.

#[path = "peers/sources/code.rs"]
mod code;
#[path = "peers/sources/debounce.rs"]
mod debounce;
#[path = "peers/sources/examples.rs"]
mod examples;
#[path = "../ladder-compile/tests/compile/common/ir/mod.rs"]
mod ir;
#[path = "peers/sources/programs.rs"]
mod programs;
#[path = "peers/sources/random.rs"]
mod random;
#[path = "ladder/text.rs"]
mod text;
#[path = "peers/tools.rs"]
mod tools;
