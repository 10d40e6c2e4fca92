//! The interface between a scenario and a machine: names before the run, actions and observations during it.

use crate::error::ScenarioError;
use crate::model::ScenarioValue;
use crate::time::TimeScale;

/// An input together with a value for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ScenarioInput {
    /// The identifier that the resolver assigned.
    pub id: usize,
    /// True if the machine accepts the value before its time ([`ScenarioWorld::queue_ahead_ticks`]).
    pub can_be_queued: bool,
}

/// An output that can be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ScenarioOutput {
    /// The identifier that the resolver assigned.
    pub id: usize,
    /// The smallest and the largest value.
    pub range: (i64, i64),
    /// True if the output is a pin that may float.
    pub can_float: bool,
}

/// The current value of an output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutputReading {
    /// A number; 0 or 1 for a pin.
    Value(i64),
    /// A pin that nothing drives.
    Floating,
}

impl std::fmt::Display for OutputReading {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            OutputReading::Value(value) => write!(f, "{value}"),
            OutputReading::Floating => f.write_str("z"),
        }
    }
}

/// A machine before it runs: resolves names and defines the ticks of its time.
pub trait NameResolver {
    /// The ticks of the machine's time.
    fn time_scale(&self) -> TimeScale;
    /// Resolves an input and a value for it.
    ///
    /// # Errors
    /// [`ScenarioError::UnknownName`] if the name is wrong, otherwise [`ScenarioError::ImpossibleValue`].
    fn resolve_input(&mut self, name: &str, value: &ScenarioValue) -> Result<ScenarioInput, ScenarioError>;
    /// One canonical name for all names of the same item.
    fn canonical_name(&self, name: &str) -> String {
        name.to_owned()
    }
    /// Resolves an output.
    ///
    /// # Errors
    /// The machine does not have the name, or it cannot be read.
    fn resolve_output(&mut self, name: &str) -> Result<ScenarioOutput, ScenarioError>;
    /// All names that may be suggested for a wrong one.
    fn known_names(&self) -> Vec<String>;
    /// Checks that bytes can be sent to the machine.
    ///
    /// # Errors
    /// The reason why they cannot.
    fn check_can_send(&mut self) -> Result<(), ScenarioError>;
    /// Checks the baud rate of a scenario, in bits per second; a ladder program accepts every rate.
    ///
    /// # Errors
    /// The machine cannot receive at this rate.
    fn check_baud_rate(&self, baud: u64) -> Result<(), ScenarioError> {
        let _ = baud;
        Ok(())
    }
    /// Checks that bytes of the machine can be received.
    ///
    /// # Errors
    /// The reason why they cannot.
    fn check_can_receive(&mut self) -> Result<(), ScenarioError>;
    /// Checks that snapshots can be written.
    ///
    /// # Errors
    /// The reason why they cannot.
    fn check_can_snapshot(&mut self) -> Result<(), ScenarioError>;
    /// Checks that the supply can be switched off and on.
    ///
    /// # Errors
    /// The reason why it cannot.
    fn check_can_power_cycle(&mut self) -> Result<(), ScenarioError>;
}

/// A running machine. Identifiers are those of its [`NameResolver`].
pub trait ScenarioWorld {
    /// The current time in ticks since power-up.
    fn now(&self) -> u64;
    /// How many ticks in advance the machine wants stimuli, so that each takes effect at its own tick.
    fn queue_ahead_ticks(&self) -> u64 {
        0
    }
    /// Sets an input to its value at tick `at`: now, or at most [`ScenarioWorld::queue_ahead_ticks`] later.
    ///
    /// # Errors
    /// The machine cannot take the value.
    fn set_input(&mut self, input: usize, at: u64) -> Result<(), ScenarioError>;
    /// The current value of an output.
    fn read_output(&self, output: usize) -> OutputReading;
    /// Sends bytes to the machine from tick `at` on, after bytes that were sent before.
    ///
    /// # Errors
    /// The machine cannot receive bytes.
    fn send(&mut self, bytes: &[u8], at: u64) -> Result<(), ScenarioError>;
    /// All bytes that the machine has sent so far.
    fn received(&self) -> &[u8];
    /// Switches the supply off and on.
    ///
    /// # Errors
    /// The reason why the machine cannot do it.
    fn power_cycle(&mut self) -> Result<(), ScenarioError>;
    /// Writes the state of the whole machine to a file.
    ///
    /// # Errors
    /// The file cannot be written, or the machine has no snapshots.
    fn snapshot(&mut self, file: &str) -> Result<(), ScenarioError>;
    /// Logs a line.
    fn log(&mut self, line: &str);
    /// A tick as text for messages: `scan 12 (120 ms)`.
    fn describe_tick(&self, tick: u64) -> String;
}
