//! A second interpreter of the simple elements: recursive over the model, state in maps by name, arithmetic in 64 bits
//! brought back by remainders. Slow and plain on purpose; it shares no code with the evaluator.

use std::collections::HashMap;

use ladder::{CompareOp, CounterKind, Element, ElementId, MathOp, Node, Operand, Program, TimerKind};

/// What was seen at one element: rung bit before and after.
pub type Seen = (ElementId, bool, bool);

/// The state by name; what is absent is 0.
#[derive(Default)]
pub struct Naive {
    pub bits: HashMap<String, bool>,
    pub integers: HashMap<String, i64>,
    remembered: HashMap<(u32, u32), bool>,
    relay: bool,
    place: (u32, u32),
    seen: Vec<Seen>,
}

impl Naive {
    /// One scan; gives what happened at each element.
    pub fn scan(&mut self, program: &Program) -> Vec<Seen> {
        self.relay = true;
        self.seen.clear();
        for (r, rung) in program.rungs.iter().enumerate() {
            self.place = (r as u32, 0);
            self.series(&rung.series, self.relay, program);
        }
        self.seen.clone()
    }

    fn series(&mut self, series: &[Node], mut power: bool, program: &Program) -> bool {
        for node in series {
            power = match node {
                Node::Leaf(element, _) => {
                    let after = self.leaf(element, power, program);
                    let (rung, index) = self.place;
                    if !matches!(element, Element::Comment(_)) {
                        self.seen.push((ElementId { rung, index }, power, after));
                    }
                    self.place.1 += 1;
                    after
                }
                Node::Parallel(branches, _) => {
                    let outs: Vec<bool> = branches.iter().map(|b| self.series(b, power, program)).collect();
                    outs.contains(&true)
                }
            };
        }
        power
    }

    fn leaf(&mut self, element: &Element, power: bool, program: &Program) -> bool {
        let before = self.remembered.get(&self.place).copied().unwrap_or(false);
        match element {
            Element::Comment(_) | Element::Short => power,
            Element::Open => false,
            Element::Contacts { name, negated, .. } => {
                let closed = if *negated { !self.bit(name) } else { self.bit(name) };
                power && closed
            }
            Element::Coil { name, negated, set, reset, .. } => {
                let stored = match (*negated, *set, *reset) {
                    (true, ..) => !power,
                    (_, true, _) => self.bit(name) || power,
                    (_, _, true) => self.bit(name) && !power,
                    _ => power,
                };
                self.bits.insert(name.clone(), stored);
                power
            }
            Element::MasterRelay => {
                self.relay = if self.relay { power } else { true };
                power
            }
            Element::Osr => {
                self.remembered.insert(self.place, power);
                power && !before
            }
            Element::Osf => {
                self.remembered.insert(self.place, power);
                !power && before
            }
            Element::Timer { kind, name, delay, .. } => {
                let scans = self.of(delay) / program.settings.cycle_us as i64 - 1;
                self.timer(*kind, name, scans, power, before)
            }
            Element::Counter { kind, name, max, .. } => {
                let max = self.of(max);
                self.remembered.insert(self.place, power);
                if power && !before {
                    let n = self.integer(name);
                    let next = match kind {
                        CounterKind::Ctu => n + 1,
                        CounterKind::Ctd => n - 1,
                        CounterKind::Ctc if n < max => n + 1,
                        CounterKind::Ctc => 0,
                    };
                    self.store(name, next);
                }
                if *kind == CounterKind::Ctc { power } else { self.integer(name) >= max }
            }
            Element::Res { name } => {
                if power {
                    self.store(name, 0);
                }
                power
            }
            Element::Move { dest, src } => {
                if power {
                    self.store(dest, self.of(src));
                }
                power
            }
            Element::Math { op, dest, op1, op2 } => {
                if power {
                    let (a, b) = (self.of(op1), self.of(op2));
                    let exact = match op {
                        MathOp::Add => a + b,
                        MathOp::Sub => a - b,
                        MathOp::Mul => a * b,
                        MathOp::Div => divide(a, b),
                    };
                    self.store(dest, exact);
                }
                power
            }
            Element::Compare { op, op1, op2 } => {
                let difference = self.of(op1) - self.of(op2);
                power
                    && match op {
                        CompareOp::Equ => difference == 0,
                        CompareOp::Neq => difference != 0,
                        CompareOp::Grt => difference > 0,
                        CompareOp::Geq => difference >= 0,
                        CompareOp::Les => difference < 0,
                        CompareOp::Leq => difference <= 0,
                    }
            }
            other => panic!("the generator gives no {other:?}"),
        }
    }

    fn timer(&mut self, kind: TimerKind, name: &str, scans: i64, power: bool, ran: bool) -> bool {
        if kind == TimerKind::Tof && !ran {
            self.remembered.insert(self.place, true);
            self.store(name, scans);
        }
        let t = self.integer(name);
        let (next, out) = match (kind, power, t < scans) {
            (TimerKind::Ton, false, _) => (0, false),
            (TimerKind::Ton, true, true) => (t + 1, false),
            (TimerKind::Ton, true, false) => (t, true),
            (TimerKind::Tof, true, _) => (0, true),
            (TimerKind::Tof, false, true) => (t + 1, true),
            (TimerKind::Tof, false, false) => (t, false),
            (TimerKind::Rto, true, true) => (t + 1, false),
            (TimerKind::Rto, false, true) => (t, false),
            (TimerKind::Rto, _, false) => (t, true),
        };
        self.store(name, next);
        out
    }

    fn of(&self, operand: &Operand) -> i64 {
        match operand {
            Operand::Var(name) => self.integer(name),
            Operand::Const { value, .. } => *value,
        }
    }

    pub fn bit(&self, name: &str) -> bool {
        self.bits.get(name).copied().unwrap_or(false)
    }

    pub fn integer(&self, name: &str) -> i64 {
        self.integers.get(name).copied().unwrap_or(0)
    }

    /// Stores the number of 16 bits that is congruent to `value`.
    pub fn store(&mut self, name: &str, value: i64) {
        self.integers.insert(name.to_owned(), (value + 0x8000).rem_euclid(0x1_0000) - 0x8000);
    }
}

/// The quotient of the magnitudes with the sign of the operands; by zero -1, or 1 below zero.
fn divide(a: i64, b: i64) -> i64 {
    let sign = if (a < 0) == (b < 0) { 1 } else { -1 };
    match (a, b) {
        (0.., 0) => -1,
        (_, 0) => 1,
        _ => sign * (a.abs() / b.abs()),
    }
}
