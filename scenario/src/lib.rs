//! Scenarios: the stimuli that a machine gets and the behaviour that it must show, step by step.
//!
//! ```text
//!   parse.rs    parses TOML text into a model            step_keys.rs       the keys, one row each
//!   model.rs    the model, with source positions         time.rs            times as written, and in ticks
//!   vcd.rs      a waveform as a scenario of stimuli      toml_values.rs     values of TOML
//!   bind.rs     resolves names and times, makes ops      play_ops.rs        these ops
//!   world.rs    the interface to a machine               bound_scenario.rs  the output of `bind`
//!   player.rs   the engine that plays a scenario         verdict.rs         how a scenario ended
//!   recorder.rs writes recorded actions as a scenario    timed_stimuli.rs   stimuli at fixed times
//! ```
//!
//! The engine makes all decisions; a `ScenarioWorld` only acts and reports. Nothing here depends on a chip or
//! on ladder programs. `docs/scenario.md` describes the format.

#![forbid(unsafe_code)]

mod bind;
mod bound_scenario;
mod codes;
mod error;
mod model;
mod parse;
mod play_ops;
mod player;
mod recorder;
mod step_keys;
mod time;
mod timed_stimuli;
mod toml_values;
mod vcd;
mod verdict;
mod world;

pub use bind::bind;
pub use bound_scenario::BoundScenario;
pub use codes::*;
pub use error::{MachineError, ScenarioError};
pub use model::{
    Assignment, Comparison, ConditionList, LocatedBytes, LocatedText, RampTarget, Repetition, Scenario, ScenarioStep,
    ScenarioValue, StepAction, StepTime, ValueCondition,
};
pub use parse::{parse, parse_bytes};
pub use player::{PlayerState, ScenarioPlayer};
pub use recorder::{RecordedAction, Recorder};
pub use step_keys::{KEYS, STEP_KEYS, StepKey};
pub use time::{TimeScale, TimeSpan, TimeUnit};
pub use timed_stimuli::TimedStimulus;
pub use vcd::{NewlineTerminated, Waveform, read_vcd};
pub use verdict::{ScenarioOutcome, ScenarioVerdict};
pub use world::{NameResolver, OutputReading, ScenarioInput, ScenarioOutput, ScenarioWorld};
