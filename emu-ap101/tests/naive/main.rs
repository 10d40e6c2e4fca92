//! A second implementation of AP101: a naive model written from the reference's text and the rules of
//! `docs/chips/ap101.md`. Programs as text (`../programs/`) and random programs run on both the model and the
//! crate.

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
