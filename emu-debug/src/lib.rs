//! Tools for any [`Cpu`](emu_core::Cpu): a runner with conditions and stimuli, probes, waveforms, a debugger.
//!
//! ```text
//!   run/       the runner, its end conditions, and its controller: a scenario, or the user's timeout
//!   stimulus/  "10ms:PB0=1" to drives of pins; bytes on a serial line; scenarios on a chip with its image
//!   probes/    what a run observes: accesses, sent bytes, lints, the waveform, the cycle profile
//!   names/     "data:0x100..0x120", "main" and source lines to addresses, and back
//!   text/      "10ms" and "16MHz" to cycles, "\n\x41" to bytes, numbers as gdb prints them, errors in input
//!   devices/   devices at the pins, and a chip that runs with them
//!   coverage/  which parts of a program were executed
//!   trace/     what every instruction does, as lines and as signals
//!   lockstep/  comparison with another simulator
//!   cod/       self-checking programs, as in gpsim
//!   debug/     the debugger core: breakpoints, steps, time travel
//!   snapshot.rs  the state of a machine as a file
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

pub mod cod;
pub mod coverage;
pub mod debug;
pub mod devices;
pub mod lockstep;
mod names;
mod probes;
pub mod run;
pub mod snapshot;
pub mod stimulus;
mod text;
pub mod trace;

pub use coverage::CodeCoverage;
pub use devices::attached_devices::{self, AttachedDevices, WiredDevice};
pub use names::address_names::{self, AddressNames, AddressRange};
pub use names::bit_space;
pub use names::program_source::{self, ProgramSource};
pub use probes::access_monitor::{self, AccessMonitor};
pub use probes::dyn_probe;
pub use probes::lints::{self, LintFinding, LintProbe};
pub use probes::profile::{self, CycleProfile};
pub use probes::run_probes::{self, RunProbes};
pub use probes::uart_log::{self, UartLog};
pub use probes::waveform::{self, WaveWriter};
pub use run::run_controller::{self, ContinueCallback, RunController, RunDecision, StretchWatch};
pub use run::stop_condition::{self, StopCondition};
pub use run::{RunEnd, RunPlan, RunResult, run};
pub use stimulus::serial_sender::{self, SerialLineSender};
pub use stimulus::{TimedDrive, chip_scenario};
pub use text::input_error::InputError;
pub use text::number_formats;
pub use text::text_escapes;
pub use text::time::{self, CycleClock};
