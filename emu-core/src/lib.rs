//! What every emulated chip shares: the instruction table, the vocabulary of instruction bodies, the traits of cores,
//! buses and probes, pins, images and the data of chips.

#![forbid(unsafe_code)]

pub mod chip;
pub mod countdown;
pub mod cpu;
pub mod cut_tests;
pub mod engine;
pub mod image;
pub mod lint;
pub mod machine;
pub mod external_io;
pub mod parts;
pub mod pins;
pub mod rng;
pub mod slices;
pub mod state;
pub mod table;

pub use chip::{Chip, ChipFamily, InstructionSet, PinDef, NamedAddress};
pub use cpu::{Bus, Cpu, LAST_CYCLE, ProgramFault, NEVER, Probe, RamInit, ResetCause, StopReason, BusEffect};
pub use pins::{ChipEvent, PinLevel, PinId, CycleTime};
