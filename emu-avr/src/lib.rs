//! Cycle-accurate emulation of the ATmega328P and related AVR chips: instruction table, core, peripherals,
//! chip data.
//!
//! Sources: "AVR Instruction Set Manual" (Microchip DS40002198) for instructions,
//! "ATmega48A/PA/88A/PA/168A/PA/328/P" (DS40002061) for the chip. QUIRKS.md lists what is not modelled.
//!
//! ```
//! use emu_avr::{Avr, chips::ATMEGA328P};
//! use emu_core::{Cpu, RamInit};
//!
//! let image = emu_asm::assemble_text(&ATMEGA328P, "again: inc r16\nrjmp again")?;
//! let mut avr = Avr::new(&ATMEGA328P, &image, RamInit::Zero);
//! let start = avr.cycle(); // after the start-up time of the oscillator
//! avr.run(start + 300, &mut ()); // an iteration takes three cycles
//! assert_eq!(avr.reg("r16"), Some(100));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]

pub mod chips;
pub mod isa;
pub mod operands;

mod cpu;
mod cpu_engine;
mod exec;
mod executor;
mod flags;
mod lint;
pub mod periph;
mod predecode;
mod recorder;
pub mod soc;
mod state;

pub use cpu::{Avr, AvrReadings, Options};
