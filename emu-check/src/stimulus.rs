//! What is done to both sides: an endless row of runs from reset, of which the first N scans are used.
//!
//! Everything follows from the program and the seed. The first N scans of a longer check are the scans of a check of N,
//! so a difference in scan n is replayed by a check of n scans.

use emu_core::rng::Rng;
use ladder_eval::Evaluator;

use crate::boundary_goals::BoundaryGoals;
use crate::coverage_goals::CoverageGoals;
use crate::value_hints::ValueHints;

/// What is done around one scan.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct ScanStimulus {
    /// Levels of the inputs, in the order of [`ValueHints::inputs`].
    pub inputs: Vec<bool>,
    /// Inputs whose level is inverted once they must have been latched; empty when none is.
    pub flips: Vec<bool>,
    /// Levels of the pins that the program does not name, a bit each; they must not matter.
    pub spare: u32,
    /// What conversions of the analog inputs give, in the evaluator's order of them.
    pub analog: Vec<u16>,
    /// A byte that begins on its way to the receiver, unless one is under way or waits.
    pub byte: Option<u8>,
    /// Symbols (by index) and the values written to them at the scan's start.
    pub writes: Vec<(usize, i32)>,
}

impl ScanStimulus {
    /// Gives the evaluator this scan's inputs and writes.
    pub(crate) fn apply(&self, hints: &ValueHints, eval: &mut Evaluator) {
        hints.inputs.iter().zip(&self.inputs).for_each(|(&symbol, &on)| eval.set(symbol, i32::from(on)));
        hints.analog.iter().zip(&self.analog).for_each(|(&symbol, &value)| eval.set_adc(symbol, value));
        self.writes.iter().for_each(|&(symbol, value)| eval.set(symbol, value));
    }

    /// The same where there is no line on which a byte takes its time: it is there at once, unless one waits.
    pub(crate) fn apply_immediately(&self, hints: &ValueHints, eval: &mut Evaluator) {
        self.apply(hints, eval);
        if let Some(byte) = self.byte.filter(|_| !eval.has_received_byte()) {
            eval.receive(byte);
        }
    }
}

/// How the inputs of a run move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum InputPlan {
    /// All stay off.
    Low,
    /// Every combination once, in random order (with too many inputs: as [`Inputs::Modes`]).
    Sweep,
    /// Each in a mode of its own.
    Modes,
    /// The same, and a mode may last long.
    Slow,
}

/// What is written in a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum WritePlan {
    Nothing,
    /// Everything, at the first scan's start.
    AllAtStart,
    /// Everything at the first scan's start, then about half of the symbols at each.
    OftenAll,
    /// Integers only and rarely, so that timers and counters run on from near their limits.
    RareIntegers,
}

/// A kind of run: inputs, writes, scans (a sweep takes as many as there are combinations, if that is more).
type RunKind = (InputPlan, WritePlan, usize);

/// The first runs, each once.
#[rustfmt::skip]
const OPENING_RUNS: [RunKind; 2] = [
    (InputPlan::Low,   WritePlan::Nothing, 24),
    (InputPlan::Sweep, WritePlan::Nothing, 32),
];

/// The runs after those, again and again. The one without writes grows from round to round, so that a long check also
/// sees what adds up slowly, such as a drift of the period.
#[rustfmt::skip]
const ROUND_RUNS: [RunKind; 6] = [
    (InputPlan::Modes, WritePlan::AllAtStart,    40),
    (InputPlan::Modes, WritePlan::OftenAll,   200),
    (InputPlan::Modes, WritePlan::RareIntegers,    200),
    (InputPlan::Sweep, WritePlan::OftenAll,    64),
    (InputPlan::Modes, WritePlan::AllAtStart,    40),
    (InputPlan::Modes, WritePlan::Nothing, 160),
];

/// Of a check without writes the run after each of those: `patience` scans long, with inputs that may stay for as long.
const LONG_RUN: RunKind = (InputPlan::Slow, WritePlan::RareIntegers, 0);

/// Up to so many inputs all combinations are tried.
pub(crate) const MAX_SWEEP_INPUTS: usize = 8;

/// Steps drawn per scan while something is not covered; the one that covers most is taken.
const DRAWS_PER_SCAN: usize = 16;

/// Steps drawn per scan for a wish.
const TRIES_PER_GOAL: usize = 24;

/// How one input moves for a while.
#[derive(Debug, Clone, Copy)]
enum InputMode {
    Hold(bool),
    /// One scan of this level in so many.
    Pulse(bool, u64),
    Toggle,
    Random,
}

/// The source of runs and steps.
#[derive(Debug, Clone)]
pub(crate) struct StimulusGenerator {
    rng: Rng,
    /// What pins without a name do is drawn apart, for it has no part in the rest.
    spare_rng: Rng,
    runs: usize,
    /// Scans of the present run that are still to come.
    remaining_scans: usize,
    first: bool,
    kind: RunKind,
    modes: Vec<(InputMode, u64)>,
    inputs: Vec<bool>,
    analog: Vec<u16>,
    /// Input combinations of a sweep that are still to come.
    sweep: Vec<u32>,
    boundary_goals: BoundaryGoals,
    /// Scans of the long run after each round; 0 for none.
    long_run_scans: usize,
}

impl StimulusGenerator {
    pub(crate) fn new(seed: u64, wishes: BoundaryGoals) -> StimulusGenerator {
        StimulusGenerator {
            rng: Rng::new(seed),
            spare_rng: Rng::new(!seed),
            runs: 0,
            remaining_scans: 0,
            first: true,
            kind: OPENING_RUNS[0],
            modes: Vec::new(),
            inputs: Vec::new(),
            analog: Vec::new(),
            sweep: Vec::new(),
            boundary_goals: wishes,
            long_run_scans: 0,
        }
    }

    /// With a run of so many scans after each round: what is reached by time alone is reached there.
    pub(crate) fn with_long_runs(seed: u64, wishes: BoundaryGoals, patience: usize) -> StimulusGenerator {
        StimulusGenerator { long_run_scans: patience, ..StimulusGenerator::new(seed, wishes) }
    }

    /// True in a long run.
    pub(crate) fn is_long(&self) -> bool {
        self.kind.0 == InputPlan::Slow
    }

    /// When a new run begins: the seed of its random RAM.
    pub(crate) fn begin_run(&mut self, hints: &ValueHints) -> Option<u64> {
        if self.remaining_scans > 0 {
            return None;
        }
        self.kind = match self.runs.checked_sub(OPENING_RUNS.len()) {
            None => OPENING_RUNS[self.runs],
            Some(n) => ROUND_RUNS.get(n % self.runs_per_round()).copied().unwrap_or((
                LONG_RUN.0,
                LONG_RUN.1,
                self.long_run_scans,
            )),
        };
        if let Some(n) = self.runs.checked_sub(OPENING_RUNS.len())
            && self.kind.1 == WritePlan::Nothing
        {
            self.kind.2 *= 1 + n / self.runs_per_round();
        }
        self.runs += 1;
        self.first = true;
        let inputs = hints.inputs.len();
        self.inputs = vec![false; inputs];
        self.analog = vec![0; hints.analog.len()];
        self.modes = vec![(InputMode::Hold(false), 0); inputs];
        self.sweep.clear();
        if self.kind.0 == InputPlan::Sweep && inputs <= MAX_SWEEP_INPUTS {
            self.sweep = (0..1 << inputs).collect();
            for n in (1..self.sweep.len()).rev() {
                let other = self.rng.below(n as u64 + 1) as usize;
                self.sweep.swap(n, other);
            }
        }
        self.remaining_scans = self.kind.2.max(self.sweep.len());
        Some(self.rng.next_u64())
    }

    /// Runs of a round.
    fn runs_per_round(&self) -> usize {
        ROUND_RUNS.len() + usize::from(self.long_run_scans > 0)
    }

    /// The next scan's step; `eval` is in the state before it. Where writing is allowed, several are drawn and tried: for
    /// goals that are still open, or for a wish.
    pub(crate) fn next_stimulus(
        &mut self,
        hints: &ValueHints,
        eval: &Evaluator,
        goals: &CoverageGoals,
    ) -> ScanStimulus {
        let drawn = self.draw_stimulus(hints, eval);
        let writes = self.kind.1 != WritePlan::Nothing && (self.first || self.kind.1 != WritePlan::AllAtStart);
        let mut step = match (writes, self.rng.below(4)) {
            (true, 0 | 1) if goals.has_open_goals() => self.best_covering(hints, eval, goals, drawn),
            (true, 1..) if self.kind.1 == WritePlan::OftenAll => self.goal_stimulus(hints, eval, drawn),
            _ => drawn,
        };
        step.spare = self.spare_rng.next_u64() as u32;
        self.inputs.clone_from(&step.inputs);
        self.analog.clone_from(&step.analog);
        self.first = false;
        self.remaining_scans = self.remaining_scans.saturating_sub(1);
        step
    }

    /// Of several steps the one that reaches most goals.
    fn best_covering(
        &mut self,
        hints: &ValueHints,
        eval: &Evaluator,
        goals: &CoverageGoals,
        mut best: ScanStimulus,
    ) -> ScanStimulus {
        let mut most = goals.count_gain(eval, hints, &best);
        for _ in 1..DRAWS_PER_SCAN {
            let other = self.redraw_stimulus(hints, eval, &best);
            let gain = goals.count_gain(eval, hints, &other);
            if gain > most {
                (best, most) = (other, gain);
            }
        }
        best
    }

    /// A step that grants the next wish, else `step`.
    fn goal_stimulus(&mut self, hints: &ValueHints, eval: &Evaluator, step: ScanStimulus) -> ScanStimulus {
        let Some(wish) = self.boundary_goals.next_open() else { return step };
        let mut candidate = step.clone();
        for _ in 0..TRIES_PER_GOAL {
            if self.boundary_goals.try_reach(wish, eval, hints, &mut candidate) {
                return candidate;
            }
            candidate = self.redraw_stimulus(hints, eval, &step);
        }
        step
    }

    fn draw_stimulus(&mut self, hints: &ValueHints, eval: &Evaluator) -> ScanStimulus {
        let inputs = match (self.kind.0, self.sweep.pop()) {
            (InputPlan::Low, _) => self.inputs.clone(),
            (_, Some(bits)) => (0..self.inputs.len()).map(|n| bits >> n & 1 == 1).collect(),
            _ => self.move_inputs(),
        };
        let flips = if self.rng.one_in(4) { self.random_bits(inputs.len()) } else { Vec::new() };
        let writes = self.draw_writes(hints, eval);
        let (analog, byte) = self.draw_external(hints);
        ScanStimulus { inputs, flips, spare: 0, analog, byte, writes }
    }

    /// Another step for the same scan: other writes, and where no sweep is under way sometimes other inputs.
    fn redraw_stimulus(&mut self, hints: &ValueHints, eval: &Evaluator, step: &ScanStimulus) -> ScanStimulus {
        let sweeping =
            self.kind.0 == InputPlan::Sweep && !self.inputs.is_empty() && self.inputs.len() <= MAX_SWEEP_INPUTS;
        let inputs =
            if sweeping || self.rng.one_in(2) { step.inputs.clone() } else { self.random_bits(step.inputs.len()) };
        let (analog, byte) = self.draw_external(hints);
        ScanStimulus {
            inputs,
            flips: step.flips.clone(),
            spare: 0,
            analog,
            byte,
            writes: self.draw_writes(hints, eval),
        }
    }

    /// Analog inputs, and a byte for the receiver. Nothing is drawn for programs without them.
    fn draw_external(&mut self, hints: &ValueHints) -> (Vec<u16>, Option<u8>) {
        let (still, rng) = (self.kind.0 == InputPlan::Low, &mut self.rng);
        let moved = |(&symbol, &value): (&usize, &u16)| match still {
            false if rng.one_in(3) => hints.random_conversion(symbol, rng),
            _ => value,
        };
        let analog = hints.analog.iter().zip(&self.analog).map(moved).collect();
        let byte = (hints.receives && !still && self.rng.one_in(2)).then(|| hints.random_byte(&mut self.rng));
        (analog, byte)
    }

    fn random_bits(&mut self, n: usize) -> Vec<bool> {
        (0..n).map(|_| self.rng.one_in(2)).collect()
    }

    /// The inputs, each moved by its mode.
    fn move_inputs(&mut self) -> Vec<bool> {
        let longest = if self.is_long() { self.long_run_scans as u64 / 4 } else { 0 };
        let rng = &mut self.rng;
        let step = |(input, (mode, left)): (&bool, &mut (InputMode, u64))| {
            if *left == 0 {
                *left = 3 + rng.below(40);
                // Long stays of all lengths, from some scans to a share of the run.
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
        self.inputs.iter().zip(&mut self.modes).map(step).collect()
    }

    fn draw_writes(&mut self, hints: &ValueHints, eval: &Evaluator) -> Vec<(usize, i32)> {
        // Which symbols: one in so many integers and one in so many bits; 0 is none.
        let (integers, bits) = match (self.kind.1, self.first) {
            (WritePlan::Nothing, _) | (WritePlan::AllAtStart, false) => return Vec::new(),
            (WritePlan::AllAtStart | WritePlan::OftenAll, true) => (1, 1),
            (WritePlan::OftenAll, false) => (2, 3),
            (WritePlan::RareIntegers, true) => (2, 0),
            (WritePlan::RareIntegers, false) if self.rng.one_in(6) => (3, 0),
            (WritePlan::RareIntegers, false) => return Vec::new(),
        };
        let mut writes = Vec::new();
        let writable = |symbol: &&usize| hints.writable.get(**symbol) == Some(&true);
        for &symbol in hints.bits.iter().filter(writable) {
            if bits > 0 && self.rng.one_in(bits) {
                writes.push((symbol, self.rng.below(2) as i32));
            }
        }
        for &symbol in hints.integers.iter().filter(writable) {
            if self.rng.one_in(integers) {
                writes.push((symbol, hints.random_value(symbol, eval, &mut self.rng)));
            }
        }
        writes
    }
}
