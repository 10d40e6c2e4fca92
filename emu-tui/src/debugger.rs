//! The debugger screen: code, registers, pins, waveforms, and either the rung with power flow, memory,
//! symbols or serial output.
//!
//! The screen does not know any machine. A [`DebuggedMachine`] supplies plain data ([`DebuggerSnapshot`]) and
//! executes the commands that `docs/debug.md` lists; keys are shortcuts for such commands. `update` handles
//! keys, `view` draws the screen.

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

/// What the screen needs from the machine, so that only visible data is collected.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ScreenQuery {
    /// Program word around which code is shown; `None` is the next instruction.
    pub around: Option<u32>,
    /// Number of instructions before and after it.
    pub lines: usize,
    /// Columns for the rung; 0 if it is not needed.
    pub rung: usize,
    /// Memory to show as (index, modulo the number of memories, first address, number of bytes); 0 bytes if
    /// it is not needed.
    pub memory: (usize, u32, usize),
    /// Machine cycle from which on edges of pins are needed.
    pub since: u64,
    /// Source line around which the current source file is shown; `None` is the line of the machine.
    pub line: Option<u32>,
    /// Number of source lines before and after it; 0 if it is not needed.
    pub source: usize,
    /// Whether the bytes sent by the serial port are needed.
    pub serial: bool,
}

/// An instruction in the code pane.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct CodeLine {
    /// Address as a program word.
    pub word: u32,
    /// Address in the syntax of commands: `0x0086`.
    pub address: String,
    /// The symbol at this address.
    pub label: Option<String>,
    /// The source line that starts here.
    pub source: Option<String>,
    /// Mnemonic and operands.
    pub text: String,
    /// The meaning of the operands; empty if it is not known.
    pub operand_meaning: String,
    /// The number of the breakpoint here.
    pub breakpoint: Option<u32>,
}

/// Some lines of a source file.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct SourceExcerpt {
    /// Name of the file.
    pub file: String,
    /// The current line of the machine, if it is in this file.
    pub current_line: Option<u32>,
    /// The line around which the file is shown.
    pub around: u32,
    /// Lines as (line number, text, number of the breakpoint).
    pub lines: Vec<(u32, String, Option<u32>)>,
}

/// A named value.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct NamedValue {
    /// The name.
    pub name: String,
    /// The value as text.
    pub text: String,
    /// True if the value has changed since the last stop.
    pub changed: bool,
}

/// The waveform of a pin.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct PinTrace {
    /// Name of the pin.
    pub name: String,
    /// True if the pin is high now.
    pub high: bool,
    /// Edges as (machine cycle, new level), in ascending order.
    pub edges: Vec<(u64, bool)>,
}

/// A range of memory.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct MemoryExcerpt {
    /// Name of the memory.
    pub name: String,
    /// Address of the first byte.
    pub address: u32,
    /// Bytes with a flag for a change since the last stop; `None` where the memory has no byte.
    pub bytes: Vec<(Option<u8>, bool)>,
}

/// Everything that the screen shows of a machine, as plain data.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DebuggerSnapshot {
    /// Name of the debugged image or program.
    pub title: String,
    /// The current time: cycle, seconds, scan, rung.
    pub time: String,
    /// Program word of the next instruction.
    pub pc: u32,
    /// Machine cycles since power-up.
    pub cycle: u64,
    /// Instructions around the requested place.
    pub code: Vec<CodeLine>,
    /// The source around the requested line; `None` if there is none or it was not requested.
    pub source: Option<SourceExcerpt>,
    /// The bytes sent by the serial port, as lines of text.
    pub serial: Vec<String>,
    /// Registers of the core.
    pub registers: Vec<NamedValue>,
    /// Levels of the pins: 0, 1 or z.
    pub pins: Vec<NamedValue>,
    /// Symbols of the ladder program; empty without one.
    pub symbols: Vec<NamedValue>,
    /// The current rung; `None` without a ladder program or if it was not requested.
    pub rung: Option<Vec<Vec<PictureGlyph>>>,
    /// The requested memory.
    pub memory: Option<MemoryExcerpt>,
    /// Waveforms of the pins that have changed.
    pub traces: Vec<PinTrace>,
}

/// The result of a command.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct CommandAnswer {
    /// Output of the command, as lines of text.
    pub text: String,
    /// True if the command failed.
    pub failed: bool,
    /// True if the command ends the session.
    pub quit: bool,
}

/// A machine under the debugger that executes commands.
pub trait DebuggedMachine {
    /// The current state of the machine.
    fn debugger_snapshot(&self, wants: &ScreenQuery) -> DebuggerSnapshot;
    /// Executes a command to its end, or until the user interrupts it.
    fn run_command(&mut self, line: &str) -> CommandAnswer;
    /// Runs for `cycles` machine cycles or `host` time of the host, whichever ends first. Returns an answer
    /// if something else stopped the machine.
    fn advance(&mut self, cycles: Option<u64>, host: Option<Duration>) -> Option<CommandAnswer>;
    /// Machine cycles per second.
    fn hertz(&self) -> f64;
}

/// The contents of the pane below the code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum LowerPane {
    Rung,
    Memory,
    Symbols,
    Serial,
}

/// How the machine runs continuously.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum AutoRun {
    /// As fast as possible.
    Free,
    /// In real time, multiplied by the speed.
    Clock,
}

/// The debugger screen.
pub struct DebuggerScreen<M> {
    machine: M,
    /// Program word of the cursor line; `None` is the next instruction.
    cursor: Option<u32>,
    /// Whether the source is shown instead of instructions, where there is source.
    source: bool,
    /// Source line of the cursor; `None` is the line of the machine.
    line: Option<u32>,
    /// The pane below the code; `None` selects the most useful one.
    lower: Option<LowerPane>,
    ladder: bool,
    memory: (usize, u32),
    /// Index of the scale of the waveform.
    zoom: usize,
    run: Option<AutoRun>,
    speed: f64,
    /// Machine cycles that are due but have not run yet.
    cycles_due: f64,
    /// True if time comes from a key script instead of a clock, so that a script always gives the same
    /// result.
    exact: bool,
    help: bool,
    prompt: Option<String>,
    /// Output of the last command, and whether it failed.
    last_message: (String, bool),
}

/// Maximum host time of one slice of a run, so that keys are handled in time.
const WORK_SLICE: Duration = Duration::from_millis(25);

impl<M: DebuggedMachine> DebuggerScreen<M> {
    /// The screen of a machine. With `exact`, keys and time come from a key script.
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

    /// The pane below the code. By default it is the rung, or the serial output once there is any, or else
    /// memory.
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

    /// Sets the message shown before the first key.
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
