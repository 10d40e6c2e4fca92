//! Traces: what every instruction does, as lines, and values of registers and memory as signals of a waveform.
//!
//! ```text
//!   words.rs    the program words that are looked at       lines.rs    steps as lines: text or JSON
//!   look.rs     the probe, and the run that steps          signals.rs  registers and memory as signals
//!   sink.rs     all lines, or the last of them
//! ```
//!
//! What an instruction has changed is known at the boundary behind it, and only who holds the machine can read it there. So the
//! machine is run one instruction at a time where it is looked at (`go`), and at full speed elsewhere: the probe only says where it
//! has to stop for that. Any slicing of a run gives the same machine.
//!
//! [`Lines`] has no probe: a debugger that steps may ask it for the line of a step of its own.

mod lines;
mod look;
mod signals;
mod sink;
mod words;

pub use lines::{Access, Format, Lines, Step, What};
pub use look::Look;
pub(crate) use look::go;
pub use signals::{Signal, Signals, Source as SignalSource, register_bits};
pub use sink::{Sink, Trace};
pub use words::Words;
