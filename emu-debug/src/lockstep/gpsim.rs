//! gpsim (Debian's `gpsim`): typed commands. `step` executes an instruction, without start-up timers before the first one;
//! `cycles` tells the cycle counter.

use std::io;
use std::path::Path;

use super::pipe::{Pipe, after};
use super::{Peer, View, odd};

/// The program and the package.
pub const PROGRAM: (&str, &str) = ("gpsim", "gpsim");

/// gpsim with a program.
#[derive(Debug)]
pub struct Gpsim {
    pipe: Pipe,
}

impl Gpsim {
    /// Starts it as the chip that we call `chip`, at `hz`, with the HEX file `hex` of `folder`.
    ///
    /// # Errors
    /// As [`Pipe::start`]; the chip is not known there.
    pub fn new(folder: &Path, hex: &str, chip: &str, hz: u64) -> io::Result<Gpsim> {
        let name = chip.replacen("pic", "p", 1);
        let mut pipe = Pipe::start(PROGRAM.0, &["-i"], folder)?;
        pipe.tell(&format!(
            "load {name} {hex}\nfrequency {hz}\n{name}.BreakOnInvalidRegisterRead = false\n\
             {name}.BreakOnInvalidRegisterWrite = false\npc\nW\n"
        ))?;
        let lines = pipe.until(ends)?;
        if lines.iter().any(|line| line.contains("pc = ")) {
            Ok(Gpsim { pipe })
        } else {
            Err(odd(format!("it does not load {hex} for {name}")))
        }
    }
}

/// The answer to the last command of a step.
fn ends(line: &str) -> bool {
    // Without a program there is no W.
    line.starts_with("W = ") || line.ends_with("> W") && line.contains("ERROR") || line.contains("is undefined")
}

impl Peer for Gpsim {
    fn step(&mut self) -> io::Result<View> {
        self.pipe.tell("step 1\ncycles\npc\nstatus\nfsr\nW\n")?;
        let lines = self.pipe.until(ends)?;
        view(&lines).ok_or_else(|| odd(format!("it answers `{}`", lines.join(" / "))))
    }
}

/// Reads what the commands have printed.
fn view(lines: &[String]) -> Option<View> {
    let value =
        |key: &str| lines.iter().rev().find(|line| line.starts_with(key)).and_then(|line| after(line, " = ", 16));
    let digits =
        |line: &&String| line.split_once(" = ").is_some_and(|(name, _)| name.bytes().all(|b| b.is_ascii_digit()));
    let cycle = lines.iter().find(digits).and_then(|line| after(line, " = ", 16))?;
    let regs = [("W", "W = "), ("STATUS", "status = "), ("FSR", "fsr = "), ("PC", "pc = ")];
    let regs: Option<Vec<_>> = regs.iter().map(|(name, key)| Some((*name, value(key)? as u32))).collect();
    Some(View { cycle: Some(cycle), regs: regs? })
}
