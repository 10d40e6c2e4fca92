//! A scenario whose names and times are those of one machine: what the player plays.

use crate::play_ops::{InputWrite, PlayAction, PlayLine, StepInfo};
use crate::world::ScenarioInput;

/// A scenario on one machine, ready to be played.
#[derive(Debug)]
pub struct BoundScenario {
    pub(crate) file: String,
    pub(crate) lines: Vec<PlayLine>,
    pub(crate) steps: Vec<StepInfo>,
    /// What is toggled somewhere: the inputs that make it 0 and 1.
    pub(crate) toggled_inputs: Vec<[ScenarioInput; 2]>,
    /// Of those the ones whose level more than one step goes by or gives.
    pub(crate) shared_bits: Vec<bool>,
    pub(crate) limit: u64,
    /// Bytes are sent in it.
    pub has_send_step: bool,
    /// Bits per second of what is sent, where it says so.
    pub baud: Option<u64>,
}

impl BoundScenario {
    /// Steps, those of repetitions once.
    #[must_use]
    pub fn len(&self) -> usize {
        self.steps.len()
    }

    /// There are no steps.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.steps.is_empty()
    }

    /// Machine cycles that a run needs to come to its limit, where a cycle is so many ticks.
    #[must_use]
    pub fn max_cycles(&self, ticks: u32) -> u64 {
        // The limit itself is the scenario's to see.
        (self.limit / u64::from(ticks.max(1))).saturating_add(1 << 16)
    }

    /// More than one step goes by, or gives, the level of a bit that this one changes, of those that toggle.
    pub(crate) fn acts_on_shared_bit(&self, act: &PlayAction) -> bool {
        act.toggled_bits().any(|bit| self.shared_bits.get(bit) == Some(&true))
    }

    /// The same of a single value.
    pub(crate) fn writes_shared_bit(&self, put: &InputWrite) -> bool {
        put.level.is_some_and(|(bit, _)| self.shared_bits.get(bit) == Some(&true))
    }

    /// Ends at this tick at the latest, whatever the file says.
    #[must_use]
    pub fn with_limit(self, limit: Option<u64>) -> BoundScenario {
        BoundScenario { limit: limit.unwrap_or(self.limit), ..self }
    }
}
