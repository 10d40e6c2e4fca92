//! Tools for any [`Cpu`](emu_core::Cpu): a runner with conditions and stimuli, probes, waveforms, a debugger.
//!
//! ```text
//!   input_error.rs     errors in user input
//!   time.rs            "10ms", "16MHz" to whole cycles and Hz
//!   address_names.rs   "data:0x100..0x120", "main" to addresses
//!   bit_space.rs       bits with addresses of their own, and their bytes
//!   program_source.rs  addresses to symbols and source lines, and back
//!   stimulus.rs        "10ms:PB0=1" to drives of pins
//!   stop_condition.rs  "pin PB5=1" to conditions
//!   text_escapes.rs    "\n\x41" to bytes and back
//!   number_formats.rs  numbers in the formats of gdb
//!   serial_sender.rs   bytes to the edges of a serial line
//!   chip_scenario.rs   names and times of scenarios on a chip with its image
//!   run.rs             the runner: its end conditions, and why it ended
//!   run_controller.rs  the controller of a run: a scenario, or the user's timeout
//!   run_probes.rs      all probes of a run as one
//!   combined_probe.rs  all probes for instructions and accesses as one
//!   dyn_probe.rs       probes behind a pointer
//!   access_monitor.rs  watched accesses, RAM read before it is written
//!   uart_log.rs        what the chip sends, and texts to wait for in it
//!   waveform.rs        pins and bytes as a VCD file
//!   lints.rs           collects suspicious behaviour of programs
//!   devices/           devices at the pins
//!   attached_devices.rs  runs a chip with devices
//!   snapshot.rs        the state of a machine as a file
//!   coverage/          which parts of a program were executed
//!   profile.rs         where the cycles went
//!   trace/             what every instruction does, as lines and as signals
//!   lockstep/          comparison with another simulator
//!   cod/               self-checking programs, as in gpsim
//!   debug/             the debugger core: breakpoints, steps, time travel
//! ```
//!
//! Parsers of text return an [`InputError`]: one sentence with what was found and what is expected.
//!
//! ```
//! use emu_avr::{Avr, chips::ATMEGA328P};
//! use emu_core::RamInit;
//! use emu_debug::{AddressNames, RunEnd, RunPlan, run, stop_condition::parse_condition};
//!
//! let image = emu_asm::assemble_text(&ATMEGA328P, "ldi r16, 32\nout 4, r16\nout 5, r16\nrjmp .")?;
//! let mut avr = Avr::new(&ATMEGA328P, &image, RamInit::Zero);
//! let names = AddressNames { chip: &ATMEGA328P, symbols: &[] };
//! let until = vec![parse_condition(&names, "pin PB5=1")?];
//! let plan = RunPlan { limit: 10_000_000, until, ..RunPlan::default() };
//! let result = run(&mut avr, &plan, None, &mut |_sent_bytes| true);
//! assert_eq!(result.reason, RunEnd::Until(0, None));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

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
