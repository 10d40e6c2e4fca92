//! Errors of times, of names, and of requests to a machine.

use std::error::Error;

/// An error that a machine reports. The scenario adds its position in the file.
pub type MachineError = Box<dyn Error + Send + Sync>;

/// The reason why a time is invalid, or why a machine refuses a name, a value or a step. `Display` gives the
/// cause as one sentence without a full stop.
#[derive(Debug, thiserror::Error)]
pub enum ScenarioError {
    /// A text is not a number with a unit.
    #[error("`{text}` is not a time")]
    NotATime {
        /// The text, shortened for messages.
        text: String,
    },
    /// The number of a time has too many digits.
    #[error("`{text}` has more than {most} digits")]
    TooManyDigits {
        /// The time, shortened for messages.
        text: String,
        /// Maximum number of digits of a time.
        most: usize,
    },
    /// A number has no unit.
    #[error("`{text}` has no unit")]
    MissingUnit {
        /// The number, shortened for messages.
        text: String,
    },
    /// The unit is not a unit of time.
    #[error("`{unit}` is not a unit of time")]
    UnknownUnit {
        /// The unit, shortened for messages.
        unit: String,
    },
    /// A count of cycles, clocks or scans has decimals.
    #[error("`{text}` is not a whole number of {unit}")]
    FractionalCount {
        /// The time, shortened for messages.
        text: String,
        /// The unit as written.
        unit: String,
    },
    /// The time is in scans, but the machine has none.
    #[error("`{time}`: an image has no scans, only a ladder program has")]
    NoScans {
        /// The time as written.
        time: String,
    },
    /// The time is too long in ticks.
    #[error("`{time}` is longer than 2^62 ticks, the most")]
    TimeTooLong {
        /// The time as written.
        time: String,
    },
    /// The machine does not have the name.
    #[error(transparent)]
    UnknownName(MachineError),
    /// The machine has the name, but it cannot take the value.
    #[error(transparent)]
    ImpossibleValue(MachineError),
    /// The machine does not support a step.
    #[error(transparent)]
    Refused(MachineError),
}

impl ScenarioError {
    /// The hint for a time that cannot be converted to ticks ([`TimeScale::ticks`](crate::TimeScale::ticks)).
    pub(crate) fn time_hint(&self) -> &'static str {
        match self {
            ScenarioError::NoScans { .. } => "give the time in us, ms, s or cycles",
            _ => "give a shorter time",
        }
    }
}
