//! What can happen at all: for every element, which rung bits can come in and go out.
//!
//! One pass over a scan in which every relay and integer may hold anything at the start and only what this scan itself
//! writes is known, done once per combination of inputs. It over-estimates, so what it calls impossible is impossible
//! (a contact behind OPEN, a comparison of what a MOVE above has just set); it serves to name exceptions of coverage,
//! never to judge an image.

use std::collections::{BTreeSet, HashMap};

use ladder::{CompareOp, CounterKind, Dialect, Element, MathOp, Node, Operand, Program, SymbolKind, TimerKind};

use crate::stimulus::SWEEP;

/// Sets of (in, out): both false.
pub(crate) const P00: u8 = 1;
/// In false, out true.
pub(crate) const P01: u8 = 2;
/// In true, out false.
pub(crate) const P10: u8 = 4;
/// Both true.
pub(crate) const P11: u8 = 8;

/// Sets of bits: can be false, can be true.
const ZERO: u8 = 1;
const ONE: u8 = 2;
const BOTH: u8 = ZERO | ONE;

/// More values than this are "anything".
const MOST: usize = 16;

/// Larger programs are looked at once, for all inputs together.
const LARGE: usize = 2_000;

/// The set that holds just `bit`.
fn only(bit: bool) -> u8 {
    if bit { ONE } else { ZERO }
}

/// A set with each bit inverted, if `negated`.
fn inverted(set: u8, negated: bool) -> u8 {
    if negated { set >> 1 | (set & ZERO) << 1 } else { set }
}

/// Per combination of inputs, and per element of the scan in order of execution: the set of (in, out) that can occur.
pub(crate) fn possible(program: &Program) -> Vec<Vec<u8>> {
    let symbols = program.symbols();
    let inputs: Vec<&str> = symbols.iter().filter(|s| s.kind == SymbolKind::Input).map(|s| s.name.as_str()).collect();
    let split = inputs.len() <= SWEEP && program.elements().count() << inputs.len() <= LARGE << SWEEP;
    let worlds = if split { 1u32 << inputs.len() } else { 1 };
    // A falling edge needs a true rung in an earlier scan, under any inputs. So the first OSF of all to fire has had one
    // while no OSF fired, the next one while only that did, and so on: starting from none, this ends with all that can.
    let mut falls = BTreeSet::new();
    loop {
        let pass = |world: u32| {
            let mut pass = Pass::new(&falls, program.dialect != Dialect::Ldmicro23);
            if split {
                let levels = inputs.iter().zip(0..).map(|(name, n)| ((*name).to_owned(), only(world >> n & 1 == 1)));
                pass.bits = levels.collect();
            }
            for rung in &program.rungs {
                pass.series(&rung.series, pass.master);
            }
            (pass.pairs, pass.risen)
        };
        let (pairs, risen): (Vec<_>, Vec<_>) = (0..worlds).map(pass).unzip();
        let before = falls.len();
        falls.extend(risen.into_iter().flatten());
        if falls.len() == before {
            return pairs;
        }
    }
}

/// Values that an integer can hold; `None` is any. Only integers of 16 bits are followed: in dialect ldmicro-5 nothing is
/// known of them.
type Values = Option<Vec<i32>>;

struct Pass<'a> {
    /// Positions of the OSFs whose rung can have been true before.
    falls: &'a BTreeSet<usize>,
    /// Positions of the OSFs whose rung can be true in this scan.
    risen: Vec<usize>,
    master: u8,
    /// Integers have widths of their own.
    wide: bool,
    /// What is known of bits; those not named can be both.
    bits: HashMap<String, u8>,
    /// What is known of integers.
    integers: HashMap<String, Vec<i32>>,
    pairs: Vec<u8>,
}

impl<'a> Pass<'a> {
    fn new(falls: &'a BTreeSet<usize>, wide: bool) -> Self {
        let (bits, integers) = (HashMap::new(), HashMap::new());
        Pass { falls, risen: Vec::new(), master: ONE, wide, bits, integers, pairs: Vec::new() }
    }

    fn series(&mut self, nodes: &[Node], mut rung: u8) -> u8 {
        for node in nodes {
            rung = match node {
                Node::Leaf(Element::Comment(_), _) => rung,
                Node::Leaf(element, _) => {
                    let pairs = self.element(element, rung);
                    self.pairs.push(pairs);
                    outs(pairs)
                }
                Node::Parallel(branches, _) => {
                    let outs: Vec<u8> = branches.iter().map(|branch| self.series(branch, rung)).collect();
                    either(&outs)
                }
            };
        }
        rung
    }

    /// Does the element with the set of rung bits `rung`, and gives the set of (in, out).
    fn element(&mut self, element: &Element, rung: u8) -> u8 {
        let when = |zero: u8, one: u8| if rung & ZERO != 0 { zero } else { 0 } | if rung & ONE != 0 { one } else { 0 };
        let same = when(P00, P11);
        match element {
            Element::Contacts { name, negated, .. } => {
                let bit = inverted(self.bits.get(name).copied().unwrap_or(BOTH), *negated);
                when(P00, if bit & ONE != 0 { P11 } else { 0 } | if bit & ZERO != 0 { P10 } else { 0 })
            }
            Element::Coil { name, negated, set, reset, .. } => {
                let old = self.bits.get(name).copied().unwrap_or(BOTH);
                let new = match (set, reset) {
                    (true, _) => when(old, ONE),
                    (_, true) => when(old, ZERO),
                    _ => inverted(rung, *negated),
                };
                self.bits.insert(name.clone(), new);
                same
            }
            Element::Open => when(P00, P10),
            Element::MasterRelay => {
                let (off, on) = (self.master & ZERO != 0, self.master & ONE != 0);
                self.master = if off { ONE } else { 0 } | if on { rung } else { 0 };
                same
            }
            Element::Osr => when(P00, P10 | P11),
            Element::Osf => {
                let position = self.pairs.len();
                if rung & ONE != 0 {
                    self.risen.push(position);
                }
                when(if self.falls.contains(&position) { P00 | P01 } else { P00 }, P10)
            }
            Element::Timer { kind, name, .. } => {
                self.integers.remove(name);
                match kind {
                    TimerKind::Ton => when(P00, P10 | P11),
                    TimerKind::Tof => when(P00 | P01, P11),
                    TimerKind::Rto => when(P00 | P01, P10 | P11),
                }
            }
            Element::Counter { kind, name, max, .. } => {
                self.integers.remove(name);
                let always = !self.wide && matches!(max, Operand::Const { value, .. } if *value <= i64::from(i16::MIN));
                match kind {
                    CounterKind::Ctc => same,
                    _ if always => when(P01, P11),
                    _ => when(P00 | P01, P10 | P11),
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
                when(P00, if truth & ONE != 0 { P11 } else { 0 } | if truth & ZERO != 0 { P10 } else { 0 })
            }
            Element::Short => same,
            Element::ShiftRegister { name, stages } => {
                (0..*stages).for_each(|n| _ = self.integers.remove(&format!("{name}{n}")));
                same
            }
            Element::LookUpTable { dest: name, .. }
            | Element::PiecewiseLinear { dest: name, .. }
            | Element::ReadAdc { name, .. }
            | Element::Persist { name } => {
                self.integers.remove(name);
                same
            }
            Element::SetPwm { .. } => same,
            Element::UartRecv { name, .. } => {
                self.integers.remove(name);
                when(P00, P10 | P11)
            }
            // Sending is busy whatever the rung; whatever they do is taken for possible.
            _ => when(P00 | P01, P10 | P11),
        }
    }

    fn values(&self, operand: &Operand) -> Values {
        match operand {
            Operand::Const { value, .. } => i32::try_from(*value).ok().map(|v| vec![v]),
            Operand::Var(name) => self.integers.get(name).cloned(),
        }
    }

    /// `name` becomes one of `values` where the rung is true.
    fn store(&mut self, name: &str, values: Values, rung: u8) {
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
        match few(merged) {
            Some(values) => _ = self.integers.insert(name.to_owned(), values),
            None => _ = self.integers.remove(name),
        }
    }

    /// The truth values that a comparison can have.
    fn compare(&self, op: CompareOp, op1: &Operand, op2: &Operand) -> u8 {
        if op1 == op2 {
            return only(holds(op, 0, 0));
        }
        let (least, most) = if self.wide { (i32::MIN, i32::MAX) } else { (i16::MIN.into(), i16::MAX.into()) };
        // Of "anything", the values around the other side's and the extremes tell all that can happen.
        let around = |values: &[i32]| {
            let near = values.iter().flat_map(|v| [v.saturating_sub(1), *v, v.saturating_add(1)]);
            near.map(|v| v.clamp(least, most)).chain([least, most]).collect::<Vec<_>>()
        };
        let (a, b) = match (self.values(op1), self.values(op2)) {
            (Some(a), Some(b)) => (a, b),
            (Some(a), None) => (a.clone(), around(&a)),
            (None, Some(b)) => (around(&b), b),
            (None, None) => return BOTH,
        };
        a.iter().flat_map(|a| b.iter().map(|b| only(holds(op, *a, *b)))).fold(0, |set, one| set | one)
    }
}

/// What the OR of sets of bits can be.
pub(crate) fn either(sets: &[u8]) -> u8 {
    let zero = if sets.iter().all(|s| s & ZERO != 0) { ZERO } else { 0 };
    zero | if sets.iter().any(|s| s & ONE != 0) { ONE } else { 0 }
}

/// The set of outs in a set of (in, out).
pub(crate) fn outs(pairs: u8) -> u8 {
    let zero = if pairs & (P00 | P10) != 0 { ZERO } else { 0 };
    zero | if pairs & (P01 | P11) != 0 { ONE } else { 0 }
}

fn few(mut values: Vec<i32>) -> Values {
    values.sort_unstable();
    values.dedup();
    (values.len() <= MOST).then_some(values)
}

fn math(op: MathOp, a: &[i32], b: &[i32]) -> Values {
    let narrow = |values: &[i32]| values.iter().map(|&v| i16::try_from(v).ok()).collect::<Option<Vec<i16>>>();
    let (a, b) = narrow(a).zip(narrow(b))?;
    if op == MathOp::Div && b.contains(&0) {
        return None;
    }
    let one = |a: i16, b: i16| match op {
        MathOp::Add => a.wrapping_add(b),
        MathOp::Sub => a.wrapping_sub(b),
        MathOp::Mul => a.wrapping_mul(b),
        MathOp::Div => a.wrapping_div(b),
    };
    few(a.iter().flat_map(|a| b.iter().map(move |b| i32::from(one(*a, *b)))).collect())
}

/// The truth of a comparison.
pub(crate) fn holds(op: CompareOp, a: i32, b: i32) -> bool {
    match op {
        CompareOp::Equ => a == b,
        CompareOp::Neq => a != b,
        CompareOp::Grt => a > b,
        CompareOp::Geq => a >= b,
        CompareOp::Les => a < b,
        CompareOp::Leq => a <= b,
    }
}
