//! AP101, a programmable controller that computes single bits: instruction table, core, channels, modules and
//! program table.
//!
//! Source: a Romanian hand-out on programming such controllers ("Programarea automatelor programabile cu
//! prelucrare la nivel de bit"). It gives the sixteen instructions, the registers, the two subcycles, the
//! zones I, E, R and M and the protected images of outputs. Where it is silent (widths, codes, sizes of
//! zones, the configuration block) the model decides; QUIRKS.md lists these decisions.

#![forbid(unsafe_code)]

pub mod chips;
pub mod config;
pub mod isa;
pub mod modules;
pub mod operands;

mod cpu;
mod exec;
mod executor;
mod predecode;
mod program_cycle;
mod repetition;
mod soc;
mod state;

pub use config::{Ap101Config, InputSampling};
pub use cpu::{Ap101, Options};
