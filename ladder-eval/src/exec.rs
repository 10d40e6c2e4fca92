//! The flat form of a program, and what each step of it does to the state.

use ladder::{CompareOp, ElementId, MathOp};

/// One step of the flat form. Groups need no jumps: every branch of a group runs in every scan (2.2).
#[derive(Debug, Clone, Copy)]
pub(crate) enum Step {
    /// A rung begins: the rung bit is the master relay.
    Rung,
    /// A parallel group begins at this nesting depth: remember the rung bit for each branch.
    Split(usize),
    /// One more branch begins: collect what the last one gave and start again from the remembered bit.
    Branch(usize),
    /// The group ends: the rung bit is the OR of all branches.
    Join(usize),
    /// An element.
    Do(ElementId, Op),
}

/// An element with its names resolved: `bit`, `var` and `dest` index the values, `memory` and `first` the memories.
#[derive(Debug, Clone, Copy)]
#[rustfmt::skip]
pub(crate) enum Op {
    Short,
    Open,
    Contact  { bit: usize, negated: bool },
    Coil     { bit: usize, negated: bool },
    SetCoil  { bit: usize },
    ClearCoil{ bit: usize },
    MasterRelay,
    Osr      { memory: usize },
    Osf      { memory: usize },
    Ton      { var: usize, preset: i16 },
    Tof      { var: usize, preset: i16, first: usize },
    Rto      { var: usize, preset: i16 },
    Ctu      { var: usize, max: i16, memory: usize },
    Ctd      { var: usize, max: i16, memory: usize },
    Ctc      { var: usize, max: i16, memory: usize },
    Move     { dest: usize, src: Value },
    Math     { op: MathOp, dest: usize, a: Value, b: Value },
    Compare  { op: CompareOp, a: Value, b: Value },
}

/// An operand: a variable's index, or a constant.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Value {
    Var(usize),
    Const(i16),
}

/// Everything that a scan may change.
#[derive(Debug, Clone)]
pub(crate) struct State {
    /// Per symbol; bits hold 0 or 1.
    pub values: Vec<i16>,
    /// Scans since power-up.
    pub scans: u64,
    /// What an element itself remembers: its last rung bit, or that it has run once.
    memories: Vec<bool>,
    /// Per nesting depth: the rung bit at the group, and the OR of its branches so far.
    groups: Vec<(bool, bool)>,
    /// The master relay; only ever off within a scan.
    master: bool,
}

impl State {
    /// All zero.
    pub fn power_up(symbols: usize, memories: usize, depth: usize) -> State {
        State {
            values: vec![0; symbols],
            scans: 0,
            memories: vec![false; memories],
            groups: vec![(false, false); depth],
            master: true,
        }
    }

    /// One scan; `watch` gets every element with the rung bit before and after it.
    pub fn scan(&mut self, steps: &[Step], mut watch: impl FnMut(ElementId, bool, bool)) {
        self.master = true;
        let mut rung = true;
        for step in steps {
            match *step {
                Step::Rung => rung = self.master,
                Step::Split(depth) => self.groups[depth] = (rung, false),
                Step::Branch(depth) => {
                    let (at_group, any) = self.groups[depth];
                    self.groups[depth] = (at_group, any | rung);
                    rung = at_group;
                }
                Step::Join(depth) => rung |= self.groups[depth].1,
                Step::Do(id, op) => {
                    let before = rung;
                    rung = self.element(op, before);
                    watch(id, before, rung);
                }
            }
        }
        self.scans = self.scans.wrapping_add(1);
    }

    /// Does one element with the rung bit `rung` and gives the rung bit after it.
    fn element(&mut self, op: Op, rung: bool) -> bool {
        match op {
            Op::Short => rung,
            Op::Open => false,
            Op::Contact { bit, negated } => rung & ((self.values[bit] != 0) != negated),
            Op::Coil { bit, negated } => {
                self.values[bit] = i16::from(rung != negated);
                rung
            }
            Op::SetCoil { bit } => {
                if rung {
                    self.values[bit] = 1;
                }
                rung
            }
            Op::ClearCoil { bit } => {
                if rung {
                    self.values[bit] = 0;
                }
                rung
            }
            Op::MasterRelay => {
                // A relay that is off comes on whatever the rung says: otherwise no rung below could ever end the
                // switched-off part, since its own rung bit starts false there.
                self.master = !self.master | rung;
                rung
            }
            Op::Osr { memory } => rung & !self.replace(memory, rung),
            Op::Osf { memory } => !rung & self.replace(memory, rung),
            Op::Ton { var, preset } => {
                let t = &mut self.values[var];
                if !rung {
                    *t = 0;
                    return false;
                }
                if *t < preset {
                    *t += 1;
                    return false;
                }
                true
            }
            Op::Tof { var, preset, first } => {
                if !self.replace(first, true) {
                    self.values[var] = preset;
                }
                let t = &mut self.values[var];
                if rung {
                    *t = 0;
                    return true;
                }
                if *t < preset {
                    *t += 1;
                    return true;
                }
                false
            }
            Op::Rto { var, preset } => {
                let t = &mut self.values[var];
                if *t < preset {
                    *t += i16::from(rung);
                    return false;
                }
                true
            }
            Op::Ctu { var, max, memory } => {
                self.count(var, rung, memory, i16::wrapping_add);
                self.values[var] >= max
            }
            Op::Ctd { var, max, memory } => {
                self.count(var, rung, memory, i16::wrapping_sub);
                self.values[var] >= max
            }
            Op::Ctc { var, max, memory } => {
                self.count(var, rung, memory, |count, one| if count >= max { 0 } else { count + one });
                rung
            }
            Op::Move { dest, src } => {
                if rung {
                    self.values[dest] = self.value(src);
                }
                rung
            }
            Op::Math { op, dest, a, b } => {
                if rung {
                    self.values[dest] = math(op, self.value(a), self.value(b));
                }
                rung
            }
            Op::Compare { op, a, b } => rung & compare(op, self.value(a), self.value(b)),
        }
    }

    fn value(&self, value: Value) -> i16 {
        match value {
            Value::Var(var) => self.values[var],
            Value::Const(value) => value,
        }
    }

    /// Stores a memory bit and gives what it held.
    fn replace(&mut self, memory: usize, now: bool) -> bool {
        std::mem::replace(&mut self.memories[memory], now)
    }

    /// On a rising edge of the rung bit, one step of a counter.
    fn count(&mut self, var: usize, rung: bool, memory: usize, step: impl Fn(i16, i16) -> i16) {
        if rung & !self.replace(memory, rung) {
            self.values[var] = step(self.values[var], 1);
        }
    }
}

/// Arithmetic of 2.4: 16 bits, wrapping.
fn math(op: MathOp, a: i16, b: i16) -> i16 {
    match op {
        MathOp::Add => a.wrapping_add(b),
        MathOp::Sub => a.wrapping_sub(b),
        MathOp::Mul => a.wrapping_mul(b),
        MathOp::Div if b == 0 => {
            if a >= 0 {
                -1
            } else {
                1
            }
        }
        MathOp::Div => a.wrapping_div(b),
    }
}

/// Signed comparison of 16 bits.
fn compare(op: CompareOp, a: i16, b: i16) -> bool {
    match op {
        CompareOp::Equ => a == b,
        CompareOp::Neq => a != b,
        CompareOp::Grt => a > b,
        CompareOp::Geq => a >= b,
        CompareOp::Les => a < b,
        CompareOp::Leq => a <= b,
    }
}
