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
mod draw;
mod element;
mod smaller;
mod style;
mod tally;
mod watchdog;

pub use campaign::{FAMILIES, FUZZ_SCHEMA, Finding, Plan, Record, Shard, Trial, trial};
pub use draw::{own_seed, program};
pub use style::Profile;
pub use tally::{Reason, Seen, Tally};
