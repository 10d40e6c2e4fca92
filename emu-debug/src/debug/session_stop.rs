//! Why a session stopped the machine.

use emu_core::cpu::{ProgramError, StopReason};

/// The hit of a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PointHit {
    /// Number of the point.
    pub id: u32,
    /// The previous value of a watched expression.
    pub old: Option<i64>,
    /// The current value; for an access, the byte read or written.
    pub new: Option<i64>,
    /// For an access: whether it is a write.
    pub write: Option<bool>,
    /// Program word of the instruction that caused it; for a breakpoint, the next instruction.
    pub pc: u32,
}

/// Why the session stopped the machine.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SessionStopReason {
    /// The request is done.
    Done,
    /// Breakpoints or watchpoints stopped the machine.
    Points(Vec<PointHit>),
    /// The requested cycle was reached.
    Limit,
    /// Nothing can wake the chip any more.
    Halted,
    /// Only a stimulus can change what the program does: it waits for a pin, or sleeps with its receiver
    /// enabled.
    BlockedOnInput,
    /// The program cannot continue.
    Error(ProgramError),
    /// The user has interrupted the run.
    Interrupted,
    /// Running backwards reached the beginning of the history.
    Beginning,
}

/// Returns the reason for a stop of the machine that no point and no goal explains. A breakpoint or a stop of
/// the probe counts as the limit of the run.
pub(super) fn session_stop_reason(stop: StopReason) -> SessionStopReason {
    match stop {
        StopReason::Error(error) => SessionStopReason::Error(error),
        StopReason::Halted => SessionStopReason::Halted,
        StopReason::Limit | StopReason::Breakpoint { .. } | StopReason::Probe => SessionStopReason::Limit,
    }
}
