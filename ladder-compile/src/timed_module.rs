//! Timers and counters as single operations, for chips that have them as modules.

use std::fmt;

use ladder::{CounterKind, TimerKind};

/// Kind of an [`IrOp::Module`](crate::ir::IrOp::Module).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TimedModule {
    /// A timer; its limit is P.
    Timer(TimerKind),
    /// A counter; its limit is the maximum.
    Counter {
        /// Kind of counter.
        kind: CounterKind,
        /// When it counts: `/` on rising edges, `\` on falling edges, `-` in scans with input 1, `o` in scans
        /// with input 0.
        input: char,
        /// True in dialect `ldmicro-5`: it counts up only below its limit, down only above it, and a CTD
        /// outputs n > max.
        bounded: bool,
    },
}

impl fmt::Display for TimedModule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            TimedModule::Timer(kind) => f.write_str(&format!("{kind:?}").to_lowercase()),
            TimedModule::Counter { kind, input, .. } => write!(f, "{} {input}", format!("{kind:?}").to_lowercase()),
        }
    }
}
