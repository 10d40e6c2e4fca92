//! AP101 told a second time: a naive model of the machine from the reference's text and the rules of `docs/chips/ap101.md`, programs as
//! text on it and on the crate (`../programs/`), and random programs on both.

mod asm;
mod assembler;
mod blocks;
mod config;
mod core;
mod decode;
mod machine;
mod modules;
mod page;
mod programs;
mod random;
mod script;
mod subcycles;
mod tally;
mod words;
