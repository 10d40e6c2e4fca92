//! Traces: what every instruction does, as lines, and values of registers and memory as signals of a
//! waveform.
//!
//! ```text
//!   word_set.rs     the traced program words          line_writer.rs  steps as lines: text or JSON
//!   trace_probe.rs  the probe, and the stepping run   signals.rs      registers and memory as signals
//!   output.rs       all lines, or the last ones
//! ```
//!
//! The changes of an instruction are known at the boundary after it, and only the owner of the machine can
//! read them there. So the machine runs one instruction at a time where it is traced (`run_traced`), and at
//! full speed elsewhere: the probe only decides where it must stop for that. Any slicing of a run gives the
//! same machine.
//!
//! [`TraceLineWriter`] has no probe: a debugger that steps can use it for the line of its own step.

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
pub use word_set::WordSet;
