//! Scenarios: what is done to a machine and expected of it, step by step.
//!
//! ```text
//!   parse.rs   TOML text to a checked model, each part with its place     step_keys.rs    the keys, one row each
//!   model.rs   the model                                                   time.rs    times as people write them, and ticks
//!   vcd.rs     a waveform as a scenario of stimuli                         record.rs  what was done, as a scenario
//!   bind.rs    names and times of one machine: a program of ops            play_ops.rs     these ops
//!   world.rs   what a machine has to do and to tell                        player.rs  the engine
//!   timed_stimuli.rs   stimuli at fixed times alone                              values.rs  values of TOML
//!   verdict.rs how a scenario ended                                 bound_scenario.rs  what `bind` makes, and the player plays
//! ```
//!
//! The engine decides, worlds only do and tell: nothing here knows a chip or a ladder. `docs/scenario.md` has the format.

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
    Assignment, Comparison, ConditionList, LocatedBytes, LocatedText, Repetition, Scenario, ScenarioStep,
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
