//! Traces: what every instruction does, as lines, and values of registers and memory as signals of a waveform.
//!
//! ```text
//!   words.rs    the program words that are looked at       lines.rs    steps as lines: text or JSON
//!   trace_probe.rs     the probe, and the run that steps          signals.rs  registers and memory as signals
//!   sink.rs     all lines, or the last of them
//! ```
//!
//! What an instruction has changed is known at the boundary behind it, and only who holds the machine can read it there. So the
//! machine is run one instruction at a time where it is looked at (`go`), and at full speed elsewhere: the probe only says where it
//! has to stop for that. Any slicing of a run gives the same machine.
//!
//! [`TraceLineWriter`] has no probe: a debugger that steps may ask it for the line of a step of its own.

mod line_writer;
mod output;
mod signals;
mod trace_probe;
mod word_set;

pub use line_writer::{TraceEventKind, TraceFormat, TraceLine, TraceLineWriter, TracedAccess};
pub use output::{TraceOutput, TraceSink};
pub use signals::{SignalSource, TraceSignal, TraceSignals, register_bits};
pub use trace_probe::TraceProbe;
pub(crate) use trace_probe::run_traced;
pub use word_set::WordCache;
