//! Cycle-accurate emulation of mid-range PIC16 chips: instruction table, core, peripherals and chip data of
//! the PIC16F873 and its family.
//!
//! Sources: Microchip "PICmicro Mid-Range MCU Family Reference Manual" (DS33023) for the architecture and the
//! instruction set; data sheets PIC16F87X (DS30292), PIC16F87XA (DS39582), and those of the other chips.
//! QUIRKS.md lists what is not modelled.

#![forbid(unsafe_code)]

pub mod chips;
pub mod isa;
pub mod operands;
pub mod periph;
pub mod soc;

mod core_state;
mod cpu;
mod exec;
mod executor;
mod lint;
mod options;
mod predecode;
mod recorder;
mod state;

pub use cpu::{Options, Pic16, Pic16Readings, TimingCorner};
