//! The Debug Adapter Protocol over the debugger's core, so that editors step through ladder programs, C and instructions.
//!
//! ```text
//!   frame.rs    messages in their frames           running.rs   steps and runs, forwards and back
//!   protocol.rs     requests, errors, arguments        stop_events.rs     why the machine stands, as events
//!   serve.rs    the transport, one client          points.rs    breakpoints of all kinds
//!   adapter.rs  requests to answers                frames.rs    the stack
//!   ladder.rs   rungs and elements by word         steps.rs     requests for them
//!   files.rs    sources and their lines            variables.rs scopes and variables
//!   listing.rs  the program as a source            memory.rs    memory and disassembly
//!                                                  evaluate.rs  expressions and the console
//! ```
//!
//! [`DebugAdapter::handle`] takes a request and gives responses and events at once, without input or output; a run that was asked for goes
//! on in [`DebugAdapter::run_slice`], in slices. [`serve`] is the thin layer that reads and writes.

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
