//! The flat form of a program, and what each step of it does to the state.

use ladder::{CompareOp, ElementId, MathOp};

use crate::parts::{Curve, Parts, Text};

/// A program with its names resolved. Steps index its lists and the values of the state.
#[derive(Debug, Default)]
pub(crate) struct Code {
    pub steps: Vec<Step>,
    /// Per symbol: its value at power-up.
    pub start: Vec<i32>,
    /// Per symbol: by how much a shift to the left and back cuts a number to its width (32 less its bits).
    pub cut: Vec<u8>,
    /// Values of the look-up tables.
    pub tables: Vec<Vec<i32>>,
    pub curves: Vec<Curve>,
    /// Symbols of the shift registers, from stage 0 on.
    pub stages: Vec<Vec<u32>>,
    pub texts: Vec<Text>,
    /// Symbols that READ_ADC names, each once, ascending.
    pub adc: Vec<u32>,
    /// Frequency of the pulse width output, where there is one.
    pub pwm_hz: Option<u32>,
    /// Scans that a byte takes on the serial line.
    pub byte_scans: u32,
    /// Scans that the writing of a byte to the EEPROM takes.
    pub cell_scans: u32,
    /// Number of EEPROM cells.
    pub cells: u32,
    /// Number of memory bits of elements.
    pub memories: u32,
    /// Deepest nesting of parallel groups.
    pub depth: usize,
}

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

/// An element: `bit`, `var`, `dest` and `src` index the values, `memory` and `first` the memories, others lists of the code.
#[derive(Debug, Clone, Copy)]
#[rustfmt::skip]
pub(crate) enum Op {
    Short,
    Open,
    Contact  { bit: u32, negated: bool },
    Coil     { bit: u32, negated: bool },
    SetCoil  { bit: u32 },
    ClearCoil{ bit: u32 },
    MasterRelay,
    Osr      { memory: u32 },
    Osf      { memory: u32 },
    Ton      { var: u32, preset: i32 },
    Tof      { var: u32, preset: i32, first: u32 },
    Rto      { var: u32, preset: i32 },
    Count    { kind: Count, input: Input, var: u32, max: Value, restart: i32, memory: u32 },
    Move     { dest: u32, src: Value },
    Math     { op: MathOp, dest: u32, a: Value, b: Value },
    Compare  { op: CompareOp, a: Value, b: Value },
    Shift    { stages: u32, memory: u32 },
    LookUp   { dest: u32, index: Value, table: u32 },
    Curve    { dest: u32, index: Value, curve: u32 },
    ReadAdc  { dest: u32, input: u32 },
    SetPwm   { duty: Value },
    Send     { src: u32 },
    Receive  { dest: u32 },
    Text     { text: u32 },
    Persist  { var: u32, cell: u32, memory: u32 },
}

/// An operand: a variable's index, or a constant.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Value {
    Var(u32),
    Const(i32),
}

/// How a counter counts (2.3, 5.3).
#[derive(Debug, Clone, Copy)]
pub(crate) enum Count {
    /// Up without bound.
    Up,
    /// Down without bound.
    Down,
    /// Up to the limit.
    UpTo,
    /// Down to the limit.
    DownTo,
    /// Up to the limit and then from the start again.
    Circular,
}

/// When a counter counts.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Input {
    Rising,
    Falling,
    High,
    Low,
}

/// Everything that a scan may change.
#[derive(Debug, Clone)]
pub(crate) struct State {
    /// Per symbol; bits hold 0 or 1.
    pub values: Vec<i32>,
    /// Scans since power-up.
    pub scans: u64,
    /// The converter, the pulse width output, the serial line, the EEPROM, the strings.
    pub parts: Parts,
    /// What an element itself remembers: its last rung bit, or that it has run once.
    memories: Vec<bool>,
    /// Per nesting depth: the rung bit at the group, and the OR of its branches so far.
    groups: Vec<(bool, bool)>,
    /// The master relay; only ever off within a scan.
    master: bool,
}

impl State {
    /// All zero but the start values of counters.
    pub(crate) fn power_up(code: &Code) -> State {
        State {
            values: code.start.clone(),
            scans: 0,
            parts: Parts::power_up(code),
            memories: vec![false; code.memories as usize],
            groups: vec![(false, false); code.depth],
            master: true,
        }
    }

    /// One scan; `watch` gets every element with the rung bit before and after it, and the values of all symbols after it.
    pub(crate) fn scan(&mut self, code: &Code, mut watch: impl FnMut(ElementId, bool, bool, &[i32])) {
        self.parts.start_scan();
        self.master = true;
        let mut rung = true;
        for step in &code.steps {
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
                    rung = self.element(code, op, before);
                    watch(id, before, rung, &self.values);
                }
            }
        }
        self.scans = self.scans.wrapping_add(1);
    }

    /// Does one element with the rung bit `rung` and gives the rung bit after it.
    fn element(&mut self, code: &Code, op: Op, rung: bool) -> bool {
        match op {
            Op::Short => rung,
            Op::Open => false,
            Op::Contact { bit, negated } => rung & ((self.get(bit) != 0) != negated),
            Op::Coil { bit, negated } => {
                self.values[bit as usize] = i32::from(rung != negated);
                rung
            }
            Op::SetCoil { bit } => {
                if rung {
                    self.values[bit as usize] = 1;
                }
                rung
            }
            Op::ClearCoil { bit } => {
                if rung {
                    self.values[bit as usize] = 0;
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
                let t = &mut self.values[var as usize];
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
                    self.values[var as usize] = preset;
                }
                let t = &mut self.values[var as usize];
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
                let t = &mut self.values[var as usize];
                if *t < preset {
                    *t += i32::from(rung);
                    return false;
                }
                true
            }
            Op::Count { kind, input, var, max, restart, memory } => {
                let before = self.replace(memory, rung);
                let counts = match input {
                    Input::Rising => rung & !before,
                    Input::Falling => !rung & before,
                    Input::High => rung,
                    Input::Low => !rung,
                };
                if counts {
                    self.put(code, var, step(kind, self.get(var), self.value(max), restart));
                }
                let (n, max) = (self.get(var), self.value(max));
                match kind {
                    Count::Up | Count::Down | Count::UpTo => n >= max,
                    Count::DownTo => n > max,
                    Count::Circular => rung,
                }
            }
            Op::Compare { op, a, b } => rung & compare(op, self.value(a), self.value(b)),
            Op::Send { src } => self.parts.send(code, self.get(src), rung),
            Op::Text { text } => self.parts.text(code, text as usize, &self.values, rung),
            // An edge is seen whether or not the rung is true.
            Op::Shift { stages, memory } => {
                if rung & !self.replace(memory, rung) {
                    self.shift(code, &code.stages[stages as usize]);
                }
                rung
            }
            Op::Receive { dest } => {
                let byte = if rung { self.parts.take() } else { None };
                if let Some(byte) = byte {
                    self.put(code, dest, byte.into());
                }
                byte.is_some()
            }
            _ if !rung => false,
            Op::Move { dest, src } => {
                self.put(code, dest, self.value(src).into());
                true
            }
            Op::Math { op, dest, a, b } => {
                self.put(code, dest, math(op, self.value(a).into(), self.value(b).into()));
                true
            }
            Op::LookUp { dest, index, table } => {
                let found = usize::try_from(self.value(index)).ok().and_then(|i| code.tables[table as usize].get(i));
                if let Some(&found) = found {
                    self.put(code, dest, found.into());
                }
                true
            }
            Op::Curve { dest, index, curve } => {
                if let Some(found) = code.curves[curve as usize].at(self.value(index)) {
                    self.put(code, dest, found.into());
                }
                true
            }
            Op::ReadAdc { dest, input } => {
                self.put(code, dest, self.parts.adc[input as usize].into());
                true
            }
            Op::SetPwm { duty } => {
                self.parts.duty = Some(self.value(duty).clamp(0, 100) as u8);
                true
            }
            Op::Persist { var, cell, memory } => {
                if self.parts.cells_are_free() {
                    let loaded = self.replace(memory, true);
                    let (value, width) = (self.get(var), 4 - code.cut[var as usize] as usize / 8);
                    let value = self.parts.persist(code, cell as usize, width, value, loaded);
                    self.put(code, var, value.into());
                }
                true
            }
        }
    }

    fn get(&self, symbol: u32) -> i32 {
        self.values[symbol as usize]
    }

    fn value(&self, value: Value) -> i32 {
        match value {
            Value::Var(var) => self.get(var),
            Value::Const(value) => value,
        }
    }

    /// Stores the low bytes of an exact result.
    fn put(&mut self, code: &Code, symbol: u32, exact: i64) {
        self.values[symbol as usize] = cut(exact, code.cut[symbol as usize]);
    }

    /// Every stage gets what the one before it held; the last is lost, stage 0 stays.
    fn shift(&mut self, code: &Code, stages: &[u32]) {
        for pair in stages.windows(2).rev() {
            self.put(code, pair[1], self.get(pair[0]).into());
        }
    }

    /// Stores a memory bit and gives what it held.
    fn replace(&mut self, memory: u32, now: bool) -> bool {
        std::mem::replace(&mut self.memories[memory as usize], now)
    }
}

/// The low bits of an exact number as two's complement; `cut` is 32 less their number.
pub(crate) fn cut(exact: i64, cut: u8) -> i32 {
    (exact as i32) << cut >> cut
}

/// One step of a counter, exact.
fn step(kind: Count, n: i32, max: i32, restart: i32) -> i64 {
    let exact = i64::from(n);
    match kind {
        Count::Up => exact + 1,
        Count::Down => exact - 1,
        Count::UpTo => exact + i64::from(n < max),
        Count::DownTo => exact - i64::from(n > max),
        Count::Circular if n >= max => restart.into(),
        Count::Circular => exact + 1,
    }
}

/// Arithmetic of 2.4, exact: what is stored are the low bytes, so the width at which it is done makes no difference.
fn math(op: MathOp, a: i64, b: i64) -> i64 {
    match op {
        MathOp::Add => a + b,
        MathOp::Sub => a - b,
        MathOp::Mul => a * b,
        MathOp::Div if b == 0 => {
            if a >= 0 {
                -1
            } else {
                1
            }
        }
        MathOp::Div => a / b,
    }
}

/// Signed comparison.
fn compare(op: CompareOp, a: i32, b: i32) -> bool {
    match op {
        CompareOp::Equ => a == b,
        CompareOp::Neq => a != b,
        CompareOp::Grt => a > b,
        CompareOp::Geq => a >= b,
        CompareOp::Les => a < b,
        CompareOp::Leq => a <= b,
    }
}
