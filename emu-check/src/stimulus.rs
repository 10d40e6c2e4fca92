//! What is done to both sides: an endless row of runs from reset, of which the first N scans are used.
//!
//! Everything follows from the program and the seed. The first N scans of a longer check are the scans of a check of N,
//! so a difference in scan n is replayed by a check of n scans.

use emu_core::rng::Rng;
use ladder_eval::Evaluator;

use crate::goals::Goals;
use crate::hints::Hints;
use crate::wishes::Wishes;

/// What is done around one scan.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Step {
    /// Levels of the inputs, in the order of [`Hints::inputs`].
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

impl Step {
    /// Gives the evaluator this scan's inputs and writes.
    pub(crate) fn apply(&self, hints: &Hints, eval: &mut Evaluator) {
        hints.inputs.iter().zip(&self.inputs).for_each(|(&symbol, &on)| eval.set(symbol, i32::from(on)));
        hints.analog.iter().zip(&self.analog).for_each(|(&symbol, &value)| eval.set_adc(symbol, value));
        self.writes.iter().for_each(|&(symbol, value)| eval.set(symbol, value));
    }

    /// The same where there is no line on which a byte takes its time: it is there at once, unless one waits.
    pub(crate) fn apply_at_once(&self, hints: &Hints, eval: &mut Evaluator) {
        self.apply(hints, eval);
        if let Some(byte) = self.byte.filter(|_| !eval.waiting()) {
            eval.receive(byte);
        }
    }
}

/// How the inputs of a run move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Inputs {
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
enum Writes {
    Nothing,
    /// Everything, at the first scan's start.
    First,
    /// Everything at the first scan's start, then about half of the symbols at each.
    Every,
    /// Integers only and rarely, so that timers and counters run on from near their limits.
    Rare,
}

/// A kind of run: inputs, writes, scans (a sweep takes as many as there are combinations, if that is more).
type Kind = (Inputs, Writes, usize);

/// The first runs, each once.
#[rustfmt::skip]
const OPENING: [Kind; 2] = [
    (Inputs::Low,   Writes::Nothing, 24),
    (Inputs::Sweep, Writes::Nothing, 32),
];

/// The runs after those, again and again. The one without writes grows from round to round, so that a long check also
/// sees what adds up slowly, such as a drift of the period.
#[rustfmt::skip]
const ROUND: [Kind; 6] = [
    (Inputs::Modes, Writes::First,    40),
    (Inputs::Modes, Writes::Every,   200),
    (Inputs::Modes, Writes::Rare,    200),
    (Inputs::Sweep, Writes::Every,    64),
    (Inputs::Modes, Writes::First,    40),
    (Inputs::Modes, Writes::Nothing, 160),
];

/// Of a check without writes the run after each of those: `patience` scans long, with inputs that may stay for as long.
const PATIENT: Kind = (Inputs::Slow, Writes::Rare, 0);

/// Up to so many inputs all combinations are tried.
pub(crate) const SWEEP: usize = 8;

/// Steps drawn per scan while something is not covered; the one that covers most is taken.
const DRAWS: usize = 16;

/// Steps drawn per scan for a wish.
const TRIES: usize = 24;

/// How one input moves for a while.
#[derive(Debug, Clone, Copy)]
enum Mode {
    Hold(bool),
    /// One scan of this level in so many.
    Pulse(bool, u64),
    Toggle,
    Random,
}

/// The source of runs and steps.
#[derive(Debug, Clone)]
pub(crate) struct Stimulus {
    rng: Rng,
    /// What pins without a name do is drawn apart, for it has no part in the rest.
    spare: Rng,
    runs: usize,
    /// Scans of the present run that are still to come.
    left: usize,
    first: bool,
    kind: Kind,
    modes: Vec<(Mode, u64)>,
    inputs: Vec<bool>,
    analog: Vec<u16>,
    /// Input combinations of a sweep that are still to come.
    sweep: Vec<u32>,
    wishes: Wishes,
    /// Scans of the long run after each round; 0 for none.
    patience: usize,
}

impl Stimulus {
    pub(crate) fn new(seed: u64, wishes: Wishes) -> Stimulus {
        Stimulus {
            rng: Rng::new(seed),
            spare: Rng::new(!seed),
            runs: 0,
            left: 0,
            first: true,
            kind: OPENING[0],
            modes: Vec::new(),
            inputs: Vec::new(),
            analog: Vec::new(),
            sweep: Vec::new(),
            wishes,
            patience: 0,
        }
    }

    /// With a run of so many scans after each round: what is reached by time alone is reached there.
    pub(crate) fn patient(seed: u64, wishes: Wishes, patience: usize) -> Stimulus {
        Stimulus { patience, ..Stimulus::new(seed, wishes) }
    }

    /// True in a long run.
    pub(crate) fn is_long(&self) -> bool {
        self.kind.0 == Inputs::Slow
    }

    /// When a new run begins: the seed of its random RAM.
    pub(crate) fn begin(&mut self, hints: &Hints) -> Option<u64> {
        if self.left > 0 {
            return None;
        }
        self.kind = match self.runs.checked_sub(OPENING.len()) {
            None => OPENING[self.runs],
            Some(n) => ROUND.get(n % self.round()).copied().unwrap_or((PATIENT.0, PATIENT.1, self.patience)),
        };
        if let Some(n) = self.runs.checked_sub(OPENING.len())
            && self.kind.1 == Writes::Nothing
        {
            self.kind.2 *= 1 + n / self.round();
        }
        self.runs += 1;
        self.first = true;
        let inputs = hints.inputs.len();
        self.inputs = vec![false; inputs];
        self.analog = vec![0; hints.analog.len()];
        self.modes = vec![(Mode::Hold(false), 0); inputs];
        self.sweep.clear();
        if self.kind.0 == Inputs::Sweep && inputs <= SWEEP {
            self.sweep = (0..1 << inputs).collect();
            for n in (1..self.sweep.len()).rev() {
                let other = self.rng.below(n as u64 + 1) as usize;
                self.sweep.swap(n, other);
            }
        }
        self.left = self.kind.2.max(self.sweep.len());
        Some(self.rng.next_u64())
    }

    /// Runs of a round.
    fn round(&self) -> usize {
        ROUND.len() + usize::from(self.patience > 0)
    }

    /// The next scan's step; `eval` is in the state before it. Where writing is allowed, several are drawn and tried: for
    /// goals that are still open, or for a wish.
    pub(crate) fn step(&mut self, hints: &Hints, eval: &Evaluator, goals: &Goals) -> Step {
        let drawn = self.draw(hints, eval);
        let writes = self.kind.1 != Writes::Nothing && (self.first || self.kind.1 != Writes::First);
        let mut step = match (writes, self.rng.below(4)) {
            (true, 0 | 1) if goals.open() => self.covering(hints, eval, goals, drawn),
            (true, 1..) if self.kind.1 == Writes::Every => self.wished(hints, eval, drawn),
            _ => drawn,
        };
        step.spare = self.spare.next_u64() as u32;
        self.inputs.clone_from(&step.inputs);
        self.analog.clone_from(&step.analog);
        self.first = false;
        self.left = self.left.saturating_sub(1);
        step
    }

    /// Of several steps the one that reaches most goals.
    fn covering(&mut self, hints: &Hints, eval: &Evaluator, goals: &Goals, mut best: Step) -> Step {
        let mut most = goals.gain(eval, hints, &best);
        for _ in 1..DRAWS {
            let other = self.redraw(hints, eval, &best);
            let gain = goals.gain(eval, hints, &other);
            if gain > most {
                (best, most) = (other, gain);
            }
        }
        best
    }

    /// A step that grants the next wish, else `step`.
    fn wished(&mut self, hints: &Hints, eval: &Evaluator, step: Step) -> Step {
        let Some(wish) = self.wishes.choose() else { return step };
        let mut candidate = step.clone();
        for _ in 0..TRIES {
            if self.wishes.grant(wish, eval, hints, &mut candidate) {
                return candidate;
            }
            candidate = self.redraw(hints, eval, &step);
        }
        step
    }

    fn draw(&mut self, hints: &Hints, eval: &Evaluator) -> Step {
        let inputs = match (self.kind.0, self.sweep.pop()) {
            (Inputs::Low, _) => self.inputs.clone(),
            (_, Some(bits)) => (0..self.inputs.len()).map(|n| bits >> n & 1 == 1).collect(),
            _ => self.moved(),
        };
        let flips = if self.rng.one_in(4) { self.coins(inputs.len()) } else { Vec::new() };
        let writes = self.writes(hints, eval);
        let (analog, byte) = self.outside(hints);
        Step { inputs, flips, spare: 0, analog, byte, writes }
    }

    /// Another step for the same scan: other writes, and where no sweep is under way sometimes other inputs.
    fn redraw(&mut self, hints: &Hints, eval: &Evaluator, step: &Step) -> Step {
        let sweeping = self.kind.0 == Inputs::Sweep && !self.inputs.is_empty() && self.inputs.len() <= SWEEP;
        let inputs = if sweeping || self.rng.one_in(2) { step.inputs.clone() } else { self.coins(step.inputs.len()) };
        let (analog, byte) = self.outside(hints);
        Step { inputs, flips: step.flips.clone(), spare: 0, analog, byte, writes: self.writes(hints, eval) }
    }

    /// Analog inputs, and a byte for the receiver. Nothing is drawn for programs without them.
    fn outside(&mut self, hints: &Hints) -> (Vec<u16>, Option<u8>) {
        let (still, rng) = (self.kind.0 == Inputs::Low, &mut self.rng);
        let moved = |(&symbol, &value): (&usize, &u16)| match still {
            false if rng.one_in(3) => hints.conversion(symbol, rng),
            _ => value,
        };
        let analog = hints.analog.iter().zip(&self.analog).map(moved).collect();
        let byte = (hints.receives && !still && self.rng.one_in(2)).then(|| hints.byte(&mut self.rng));
        (analog, byte)
    }

    fn coins(&mut self, n: usize) -> Vec<bool> {
        (0..n).map(|_| self.rng.one_in(2)).collect()
    }

    /// The inputs, each moved by its mode.
    fn moved(&mut self) -> Vec<bool> {
        let longest = if self.is_long() { self.patience as u64 / 4 } else { 0 };
        let rng = &mut self.rng;
        let step = |(input, (mode, left)): (&bool, &mut (Mode, u64))| {
            if *left == 0 {
                *left = 3 + rng.below(40);
                // Long stays of all lengths, from some scans to a share of the run.
                while *left * 2 < longest && !rng.one_in(6) {
                    *left *= 2;
                }
                *mode = match rng.below(6) {
                    0..4 if *left > 43 => Mode::Hold(rng.one_in(2)),
                    0 | 1 => Mode::Hold(!*input),
                    2 => Mode::Pulse(true, 2 + rng.below(12)),
                    3 => Mode::Pulse(false, 2 + rng.below(12)),
                    4 => Mode::Toggle,
                    _ => Mode::Random,
                };
            }
            *left -= 1;
            match *mode {
                Mode::Hold(level) => level,
                Mode::Pulse(level, n) => (*left % n == 0) == level,
                Mode::Toggle => !*input,
                Mode::Random => rng.one_in(2),
            }
        };
        self.inputs.iter().zip(&mut self.modes).map(step).collect()
    }

    fn writes(&mut self, hints: &Hints, eval: &Evaluator) -> Vec<(usize, i32)> {
        // Which symbols: one in so many integers and one in so many bits; 0 is none.
        let (integers, bits) = match (self.kind.1, self.first) {
            (Writes::Nothing, _) | (Writes::First, false) => return Vec::new(),
            (Writes::First | Writes::Every, true) => (1, 1),
            (Writes::Every, false) => (2, 3),
            (Writes::Rare, true) => (2, 0),
            (Writes::Rare, false) if self.rng.one_in(6) => (3, 0),
            (Writes::Rare, false) => return Vec::new(),
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
                writes.push((symbol, hints.value(symbol, eval, &mut self.rng)));
            }
        }
        writes
    }
}
