//! Fuzzing with random valid ladder programs: each is compiled for a chip of every family that supports it,
//! and checked there.
//!
//! ```text
//!   seed, number -> program_style -> generator -> program --check on each chip--> tally, findings -> record
//!                                                                                     |            |
//!                                                                      shrink_program <--+      merge <--+
//! ```
//!
//! Program n of a seed does not depend on the shard or job that generates it, nor on the chips. See
//! `docs/fuzz.md`.

mod campaign;
mod element_generator;
mod flow_generator;
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
