//! What a machine has to do for a scenario, and to tell.

use crate::error::ScenarioError;
use crate::model::ScenarioValue;
use crate::time::TimeScale;

/// Something that can be given a value, with the value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ScenarioInput {
    /// What the site calls it.
    pub id: usize,
    /// It can be told before its time ([`ScenarioWorld::ahead`]).
    pub can_be_queued: bool,
}

/// Something that can be looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ScenarioOutput {
    /// What the site calls it.
    pub id: usize,
    /// The least and the most that it can be.
    pub range: (i64, i64),
    /// Nothing may drive it.
    pub can_float: bool,
}

/// What something is at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutputReading {
    /// A number; of a pin 0 or 1.
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

/// A machine before it runs: what has which name, and how its time is counted.
pub trait NameResolver {
    /// Its ticks.
    fn time_scale(&self) -> TimeScale;
    /// Something and the value that it will be given.
    ///
    /// # Errors
    /// [`ScenarioError::UnknownName`] where it is the name that is wrong, else [`ScenarioError::ImpossibleValue`].
    fn resolve_input(&mut self, name: &str, value: &ScenarioValue) -> Result<ScenarioInput, ScenarioError>;
    /// One name for all names of the same thing.
    fn canonical_name(&self, name: &str) -> String {
        name.to_owned()
    }
    /// Something that can be looked at.
    ///
    /// # Errors
    /// Why not.
    fn resolve_output(&mut self, name: &str) -> Result<ScenarioOutput, ScenarioError>;
    /// All names that are worth proposing for one that is wrong.
    fn known_names(&self) -> Vec<String>;
    /// Bytes can be sent to the machine.
    ///
    /// # Errors
    /// Why not.
    fn check_can_send(&mut self) -> Result<(), ScenarioError>;
    /// Bytes can be sent at a rate that a scenario gives, in bits per second; of a ladder program that is not asked.
    ///
    /// # Errors
    /// Why not.
    fn check_baud_rate(&self, baud: u64) -> Result<(), ScenarioError> {
        let _ = baud;
        Ok(())
    }
    /// Bytes of the machine can be received.
    ///
    /// # Errors
    /// Why not.
    fn check_can_receive(&mut self) -> Result<(), ScenarioError>;
    /// Snapshots can be written.
    ///
    /// # Errors
    /// Why not.
    fn check_can_snapshot(&mut self) -> Result<(), ScenarioError>;
    /// The supply can go off and on.
    ///
    /// # Errors
    /// Why not.
    fn check_can_power_cycle(&mut self) -> Result<(), ScenarioError>;
}

/// A machine as it runs. Identifiers are those of its [`NameResolver`].
pub trait ScenarioWorld {
    /// Now, in ticks since power-up.
    fn now(&self) -> u64;
    /// How many ticks ahead stimuli are wanted, so that each takes effect at its own tick.
    fn queue_ahead_ticks(&self) -> u64 {
        0
    }
    /// Gives something its value at a tick: now, or at most [`ScenarioWorld::ahead`] later.
    ///
    /// # Errors
    /// The machine cannot take it.
    fn set_input(&mut self, input: usize, at: u64) -> Result<(), ScenarioError>;
    /// What something is at now.
    fn read_output(&self, output: usize) -> OutputReading;
    /// Sends bytes to the machine from a tick on, behind those sent before.
    ///
    /// # Errors
    /// The machine cannot take it.
    fn send(&mut self, bytes: &[u8], at: u64) -> Result<(), ScenarioError>;
    /// All bytes of the machine so far.
    fn received(&self) -> &[u8];
    /// Switches the supply off and on.
    ///
    /// # Errors
    /// Why it cannot.
    fn power_cycle(&mut self) -> Result<(), ScenarioError>;
    /// Writes the whole machine to a file.
    ///
    /// # Errors
    /// Why it cannot.
    fn snapshot(&mut self, file: &str) -> Result<(), ScenarioError>;
    /// Tells a line.
    fn log(&mut self, line: &str);
    /// A tick in words, for messages: `scan 12 (120 ms)`.
    fn describe_tick(&self, tick: u64) -> String;
}
