//! Timers and counters as wholes, for chips that have them as modules.

use std::fmt;

use ladder::{CounterKind, TimerKind};

/// What an [`Op::Module`](crate::ir::Op::TimedModule) is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TimedModule {
    /// A timer; the limit is its P.
    Timer(TimerKind),
    /// A counter; the limit is its max.
    Counter {
        /// Which one.
        kind: CounterKind,
        /// When it counts: `/` at rising edges, `\` at falling ones, `-` in every scan with in = 1, `o` in every scan with in = 0.
        input: char,
        /// As in dialect `ldmicro-5`: it counts up only below its limit, down only above it, and a CTD gives n > max.
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
