//! A second interpreter: recursive over the model, state in maps by name, arithmetic in 64 bits brought back by remainders,
//! times as the scan at which something is free again, digits in closed form. Slow and plain on purpose; it shares no code
//! with the evaluator, but for the pieces of a string, which are syntax.

mod bits;

use std::collections::HashMap;

use ladder::format::{StringPiece, split_format_string};
use ladder::{
    CompareOp, CounterKind, Element, ElementId, LadderDialect, LadderOperand, LadderProgram, LdFormat, MathOp,
    RungNode, TimerKind,
};

/// What was seen at one element: rung bit before and after.
pub type ElementObservation = (ElementId, bool, bool);

/// The state by name; what is absent is 0.
#[derive(Default)]
pub struct NaiveInterpreter {
    pub bits: HashMap<String, bool>,
    pub integers: HashMap<String, i64>,
    /// What a conversion gives, by name.
    pub levels: HashMap<String, i64>,
    /// The byte that the last scan sent.
    pub sent: Option<u8>,
    /// The byte that waits.
    pub received_byte: Option<u8>,
    pub duty: Option<i64>,
    /// The EEPROM by address; what is absent is FFh.
    pub cells: HashMap<usize, u8>,
    remembered: HashMap<(u32, u32), bool>,
    master_relay: bool,
    current_element: (u32, u32),
    seen: Vec<ElementObservation>,
    /// Bytes of the integers, and what a RES stores.
    widths: HashMap<String, u32>,
    starts: HashMap<String, i64>,
    /// Address of the first cell of each PERSIST.
    addresses: HashMap<(u32, u32), usize>,
    /// Number of this scan, and those from which on transmitter and EEPROM are free.
    now: u64,
    line_free: u64,
    cells_free: u64,
    /// Of a string that is being sent: the next character, and the number that it shows once it is read.
    texts: HashMap<(u32, u32), (usize, i64)>,
}

impl NaiveInterpreter {
    /// The state at power-up.
    pub fn new(program: &LadderProgram) -> NaiveInterpreter {
        let widths = program.symbols().into_iter().map(|s| (s.name, s.bytes.into())).collect();
        let mut naive = NaiveInterpreter { widths, ..NaiveInterpreter::default() };

        let mut address = 0;
        for (ElementId { rung, index }, element, _) in program.elements() {
            match element {
                Element::Counter { name, init, .. } if !naive.starts.contains_key(name) => {
                    let start = init.as_ref().map_or(0, |init| naive.operand_value(init));
                    naive.store(name, start);
                    naive.starts.insert(name.clone(), start);
                }
                Element::Persist { name } => {
                    naive.addresses.insert((rung, index), address);
                    address += naive.widths[name] as usize;
                }
                _ => {}
            }
        }
        naive
    }

    /// One scan; gives what happened at each element.
    pub fn scan(&mut self, program: &LadderProgram) -> Vec<ElementObservation> {
        self.master_relay = true;
        self.seen.clear();
        self.now += 1;
        self.sent = None;
        for (r, rung) in program.rungs.iter().enumerate() {
            self.current_element = (r as u32, 0);
            self.series(&rung.series, self.master_relay, program);
        }
        self.seen.clone()
    }

    fn series(&mut self, series: &[RungNode], mut power: bool, program: &LadderProgram) -> bool {
        for node in series {
            power = match node {
                RungNode::Leaf(element, _) => {
                    let after = self.leaf(element, power, program);
                    let (rung, index) = self.current_element;
                    if !matches!(element, Element::Comment(_)) {
                        self.seen.push((ElementId { rung, index }, power, after));
                    }
                    self.current_element.1 += 1;
                    after
                }
                RungNode::Parallel(branches, _) => {
                    let outs: Vec<bool> = branches.iter().map(|b| self.series(b, power, program)).collect();
                    outs.contains(&true)
                }
            };
        }
        power
    }

    fn leaf(&mut self, element: &Element, power: bool, program: &LadderProgram) -> bool {
        let before = self.remembered.get(&self.current_element).copied().unwrap_or(false);
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
                self.master_relay = if self.master_relay { power } else { true };
                power
            }
            Element::Osr => {
                self.remembered.insert(self.current_element, power);
                power && !before
            }
            Element::Osf => {
                self.remembered.insert(self.current_element, power);
                !power && before
            }
            Element::Timer { kind, name, delay, adjust } => {
                let usual =
                    if (program.dialect, program.format) == (LadderDialect::Ldmicro5, LdFormat::V02) { 0 } else { -1 };
                let scans = self.operand_value(delay) / program.settings.cycle_us as i64;
                let adjust = adjust.as_ref().map_or(usual, |adjust| self.operand_value(adjust));
                self.timer(*kind, name, scans + adjust, power, before)
            }
            Element::Counter { kind, name, max, input, init } => {
                self.remembered.insert(self.current_element, power);
                let counts = match input {
                    Some('\\') => before && !power,
                    Some('-') => power,
                    Some('o') => !power,
                    _ => power && !before,
                };
                let bounded = program.dialect == LadderDialect::Ldmicro5;
                if counts {
                    let (n, max) = (self.integer(name), self.operand_value(max));
                    let next = match kind {
                        CounterKind::Ctu if bounded && n >= max => n,
                        CounterKind::Ctd if bounded && n <= max => n,
                        CounterKind::Ctu => n + 1,
                        CounterKind::Ctd => n - 1,
                        CounterKind::Ctc if n < max => n + 1,
                        CounterKind::Ctc => init.as_ref().map_or(0, |init| self.operand_value(init)),
                    };
                    self.store(name, next);
                }
                let (n, max) = (self.integer(name), self.operand_value(max));
                match kind {
                    CounterKind::Ctc => power,
                    CounterKind::Ctd if bounded => n > max,
                    _ => n >= max,
                }
            }
            Element::Res { name } => {
                if power {
                    self.store(name, self.starts.get(name).copied().unwrap_or(0));
                }
                power
            }
            Element::ShiftRegister { name, stages } => {
                self.remembered.insert(self.current_element, power);
                if power && !before {
                    let held: Vec<i64> = (0..*stages).map(|stage| self.integer(&format!("{name}{stage}"))).collect();
                    for (stage, value) in (1..*stages).zip(held) {
                        self.store(&format!("{name}{stage}"), value);
                    }
                }
                power
            }
            Element::LookUpTable { dest, index, values, .. } => {
                let at = self.operand_value(index);
                if power && at >= 0 && at < values.len() as i64 {
                    self.store(dest, values[at as usize]);
                }
                power
            }
            Element::PiecewiseLinear { dest, index, points } => {
                let x = self.operand_value(index);
                let after = (1..points.len()).find(|&i| x <= points[i].0).filter(|_| power);
                if let Some(after) = after {
                    let ((x0, y0), (x1, y1)) = (points[after - 1], points[after]);
                    let fits = |v: i64| (-0x8000..0x8000).contains(&v);
                    let short = points.iter().all(|(x, y)| fits(*x) && fits(*y))
                        && self.is_narrow(dest)
                        && self.is_narrow(index);
                    let bits = if short { 16 } else { 32 };
                    let product = wrap_to_bits(wrap_to_bits(x - x0, bits) * (y1 - y0), bits);
                    self.store(dest, wrap_to_bits(y0 + divide(product, x1 - x0), bits));
                }
                power
            }
            Element::ReadAdc { name, .. } => {
                if power {
                    self.store(name, self.levels.get(name).copied().unwrap_or(0));
                }
                power
            }
            Element::SetPwm { duty, .. } => {
                if power {
                    self.duty = Some(self.operand_value(duty).clamp(0, 100));
                }
                power
            }
            Element::UartSend { name, .. } => {
                if power && self.now >= self.line_free {
                    self.transmit(self.integer(name).rem_euclid(256) as u8, program);
                }
                self.now < self.line_free
            }
            Element::UartRecv { name, .. } => match (power, self.received_byte) {
                (true, Some(byte)) => {
                    self.received_byte = None;
                    self.store(name, byte.into());
                    true
                }
                _ => false,
            },
            Element::FormattedString { var, text, quoted } => {
                self.remembered.insert(self.current_element, power);
                let pieces = split_format_string(text, *quoted).expect("a sound text");
                if power && !before {
                    self.texts.insert(self.current_element, (0, 0));
                }
                self.string(&pieces, var.as_deref(), program)
            }
            Element::Persist { name } => {
                if power && self.now >= self.cells_free {
                    self.persist(name, before, program);
                    self.remembered.insert(self.current_element, true);
                }
                power
            }
            Element::Move { dest, src } => {
                if power {
                    self.store(dest, self.operand_value(src));
                }
                power
            }
            Element::Math { op, dest, op1, op2 } => {
                if power {
                    let (a, b) = (self.operand_value(op1), self.operand_value(op2));
                    let exact = match op {
                        MathOp::Add => a + b,
                        MathOp::Sub => a - b,
                        MathOp::Mul => a * b,
                        MathOp::Div => divide(a, b),
                        MathOp::Mod => a - b * divide(a, b),
                        MathOp::And => bitwise(a, b, |x, y| x && y),
                        MathOp::Or => bitwise(a, b, |x, y| x || y),
                        MathOp::Xor => bitwise(a, b, |x, y| x != y),
                    };
                    self.store(dest, exact);
                }
                power
            }
            Element::Unary { op, dest, src } => {
                if power {
                    let result = bits::unary(*op, self.operand_value(src), self.operand_bits(src));
                    self.store(dest, result);
                }
                power
            }
            Element::Shift { op, dest, src, count } => {
                if power {
                    let (value, bits) = (self.operand_value(src), self.operand_bits(src));
                    self.store(dest, bits::shift(*op, value, bits, self.operand_value(count)));
                }
                power
            }
            Element::BitWrite { name, bit, value } => {
                if power {
                    let mut all = bits::of(self.integer(name), 32);
                    let at = self.operand_value(bit);
                    all.iter_mut().zip(0..).filter(|(_, n)| *n == at).for_each(|(held, _)| *held = *value);
                    self.store(name, bits::number(&all));
                }
                power
            }
            Element::BitTest { name, bit, value } => {
                let (held, at) = (self.integer(name), self.operand_value(bit));
                let is = match at {
                    0..40 => held.div_euclid(1 << at).rem_euclid(2) == 1,
                    _ => at > 0 && held < 0,
                };
                power && is == *value
            }
            Element::Bus { dest, src, targets } => {
                if power {
                    let from = bits::of(self.operand_value(src), 8);
                    let routed = (0..8).map(|place| {
                        let source = (0..8).rev().find(|&n| targets[n] == place);
                        i64::from(source.is_some_and(|n| from[n])) * (1 << place)
                    });
                    let all_bytes = (0..8).all(|n| usize::from(targets[n]) == n);
                    let result = if all_bytes { self.operand_value(src) } else { routed.sum() };
                    self.store(dest, result);
                }
                power
            }
            Element::Compare { op, op1, op2 } => {
                let difference = self.operand_value(op1) - self.operand_value(op2);
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
            Element::Placeholder => panic!("the generator gives no placeholder"),
        }
    }

    fn timer(&mut self, kind: TimerKind, name: &str, scans: i64, power: bool, ran: bool) -> bool {
        if kind == TimerKind::Tof && !ran {
            self.remembered.insert(self.current_element, true);
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

    fn operand_value(&self, operand: &LadderOperand) -> i64 {
        match operand {
            LadderOperand::Var(name) => self.integer(name),
            LadderOperand::Const { value, .. } => *value,
        }
    }

    /// The width of a variable, or of the shortest integer that holds a constant, in bits.
    fn operand_bits(&self, operand: &LadderOperand) -> usize {
        match operand {
            LadderOperand::Var(name) => 8 * self.widths[name] as usize,
            LadderOperand::Const { value, .. } => {
                8 * (1..=4).find(|&n| wrap_to_bits(*value, 8 * n) == *value).expect("a width") as usize
            }
        }
    }

    pub fn bit(&self, name: &str) -> bool {
        self.bits.get(name).copied().unwrap_or(false)
    }

    pub fn integer(&self, name: &str) -> i64 {
        self.integers.get(name).copied().unwrap_or(0)
    }

    /// Stores the number of the integer's width that is congruent to `value`.
    pub fn store(&mut self, name: &str, value: i64) {
        let bits = 8 * self.widths.get(name).copied().unwrap_or(2);
        self.integers.insert(name.to_owned(), wrap_to_bits(value, bits));
    }

    /// Whether an operand, or a variable by its name, has at most 16 bits.
    fn is_narrow<'a>(&self, operand: impl Into<NarrowOperand<'a>>) -> bool {
        match operand.into() {
            NarrowOperand::Name(name) => self.widths[name] <= 2,
            NarrowOperand::Value(value) => (-0x8000..0x8000).contains(&value),
        }
    }

    fn transmit(&mut self, byte: u8, program: &LadderProgram) {
        let rate = program.settings.baud.expect("a rate") * program.settings.cycle_us;
        self.sent = Some(byte);
        self.line_free = self.now + (10_000_000 / rate + u64::from(10_000_000 % rate != 0)).max(1);
    }

    fn string(&mut self, pieces: &[StringPiece], var: Option<&str>, program: &LadderProgram) -> bool {
        let Some(&(at, mut shown)) = self.texts.get(&self.current_element) else { return false };
        if at < pieces.len() && self.now >= self.line_free {
            let value = var.map_or(0, |name| self.integer(name));
            let places = pieces.iter().filter(|p| matches!(p, StringPiece::Digit { .. })).count() as u32;
            let signed = pieces.contains(&StringPiece::Sign);
            let byte = match pieces[at] {
                StringPiece::Byte(byte) => byte,
                StringPiece::Sign => {
                    let bits = 8 * self.widths[var.expect("a variable")];
                    shown = wrap_to_bits(value.abs(), bits);
                    if value < 0 { b'-' } else { b' ' }
                }
                StringPiece::Digit { divisor, first, last } => {
                    if first && !signed {
                        shown = value;
                    }
                    let above = if first { shown } else { shown % (i64::from(divisor) * 10) };
                    let blank = shown / i64::from(divisor) == 0 && !last && places > 1;
                    if blank { b' ' } else { (48 + above / i64::from(divisor)).rem_euclid(256) as u8 }
                }
            };
            self.transmit(byte, program);
            self.texts.insert(self.current_element, (at + 1, shown));
        }
        let left = self.texts[&self.current_element].0 < pieces.len();
        if !left {
            self.texts.remove(&self.current_element);
        }
        left
    }

    fn persist(&mut self, name: &str, loaded: bool, program: &LadderProgram) {
        let (from, count) = (self.addresses[&self.current_element], self.widths[name] as usize);
        let byte = |value: i64, place: usize| value.div_euclid(256_i64.pow(place as u32)).rem_euclid(256) as u8;
        let held = |naive: &NaiveInterpreter, place: usize| naive.cells.get(&(from + place)).copied().unwrap_or(255);
        if !loaded {
            let value = (0..count).map(|place| i64::from(held(self, place)) * 256_i64.pow(place as u32)).sum();
            return self.store(name, value);
        }
        let value = self.integer(name);
        if let Some(place) = (0..count).find(|&place| held(self, place) != byte(value, place)) {
            self.cells.insert(from + place, byte(value, place));
            let cycle = program.settings.cycle_us;
            self.cells_free = self.now + 10_000 / cycle + u64::from(10_000 % cycle != 0);
        }
    }
}

/// What may be short.
enum NarrowOperand<'a> {
    Name(&'a str),
    Value(i64),
}

impl<'a> From<&'a String> for NarrowOperand<'a> {
    fn from(name: &'a String) -> Self {
        NarrowOperand::Name(name)
    }
}

impl<'a> From<&'a LadderOperand> for NarrowOperand<'a> {
    fn from(operand: &'a LadderOperand) -> Self {
        match operand {
            LadderOperand::Var(name) => NarrowOperand::Name(name),
            LadderOperand::Const { value, .. } => NarrowOperand::Value(*value),
        }
    }
}

/// The number of so many bits that is congruent to `value`.
fn wrap_to_bits(value: i64, bits: u32) -> i64 {
    let half = 1 << (bits - 1);
    (value + half).rem_euclid(2 * half) - half
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

/// Bit by bit, on enough bits for any operand.
fn bitwise(a: i64, b: i64, is: impl Fn(bool, bool) -> bool) -> i64 {
    let pairs = bits::of(a, 40).into_iter().zip(bits::of(b, 40));
    bits::number(&pairs.map(|(x, y)| is(x, y)).collect::<Vec<bool>>())
}
