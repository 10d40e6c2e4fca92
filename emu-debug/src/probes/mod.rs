//! Probes: what a run observes, such as accesses, sent bytes, lints, the waveform and the cycle profile.
//!
//! ```text
//!   RunProbes         serial output, awaited levels, waveform; contains one observer of instructions:
//!     CombinedProbe   conditions (AccessMonitor), lints, trace, and
//!       DynRunProbe   coverage or profile of the command, behind a pointer
//!   LevelProbe        for the debugger: any probe behind a pointer (DynProbe), one loop per ObserveLevel
//! ```

pub mod access_monitor;
pub(crate) mod combined_probe;
pub mod dyn_probe;
pub mod lints;
pub mod profile;
pub mod run_probes;
pub mod uart_log;
pub mod waveform;
