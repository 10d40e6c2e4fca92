//! Static analysis: which rung bits can occur at the input and output of every element.
//!
//! The analysis makes one pass over a scan per combination of inputs. At the start of the scan, every relay
//! and integer may have any value; only what the scan itself writes is known. The result is an over-estimate,
//! so what it calls impossible is impossible (a contact after OPEN, a comparison of a value that a MOVE above
//! has just set). It is only used to exclude outcomes from coverage, never to judge an image.

use std::collections::{BTreeSet, HashMap};

use ladder::il::IlAction;
use ladder::{
    CompareOp, CounterKind, Element, FlowOp, LadderDialect, LadderOperand, LadderProgram, MathOp, RungNode,
    SerialTransfer, SymbolKind, TimerKind,
};

use crate::stimulus::generator::MAX_SWEEP_INPUTS;

/// Bit of a set of (input, output) pairs: both false.
pub(crate) const FALSE_FALSE: u8 = 1;
/// Bit of a set of (input, output) pairs: input false, output true.
pub(crate) const FALSE_TRUE: u8 = 2;
/// Bit of a set of (input, output) pairs: input true, output false.
pub(crate) const TRUE_FALSE: u8 = 4;
/// Bit of a set of (input, output) pairs: both true.
pub(crate) const TRUE_TRUE: u8 = 8;

/// Bits of the set of values that a bit can have: it can be false, it can be true.
const ZERO: u8 = 1;
const ONE: u8 = 2;
const BOTH: u8 = ZERO | ONE;

/// Maximum number of values tracked per integer; an integer with more can have any value.
const MAX_TRACKED_VALUES: usize = 16;

/// Size up to which a program is analysed for every combination of inputs; larger ones get one pass for all
/// inputs.
const LARGE_PROGRAM_ELEMENTS: usize = 2_000;

/// The set that contains only `bit`.
fn single_bit_set(bit: bool) -> u8 {
    if bit { ONE } else { ZERO }
}

/// A set with each of its bits inverted if `negated`.
fn invert_set(set: u8, negated: bool) -> u8 {
    if negated { set >> 1 | (set & ZERO) << 1 } else { set }
}

/// For each combination of inputs, and each element in execution order: the set of (input, output) pairs that
/// can occur.
pub(crate) fn possible_outcomes(program: &LadderProgram) -> Vec<Vec<u8>> {
    let symbols = program.symbols();
    let inputs: Vec<&str> = symbols.iter().filter(|s| s.kind == SymbolKind::Input).map(|s| s.name.as_str()).collect();
    let split = inputs.len() <= MAX_SWEEP_INPUTS
        && program.elements().count() << inputs.len() <= LARGE_PROGRAM_ELEMENTS << MAX_SWEEP_INPUTS;
    let input_combinations = if split { 1u32 << inputs.len() } else { 1 };
    // A falling edge needs a true rung in an earlier scan, under any inputs. So the first OSF that fires had
    // a true rung while no OSF had fired, the second one while only the first had, and so on. Starting with
    // none, the loop ends with all OSFs that can fire.
    let mut falling_edges = BTreeSet::new();
    // With jumps a rung may follow any other, and any number of times.
    let jumps = program.elements().any(|at| ladder::flow::changes_order(at.element));
    loop {
        let pass = |combination: u32| {
            let mut pass = AnalysisPass::new(&falling_edges, program.dialect != LadderDialect::Ldmicro23);
            if split {
                let levels = inputs
                    .iter()
                    .zip(0..)
                    .map(|(name, n)| ((*name).to_owned(), single_bit_set(combination >> n & 1 == 1)));
                pass.bits = levels.collect();
            }
            for rung in &program.rungs {
                if jumps {
                    pass.forget();
                }
                pass.series(&rung.series, pass.master);
            }
            (pass.pairs, pass.risen_edges)
        };
        let (pairs, risen): (Vec<_>, Vec<_>) = (0..input_combinations).map(pass).unzip();
        let before = falling_edges.len();
        falling_edges.extend(risen.into_iter().flatten());
        if falling_edges.len() == before {
            return pairs;
        }
    }
}

/// The values that an integer can have; `None` means any. Only 16-bit integers are tracked; in dialect
/// ldmicro-5 all integers are unknown.
type KnownValues = Option<Vec<i32>>;

/// One pass of the analysis over a scan, for one combination of inputs.
struct AnalysisPass<'a> {
    /// Positions of the OSF elements whose rung can have been true in an earlier scan.
    falling_edges: &'a BTreeSet<usize>,
    /// Positions of the OSF elements whose rung can be true in this scan.
    risen_edges: Vec<usize>,
    /// Values that the power rail of the master relay can have.
    master: u8,
    /// True if integers have individual widths (dialect ldmicro-5).
    wide: bool,
    /// Known values of bits; a bit without an entry can be false or true.
    bits: HashMap<String, u8>,
    /// Known values of integers; an integer without an entry can have any value.
    integers: HashMap<String, Vec<i32>>,
    /// The result: per element in execution order, the set of (input, output) pairs.
    pairs: Vec<u8>,
}

impl<'a> AnalysisPass<'a> {
    fn new(falling_edges: &'a BTreeSet<usize>, wide: bool) -> Self {
        let (bits, integers) = (HashMap::new(), HashMap::new());
        AnalysisPass { falling_edges, risen_edges: Vec::new(), master: ONE, wide, bits, integers, pairs: Vec::new() }
    }

    /// Forgets all that the scan wrote: only inputs have a known value.
    fn forget(&mut self) {
        self.master = BOTH;
        self.bits.retain(|name, _| name.starts_with('X'));
        self.integers.clear();
    }

    fn series(&mut self, nodes: &[RungNode], mut rung: u8) -> u8 {
        for node in nodes {
            rung = match node {
                RungNode::Leaf(Element::Comment(_), _) => rung,
                RungNode::Leaf(element, _) => {
                    let pairs = self.element(element, rung);
                    self.pairs.push(pairs);
                    outputs_of_pairs(pairs)
                }
                RungNode::Parallel(branches, _) => {
                    let outs: Vec<u8> = branches.iter().map(|branch| self.series(branch, rung)).collect();
                    or_of_sets(&outs)
                }
            };
        }
        rung
    }

    /// Executes the element with the set of rung bits `rung`. Returns the set of (input, output) pairs.
    fn element(&mut self, element: &Element, rung: u8) -> u8 {
        let when = |zero: u8, one: u8| if rung & ZERO != 0 { zero } else { 0 } | if rung & ONE != 0 { one } else { 0 };
        let same = when(FALSE_FALSE, TRUE_TRUE);
        match element {
            Element::Contacts { name, negated, .. } => {
                let bit = invert_set(self.bits.get(name).copied().unwrap_or(BOTH), *negated);
                when(
                    FALSE_FALSE,
                    if bit & ONE != 0 { TRUE_TRUE } else { 0 } | if bit & ZERO != 0 { TRUE_FALSE } else { 0 },
                )
            }
            Element::Coil { name, negated, set, reset, ttrigger } => {
                let old = self.bits.get(name).copied().unwrap_or(BOTH);
                let new = match (negated, set, reset, ttrigger) {
                    (true, ..) => invert_set(rung, true),
                    (_, true, ..) => when(old, ONE),
                    (_, _, true, _) => when(old, ZERO),
                    (_, _, _, Some(1)) => when(old, old | invert_set(old, true)),
                    _ => rung,
                };
                self.bits.insert(name.clone(), new);
                same
            }
            Element::Flow { op: FlowOp::Gosub, .. } => {
                self.forget();
                same
            }
            // After the maximum number of jumps back in a scan, the next one is not taken.
            Element::Flow { op: FlowOp::Goto, .. } => when(FALSE_FALSE, TRUE_FALSE | TRUE_TRUE),
            Element::Flow { .. } | Element::Return | Element::Lock => same,
            Element::SeedRandom { .. } | Element::Delay { .. } | Element::Sleep | Element::ClearWatchdog => same,
            Element::NpulseOff | Element::Text { .. } => same,
            Element::Segments { dest, src, .. } => {
                self.integers.remove(dest);
                if let LadderOperand::Var(name) = src {
                    self.integers.remove(name);
                }
                same
            }
            Element::Open => when(FALSE_FALSE, TRUE_FALSE),
            Element::MasterRelay => {
                let (off, on) = (self.master & ZERO != 0, self.master & ONE != 0);
                self.master = if off { ONE } else { 0 } | if on { rung } else { 0 };
                same
            }
            Element::Osr => when(FALSE_FALSE, TRUE_FALSE | TRUE_TRUE),
            Element::Osf => {
                let position = self.pairs.len();
                if rung & ONE != 0 {
                    self.risen_edges.push(position);
                }
                when(
                    if self.falling_edges.contains(&position) { FALSE_FALSE | FALSE_TRUE } else { FALSE_FALSE },
                    TRUE_FALSE,
                )
            }
            Element::Odr => when(FALSE_TRUE, TRUE_FALSE | TRUE_TRUE),
            Element::Odf | Element::Osl => when(FALSE_FALSE | FALSE_TRUE, TRUE_TRUE),
            Element::Osc => when(FALSE_FALSE, TRUE_FALSE | TRUE_TRUE),
            Element::Timer { kind, name, .. } => {
                self.integers.remove(name);
                match kind {
                    TimerKind::Ton => when(FALSE_FALSE, TRUE_FALSE | TRUE_TRUE),
                    TimerKind::Tof => when(FALSE_FALSE | FALSE_TRUE, TRUE_TRUE),
                    TimerKind::Tcy => when(FALSE_FALSE, TRUE_FALSE | TRUE_TRUE),
                    TimerKind::Rto | TimerKind::Rtl | TimerKind::Thi | TimerKind::Tlo => {
                        when(FALSE_FALSE | FALSE_TRUE, TRUE_FALSE | TRUE_TRUE)
                    }
                }
            }
            Element::Counter { kind, name, max, input, .. } => {
                self.integers.remove(name);
                let always =
                    !self.wide && matches!(max, LadderOperand::Const { value, .. } if *value <= i64::from(i16::MIN));
                match kind {
                    CounterKind::Ctc if !self.wide => same,
                    CounterKind::Ctc | CounterKind::Ctr => match input {
                        Some('\\' | 'o') => when(FALSE_FALSE | FALSE_TRUE, TRUE_FALSE),
                        _ => when(FALSE_FALSE, TRUE_FALSE | TRUE_TRUE),
                    },
                    _ if always => when(FALSE_TRUE, TRUE_TRUE),
                    _ => when(FALSE_FALSE | FALSE_TRUE, TRUE_FALSE | TRUE_TRUE),
                }
            }
            Element::Res { name } => {
                self.store(name, Some(vec![0]), rung);
                same
            }
            Element::Move { dest, src } => {
                let values = self.values(src);
                self.store(dest, values, rung);
                same
            }
            Element::Math { op, dest, op1, op2 } => {
                let values = self.values(op1).zip(self.values(op2)).and_then(|(a, b)| math(*op, &a, &b));
                self.store(dest, values, rung);
                same
            }
            Element::Compare { op, op1, op2 } => {
                let truth = self.compare(*op, op1, op2);
                when(
                    FALSE_FALSE,
                    if truth & ONE != 0 { TRUE_TRUE } else { 0 } | if truth & ZERO != 0 { TRUE_FALSE } else { 0 },
                )
            }
            Element::Short => same,
            Element::ShiftRegister { name, stages } => {
                (0..*stages).for_each(|n| _ = self.integers.remove(&format!("{name}{n}")));
                same
            }
            // A bit below the lowest is 0.
            Element::BitTest { bit: LadderOperand::Const { value: ..=-1, .. }, value, .. } => {
                when(FALSE_FALSE, if *value { TRUE_FALSE } else { TRUE_TRUE })
            }
            Element::BitTest { .. } => when(FALSE_FALSE, TRUE_FALSE | TRUE_TRUE),
            Element::Unary { dest: name, .. }
            | Element::Shift { dest: name, .. }
            | Element::BitWrite { name, .. }
            | Element::Bus { dest: name, .. }
            | Element::TimeValue { dest: name, .. }
            | Element::Random { dest: name }
            | Element::LookUpTable { dest: name, .. }
            | Element::PiecewiseLinear { dest: name, .. }
            | Element::ReadAdc { name, .. }
            | Element::Persist { name } => {
                self.integers.remove(name);
                same
            }
            Element::SetPwm { .. } | Element::Comment(_) => same,
            Element::BusTransfer(transfer) => {
                transfer.recv.iter().for_each(|name| _ = self.integers.remove(name));
                same
            }
            Element::UartRecvAvail | Element::UartSendReady => when(FALSE_FALSE, TRUE_FALSE | TRUE_TRUE),
            Element::Pulser { coil, .. } | Element::Npulse { coil, .. } => {
                self.bits.insert(coil.clone(), BOTH);
                when(FALSE_FALSE | FALSE_TRUE, TRUE_FALSE | TRUE_TRUE)
            }
            Element::Stepper { name, coil, .. } => {
                ladder::stepper_counters(name).iter().for_each(|counter| _ = self.integers.remove(counter));
                self.bits.insert(coil.clone(), BOTH);
                when(FALSE_FALSE | FALSE_TRUE, TRUE_FALSE | TRUE_TRUE)
            }
            Element::QuadEncod { counter, dir, .. } => {
                self.integers.remove(counter);
                dir.iter().for_each(|name| _ = self.bits.insert(name.clone(), BOTH));
                when(FALSE_FALSE, TRUE_FALSE | TRUE_TRUE)
            }
            Element::UartRecv { name, .. } => {
                self.integers.remove(name);
                when(FALSE_FALSE, TRUE_FALSE | TRUE_TRUE)
            }
            Element::UartSend { rest: Some(SerialTransfer { bytes: 1, wait: 1 }), .. } => when(FALSE_FALSE, TRUE_FALSE),
            // The current result of Instruction List does not begin anew with a rung.
            Element::Instruction(step) => {
                element.facts().written().for_each(|name| _ = self.bits.insert(name.to_owned(), BOTH));
                if matches!(step.action, IlAction::Nothing) {
                    return same;
                }
                FALSE_FALSE | FALSE_TRUE | TRUE_FALSE | TRUE_TRUE
            }
            // A transmitter may be busy on any rung, so every outcome is taken as possible.
            Element::UartSend { .. } | Element::FormattedString { .. } | Element::Placeholder => {
                when(FALSE_FALSE | FALSE_TRUE, TRUE_FALSE | TRUE_TRUE)
            }
        }
    }

    fn values(&self, operand: &LadderOperand) -> KnownValues {
        match operand {
            LadderOperand::Const { value, .. } => i32::try_from(*value).ok().map(|v| vec![v]),
            LadderOperand::Var(name) => self.integers.get(name).cloned(),
        }
    }

    /// Stores one of `values` in `name` where the rung is true.
    fn store(&mut self, name: &str, values: KnownValues, rung: u8) {
        let merged = match (rung, values, self.integers.get(name)) {
            (ZERO, _, _) => return,
            _ if self.wide => return,
            (ONE, Some(values), _) => values,
            (_, Some(values), Some(old)) => [&values[..], old].concat(),
            _ => {
                self.integers.remove(name);
                return;
            }
        };
        match limited_values(merged) {
            Some(values) => _ = self.integers.insert(name.to_owned(), values),
            None => _ = self.integers.remove(name),
        }
    }

    /// The set of results that a comparison can have.
    fn compare(&self, op: CompareOp, op1: &LadderOperand, op2: &LadderOperand) -> u8 {
        if op1 == op2 {
            return single_bit_set(comparison_holds(op, 0, 0));
        }
        let (least, most) = if self.wide { (i32::MIN, i32::MAX) } else { (i16::MIN.into(), i16::MAX.into()) };
        // If one side is unknown, the neighbours of the other side's values and the extremes cover all cases.
        let around = |values: &[i32]| {
            let neighbours = values.iter().flat_map(|v| [v.saturating_sub(1), *v, v.saturating_add(1)]);
            neighbours.map(|v| v.clamp(least, most)).chain([least, most]).collect::<Vec<_>>()
        };
        let (a, b) = match (self.values(op1), self.values(op2)) {
            (Some(a), Some(b)) => (a, b),
            (Some(a), None) => (a.clone(), around(&a)),
            (None, Some(b)) => (around(&b), b),
            (None, None) => return BOTH,
        };
        a.iter()
            .flat_map(|a| b.iter().map(|b| single_bit_set(comparison_holds(op, *a, *b))))
            .fold(0, |set, one| set | one)
    }
}

/// The set of values that the OR of some sets of bits can have.
pub(crate) fn or_of_sets(sets: &[u8]) -> u8 {
    let zero = if sets.iter().all(|s| s & ZERO != 0) { ZERO } else { 0 };
    zero | if sets.iter().any(|s| s & ONE != 0) { ONE } else { 0 }
}

/// The set of outputs in a set of (input, output) pairs.
pub(crate) fn outputs_of_pairs(pairs: u8) -> u8 {
    let zero = if pairs & (FALSE_FALSE | TRUE_FALSE) != 0 { ZERO } else { 0 };
    zero | if pairs & (FALSE_TRUE | TRUE_TRUE) != 0 { ONE } else { 0 }
}

fn limited_values(mut values: Vec<i32>) -> KnownValues {
    values.sort_unstable();
    values.dedup();
    (values.len() <= MAX_TRACKED_VALUES).then_some(values)
}

fn math(op: MathOp, a: &[i32], b: &[i32]) -> KnownValues {
    let narrow = |values: &[i32]| values.iter().map(|&v| i16::try_from(v).ok()).collect::<Option<Vec<i16>>>();
    let (a, b) = narrow(a).zip(narrow(b))?;
    if matches!(op, MathOp::Div | MathOp::Mod) && b.contains(&0) {
        return None;
    }
    let one = |a: i16, b: i16| match op {
        MathOp::Add => a.wrapping_add(b),
        MathOp::Sub => a.wrapping_sub(b),
        MathOp::Mul => a.wrapping_mul(b),
        MathOp::Div => a.wrapping_div(b),
        MathOp::Mod => a.wrapping_rem(b),
        MathOp::And => a & b,
        MathOp::Or => a | b,
        MathOp::Xor => a ^ b,
    };
    limited_values(a.iter().flat_map(|a| b.iter().map(move |b| i32::from(one(*a, *b)))).collect())
}

/// Returns true if a comparison of two values is true.
pub(crate) fn comparison_holds(op: CompareOp, a: i32, b: i32) -> bool {
    match op {
        CompareOp::Equ => a == b,
        CompareOp::Neq => a != b,
        CompareOp::Grt => a > b,
        CompareOp::Geq => a >= b,
        CompareOp::Les => a < b,
        CompareOp::Leq => a <= b,
    }
}
