//! The debugger for gdb: the gdb remote serial protocol over a [`DebugSession`].
//!
//! ```text
//!   packets.rs     bytes to packets: checksums, acknowledgements, Ctrl-C
//!   layout.rs      registers and memories of each family as gdb sees them, target.xml, the memory map
//!   gdb_arch.rs    the processor description for the crate gdbstub, one for all processors
//!   gdb_target.rs  registers and memories
//!   gdb_points.rs  breakpoints and watchpoints
//!   resume.rs      running, stepping, going back, and stop replies
//!   flash.rs       `load`
//!   monitor.rs     the commands of `monitor`
//!   serve.rs       one connection from its start to its end
//! ```
//!
//! gdbstub parses and writes the contents of packets. Every change of the machine is an action of the
//! session, so that it is part of the session's history.

#![forbid(unsafe_code)]

mod error;
mod flash;
mod gdb_arch;
mod gdb_points;
mod gdb_target;
mod layout;
mod monitor;
mod packets;
mod resume;
mod serve;

pub use error::GdbError;
pub use serve::{ClientEnd, GdbOptions, parse_address, serve};

use emu_debug::debug::DebugSession;

/// A handler for further `monitor` commands: returns the lines of the answer, or `None` if it does not know
/// the command.
pub type MonitorHandler = dyn FnMut(&mut DebugSession, &str) -> Option<Vec<String>>;
