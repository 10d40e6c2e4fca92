//! The Debug Adapter Protocol over a debugger session, so that editors can step through ladder programs, C
//! and instructions.
//!
//! ```text
//!   framing.rs        the framing of messages        runs.rs           steps and runs, forwards and back
//!   protocol.rs       requests, errors, arguments    stop_events.rs    stop reasons as events
//!   serve.rs          the transport, one client      breakpoints.rs    breakpoints of all kinds
//!   adapter.rs        dispatches requests            stack_frames.rs   the call stack
//!   ladder_source.rs  rungs and elements by word     step_requests.rs  requests that run the machine
//!   files.rs          sources and their lines        variables.rs      scopes and variables
//!   listing.rs        the disassembly as a source    locals.rs         variables of C
//!   memory.rs         memory, disassembly requests   evaluate.rs       expressions and the console
//! ```
//!
//! [`DebugAdapter::handle`] takes a request and returns responses and events without input or output; a
//! requested run is executed by [`DebugAdapter::run_slice`], slice by slice. [`serve`] is the thin layer that
//! reads and writes messages.

#![forbid(unsafe_code)]

mod adapter;
mod breakpoints;
mod error;
mod evaluate;
mod files;
pub mod framing;
mod ladder_source;
mod listing;
mod locals;
mod memory;
mod protocol;
mod runs;
mod serve;
mod stack_frames;
mod step_requests;
mod stop_events;
mod variables;

pub use adapter::{DebugAdapter, OpenMachine, OpenedMachine};
pub use error::{DapError, LaunchError};
pub use protocol::LaunchArguments;
pub use serve::serve;
