//! AP101, a programmable controller that computes single bits: instruction table, core, channels, modules and
//! program table.
//!
//! Source: a Romanian hand-out on programming such controllers ("Programarea automatelor programabile cu
//! prelucrare la nivel de bit"). It gives the sixteen instructions, the registers, the two subcycles, the
//! zones I, E, R and M and the protected images of outputs. Where it is silent (widths, codes, sizes of
//! zones, the configuration block) the model decides; QUIRKS.md lists these decisions.
//!
//! ```
//! use emu_ap101::{Ap101, chips::AP101};
//! use emu_core::{Cpu, CycleTime, PinLevel};
//!
//! let image = emu_asm::assemble_text(&AP101, "channels 8, 4\nld I1\nand I2\nsto E1")?;
//! let mut machine = Ap101::new(&image);
//! for pin in [1, 2] {
//!     machine.drive(CycleTime::at(0), pin, PinLevel::High); // I1 and I2
//! }
//! machine.run(100, &mut ());
//! assert_eq!(machine.peek("e", 1), Some(1));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]

pub mod chips;
pub mod config;
pub mod isa;
pub mod modules;
pub mod operands;

mod channels;
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
