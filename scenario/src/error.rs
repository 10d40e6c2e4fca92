//! What can be wrong with a time, with a name, and with what a machine is asked to do.

use std::error::Error;

/// A machine's own error. The scenario adds where it came from.
pub type MachineError = Box<dyn Error + Send + Sync>;

/// Why a time cannot be read or counted, or why a machine refuses a name, a value or a step. `Display` is the cause, one
/// sentence without a full stop.
#[derive(Debug, thiserror::Error)]
pub enum ScenarioError {
    /// A text is not a number with a unit.
    #[error("`{text}` is no time")]
    NotATime {
        /// The text, shortened for messages.
        text: String,
    },
    /// The number of a time has too many digits.
    #[error("`{text}` has more than {most} digits")]
    TooManyDigits {
        /// The time, shortened for messages.
        text: String,
        /// Most digits that a time may have.
        most: usize,
    },
    /// A number has no unit.
    #[error("`{text}` has no unit")]
    MissingUnit {
        /// The number, shortened for messages.
        text: String,
    },
    /// A unit is none of time.
    #[error("`{unit}` is no unit of time")]
    UnknownUnit {
        /// The unit, shortened for messages.
        unit: String,
    },
    /// A count of cycles, clocks or scans has decimals.
    #[error("`{text}` is no whole number of {unit}")]
    FractionalCount {
        /// The time, shortened for messages.
        text: String,
        /// The unit as written.
        unit: String,
    },
    /// A time is in scans, and the machine has none.
    #[error("`{time}`: an image has no scans, only a ladder program has")]
    NoScans {
        /// The time as written.
        time: String,
    },
    /// A time has too many ticks.
    #[error("`{time}` is longer than 2^62 ticks, the most")]
    TimeTooLong {
        /// The time as written.
        time: String,
    },
    /// A name stands for nothing on the machine.
    #[error(transparent)]
    UnknownName(MachineError),
    /// The machine has the name and cannot take the value.
    #[error(transparent)]
    ImpossibleValue(MachineError),
    /// The machine does not do what a step asks for.
    #[error(transparent)]
    Refused(MachineError),
}

impl ScenarioError {
    /// The advice for a time that a machine cannot count ([`TimeScale::ticks`](crate::TimeScale::ticks)).
    pub(crate) fn time_hint(&self) -> &'static str {
        match self {
            ScenarioError::NoScans { .. } => "give the time in us, ms, s or cycles",
            _ => "give a shorter time",
        }
    }
}
