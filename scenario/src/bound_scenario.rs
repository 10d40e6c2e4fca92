//! A scenario bound to one machine; the player plays it.

use crate::play_ops::{InputWrite, PlayAction, PlayLine, StepInfo};
use crate::world::ScenarioInput;

/// A scenario whose names and times are resolved for one machine, ready to be played.
#[derive(Debug)]
pub struct BoundScenario {
    /// The name of the file of the scenario.
    pub(crate) file: String,
    /// The ops, in order.
    pub(crate) lines: Vec<PlayLine>,
    /// The steps, for messages.
    pub(crate) steps: Vec<StepInfo>,
    /// Per toggled input: the inputs that set it to 0 and to 1.
    pub(crate) toggled_inputs: Vec<[ScenarioInput; 2]>,
    /// Per toggled input: true if more than one step reads or sets its level.
    pub(crate) shared_bits: Vec<bool>,
    /// The tick at which the scenario ends at the latest.
    pub(crate) limit: u64,
    /// True if a step sends bytes.
    pub has_send_step: bool,
    /// Bits per second of the bytes sent, if the scenario sets it.
    pub baud: Option<u64>,
}

impl BoundScenario {
    /// Number of steps; the steps of a repetition count once.
    #[must_use]
    pub fn len(&self) -> usize {
        self.steps.len()
    }

    /// True if there are no steps.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.steps.is_empty()
    }

    /// Machine cycles that a run needs to reach the limit of the scenario, with `ticks` ticks per cycle.
    #[must_use]
    pub fn max_cycles(&self, ticks: u32) -> u64 {
        // 65,536 cycles more than the limit, because the scenario itself must detect the limit.
        (self.limit / u64::from(ticks.max(1))).saturating_add(1 << 16)
    }

    /// True if the action changes a toggled bit whose level more than one step reads or sets.
    pub(crate) fn acts_on_shared_bit(&self, act: &PlayAction) -> bool {
        act.toggled_bits().any(|bit| self.shared_bits.get(bit) == Some(&true))
    }

    /// True if the write changes a toggled bit whose level more than one step reads or sets.
    pub(crate) fn writes_shared_bit(&self, put: &InputWrite) -> bool {
        put.level.is_some_and(|(bit, _)| self.shared_bits.get(bit) == Some(&true))
    }

    /// Replaces the limit of the scenario by `limit`, in ticks, if one is given.
    #[must_use]
    pub fn with_limit(self, limit: Option<u64>) -> BoundScenario {
        BoundScenario { limit: limit.unwrap_or(self.limit), ..self }
    }
}
