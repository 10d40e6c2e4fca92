//! Tools over any [`Cpu`](emu_core::Cpu): a runner with conditions and stimulus, probes, waveforms.
//!
//! ```text
//!   time.rs      "10ms", "16MHz" to whole cycles and Hz     run.rs    the runner: until what, why it ended
//!   place.rs     "data:0x100..0x120", "main" to addresses   tools.rs  all probes of a run as one
//!   stimulus.rs  "10ms:PB0=1" to drives of pins             uart.rs   what the chip sends, and texts waited for in it
//!   until.rs     "pin PB5=1" to conditions                  close.rs  accesses waited for, RAM read before written
//!   text.rs      "\n\x41" to bytes and back                 wave.rs   pins and bytes as a VCD file
//!   cod/         programs that check themselves, as gpsim does
//!   sender.rs    bytes to the edges of a serial line
//!   devices/     devices at the pins             board.rs  the chip run with them
//!   snapshot.rs  the state of a machine as a file
//!   source.rs    addresses as symbols and source lines, and back
//!   lints.rs     what programs do that is seldom meant, collected
//!   coverage/    what of a program was executed      profile.rs  where the cycles went
//!   lockstep/    beside a simulator of somebody else
//!   seer.rs      probes behind a pointer         closer.rs all that looks closely as one probe
//!   host.rs     who has a run in hand: a scenario, or the patience of the user
//!   scene.rs    names and times of scenarios on a chip with its image
//!   trace/       what every instruction does, as lines and as signals
//!   debug/       the debugger without a face: breakpoints, steps, time travel
//!   bits.rs      bits with addresses of their own, and the bytes that they are parts of
//! ```
//!
//! The readers of text give their error as one sentence that says what was found and what is wanted.

#![forbid(unsafe_code)]

pub mod bits;
pub mod board;
pub mod close;
mod closer;
pub mod cod;
pub mod coverage;
pub mod debug;
pub mod devices;
pub mod host;
pub mod lints;
pub mod lockstep;
pub mod numbers;
pub mod place;
pub mod profile;
pub mod run;
pub mod scene;
pub mod seer;
pub mod sender;
pub mod snapshot;
pub mod source;
pub mod stimulus;
pub mod text;
pub mod time;
pub mod tools;
pub mod trace;
pub mod uart;
pub mod until;
pub mod wave;

pub use board::{Board, Fitted};
pub use close::Close;
pub use coverage::Coverage;
pub use host::{Going, Host, Patience, Watched};
pub use lints::{Found, Lints};
pub use place::{Names, Range};
pub use profile::Profile;
pub use run::{Ended, Plan, Reason, run};
pub use sender::Sender;
pub use source::Source;
pub use stimulus::Drive;
pub use time::Clock;
pub use tools::Tools;
pub use uart::Uart;
pub use until::Until;
pub use wave::Wave;
