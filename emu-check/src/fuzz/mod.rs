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
mod generator;
mod element_generator;
mod shrink_program;
mod program_style;
mod tally;
mod watchdog;

pub use campaign::{FAMILIES, FUZZ_SCHEMA, CampaignFinding, CampaignPlan, CampaignRecord, CampaignShard, ProgramTrial, run_trial};
pub use generator::{program_seed, generate_program};
pub use program_style::ProgramProfile;
pub use tally::{RefusalReason, ClassTotals, ChipTally};
