//! Probes: what a run observes, such as accesses, sent bytes, lints, the waveform and the cycle profile.

pub mod access_monitor;
pub(crate) mod combined_probe;
pub mod dyn_probe;
pub mod lints;
pub mod profile;
pub mod run_probes;
pub mod uart_log;
pub mod waveform;
