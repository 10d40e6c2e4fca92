//! The flat form of a program, and what each step of it does to the state.

use ladder::{CompareOp, ElementId, MathOp, ShiftOp, UnaryOp};

use crate::bit_ops;
use crate::peripheral_state::{FormattedText, PeripheralState, PiecewiseCurve};

/// A program with its names resolved. Steps index its lists and the values of the state.
#[derive(Debug, Default)]
pub(crate) struct FlatProgram {
    pub steps: Vec<FlatStep>,
    /// Per symbol: its value at power-up.
    pub initial_values: Vec<i32>,
    /// Per symbol: by how much a shift to the left and back cuts a number to its width (32 less its bits).
    pub cut_bits: Vec<u8>,
    /// Values of the look-up tables.
    pub tables: Vec<Vec<i32>>,
    pub curves: Vec<PiecewiseCurve>,
    /// Symbols of the shift registers, from stage 0 on.
    pub shift_stages: Vec<Vec<u32>>,
    pub texts: Vec<FormattedText>,
    /// Symbols that READ_ADC names, each once, ascending.
    pub adc_symbols: Vec<u32>,
    /// Frequency of the pulse width output, where there is one.
    pub pwm_hz: Option<u32>,
    /// Scans that a byte takes on the serial line.
    pub scans_per_byte: u32,
    /// Scans that the writing of a byte to the EEPROM takes.
    pub scans_per_eeprom_write: u32,
    /// Number of EEPROM cells.
    pub eeprom_cells: u32,
    /// Number of memory bits of elements.
    pub memories: u32,
    /// Deepest nesting of parallel groups.
    pub max_depth: usize,
}

/// One step of the flat form. Groups need no jumps: every branch of a group runs in every scan (2.2).
#[derive(Debug, Clone, Copy)]
pub(crate) enum FlatStep {
    /// A rung begins: the rung bit is the master relay.
    Rung,
    /// A parallel group begins at this nesting depth: remember the rung bit for each branch.
    Split(usize),
    /// One more branch begins: collect what the last one gave and start again from the remembered bit.
    Branch(usize),
    /// The group ends: the rung bit is the OR of all branches.
    Join(usize),
    /// An element.
    Do(ElementId, ElementOp),
}

/// An element: `bit`, `var`, `dest` and `src` index the values, `memory` and `first` the memories, others lists of the code.
#[derive(Debug, Clone, Copy)]
#[rustfmt::skip]
pub(crate) enum ElementOp {
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
    Count    { kind: CountMode, input: CountInput, var: u32, max: ValueSource, restart: i32, memory: u32 },
    Move     { dest: u32, src: ValueSource },
    Math     { op: MathOp, dest: u32, a: ValueSource, b: ValueSource },
    Unary    { op: UnaryOp, dest: u32, src: ValueSource, bits: u32 },
    ShiftBits{ op: ShiftOp, dest: u32, src: ValueSource, bits: u32, count: ValueSource },
    WriteBit { var: u32, bit: ValueSource, value: bool },
    TestBit  { var: u32, bit: ValueSource, value: bool },
    Bus      { dest: u32, src: ValueSource, targets: [u8; 8] },
    Compare  { op: CompareOp, a: ValueSource, b: ValueSource },
    Shift    { stages: u32, memory: u32 },
    LookUp   { dest: u32, index: ValueSource, table: u32 },
    Curve    { dest: u32, index: ValueSource, curve: u32 },
    ReadAdc  { dest: u32, input: u32 },
    SetPwm   { duty: ValueSource },
    Send     { src: u32 },
    Receive  { dest: u32 },
    Text     { text: u32 },
    Persist  { var: u32, cell: u32, memory: u32 },
}

/// An operand: a variable's index, or a constant.
#[derive(Debug, Clone, Copy)]
pub(crate) enum ValueSource {
    Var(u32),
    Const(i32),
}

/// How a counter counts (2.3, 5.3).
#[derive(Debug, Clone, Copy)]
pub(crate) enum CountMode {
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
pub(crate) enum CountInput {
    Rising,
    Falling,
    High,
    Low,
}

/// Everything that a scan may change.
#[derive(Debug, Clone)]
pub(crate) struct ScanState {
    /// Per symbol; bits hold 0 or 1.
    pub values: Vec<i32>,
    /// Scans since power-up.
    pub scans: u64,
    /// The converter, the pulse width output, the serial line, the EEPROM, the strings.
    pub parts: PeripheralState,
    /// What an element itself remembers: its last rung bit, or that it has run once.
    memories: Vec<bool>,
    /// Per nesting depth: the rung bit at the group, and the OR of its branches so far.
    groups: Vec<(bool, bool)>,
    /// The master relay; only ever off within a scan.
    master: bool,
}

impl ScanState {
    /// All zero but the start values of counters.
    pub(crate) fn new(code: &FlatProgram) -> ScanState {
        ScanState {
            values: code.initial_values.clone(),
            scans: 0,
            parts: PeripheralState::power_up(code),
            memories: vec![false; code.memories as usize],
            groups: vec![(false, false); code.max_depth],
            master: true,
        }
    }

    /// One scan; `watch` gets every element with the rung bit before and after it, and the values of all symbols after it.
    pub(crate) fn scan(&mut self, code: &FlatProgram, mut watch: impl FnMut(ElementId, bool, bool, &[i32])) {
        self.parts.start_scan();
        self.master = true;
        let mut rung = true;
        for step in &code.steps {
            match *step {
                FlatStep::Rung => rung = self.master,
                FlatStep::Split(depth) => self.groups[depth] = (rung, false),
                FlatStep::Branch(depth) => {
                    let (at_group, any) = self.groups[depth];
                    self.groups[depth] = (at_group, any | rung);
                    rung = at_group;
                }
                FlatStep::Join(depth) => rung |= self.groups[depth].1,
                FlatStep::Do(id, op) => {
                    let before = rung;
                    rung = self.execute_element(code, op, before);
                    watch(id, before, rung, &self.values);
                }
            }
        }
        self.scans = self.scans.wrapping_add(1);
    }

    /// Does one element with the rung bit `rung` and gives the rung bit after it.
    fn execute_element(&mut self, code: &FlatProgram, op: ElementOp, rung: bool) -> bool {
        match op {
            ElementOp::Short => rung,
            ElementOp::Open => false,
            ElementOp::Contact { bit, negated } => rung & ((self.read_symbol(bit) != 0) != negated),
            ElementOp::Coil { bit, negated } => {
                self.values[bit as usize] = i32::from(rung != negated);
                rung
            }
            ElementOp::SetCoil { bit } => {
                if rung {
                    self.values[bit as usize] = 1;
                }
                rung
            }
            ElementOp::ClearCoil { bit } => {
                if rung {
                    self.values[bit as usize] = 0;
                }
                rung
            }
            ElementOp::MasterRelay => {
                // A relay that is off comes on whatever the rung says: otherwise no rung below could ever end the
                // switched-off part, since its own rung bit starts false there.
                self.master = !self.master | rung;
                rung
            }
            ElementOp::Osr { memory } => rung & !self.replace_memory(memory, rung),
            ElementOp::Osf { memory } => !rung & self.replace_memory(memory, rung),
            ElementOp::Ton { var, preset } => {
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
            ElementOp::Tof { var, preset, first } => {
                if !self.replace_memory(first, true) {
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
            ElementOp::Rto { var, preset } => {
                let t = &mut self.values[var as usize];
                if *t < preset {
                    *t += i32::from(rung);
                    return false;
                }
                true
            }
            ElementOp::Count { kind, input, var, max, restart, memory } => {
                let before = self.replace_memory(memory, rung);
                let counts = match input {
                    CountInput::Rising => rung & !before,
                    CountInput::Falling => !rung & before,
                    CountInput::High => rung,
                    CountInput::Low => !rung,
                };
                if counts {
                    self.store(code, var, count_step(kind, self.read_symbol(var), self.read_value(max), restart));
                }
                let (n, max) = (self.read_symbol(var), self.read_value(max));
                match kind {
                    CountMode::Up | CountMode::Down | CountMode::UpTo => n >= max,
                    CountMode::DownTo => n > max,
                    CountMode::Circular => rung,
                }
            }
            ElementOp::Compare { op, a, b } => rung & compare(op, self.read_value(a), self.read_value(b)),
            ElementOp::TestBit { var, bit, value } => {
                rung & (bit_ops::has_bit(self.read_symbol(var), self.read_value(bit)) == value)
            }
            ElementOp::Send { src } => self.parts.send(code, self.read_symbol(src), rung),
            ElementOp::Text { text } => self.parts.send_text(code, text as usize, &self.values, rung),
            // An edge is seen whether or not the rung is true.
            ElementOp::Shift { stages, memory } => {
                if rung & !self.replace_memory(memory, rung) {
                    self.shift_stages(code, &code.shift_stages[stages as usize]);
                }
                rung
            }
            ElementOp::Receive { dest } => {
                let byte = if rung { self.parts.take_received() } else { None };
                if let Some(byte) = byte {
                    self.store(code, dest, byte.into());
                }
                byte.is_some()
            }
            _ if !rung => false,
            ElementOp::Move { dest, src } => {
                self.store(code, dest, self.read_value(src).into());
                true
            }
            ElementOp::Math { op, dest, a, b } => {
                self.store(code, dest, math(op, self.read_value(a).into(), self.read_value(b).into()));
                true
            }
            ElementOp::Unary { op, dest, src, bits } => {
                self.store(code, dest, bit_ops::unary(op, self.read_value(src), bits));
                true
            }
            ElementOp::ShiftBits { op, dest, src, bits, count } => {
                self.store(code, dest, bit_ops::shift(op, self.read_value(src), bits, self.read_value(count)));
                true
            }
            ElementOp::WriteBit { var, bit, value } => {
                self.store(code, var, bit_ops::with_bit(self.read_symbol(var), self.read_value(bit), value));
                true
            }
            ElementOp::Bus { dest, src, targets } => {
                self.store(code, dest, bit_ops::route_bits(self.read_value(src), targets));
                true
            }
            ElementOp::LookUp { dest, index, table } => {
                let found =
                    usize::try_from(self.read_value(index)).ok().and_then(|i| code.tables[table as usize].get(i));
                if let Some(&found) = found {
                    self.store(code, dest, found.into());
                }
                true
            }
            ElementOp::Curve { dest, index, curve } => {
                if let Some(found) = code.curves[curve as usize].value_at(self.read_value(index)) {
                    self.store(code, dest, found.into());
                }
                true
            }
            ElementOp::ReadAdc { dest, input } => {
                self.store(code, dest, self.parts.adc[input as usize].into());
                true
            }
            ElementOp::SetPwm { duty } => {
                self.parts.duty = Some(self.read_value(duty).clamp(0, 100) as u8);
                true
            }
            ElementOp::Persist { var, cell, memory } => {
                if self.parts.is_eeprom_free() {
                    let loaded = self.replace_memory(memory, true);
                    let (value, width) = (self.read_symbol(var), 4 - code.cut_bits[var as usize] as usize / 8);
                    let value = self.parts.persist(code, cell as usize, width, value, loaded);
                    self.store(code, var, value.into());
                }
                true
            }
        }
    }

    fn read_symbol(&self, symbol: u32) -> i32 {
        self.values[symbol as usize]
    }

    fn read_value(&self, value: ValueSource) -> i32 {
        match value {
            ValueSource::Var(var) => self.read_symbol(var),
            ValueSource::Const(value) => value,
        }
    }

    /// Stores the low bytes of an exact result.
    fn store(&mut self, code: &FlatProgram, symbol: u32, exact: i64) {
        self.values[symbol as usize] = truncate(exact, code.cut_bits[symbol as usize]);
    }

    /// Every stage gets what the one before it held; the last is lost, stage 0 stays.
    fn shift_stages(&mut self, code: &FlatProgram, stages: &[u32]) {
        for pair in stages.windows(2).rev() {
            self.store(code, pair[1], self.read_symbol(pair[0]).into());
        }
    }

    /// Stores a memory bit and gives what it held.
    fn replace_memory(&mut self, memory: u32, now: bool) -> bool {
        std::mem::replace(&mut self.memories[memory as usize], now)
    }
}

/// The low bits of an exact number as two's complement; `cut` is 32 less their number.
pub(crate) fn truncate(exact: i64, cut: u8) -> i32 {
    (exact as i32) << cut >> cut
}

/// One step of a counter, exact.
fn count_step(kind: CountMode, n: i32, max: i32, restart: i32) -> i64 {
    let exact = i64::from(n);
    match kind {
        CountMode::Up => exact + 1,
        CountMode::Down => exact - 1,
        CountMode::UpTo => exact + i64::from(n < max),
        CountMode::DownTo => exact - i64::from(n > max),
        CountMode::Circular if n >= max => restart.into(),
        CountMode::Circular => exact + 1,
    }
}

/// Arithmetic of 2.4 and 5.5, exact: what is stored are the low bytes, so the width at which it is done makes no difference.
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
        // What is left over when the quotient above is taken.
        MathOp::Mod if b == 0 => a,
        MathOp::Mod => a % b,
        MathOp::And => a & b,
        MathOp::Or => a | b,
        MathOp::Xor => a ^ b,
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
