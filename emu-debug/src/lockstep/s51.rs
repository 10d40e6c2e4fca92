//! s51 of uCsim (Debian's `sdcc-ucsim`), controlled by typed commands.
//!
//! `step` prints the registers, `state` the clocks since power-up; the set-up commands take no clocks. The
//! initial contents of memories are random there, so they are filled. Stack wrap-around is disabled as an
//! error, because silicon allows it. s51 reads commands ten times per second, so many steps are requested at
//! once. A `step` in idle mode takes one cycle of it; `run` continues up to a breakpoint.

use std::io;

use super::pipe::{PeerPipe, number_after};
use super::{PassedSleep, PeerSimulator, PeerStart, RegisterView, endless_sleep, invalid_answer};

/// The program and its package.
pub const PROGRAM: (&str, &str) = ("s51", "sdcc-ucsim");

/// Number of steps requested at once; few enough that the commands fit into a pipe while the answers wait.
const STEPS_AHEAD: u32 = 200;

/// The names of R0 to R7.
const BANK: [&str; 8] = ["r0", "r1", "r2", "r3", "r4", "r5", "r6", "r7"];

/// s51 with a program.
#[derive(Debug)]
pub struct S51Peer {
    pipe: PeerPipe,
    clocks_per_cycle: u64,
    /// Number of requested steps with unread answers.
    ahead: u32,
}

/// Returns the CPU type of s51: with timer 2 or without, CMOS (with idle and power-down) or not. No type has
/// the additions of Atmel's chips (watchdog, second data pointer).
#[must_use]
pub fn type_name_of(chip: &str) -> &'static str {
    match chip {
        "8031" | "8051" | "8751" => "51",
        "8032" | "8052" | "8752" => "52",
        "at89c52" | "at89s52" => "C52",
        _ => "C51",
    }
}

impl S51Peer {
    /// Starts s51 with a program.
    ///
    /// # Errors
    /// As [`PeerPipe::start`].
    pub fn new(start: &PeerStart<'_>) -> io::Result<S51Peer> {
        let args = ["-t", type_name_of(start.chip), "-b", "-q"];
        let mut pipe = PeerPipe::start(start, &args)?;
        pipe.write_commands(&format!(
            "set error stack off\nset error stack_overflow off\nfill iram 0 255 0\nfill xram 0 65535 0\nfile \"{}\"\nstate\n",
            start.hex
        ))?;
        pipe.read_until(is_last_line)?;
        Ok(S51Peer { pipe, clocks_per_cycle: start.clocks_per_cycle.max(1).into(), ahead: 0 })
    }

    /// Returns the next answer to `step` and `state`, or to commands with the same output.
    fn next_view(&mut self) -> io::Result<RegisterView> {
        let lines = self.pipe.read_until(is_last_line)?;
        parse_view(&lines, self.clocks_per_cycle)
            .ok_or_else(|| invalid_answer(format!("it answers `{}`", lines.join(" / "))))
    }
}

/// Returns true if the line is the last that `state` prints.
fn is_last_line(line: &str) -> bool {
    line.starts_with("Simulation:")
}

impl PeerSimulator for S51Peer {
    fn step(&mut self) -> io::Result<RegisterView> {
        if self.ahead == 0 {
            self.pipe.write_commands(&"step\nstate\n".repeat(STEPS_AHEAD as usize))?;
            self.ahead = STEPS_AHEAD;
        }
        self.ahead -= 1;
        self.next_view()
    }

    fn pass_sleep(&mut self, nap: PassedSleep) -> io::Result<RegisterView> {
        let asleep = self.step()?;
        // Steps that are already requested pass cycles of the sleep, up to the step that wakes.
        while self.ahead > 0 {
            let view = self.step()?;
            if view.pc() != asleep.pc() {
                return Ok(view);
            }
        }
        self.pipe.write_commands(&format!("break 0x{:04x}\nrun\n", nap.pc))?;
        self.pipe.read_until(|line| line.contains("Stop at")).map_err(|error| endless_sleep(error, nap))?;
        self.pipe.write_commands(&format!("clear 0x{:04x}\ninfo registers\nstate\n", nap.pc))?;
        self.next_view()
    }
}

/// Parses the output of `step` and `state`.
fn parse_view(lines: &[String], clocks_per_cycle: u64) -> Option<RegisterView> {
    // The first register dump is that of `step`; `state` repeats it.
    let head = lines.iter().position(|line| line.contains("R0 R1 R2"))?;
    let bank = lines.get(head + 1)?.split_whitespace().map(|cell| u32::from_str_radix(cell, 16).ok());
    let mut regs: Vec<(&'static str, u32)> =
        BANK.into_iter().zip(bank).filter_map(|(name, v)| Some((name, v?))).collect();
    let text = lines.join("\n");
    for (name, key) in [("ACC", "ACC= "), ("B", "  B= "), ("PSW", "PSW= "), ("SP", "\nSP "), ("DPTR", "DPTR= ")] {
        regs.push((name, number_after(&text, key, 16)? as u32));
    }
    regs.push(("PC", number_after(&text, "PC= ", 16)? as u32));
    let clocks = number_after(text.split_once("Total time since last reset=")?.1, "(", 10)?;
    (regs.len() == BANK.len() + 6).then_some(RegisterView { cycle: Some(clocks / clocks_per_cycle), regs })
}
