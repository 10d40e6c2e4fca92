//! The debugger's screen: code, registers, pins, a waveform, and the rung with power flow, memory or symbols.
//!
//! It knows no machine. A [`DebuggedMachine`] tells what is to be seen as plain data ([`DebuggerSnapshot`]) and obeys the commands that
//! `docs/debug.md` lists; keys are short for such commands. `update` is what keys do, `view` what it looks like.

mod panes;
#[cfg(test)]
mod tests;
mod update;
mod view;

use std::time::Duration;

use ratatui_core::buffer::Buffer;
use ratatui_core::layout::Rect;

use crate::rung_picture::PictureGlyph;
use crate::{ScreenKey, ScreenStyle, ScreenView, ViewRequest};

/// What the screen wants to see, so that no more is collected than it shows.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ScreenQuery {
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
pub struct CodeLine {
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
    pub operand_meaning: String,
    /// The breakpoint here, by its number.
    pub breakpoint: Option<u32>,
}

/// A part of a source file.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct SourceExcerpt {
    /// The file.
    pub file: String,
    /// The line where the machine is, if it is in this file.
    pub current_line: Option<u32>,
    /// The line around which it is shown.
    pub around: u32,
    /// Lines with their numbers, and the breakpoint on each by its number.
    pub lines: Vec<(u32, String, Option<u32>)>,
}

/// A value with a name.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct NamedValue {
    /// Its name.
    pub name: String,
    /// Its value.
    pub text: String,
    /// It is not what it was at the last stop.
    pub changed: bool,
}

/// A pin over time.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct PinTrace {
    /// Its name.
    pub name: String,
    /// High now.
    pub high: bool,
    /// Machine cycles of its edges, rising, and what it was from then on.
    pub edges: Vec<(u64, bool)>,
}

/// A stretch of memory.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct MemoryExcerpt {
    /// The memory.
    pub name: String,
    /// Address of the first byte.
    pub address: u32,
    /// Bytes, and whether they have changed since the last stop; nothing where there is none.
    pub bytes: Vec<(Option<u8>, bool)>,
}

/// Everything that the screen shows of a machine, as plain data.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DebuggerSnapshot {
    /// What is debugged.
    pub title: String,
    /// Where it is in time: cycle, seconds, scan, rung.
    pub time: String,
    /// Program word of the instruction that is next.
    pub pc: u32,
    /// Machine cycles since power-up.
    pub cycle: u64,
    /// Instructions around the place that is wanted.
    pub code: Vec<CodeLine>,
    /// The source around the line that is wanted; nothing where there is none, or none is wanted.
    pub source: Option<SourceExcerpt>,
    /// What the serial port has sent, in lines.
    pub serial: Vec<String>,
    /// Registers of the core.
    pub registers: Vec<NamedValue>,
    /// Pins: 0, 1 or z.
    pub pins: Vec<NamedValue>,
    /// Symbols of a ladder program; empty where there is none.
    pub symbols: Vec<NamedValue>,
    /// The rung in which the machine is; nothing where there is no ladder program, or none is wanted.
    pub rung: Option<Vec<Vec<PictureGlyph>>>,
    /// Memory, where it is wanted.
    pub memory: Option<MemoryExcerpt>,
    /// Pins that have moved, over time.
    pub traces: Vec<PinTrace>,
}

/// What came of a command.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct CommandAnswer {
    /// What it said, in lines.
    pub text: String,
    /// It failed.
    pub failed: bool,
    /// It was the last.
    pub quit: bool,
}

/// A machine under the debugger, and the commands that it obeys.
pub trait DebuggedMachine {
    /// What is to be seen of it now.
    fn debugger_snapshot(&self, wants: &ScreenQuery) -> DebuggerSnapshot;
    /// Carries out a command, to its end or until the user stops it.
    fn run_command(&mut self, line: &str) -> CommandAnswer;
    /// Runs for so many machine cycles, for so long on the host's clock, whichever ends first. Says why where something else
    /// has stopped it.
    fn advance(&mut self, cycles: Option<u64>, host: Option<Duration>) -> Option<CommandAnswer>;
    /// Machine cycles in a second.
    fn hertz(&self) -> f64;
}

/// What stands below the code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum LowerPane {
    Rung,
    Memory,
    Symbols,
    Serial,
}

/// How it runs on by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum AutoRun {
    /// As fast as it goes.
    Free,
    /// A second of the chip in a second of the wall clock, times the speed.
    Clock,
}

/// The screen.
pub struct DebuggerScreen<M> {
    machine: M,
    /// Program word of the line that keys act on; nothing stands for the instruction that is next.
    cursor: Option<u32>,
    /// The source is shown in place of instructions, as far as there is any.
    source: bool,
    /// The source line that keys act on; nothing stands for where the machine is.
    line: Option<u32>,
    /// What is below; nothing chosen yet is what is of most use.
    lower: Option<LowerPane>,
    ladder: bool,
    memory: (usize, u32),
    /// Which of the scales of the waveform.
    zoom: usize,
    run: Option<AutoRun>,
    speed: f64,
    /// Machine cycles that are due and were not yet run.
    cycles_due: f64,
    /// Time passes as a text of keys says, not on a clock: the same text is to do the same anywhere.
    exact: bool,
    help: bool,
    prompt: Option<String>,
    /// What the last command said, and whether it failed.
    last_message: (String, bool),
}

/// How long a go lasts on the host, so that keys are answered.
const WORK_SLICE: Duration = Duration::from_millis(25);

impl<M: DebuggedMachine> DebuggerScreen<M> {
    /// The screen of a machine. `exact`: keys come from a text, and time with them.
    pub fn new(machine: M, exact: bool) -> DebuggerScreen<M> {
        let ladder =
            !machine.debugger_snapshot(&ScreenQuery { since: u64::MAX, ..ScreenQuery::default() }).symbols.is_empty();
        DebuggerScreen {
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
            cycles_due: 0.0,
            exact,
            help: false,
            prompt: None,
            last_message: (String::new(), false),
        }
    }

    /// What is below: until something is chosen the rung, what the serial port has sent as soon as it has, else memory.
    fn lower(&self) -> LowerPane {
        let sent = || {
            !self
                .machine
                .debugger_snapshot(&ScreenQuery { serial: true, since: u64::MAX, ..ScreenQuery::default() })
                .serial
                .is_empty()
        };
        match self.lower {
            Some(lower) => lower,
            None if self.ladder => LowerPane::Rung,
            None if sent() => LowerPane::Serial,
            None => LowerPane::Memory,
        }
    }

    /// What is said below before the first key.
    #[must_use]
    pub fn with_message(mut self, text: &str) -> DebuggerScreen<M> {
        self.last_message.0 = text.to_owned();
        self
    }
}

impl<M: DebuggedMachine> ScreenView for DebuggerScreen<M> {
    fn render(&self, area: Rect, look: ScreenStyle) -> Buffer {
        view::view(self, area, look)
    }

    fn handle_key(&mut self, key: ScreenKey, area: Rect) -> ViewRequest {
        update::update(self, key, area)
    }

    fn advance_time(&mut self, time: Duration) {
        let Some(run) = self.run else { return };
        let host = (!self.exact).then_some(WORK_SLICE);
        let cycles = if run == AutoRun::Clock || self.exact {
            self.cycles_due += time.as_secs_f64() * self.machine.hertz() * self.speed;
            let due = self.cycles_due.floor().clamp(0.0, 1e15);
            self.cycles_due -= due;
            Some(due as u64)
        } else {
            None
        };
        if let Some(answer) = self.machine.advance(cycles, host) {
            self.run = None;
            (self.cursor, self.line) = (None, None);
            self.last_message = (answer.text, answer.failed);
        }
    }

    fn is_moving(&self) -> bool {
        self.run.is_some()
    }
}
