//! Self-checking programs: executes what gpasm's `.direct` stores in a `.cod` file for gpsim, on any
//! [`Cpu`](emu_core::Cpu).
//!
//! ```text
//!   script.rs   messages: start commands, assertions and commands at addresses
//!   command.rs  parses one message           expr.rs     expressions
//!   circuit.rs  parts, nets, symbols, and the commands that change them
//!   nets.rs     voltages of nets             value.rs    values of expressions
//!   wiring.rs   the chip's pins on the nets  parts/      the parts
//!   run.rs      the run: from edge to edge, from message to message
//! ```
//!
//! `docs/formats/cod.md` lists the supported messages and their meaning.
//!
//! ```no_run
//! # use emu_core::{Cpu, image::{SymbolAt, SymbolFile, load_messages}};
//! # use emu_debug::{AddressNames, cod};
//! # fn show<C: Cpu>(cpu: &mut C, symbols: &[SymbolAt], bytes: &[u8]) {
//! let messages = load_messages(&SymbolFile { name: "test.cod", bytes }).unwrap_or_default();
//! let script = cod::CodScript::read(&messages).unwrap_or_default();
//! let names = AddressNames { chip: cpu.chip(), symbols };
//! let limits = cod::CodRunLimits { cycle: 100_000_000, hz: script.frequency().unwrap_or(20_000_000) };
//! let outcome = cod::run_script(cpu, &script, names, limits, &mut |_, _, _, _| {});
//! assert!(outcome.verdict.passed());
//! # }
//! ```

mod circuit;
mod command;
mod error;
mod expr;
mod nets;
mod parts;
mod run;
mod script;
mod value;
mod wiring;

#[cfg(test)]
mod tests;

pub use error::CodError;
pub use run::{CodOutcome, CodRunLimits, CodVerdict, NamedText, run_script};
pub use script::{CodRefusal, CodScript};
pub use wiring::SetAnalogInput;
