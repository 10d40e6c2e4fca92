//! Cycle-accurate emulation of MCS-51: instruction table, core, peripherals and chip data of the 8051, 8052,
//! AT89S52 and related chips.
//!
//! Sources: Intel "MCS 51 Microcontroller Family User's Manual" (272383-002) for the architecture, the
//! instruction set and the hardware of the 8051 and 8052; Atmel data sheets AT89S52 (1919), AT89C2051 (0368)
//! and AT89C4051 (1001) for those chips. QUIRKS.md lists what is not modelled.
//!
//! ```
//! use emu_8051::Mcs51;
//! use emu_core::{Cpu, RamInit};
//!
//! let chip = emu_8051::chips::chips().find(|chip| chip.name == "at89s52").ok_or("no such chip")?;
//! let image = emu_asm::assemble_text(chip, "again: inc a\nsjmp again")?;
//! let mut cpu = Mcs51::new(chip, &image, RamInit::Zero);
//! cpu.run(300, &mut ()); // an iteration takes three machine cycles, 36 clocks
//! assert_eq!(cpu.reg("a"), Some(100));
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
mod cpu_engine;
mod exec;
mod executor;
mod operand_place;
mod predecode;
mod recorder;
mod state;

pub use cpu::{Mcs51, Mcs51Readings, Options};
