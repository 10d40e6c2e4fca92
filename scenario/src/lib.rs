//! Scenarios: what is done to a machine and expected of it, step by step.
//!
//! ```text
//!   parse.rs   TOML text to a checked model, each part with its place     keys.rs    the keys, one row each
//!   model.rs   the model                                                   time.rs    times as people write them, and ticks
//!   vcd.rs     a waveform as a scenario of stimuli                         record.rs  what was done, as a scenario
//!   bind.rs    names and times of one machine: a program of ops            ops.rs     these ops
//!   world.rs   what a machine has to do and to tell                        player.rs  the engine
//!   timed.rs   stimuli at fixed times alone                              values.rs  values of TOML
//!   verdict.rs how a scenario ended
//! ```
//!
//! The engine decides, worlds only do and tell: nothing here knows a chip or a ladder. `docs/scenario.md` has the format.

#![forbid(unsafe_code)]

mod bind;
mod codes;
mod keys;
mod model;
mod ops;
mod parse;
mod player;
mod record;
mod time;
mod timed;
mod values;
mod vcd;
mod verdict;
mod world;

pub use bind::{Bound, bind};
pub use codes::*;
pub use keys::{KEYS, Key, STEP_KEYS};
pub use model::{Assign, Bytes, Compare, Cond, Every, Named, Scenario, Step, Test, Value, Verb, When};
pub use parse::{parse, parse_bytes};
pub use player::{Next, Player};
pub use record::{Done, Recorder};
pub use time::{Scale, Span, Unit};
pub use timed::Timed;
pub use vcd::{Waveform, WholeLines, read_vcd};
pub use verdict::{Outcome, Verdict};
pub use world::{Input, Output, Reading, Site, World};
