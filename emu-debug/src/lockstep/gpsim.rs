//! gpsim (Debian's `gpsim`), controlled by typed commands.
//!
//! `step` executes an instruction, without start-up timers before the first one. `cycles` prints the cycle
//! counter even after errors, so it ends every answer. gpsim reports unknown commands in separate lines after
//! the prompt. A `step` in sleep takes one cycle of it; `run` continues up to a break.

use std::io;

use super::pipe::{PeerPipe, number_after};
use super::{PassedSleep, PeerSimulator, PeerStart, RegisterView, endless_sleep, invalid_answer, unknown_chip};

/// The program and its package.
pub const PROGRAM: (&str, &str) = ("gpsim", "gpsim");

/// Prints the chip registers, which include W, if W cannot be printed alone.
const DUMP_REGISTERS: &str = "dump s";

/// gpsim with a program.
#[derive(Debug)]
pub struct GpsimPeer {
    pipe: PeerPipe,
    /// The command that prints W.
    w: &'static str,
}

/// Returns the chip of gpsim that is equivalent to `chip`: the 16F84A differs from the 16F84 only in its
/// speed (DS35007, section 1), and the 16F871 is a 16F870 with ports D and E (DS30569, table 1-1).
#[must_use]
pub fn equivalent_chip(chip: &str) -> Option<&'static str> {
    match chip {
        "pic16f84a" => Some("p16f84"),
        "pic16f870" => Some("p16f871"),
        _ => None,
    }
}

impl GpsimPeer {
    /// Starts gpsim with a program.
    ///
    /// # Errors
    /// As [`PeerPipe::start`]; or gpsim does not know the chip.
    pub fn new(start: &PeerStart<'_>) -> io::Result<GpsimPeer> {
        let name = equivalent_chip(start.chip).map_or_else(|| start.chip.replacen("pic", "p", 1), str::to_owned);
        let mut pipe = PeerPipe::start(start, &["-i"])?;
        let (hex, hz) = (start.hex, start.hz);
        pipe.write_commands(&format!(
            "load {name} {hex}\nfrequency {hz}\n{name}.BreakOnInvalidRegisterRead = false\n\
             {name}.BreakOnInvalidRegisterWrite = false\npc\nW\ncycles\n"
        ))?;
        let lines = pipe.read_until(is_last_line)?;
        if lines.iter().any(|line| line.contains("not a valid processor")) {
            return Err(unknown_chip(start.chip));
        }
        if !lines.iter().any(|line| line.starts_with("pc = ")) {
            return Err(invalid_answer(format!("it does not load {hex} for {name}: {}", error_message(&lines))));
        }
        // The 16C71 has no register of that name (0.31).
        let w = if lines.iter().any(|line| line.starts_with("W = ")) { "W" } else { DUMP_REGISTERS };
        Ok(GpsimPeer { pipe, w })
    }

    /// Returns the registers after these commands.
    fn query_view(&mut self, commands: &str) -> io::Result<RegisterView> {
        self.pipe.write_commands(&format!("{commands}pc\nstatus\nfsr\n{}\ncycles\n", self.w))?;
        let lines = self.pipe.read_until(is_last_line)?;
        parse_view(&lines).ok_or_else(|| invalid_answer(error_message(&lines)))
    }
}

/// Returns true if the line answers the last command: the cycle counter, as `N = 0xN`.
fn is_last_line(line: &str) -> bool {
    line.split_once(" = 0x").is_some_and(|(name, _)| !name.is_empty() && name.bytes().all(|b| b.is_ascii_digit()))
}

/// Returns the error message of an answer.
fn error_message(lines: &[String]) -> String {
    let found = lines.iter().find(|line| line.contains("ERROR") || line.contains("failed"));
    found.map_or_else(|| format!("it answers `{}`", lines.join(" / ")), |line| format!("it says `{line}`"))
}

impl PeerSimulator for GpsimPeer {
    fn step(&mut self) -> io::Result<RegisterView> {
        self.query_view("step 1\n")
    }

    fn pass_sleep(&mut self, nap: PassedSleep) -> io::Result<RegisterView> {
        self.query_view("step 1\n")?;
        // A break at a cycle would end a sleep without a wake, but it cannot be removed (0.31).
        let view =
            self.query_view(&format!("break e 0x{:x}\nrun\n", nap.pc)).map_err(|error| endless_sleep(error, nap))?;
        self.pipe.write_commands("clear 0\ncycles\n")?;
        self.pipe.read_until(is_last_line)?;
        Ok(view)
    }
}

/// Parses the output of the commands.
fn parse_view(lines: &[String]) -> Option<RegisterView> {
    let value = |key: &str| {
        lines
            .iter()
            .rev()
            .find(|line| line.starts_with(key))
            .and_then(|line| number_after(line, " = ", 16))
            .map(|n| n as u32)
    };
    let cycle = lines.iter().rev().find(|line| is_last_line(line)).and_then(|line| number_after(line, " = ", 16))?;
    let dumped = || {
        let line = lines.iter().find(|line| line.contains(" W  "))?;
        number_after(line.split_once(" W  ")?.1, "=", 16).map(|n| n as u32)
    };
    let (status, fsr, pc) = (value("status = ")?, value("fsr = ")?, value("pc = ")?);
    let w = value("W = ").or_else(dumped)?;
    Some(RegisterView { cycle: Some(cycle), regs: vec![("W", w), ("STATUS", status), ("FSR", fsr), ("PC", pc)] })
}
