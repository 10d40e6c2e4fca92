//! The debugger's screen: code, registers, pins, a waveform, and the rung with power flow, memory or symbols.
//!
//! It knows no machine. A [`Machine`] tells what is to be seen as plain data ([`Sight`]) and obeys the commands that
//! `docs/debug.md` lists; keys are short for such commands. `update` is what keys do, `view` what it looks like.

mod panes;
#[cfg(test)]
mod tests;
mod update;
mod view;

use std::time::Duration;

use ratatui_core::buffer::Buffer;
use ratatui_core::layout::Rect;

use crate::flow::Sign;
use crate::{App, Key, Look, Wish};

/// What the screen wants to see, so that no more is collected than it shows.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Wants {
    /// Program word around which code is shown; nothing stands for the instruction that is next.
    pub around: Option<u32>,
    /// Instructions on each side of it.
    pub lines: usize,
    /// Columns for the rung; 0 wants none.
    pub rung: usize,
    /// Which memory, counted around, from which address on, and how many bytes; 0 wants none.
    pub memory: (usize, u32, usize),
    /// Machine cycle from which edges of pins are wanted.
    pub since: u64,
    /// The source line around which the source is shown, of the file that is shown; nothing stands for where the machine is.
    pub line: Option<u32>,
    /// Source lines on each side of it; 0 wants none.
    pub source: usize,
    /// What the serial port has sent is wanted.
    pub serial: bool,
}

/// An instruction.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Code {
    /// Program word.
    pub word: u32,
    /// Its address as commands take it: `0x0086`.
    pub address: String,
    /// What has its name here.
    pub label: Option<String>,
    /// The source line that begins here.
    pub source: Option<String>,
    /// Mnemonic and operands.
    pub text: String,
    /// What the operands mean; empty where nothing is known.
    pub meant: String,
    /// The breakpoint here, by its number.
    pub point: Option<u32>,
}

/// A part of a source file.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Source {
    /// The file.
    pub file: String,
    /// The line where the machine is, if it is in this file.
    pub here: Option<u32>,
    /// The line around which it is shown.
    pub around: u32,
    /// Lines with their numbers, and the breakpoint on each by its number.
    pub lines: Vec<(u32, String, Option<u32>)>,
}

/// A value with a name.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Value {
    /// Its name.
    pub name: String,
    /// Its value.
    pub text: String,
    /// It is not what it was at the last stop.
    pub changed: bool,
}

/// A pin over time.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Trace {
    /// Its name.
    pub name: String,
    /// High now.
    pub high: bool,
    /// Machine cycles of its edges, rising, and what it was from then on.
    pub edges: Vec<(u64, bool)>,
}

/// A stretch of memory.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Memory {
    /// The memory.
    pub name: String,
    /// Address of the first byte.
    pub at: u32,
    /// Bytes, and whether they have changed since the last stop; nothing where there is none.
    pub bytes: Vec<(Option<u8>, bool)>,
}

/// Everything that the screen shows of a machine, as plain data.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sight {
    /// What is debugged.
    pub title: String,
    /// Where it is in time: cycle, seconds, scan, rung.
    pub time: String,
    /// Program word of the instruction that is next.
    pub pc: u32,
    /// Machine cycles since power-up.
    pub cycle: u64,
    /// Instructions around the place that is wanted.
    pub code: Vec<Code>,
    /// The source around the line that is wanted; nothing where there is none, or none is wanted.
    pub source: Option<Source>,
    /// What the serial port has sent, in lines.
    pub serial: Vec<String>,
    /// Registers of the core.
    pub registers: Vec<Value>,
    /// Pins: 0, 1 or z.
    pub pins: Vec<Value>,
    /// Symbols of a ladder program; empty where there is none.
    pub symbols: Vec<Value>,
    /// The rung in which the machine is; nothing where there is no ladder program, or none is wanted.
    pub rung: Option<Vec<Vec<Sign>>>,
    /// Memory, where it is wanted.
    pub memory: Option<Memory>,
    /// Pins that have moved, over time.
    pub traces: Vec<Trace>,
}

/// What came of a command.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Answer {
    /// What it said, in lines.
    pub text: String,
    /// It failed.
    pub failed: bool,
    /// It was the last.
    pub quit: bool,
}

/// A machine under the debugger, and the commands that it obeys.
pub trait Machine {
    /// What is to be seen of it now.
    fn sight(&self, wants: &Wants) -> Sight;
    /// Carries out a command, to its end or until the user stops it.
    fn obey(&mut self, line: &str) -> Answer;
    /// Runs for so many machine cycles, for so long on the host's clock, whichever ends first. Says why where something else
    /// has stopped it.
    fn advance(&mut self, cycles: Option<u64>, host: Option<Duration>) -> Option<Answer>;
    /// Machine cycles in a second.
    fn hertz(&self) -> f64;
}

/// What stands below the code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Lower {
    Rung,
    Memory,
    Symbols,
    Serial,
}

/// How it runs on by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Run {
    /// As fast as it goes.
    Free,
    /// A second of the chip in a second of the wall clock, times the speed.
    Clock,
}

/// The screen.
pub struct Debugger<M> {
    machine: M,
    /// Program word of the line that keys act on; nothing stands for the instruction that is next.
    cursor: Option<u32>,
    /// The source is shown in place of instructions, as far as there is any.
    source: bool,
    /// The source line that keys act on; nothing stands for where the machine is.
    line: Option<u32>,
    /// What is below; nothing chosen yet is what is of most use.
    lower: Option<Lower>,
    ladder: bool,
    memory: (usize, u32),
    /// Which of the scales of the waveform.
    zoom: usize,
    run: Option<Run>,
    speed: f64,
    /// Machine cycles that are due and were not yet run.
    owed: f64,
    /// Time passes as a text of keys says, not on a clock: the same text is to do the same anywhere.
    exact: bool,
    help: bool,
    prompt: Option<String>,
    /// What the last command said, and whether it failed.
    told: (String, bool),
}

/// How long a go lasts on the host, so that keys are answered.
const GO: Duration = Duration::from_millis(25);

impl<M: Machine> Debugger<M> {
    /// The screen of a machine. `exact`: keys come from a text, and time with them.
    pub fn new(machine: M, exact: bool) -> Debugger<M> {
        let ladder = !machine.sight(&Wants { since: u64::MAX, ..Wants::default() }).symbols.is_empty();
        Debugger {
            machine,
            cursor: None,
            source: true,
            line: None,
            lower: None,
            ladder,
            memory: (0, 0),
            zoom: 3,
            run: None,
            speed: 1.0,
            owed: 0.0,
            exact,
            help: false,
            prompt: None,
            told: (String::new(), false),
        }
    }

    /// What is below: until something is chosen the rung, what the serial port has sent as soon as it has, else memory.
    fn lower(&self) -> Lower {
        let sent =
            || !self.machine.sight(&Wants { serial: true, since: u64::MAX, ..Wants::default() }).serial.is_empty();
        match self.lower {
            Some(lower) => lower,
            None if self.ladder => Lower::Rung,
            None if sent() => Lower::Serial,
            None => Lower::Memory,
        }
    }

    /// What is said below before the first key.
    #[must_use]
    pub fn telling(mut self, text: &str) -> Debugger<M> {
        self.told.0 = text.to_owned();
        self
    }
}

impl<M: Machine> App for Debugger<M> {
    fn view(&self, area: Rect, look: Look) -> Buffer {
        view::view(self, area, look)
    }

    fn key(&mut self, key: Key, area: Rect) -> Wish {
        update::update(self, key, area)
    }

    fn pass(&mut self, time: Duration) {
        let Some(run) = self.run else { return };
        let host = (!self.exact).then_some(GO);
        let cycles = if run == Run::Clock || self.exact {
            self.owed += time.as_secs_f64() * self.machine.hertz() * self.speed;
            let due = self.owed.floor().clamp(0.0, 1e15);
            self.owed -= due;
            Some(due as u64)
        } else {
            None
        };
        if let Some(answer) = self.machine.advance(cycles, host) {
            self.run = None;
            (self.cursor, self.line) = (None, None);
            self.told = (answer.text, answer.failed);
        }
    }

    fn moves(&self) -> bool {
        self.run.is_some()
    }
}
