//! The panel: a ladder program under one's hands. Inputs are switches under keys, outputs lamps; relays, timers, counters,
//! numbers, what is sent, the rungs with power flow and a waveform stand beside them.
//!
//! `machine` runs the program and remembers, `update` is what keys do, `view` what it looks like.

mod machine;
mod parts;
mod prompt;
mod rows;
#[cfg(test)]
mod tests;
mod update;
mod view;
mod wave;

use std::sync::Arc;
use std::time::Duration;

use ladder::{Program, SymbolKind};
use ladder_eval::Evaluator;
use ratatui_core::buffer::Buffer;
use ratatui_core::layout::Rect;

use crate::{App, Key, Look, Wish};
use machine::Machine;
use parts::Part;

/// How the program runs on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pace {
    /// A scan a key.
    Still,
    /// As fast as it goes.
    Free,
    /// As the wall clock goes, times the speed.
    Real,
}

/// Everything that the panel is: a value.
#[derive(Debug, Clone)]
pub struct Panel {
    /// The program as it runs.
    machine: Machine,
    /// What the head line calls it.
    name: String,
    pace: Pace,
    /// Seconds of the program in a second of the wall clock.
    speed: f64,
    /// Microseconds of the program that are due and were not yet run.
    owed: f64,
    /// It could not keep up with the clock.
    late: bool,
    /// First rung that is shown, and how many of its lines lie above the screen.
    top: (usize, usize),
    /// First line of the parts that is shown.
    first: usize,
    /// First column of the rungs that is shown.
    left: usize,
    /// Scans in a column of the waveform.
    zoom: usize,
    /// First bit of the waveform that is shown.
    bit: usize,
    /// The keys are told.
    help: bool,
    /// The command line, while it is typed.
    prompt: Option<String>,
    /// What the last key came to, where that is worth a word, and whether it went wrong.
    told: (String, bool),
    /// Which of the analog inputs the keys change.
    analog: usize,
    /// Timers and counters, in text order.
    parts: Arc<[Part]>,
}

/// Speeds that can be had.
pub const SPEEDS: std::ops::RangeInclusive<f64> = 0.001..=1000.0;

/// Work in one go, in elements of the program.
const ELEMENTS: usize = 50_000;

/// How often free running has such a go.
const PICTURES_A_SECOND: f64 = 30.0;

impl Panel {
    /// A program before its first scan. `evaluator` is its power-up state, with what was set before.
    #[must_use]
    pub fn new(name: &str, program: Program, evaluator: Evaluator) -> Panel {
        let parts = parts::of(&program).into();
        let machine = Machine::new(program, evaluator);
        Panel {
            machine,
            name: name.to_owned(),
            pace: Pace::Still,
            speed: 1.0,
            owed: 0.0,
            late: false,
            top: (0, 0),
            first: 0,
            left: 0,
            zoom: 1,
            bit: 0,
            help: false,
            prompt: None,
            told: (String::new(), false),
            analog: 0,
            parts,
        }
    }

    /// Sets how it runs, and how fast the wall clock is (held within [`SPEEDS`]).
    #[must_use]
    pub fn paced(mut self, pace: Pace, speed: f64) -> Panel {
        self.pace = pace;
        self.speed = speed.clamp(*SPEEDS.start(), *SPEEDS.end());
        self
    }

    /// The level at an analog input (0 to 1023), by its symbol.
    pub fn set_level(&mut self, symbol: usize, level: u16) {
        self.machine.set_level(symbol, level);
    }

    /// The inputs, by symbol.
    fn inputs(&self) -> impl Iterator<Item = usize> {
        self.machine.symbols_of(|kind| kind == SymbolKind::Input)
    }

    /// Scans that one go runs at most, so that keys are answered.
    fn most(&self) -> usize {
        (ELEMENTS / self.machine.elements().max(1)).max(1)
    }
}

impl App for Panel {
    fn view(&self, area: Rect, look: Look) -> Buffer {
        view::view(self, area, look)
    }

    fn key(&mut self, key: Key, area: Rect) -> Wish {
        update::update(self, key, area)
    }

    fn pass(&mut self, time: Duration) {
        // A text of keys may let more than one picture's time pass at once.
        let pictures = (time.as_secs_f64() * PICTURES_A_SECOND).round().max(1.0);
        let most = self.most() as f64 * pictures;
        match self.pace {
            Pace::Still => {}
            Pace::Free => self.machine.run(most as u64),
            Pace::Real => {
                let cycle = self.machine.cycle_us().max(1) as f64;
                self.owed += time.as_secs_f64() * 1e6 * self.speed;
                let due = (self.owed / cycle).floor();
                self.owed -= due * cycle;
                // What cannot be caught up with is let go: the program is then slower than the clock, and says so.
                self.late = due > most;
                self.machine.run(due.min(most) as u64);
            }
        }
    }

    fn moves(&self) -> bool {
        self.pace != Pace::Still
    }
}
