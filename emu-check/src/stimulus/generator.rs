//! Generates the stimulus of a check: an endless sequence of runs from reset, of which the first N scans are
//! used.
//!
//! The sequence depends only on the program and the seed. The first N scans of a longer check equal those of
//! a check of N scans, so a difference in scan n is replayed by a check of n scans.

use emu_core::rng::Rng;
use ladder_eval::Evaluator;

use crate::coverage::goals::CoverageGoals;
use crate::stimulus::boundary_goals::BoundaryGoals;
use crate::stimulus::stimulus_symbols::StimulusSymbols;

/// The stimulus of one scan.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct ScanStimulus {
    /// Levels of the inputs, in the order of [`StimulusSymbols::inputs`].
    pub inputs: Vec<bool>,
    /// Inputs whose level is inverted after the scan must have latched them; empty if there are none.
    pub flips: Vec<bool>,
    /// Levels of [`ProgramPlaces::drivable_pins`](crate::chip::program_places::ProgramPlaces::drivable_pins),
    /// one bit each; they must have no effect.
    pub drivable_levels: u32,
    /// Results of converting the analog inputs, in the evaluator's order.
    pub analog: Vec<u16>,
    /// A byte that begins to be sent to the receiver, unless one is in flight or waits to be read.
    pub byte: Option<u8>,
    /// Symbols (by index) with the values that are written to them at the start of the scan.
    pub writes: Vec<(usize, i32)>,
}

impl ScanStimulus {
    /// Applies the inputs and writes of this scan to the evaluator.
    pub(crate) fn apply(&self, stimulus_symbols: &StimulusSymbols, eval: &mut Evaluator) {
        stimulus_symbols.inputs.iter().zip(&self.inputs).for_each(|(&symbol, &on)| eval.set(symbol, i32::from(on)));
        stimulus_symbols.analog.iter().zip(&self.analog).for_each(|(&symbol, &value)| eval.set_adc(symbol, value));
        self.writes.iter().for_each(|&(symbol, value)| eval.set(symbol, value));
    }

    /// Applies the inputs and writes of a scan without a serial line that takes time: the byte is received at
    /// once, unless one waits.
    pub(crate) fn apply_immediately(&self, stimulus_symbols: &StimulusSymbols, eval: &mut Evaluator) {
        self.apply(stimulus_symbols, eval);
        if let Some(byte) = self.byte.filter(|_| !eval.has_received_byte()) {
            eval.receive(byte);
        }
    }
}

/// How the inputs change in a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum InputPlan {
    /// All inputs stay off.
    Low,
    /// Every combination once, in random order; with too many inputs, like [`InputPlan::Modes`].
    Sweep,
    /// Each input changes by an [`InputMode`] of its own.
    Modes,
    /// Modes that may last long; otherwise [`InputPlan::Modes`].
    Slow,
}

/// Which symbols are written in a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum WritePlan {
    Nothing,
    /// All symbols, at the start of the first scan.
    AllAtStart,
    /// All symbols at the start of the first scan, then about half of them at the start of each scan.
    OftenAll,
    /// Only integers, and rarely, so that timers and counters continue from values near their limits.
    RareIntegers,
}

/// A kind of run. A sweep is longer if the inputs have more combinations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct RunKind {
    /// How the inputs change.
    inputs: InputPlan,
    /// Which symbols are written.
    writes: WritePlan,
    /// Number of scans; 0 means [`StimulusGenerator::long_run_scans`].
    scans: usize,
}

/// The first runs, each done once.
#[rustfmt::skip]
const OPENING_RUNS: [RunKind; 2] = [
    RunKind { inputs: InputPlan::Low,   writes: WritePlan::Nothing, scans: 24 },
    RunKind { inputs: InputPlan::Sweep, writes: WritePlan::Nothing, scans: 32 },
];

/// The runs after the opening runs, repeated forever. The run without writes is longer in each repetition, so
/// that a long check also finds errors that accumulate slowly, such as a drift of the period.
#[rustfmt::skip]
const REPEATED_RUNS: [RunKind; 6] = [
    RunKind { inputs: InputPlan::Modes, writes: WritePlan::AllAtStart,   scans: 40 },
    RunKind { inputs: InputPlan::Modes, writes: WritePlan::OftenAll,     scans: 200 },
    RunKind { inputs: InputPlan::Modes, writes: WritePlan::RareIntegers, scans: 200 },
    RunKind { inputs: InputPlan::Sweep, writes: WritePlan::OftenAll,     scans: 64 },
    RunKind { inputs: InputPlan::Modes, writes: WritePlan::AllAtStart,   scans: 40 },
    RunKind { inputs: InputPlan::Modes, writes: WritePlan::Nothing,      scans: 160 },
];

/// The run at the end of each repetition if the caller writes no symbols (foreign images, comparison of two
/// dialects) and discards the writes. It is `long_run_scans` scans long, and an input may keep a level for up
/// to a quarter of it.
const LONG_RUN: RunKind = RunKind { inputs: InputPlan::Slow, writes: WritePlan::RareIntegers, scans: 0 };

/// Maximum number of inputs whose combinations are all tried.
pub(crate) const MAX_SWEEP_INPUTS: usize = 8;

/// Candidates per scan while coverage is incomplete; the one that covers most is used.
const DRAWS_PER_SCAN: usize = 16;

/// Candidates per scan for one boundary goal.
const TRIES_PER_GOAL: usize = 24;

/// How one input changes for some scans.
#[derive(Debug, Clone, Copy)]
enum InputMode {
    Hold(bool),
    /// This level in one of every n scans.
    Pulse(bool, u64),
    Toggle,
    Random,
}

/// The generator of runs and stimuli.
#[derive(Debug, Clone)]
pub(crate) struct StimulusGenerator {
    rng: Rng,
    /// The random numbers for unnamed pins; they are separate so that these pins do not affect the rest.
    drivable_rng: Rng,
    /// Number of runs that have begun.
    runs: usize,
    /// Number of scans that the current run still has.
    remaining_scans: usize,
    /// The next scan is the first of its run.
    first: bool,
    /// The kind of the current run.
    kind: RunKind,
    /// Per input: its mode, and for how many scans it still lasts.
    modes: Vec<(InputMode, u64)>,
    /// Levels of the inputs in the last scan.
    inputs: Vec<bool>,
    /// Results of converting the analog inputs in the last scan.
    analog: Vec<u16>,
    /// Input combinations that the current sweep still has.
    sweep: Vec<u32>,
    boundary_goals: BoundaryGoals,
    /// Number of scans of the long run at the end of each repetition; 0 for none.
    long_run_scans: usize,
}

impl StimulusGenerator {
    /// A generator for a seed and the boundary goals of a program.
    pub(crate) fn new(seed: u64, boundary_goals: BoundaryGoals) -> StimulusGenerator {
        StimulusGenerator {
            rng: Rng::new(seed),
            drivable_rng: Rng::new(!seed),
            runs: 0,
            remaining_scans: 0,
            first: true,
            kind: OPENING_RUNS[0],
            modes: Vec::new(),
            inputs: Vec::new(),
            analog: Vec::new(),
            sweep: Vec::new(),
            boundary_goals,
            long_run_scans: 0,
        }
    }

    /// A generator with a run of `long_run_scans` scans at the end of each repetition, to reach states that
    /// only time leads to.
    pub(crate) fn with_long_runs(seed: u64, boundary_goals: BoundaryGoals, long_run_scans: usize) -> StimulusGenerator {
        StimulusGenerator { long_run_scans, ..StimulusGenerator::new(seed, boundary_goals) }
    }

    /// Returns true in a long run.
    pub(crate) fn is_long(&self) -> bool {
        self.kind.inputs == InputPlan::Slow
    }

    /// Begins a new run if one is due, and returns the seed of its random RAM.
    pub(crate) fn begin_run(&mut self, stimulus_symbols: &StimulusSymbols) -> Option<u64> {
        if self.remaining_scans > 0 {
            return None;
        }
        self.kind = match self.runs.checked_sub(OPENING_RUNS.len()) {
            None => OPENING_RUNS[self.runs],
            Some(n) => REPEATED_RUNS
                .get(n % self.runs_per_repetition())
                .copied()
                .unwrap_or(RunKind { scans: self.long_run_scans, ..LONG_RUN }),
        };
        if let Some(n) = self.runs.checked_sub(OPENING_RUNS.len())
            && self.kind.writes == WritePlan::Nothing
        {
            self.kind.scans *= 1 + n / self.runs_per_repetition();
        }
        self.runs += 1;
        self.first = true;
        let inputs = stimulus_symbols.inputs.len();
        self.inputs = vec![false; inputs];
        self.analog = vec![0; stimulus_symbols.analog.len()];
        self.modes = vec![(InputMode::Hold(false), 0); inputs];
        self.sweep.clear();
        if self.kind.inputs == InputPlan::Sweep && inputs <= MAX_SWEEP_INPUTS {
            self.sweep = (0..1 << inputs).collect();
            for n in (1..self.sweep.len()).rev() {
                let other = self.rng.below(n as u64 + 1) as usize;
                self.sweep.swap(n, other);
            }
        }
        self.remaining_scans = self.kind.scans.max(self.sweep.len());
        Some(self.rng.next_u64())
    }

    /// Number of runs after which the sequence of kinds repeats.
    fn runs_per_repetition(&self) -> usize {
        REPEATED_RUNS.len() + usize::from(self.long_run_scans > 0)
    }

    /// The stimulus of the next scan; `eval` is in its state before the scan. In runs that write symbols,
    /// several candidates are tried on a copy of `eval`, to reach an open coverage goal or a boundary goal.
    pub(crate) fn next_stimulus(
        &mut self,
        stimulus_symbols: &StimulusSymbols,
        eval: &Evaluator,
        goals: &CoverageGoals,
    ) -> ScanStimulus {
        let drawn = self.draw_stimulus(stimulus_symbols, eval);
        let writes =
            self.kind.writes != WritePlan::Nothing && (self.first || self.kind.writes != WritePlan::AllAtStart);
        let mut stimulus = match (writes, self.rng.below(4)) {
            (true, 0 | 1) if goals.has_open_goals() => self.best_covering(stimulus_symbols, eval, goals, drawn),
            (true, 1..) if self.kind.writes == WritePlan::OftenAll => self.goal_stimulus(stimulus_symbols, eval, drawn),
            _ => drawn,
        };
        stimulus.drivable_levels = self.drivable_rng.next_u64() as u32;
        self.inputs.clone_from(&stimulus.inputs);
        self.analog.clone_from(&stimulus.analog);
        self.first = false;
        self.remaining_scans = self.remaining_scans.saturating_sub(1);
        stimulus
    }

    /// Of several candidates, the one that reaches most coverage goals.
    fn best_covering(
        &mut self,
        stimulus_symbols: &StimulusSymbols,
        eval: &Evaluator,
        goals: &CoverageGoals,
        mut best: ScanStimulus,
    ) -> ScanStimulus {
        let mut most = goals.count_gain(eval, stimulus_symbols, &best);
        for _ in 1..DRAWS_PER_SCAN {
            let other = self.redraw_stimulus(stimulus_symbols, eval, &best);
            let gain = goals.count_gain(eval, stimulus_symbols, &other);
            if gain > most {
                (best, most) = (other, gain);
            }
        }
        best
    }

    /// A stimulus that reaches the next boundary goal, or else `stimulus`.
    fn goal_stimulus(
        &mut self,
        stimulus_symbols: &StimulusSymbols,
        eval: &Evaluator,
        stimulus: ScanStimulus,
    ) -> ScanStimulus {
        let Some(goal) = self.boundary_goals.next_open() else { return stimulus };
        let mut candidate = stimulus.clone();
        for _ in 0..TRIES_PER_GOAL {
            if self.boundary_goals.try_reach(goal, eval, stimulus_symbols, &mut candidate) {
                return candidate;
            }
            candidate = self.redraw_stimulus(stimulus_symbols, eval, &stimulus);
        }
        stimulus
    }

    fn draw_stimulus(&mut self, stimulus_symbols: &StimulusSymbols, eval: &Evaluator) -> ScanStimulus {
        let inputs = match (self.kind.inputs, self.sweep.pop()) {
            (InputPlan::Low, _) => self.inputs.clone(),
            (_, Some(bits)) => (0..self.inputs.len()).map(|n| bits >> n & 1 == 1).collect(),
            _ => self.move_inputs(),
        };
        let flips = if self.rng.one_in(4) { self.random_bits(inputs.len()) } else { Vec::new() };
        let writes = self.draw_writes(stimulus_symbols, eval);
        let (analog, byte) = self.draw_external(stimulus_symbols);
        ScanStimulus { inputs, flips, drivable_levels: 0, analog, byte, writes }
    }

    /// Another candidate for the same scan: other writes, and sometimes other inputs unless a sweep is in
    /// progress.
    fn redraw_stimulus(
        &mut self,
        stimulus_symbols: &StimulusSymbols,
        eval: &Evaluator,
        stimulus: &ScanStimulus,
    ) -> ScanStimulus {
        let sweeping =
            self.kind.inputs == InputPlan::Sweep && !self.inputs.is_empty() && self.inputs.len() <= MAX_SWEEP_INPUTS;
        let inputs = if sweeping || self.rng.one_in(2) {
            stimulus.inputs.clone()
        } else {
            self.random_bits(stimulus.inputs.len())
        };
        let (analog, byte) = self.draw_external(stimulus_symbols);
        ScanStimulus {
            inputs,
            flips: stimulus.flips.clone(),
            drivable_levels: 0,
            analog,
            byte,
            writes: self.draw_writes(stimulus_symbols, eval),
        }
    }

    /// Draws values for the analog inputs and a byte for the receiver; draws nothing for a program without
    /// them.
    fn draw_external(&mut self, stimulus_symbols: &StimulusSymbols) -> (Vec<u16>, Option<u8>) {
        let (inputs_stay_low, rng) = (self.kind.inputs == InputPlan::Low, &mut self.rng);
        let next_value = |(&symbol, &value): (&usize, &u16)| match inputs_stay_low {
            false if rng.one_in(3) => stimulus_symbols.random_conversion(symbol, rng),
            _ => value,
        };
        let analog = stimulus_symbols.analog.iter().zip(&self.analog).map(next_value).collect();
        let byte = (stimulus_symbols.receives && !inputs_stay_low && self.rng.one_in(2))
            .then(|| stimulus_symbols.random_byte(&mut self.rng));
        (analog, byte)
    }

    fn random_bits(&mut self, n: usize) -> Vec<bool> {
        (0..n).map(|_| self.rng.one_in(2)).collect()
    }

    /// The levels of the inputs, each changed by its mode.
    fn move_inputs(&mut self) -> Vec<bool> {
        let longest = if self.is_long() { self.long_run_scans as u64 / 4 } else { 0 };
        let rng = &mut self.rng;
        let next_level = |(input, (mode, left)): (&bool, &mut (InputMode, u64))| {
            if *left == 0 {
                *left = 3 + rng.below(40);
                // Longer durations, from a few scans up to a quarter of the run.
                while *left * 2 < longest && !rng.one_in(6) {
                    *left *= 2;
                }
                *mode = match rng.below(6) {
                    0..4 if *left > 43 => InputMode::Hold(rng.one_in(2)),
                    0 | 1 => InputMode::Hold(!*input),
                    2 => InputMode::Pulse(true, 2 + rng.below(12)),
                    3 => InputMode::Pulse(false, 2 + rng.below(12)),
                    4 => InputMode::Toggle,
                    _ => InputMode::Random,
                };
            }
            *left -= 1;
            match *mode {
                InputMode::Hold(level) => level,
                InputMode::Pulse(level, n) => (*left % n == 0) == level,
                InputMode::Toggle => !*input,
                InputMode::Random => rng.one_in(2),
            }
        };
        self.inputs.iter().zip(&mut self.modes).map(next_level).collect()
    }

    fn draw_writes(&mut self, stimulus_symbols: &StimulusSymbols, eval: &Evaluator) -> Vec<(usize, i32)> {
        // Which symbols are written: one in n integers and one in n bits; 0 means none.
        let (integers, bits) = match (self.kind.writes, self.first) {
            (WritePlan::Nothing, _) | (WritePlan::AllAtStart, false) => return Vec::new(),
            (WritePlan::AllAtStart | WritePlan::OftenAll, true) => (1, 1),
            (WritePlan::OftenAll, false) => (2, 3),
            (WritePlan::RareIntegers, true) => (2, 0),
            (WritePlan::RareIntegers, false) if self.rng.one_in(6) => (3, 0),
            (WritePlan::RareIntegers, false) => return Vec::new(),
        };
        let mut writes = Vec::new();
        let writable = |symbol: &&usize| stimulus_symbols.writable.get(**symbol) == Some(&true);
        for &symbol in stimulus_symbols.bits.iter().filter(writable) {
            if bits > 0 && self.rng.one_in(bits) {
                writes.push((symbol, self.rng.below(2) as i32));
            }
        }
        for &symbol in stimulus_symbols.integers.iter().filter(writable) {
            if self.rng.one_in(integers) {
                writes.push((symbol, stimulus_symbols.random_value(symbol, eval, &mut self.rng)));
            }
        }
        writes
    }
}
