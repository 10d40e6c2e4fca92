//! The parts that all emulated chips share: the instruction table, the traits for instruction bodies, the
//! traits [`Cpu`], [`Bus`] and [`Probe`], pins, images, and the data of chips.
//!
//! Code for any chip takes a [`Cpu`] and observes it with a [`Probe`], whose hooks cost nothing unless they
//! are enabled:
//!
//! ```
//! use emu_core::{Cpu, Probe};
//!
//! /// Counts the branches that are taken.
//! #[derive(Default)]
//! struct TakenBranches(u64);
//!
//! impl Probe for TakenBranches {
//!     const FLOW: bool = true;
//!
//!     fn on_branch(&mut self, _next: u32, _to: u32, taken: bool) {
//!         self.0 += u64::from(taken);
//!     }
//! }
//!
//! /// Returns how many branches `cpu` takes before machine cycle `until`.
//! fn taken_branches<C: Cpu>(cpu: &mut C, until: u64) -> u64 {
//!     let mut probe = TakenBranches::default();
//!     cpu.run(until, &mut probe);
//!     probe.0
//! }
//! ```
//!
//! Images are read with the table of the chip's memories:
//!
//! ```
//! use emu_core::image::{ImageSpace, WordBits, load_hex};
//!
//! let flash = ImageSpace { name: "flash", start: 0, len: 0x8000, word: 2, word_bits: WordBits::All };
//! let image = load_hex("nop.hex", b":020000000000FE\n:00000001FF\n", &[flash]).expect("a sound file").image;
//! assert_eq!(image.bytes_in("flash").map(|one| one.byte).collect::<Vec<_>>(), [0, 0]);
//!
//! let faults = load_hex("bad.hex", b":020000000000FF\n:00000001FF\n", &[flash]).unwrap_err();
//! assert_eq!(faults[0].code, "HEX006"); // the checksum
//! ```

#![forbid(unsafe_code)]

pub mod bus;
pub mod chip;
pub mod countdown;
pub mod cpu;
pub mod device;
pub mod engine;
pub mod engine_macros;
mod error;
pub mod external_io;
mod family;
pub mod image;
pub mod lint;
pub mod machine;
pub mod parts;
pub mod pins;
pub mod rng;
pub mod state;
pub mod table;

pub use bus::{Bus, BusEffect, RegisterRead};
pub use chip::{Chip, ChipFamily, ChipPin, InstructionSet, NamedAddress, NamedConstant, PinDef};
pub use cpu::{Cpu, CpuParts, LAST_CYCLE, NEVER, Probe, ProgramError, ProgramFault, RamInit, ResetCause, StopReason};
pub use error::CoreError;
pub use pins::{ChipEvent, CycleTime, PinId, PinLevel, PinOutput};
