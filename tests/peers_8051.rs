//! Comparisons of the 8051 with s51 of uCsim (Debian's sdcc-ucsim).
//!
//! A plain `cargo test` ignores them; `.ci/peers` installs the peer and runs them. Random tests take their
//! seed from the variable EMU_SEED and print it.

#[path = "peers/s51/batch.rs"]
mod batch;
#[path = "peers/s51/drive.rs"]
mod drive;
#[path = "peers/s51/findings.rs"]
mod findings;
#[path = "peers/s51/opcodes.rs"]
mod opcodes;
#[path = "peers/s51/program.rs"]
mod program;
