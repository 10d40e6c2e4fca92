//! The panel: a ladder program that runs under manual control. Keys switch the inputs; the panel shows
//! outputs, relays, timers, counters, integers, sent bytes, the rungs with power flow, and waveforms.
//!
//! `scan_history` runs the program and keeps its past, `update` handles keys, `view` draws the panel.

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

/// How the program runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PanelPace {
    /// One scan per key.
    Paused,
    /// As fast as possible.
    Free,
    /// In real time, multiplied by the speed.
    Real,
}

/// The state of the panel.
#[derive(Debug, Clone)]
pub struct LadderPanel {
    /// The running program.
    machine: PanelMachine,
    /// Name in the title line.
    name: String,
    pace: PanelPace,
    /// Seconds of the program per second of real time.
    speed: f64,
    /// Microseconds of the program that are due but have not run yet.
    us_due: f64,
    /// True if the program could not keep up with real time.
    is_late: bool,
    /// First rung shown, and how many of its lines are above the screen.
    first_rung: (usize, usize),
    /// First line of the parts that is shown.
    first_part: usize,
    /// First column of the rungs that is shown.
    first_column: usize,
    /// Scans per column of the waveforms.
    zoom: usize,
    /// First bit shown in the waveforms.
    first_bit: usize,
    /// Whether the help is shown.
    help: bool,
    /// The command line while it is being typed.
    prompt: Option<String>,
    /// The message of the last key or command, and whether it failed.
    last_message: (String, bool),
    /// Index of the analog input that keys change, modulo their number.
    analog: usize,
    /// The program's timers and counters, in text order.
    parts: Arc<[CountingPart]>,
}

/// Allowed speeds.
pub const SPEEDS: std::ops::RangeInclusive<f64> = 0.001..=1000.0;

/// Maximum work per slice, in elements executed.
const ELEMENTS_PER_SLICE: usize = 50_000;

/// Slices per second in free running.
const FRAMES_PER_SECOND: f64 = 30.0;

impl LadderPanel {
    /// A program before its first scan. `evaluator` is its power-up state, including values set before.
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

    /// Sets the pace and the speed, which is clamped to [`SPEEDS`].
    #[must_use]
    pub fn with_pace(mut self, pace: PanelPace, speed: f64) -> LadderPanel {
        self.pace = pace;
        self.speed = speed.clamp(*SPEEDS.start(), *SPEEDS.end());
        self
    }

    /// Sets the level of an analog input (0 to 1023), by symbol index.
    pub fn set_level(&mut self, symbol: usize, level: u16) {
        self.machine.set_level(symbol, level);
    }

    /// Symbol indices of the inputs.
    fn inputs(&self) -> impl Iterator<Item = usize> {
        self.machine.symbols_of(|kind| kind == SymbolKind::Input)
    }

    /// Maximum number of scans per slice, so that keys are handled in time.
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
        // A key script may let the time of several frames pass at once.
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
                // Time that cannot be made up is dropped: the program is then slower than real time, and the
                // title says so.
                self.is_late = due > most;
                self.machine.run(due.min(most) as u64);
            }
        }
    }

    fn is_moving(&self) -> bool {
        self.pace != PanelPace::Paused
    }
}
