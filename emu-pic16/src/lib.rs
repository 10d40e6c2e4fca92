//! Cycle-accurate emulation of mid-range PIC16 chips: instruction table, core, peripherals and chip data of
//! the PIC16F873 and its family.
//!
//! Sources: Microchip "PICmicro Mid-Range MCU Family Reference Manual" (DS33023) for the architecture and the
//! instruction set; data sheets PIC16F87X (DS30292), PIC16F87XA (DS39582), and those of the other chips.
//! QUIRKS.md lists what is not modelled.
//!
//! ```
//! use emu_core::{Cpu, RamInit};
//! use emu_pic16::Pic16;
//!
//! let chip = emu_pic16::chips::chips().find(|chip| chip.name == "pic16f877a").ok_or("no such chip")?;
//! let image = emu_asm::assemble_text(chip, "again: addlw 1\n goto again")?;
//! let mut pic = Pic16::new(chip, &image, RamInit::Zero);
//! pic.set_reg("W", 0);
//! while pic.instructions() < 200 {
//!     pic.step(&mut ()); // an iteration has two instructions and takes three instruction cycles
//! }
//! assert_eq!(pic.reg("W"), Some(100));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

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

pub use cpu::{Options, Pic16, Pic16Readings, Pic16Stack, TimingCorner};
