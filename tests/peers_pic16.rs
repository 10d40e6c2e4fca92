//! Comparisons of the PIC16 with gpsim (Debian's gpsim), with programs assembled by gpasm (gputils).
//!
//! A plain `cargo test` ignores the tests that need them; `.ci/peers` installs them and runs these tests.
//! Random tests take their seed from the variable EMU_SEED and print it.

#[path = "peers/gpsim/batch.rs"]
mod batch;
#[path = "peers/gpsim/drive.rs"]
mod drive;
#[path = "peers/gpsim/findings.rs"]
mod findings;
#[path = "peers/gpsim/instructions.rs"]
mod instructions;
#[path = "peers/gpsim/programs.rs"]
mod programs;
