//! s51 of uCsim (Debian's `sdcc-ucsim`): typed commands. `step` prints the registers, `state` the clocks since power-up; setting
//! up takes none. Memories are random there at first, so they are filled; a stack that comes round is no error on silicon. It looks
//! for commands ten times a second, so many steps are asked for at once.

use std::io;
use std::path::Path;

use super::pipe::{Pipe, after};
use super::{Peer, View, odd};

/// The program and the package.
pub const PROGRAM: (&str, &str) = ("s51", "sdcc-ucsim");

/// Steps that are asked for at once; few enough that the commands fit into a pipe while the answers wait.
const AHEAD: u32 = 200;

/// The names of R0 to R7.
const BANK: [&str; 8] = ["r0", "r1", "r2", "r3", "r4", "r5", "r6", "r7"];

/// s51 with a program.
#[derive(Debug)]
pub struct S51 {
    pipe: Pipe,
    clocks_per_cycle: u64,
    /// Steps asked for whose answers were not read.
    ahead: u32,
}

impl S51 {
    /// Starts it as an 8052 with the HEX file `hex` of `folder`.
    ///
    /// # Errors
    /// As [`Pipe::start`].
    pub fn new(folder: &Path, hex: &str, clocks_per_cycle: u32) -> io::Result<S51> {
        let mut pipe = Pipe::start(PROGRAM.0, &["-t", "8052", "-b", "-q"], folder)?;
        pipe.tell(&format!(
            "set error stack off\nset error stack_overflow off\nfill iram 0 255 0\nfill xram 0 65535 0\nfile \"{hex}\"\nstate\n"
        ))?;
        pipe.until(|line| line.starts_with("Simulation:"))?;
        Ok(S51 { pipe, clocks_per_cycle: clocks_per_cycle.max(1).into(), ahead: 0 })
    }
}

impl Peer for S51 {
    fn step(&mut self) -> io::Result<View> {
        if self.ahead == 0 {
            self.pipe.tell(&"step\nstate\n".repeat(AHEAD as usize))?;
            self.ahead = AHEAD;
        }
        self.ahead -= 1;
        let lines = self.pipe.until(|line| line.starts_with("Simulation:"))?;
        view(&lines, self.clocks_per_cycle).ok_or_else(|| odd(format!("it answers `{}`", lines.join(" / "))))
    }
}

/// Reads what `step` and `state` have printed.
fn view(lines: &[String], clocks_per_cycle: u64) -> Option<View> {
    // The first dump of registers is that of `step`; `state` shows the same again.
    let head = lines.iter().position(|line| line.contains("R0 R1 R2"))?;
    let bank = lines.get(head + 1)?.split_whitespace().map(|cell| u32::from_str_radix(cell, 16).ok());
    let mut regs: Vec<(&'static str, u32)> =
        BANK.into_iter().zip(bank).filter_map(|(name, v)| Some((name, v?))).collect();
    let text = lines.join("\n");
    for (name, key) in [("ACC", "ACC= "), ("B", "  B= "), ("PSW", "PSW= "), ("SP", "\nSP "), ("DPTR", "DPTR= ")] {
        regs.push((name, after(&text, key, 16)? as u32));
    }
    regs.push(("PC", after(&text, "PC= ", 16)? as u32));
    let clocks = after(text.split_once("Total time since last reset=")?.1, "(", 10)?;
    (regs.len() == BANK.len() + 6).then_some(View { cycle: Some(clocks / clocks_per_cycle), regs })
}
