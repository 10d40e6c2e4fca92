//! Tools over any [`Cpu`](emu_core::Cpu): a runner with conditions and stimulus, probes, waveforms.
//!
//! ```text
//!   input_error.rs  what is wrong with what users give
//!   time.rs      "10ms", "16MHz" to whole cycles and Hz     run.rs    the runner: until what, why it ended
//!   place.rs     "data:0x100..0x120", "main" to addresses   tools.rs  all probes of a run as one
//!   stimulus.rs  "10ms:PB0=1" to drives of pins             uart.rs   what the chip sends, and texts waited for in it
//!   stop_condition.rs     "pin PB5=1" to conditions                  access_monitor.rs  accesses waited for, RAM read before written
//!   text.rs      "\n\x41" to bytes and back                 wave.rs   pins and bytes as a VCD file
//!   cod/         programs that check themselves, as gpsim does
//!   sender.rs    bytes to the edges of a serial line
//!   devices/     devices at the pins             attached_devices.rs  the chip run with them
//!   snapshot.rs  the state of a machine as a file
//!   source.rs    addresses as symbols and source lines, and back
//!   lints.rs     what programs do that is seldom meant, collected
//!   coverage/    what of a program was executed      profile.rs  where the cycles went
//!   lockstep/    beside a simulator of somebody else
//!   dyn_probe.rs      probes behind a pointer         combined_probe.rs all that looks closely as one probe
//!   run_controller.rs     who has a run in hand: a scenario, or the patience of the user
//!   scene.rs    names and times of scenarios on a chip with its image
//!   trace/       what every instruction does, as lines and as signals
//!   debug/       the debugger without a face: breakpoints, steps, time travel
//!   bits.rs      bits with addresses of their own, and the bytes that they are parts of
//! ```
//!
//! The readers of text give an [`InputError`]: one sentence that says what was found and what is wanted.

#![forbid(unsafe_code)]

pub mod access_monitor;
pub mod address_names;
pub mod attached_devices;
pub mod bit_space;
pub mod chip_scenario;
pub mod cod;
mod combined_probe;
pub mod coverage;
pub mod debug;
pub mod devices;
pub mod dyn_probe;
mod input_error;
pub mod lints;
pub mod lockstep;
pub mod number_formats;
pub mod profile;
pub mod program_source;
pub mod run;
pub mod run_controller;
pub mod run_probes;
pub mod serial_sender;
pub mod snapshot;
pub mod stimulus;
pub mod stop_condition;
pub mod text_escapes;
pub mod time;
pub mod trace;
pub mod uart_log;
pub mod waveform;

pub use access_monitor::AccessMonitor;
pub use address_names::{AddressNames, AddressRange};
pub use attached_devices::{AttachedDevices, WiredDevice};
pub use coverage::CodeCoverage;
pub use input_error::InputError;
pub use lints::{LintFinding, LintProbe};
pub use profile::CycleProfile;
pub use program_source::ProgramSource;
pub use run::{RunEnd, RunPlan, RunResult, run};
pub use run_controller::{ContinueCallback, RunController, RunDecision, StretchWatch};
pub use run_probes::RunProbes;
pub use serial_sender::SerialLineSender;
pub use stimulus::TimedDrive;
pub use stop_condition::StopCondition;
pub use time::CycleClock;
pub use uart_log::UartLog;
pub use waveform::WaveWriter;
