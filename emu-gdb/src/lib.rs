//! The debugger for gdb: its remote serial protocol over a [`DebugSession`].
//!
//! ```text
//!   packets.rs     bytes to packets: check sums, acknowledgements, Ctrl-C
//!   layout.rs   registers and memories of each family as gdb sees them, target.xml, the map of memories
//!   arch.rs     what the crate gdbstub wants to know of a processor, the same for all of ours
//!   gdb_target.rs     registers and memories
//!   points.rs   breakpoints and watchpoints
//!   resume.rs   running, stepping, going back, and what is said of a stop
//!   flash.rs    `load`
//!   monitor.rs  the commands behind `monitor`
//!   serve.rs    a client from its first byte to its last
//! ```
//!
//! The packets themselves are read and written by gdbstub. Everything that changes the machine is an action of the session, so
//! that it is in its history.

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

/// Commands behind `monitor` that this crate does not know: the lines of the answer, or nothing where there is no such command.
pub type MonitorHandler = dyn FnMut(&mut DebugSession, &str) -> Option<Vec<String>>;
