//! What every emulated chip shares: the instruction table, the vocabulary of instruction bodies, the traits of cores,
//! buses and probes, pins, images and the data of chips.

#![forbid(unsafe_code)]

pub mod chip;
pub mod countdown;
pub mod cpu;
pub mod cuts;
pub mod engine;
pub mod image;
pub mod lint;
pub mod machine;
pub mod outside;
pub mod parts;
pub mod pins;
pub mod rng;
pub mod slices;
pub mod state;
pub mod table;

pub use chip::{Chip, Family, Isa, PinDef, Reg};
pub use cpu::{Bus, Cpu, END_OF_TIME, Fault, NEVER, Probe, RamInit, Reset, Stop, Wake};
pub use pins::{Event, Level, PinId, Time};
