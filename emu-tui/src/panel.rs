//! The panel: a ladder program under one's hands. Inputs are switches under keys, outputs lamps; relays, timers, counters,
//! numbers, what is sent, the rungs with power flow and a waveform stand beside them.
//!
//! `machine` runs the program and remembers, `update` is what keys do, `view` what it looks like.

mod parts;
mod prompt;
mod rows;
mod scan_history;
#[cfg(test)]
mod tests;
mod update;
mod view;
mod wave;

use std::sync::Arc;
use std::time::Duration;

use ladder::{LadderProgram, SymbolKind};
use ladder_eval::Evaluator;
use ratatui_core::buffer::Buffer;
use ratatui_core::layout::Rect;

use crate::{ScreenKey, ScreenStyle, ScreenView, ViewRequest};
use parts::CountingPart;
use scan_history::PanelMachine;

/// How the program runs on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PanelPace {
    /// A scan a key.
    Paused,
    /// As fast as it goes.
    Free,
    /// As the wall clock goes, times the speed.
    Real,
}

/// Everything that the panel is: a value.
#[derive(Debug, Clone)]
pub struct LadderPanel {
    /// The program as it runs.
    machine: PanelMachine,
    /// What the head line calls it.
    name: String,
    pace: PanelPace,
    /// Seconds of the program in a second of the wall clock.
    speed: f64,
    /// Microseconds of the program that are due and were not yet run.
    us_due: f64,
    /// It could not keep up with the clock.
    is_late: bool,
    /// First rung that is shown, and how many of its lines lie above the screen.
    first_rung: (usize, usize),
    /// First line of the parts that is shown.
    first_part: usize,
    /// First column of the rungs that is shown.
    first_column: usize,
    /// Scans in a column of the waveform.
    zoom: usize,
    /// First bit of the waveform that is shown.
    first_bit: usize,
    /// The keys are told.
    help: bool,
    /// The command line, while it is typed.
    prompt: Option<String>,
    /// What the last key came to, where that is worth a word, and whether it went wrong.
    last_message: (String, bool),
    /// Which of the analog inputs the keys change.
    analog: usize,
    /// Timers and counters, in text order.
    parts: Arc<[CountingPart]>,
}

/// Speeds that can be had.
pub const SPEEDS: std::ops::RangeInclusive<f64> = 0.001..=1000.0;

/// Work in one go, in elements of the program.
const ELEMENTS_PER_SLICE: usize = 50_000;

/// How often free running has such a go.
const FRAMES_PER_SECOND: f64 = 30.0;

impl LadderPanel {
    /// A program before its first scan. `evaluator` is its power-up state, with what was set before.
    #[must_use]
    pub fn new(name: &str, program: LadderProgram, evaluator: Evaluator) -> LadderPanel {
        let parts = parts::counting_parts(&program).into();
        let machine = PanelMachine::new(program, evaluator);
        LadderPanel {
            machine,
            name: name.to_owned(),
            pace: PanelPace::Paused,
            speed: 1.0,
            us_due: 0.0,
            is_late: false,
            first_rung: (0, 0),
            first_part: 0,
            first_column: 0,
            zoom: 1,
            first_bit: 0,
            help: false,
            prompt: None,
            last_message: (String::new(), false),
            analog: 0,
            parts,
        }
    }

    /// Sets how it runs, and how fast the wall clock is (held within [`SPEEDS`]).
    #[must_use]
    pub fn with_pace(mut self, pace: PanelPace, speed: f64) -> LadderPanel {
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
    fn scans_per_slice(&self) -> usize {
        (ELEMENTS_PER_SLICE / self.machine.elements().max(1)).max(1)
    }
}

impl ScreenView for LadderPanel {
    fn render(&self, area: Rect, look: ScreenStyle) -> Buffer {
        view::view(self, area, look)
    }

    fn handle_key(&mut self, key: ScreenKey, area: Rect) -> ViewRequest {
        update::update(self, key, area)
    }

    fn advance_time(&mut self, time: Duration) {
        // A text of keys may let more than one picture's time pass at once.
        let pictures = (time.as_secs_f64() * FRAMES_PER_SECOND).round().max(1.0);
        let most = self.scans_per_slice() as f64 * pictures;
        match self.pace {
            PanelPace::Paused => {}
            PanelPace::Free => self.machine.run(most as u64),
            PanelPace::Real => {
                let cycle = self.machine.cycle_us().max(1) as f64;
                self.us_due += time.as_secs_f64() * 1e6 * self.speed;
                let due = (self.us_due / cycle).floor();
                self.us_due -= due * cycle;
                // What cannot be caught up with is let go: the program is then slower than the clock, and says so.
                self.is_late = due > most;
                self.machine.run(due.min(most) as u64);
            }
        }
    }

    fn is_moving(&self) -> bool {
        self.pace != PanelPace::Paused
    }
}
