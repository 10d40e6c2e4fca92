//! Random valid ladder programs, each compiled for a chip of every family that can express it and checked there.
//!
//! ```text
//!   seed, number -> style -> draw (elements) -> program --check on each chip--> tally, findings -> record of a shard
//!                                                                  |                                     |
//!                                                                  +--> smaller                          +--> merge
//! ```
//!
//! Program n of a seed is the same whatever shard or job draws it, and whatever chips it is for. See `docs/fuzz.md`.

mod campaign;
mod element_generator;
mod generator;
mod program_style;
mod shrink_program;
mod tally;
mod watchdog;

pub use campaign::{
    CampaignFinding, CampaignPlan, CampaignRecord, CampaignShard, FAMILIES, FUZZ_SCHEMA, ProgramTrial, run_trial,
};
pub use generator::{generate_program, program_seed};
pub use program_style::ProgramProfile;
pub use tally::{ChipTally, ClassTotals, RefusalReason};
