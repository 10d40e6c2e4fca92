//! The parts that all emulated chips share: the instruction table, the traits for instruction bodies, the
//! traits [`Cpu`], [`Bus`] and [`Probe`], pins, images, and the data of chips.

#![forbid(unsafe_code)]

pub mod chip;
pub mod countdown;
pub mod cpu;
pub mod engine;
mod error;
pub mod external_io;
pub mod image;
pub mod lint;
pub mod machine;
pub mod parts;
pub mod pins;
pub mod rng;
pub mod state;
pub mod table;

pub use chip::{Chip, ChipFamily, InstructionSet, NamedAddress, PinDef};
pub use cpu::{Bus, BusEffect, Cpu, LAST_CYCLE, NEVER, Probe, ProgramFault, RamInit, ResetCause, StopReason};
pub use error::CoreError;
pub use pins::{ChipEvent, CycleTime, PinId, PinLevel};
