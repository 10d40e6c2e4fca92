//! A second, independent interpreter, which is deliberately slow and simple.
//!
//! It walks the model recursively and keeps its state in maps by name. It computes in 64 bits and reduces
//! results with remainders, stores times as the scan at which something is free again, and computes digits in
//! closed form. It shares no code with the evaluator except the parser of strings, which is only syntax.

mod bits;
mod flow;
mod narrow;
mod parts;
mod ports;
mod pulses;
mod serial;
mod values;

use std::collections::{HashMap, HashSet, VecDeque};

use bits::{bitwise, divide, wrap_to_bits};
use flow::Departure;
use ladder::format::split_format_string;
use ladder::{
    CompareOp, CounterKind, CurvePoint, Element, ElementId, FlowOp, LadderDialect, LadderOperand, LadderProgram,
    LdFormat, MathOp, ProgramElement, RungNode, SerialTransfer, TimerKind,
};
use narrow::NarrowOperand;
use serial::LoggedStep;

/// Observation at one element: the rung bit before and after it.
pub type ElementObservation = (ElementId, bool, bool);

/// State by name; an absent entry is 0.
#[derive(Default)]
pub struct NaiveInterpreter {
    pub bits: HashMap<String, bool>,
    pub integers: HashMap<String, i64>,
    /// Result of a conversion, by name.
    pub levels: HashMap<String, i64>,
    /// Bytes that the last scan sent.
    pub sent: Vec<u8>,
    /// What this scan did on the buses, as `(device, register, byte)`: -1 on SPI, and for a byte that is
    /// read.
    pub on_buses: Vec<(i64, i64, i64)>,
    /// Byte that devices answer in this scan.
    pub answer: i64,
    /// Byte that waits in the receiver.
    pub received_byte: Option<u8>,
    pub duties: HashMap<Option<String>, i64>,
    /// EEPROM cells by address; an absent cell is FFh.
    pub cells: HashMap<usize, u8>,
    remembered: HashMap<(u32, u32), bool>,
    /// Whether a second memory of an element is set.
    armed: HashSet<(u32, u32)>,
    master_relay: bool,
    current_element: (u32, u32),
    /// Set by an element that leaves its rung.
    departure: Option<flow::Departure>,
    jumps_back: u32,
    /// Set by LOCK.
    locked: bool,
    /// What this scan has done so far.
    log: Vec<LoggedStep>,
    /// What a scan that UART_RECV holds did before: it is gone through again, without effect.
    replay: VecDeque<LoggedStep>,
    /// Set by an UART_RECV that holds the scan.
    held: bool,
    /// Set while the scan that it holds ends.
    ends: bool,
    /// State of each RANDOM, by its destination.
    sequences: HashMap<String, i64>,
    seen: Vec<ElementObservation>,
    /// Widths of the integers in bytes, and the values that RES stores.
    widths: HashMap<String, u32>,
    starts: HashMap<String, (usize, LadderOperand)>,
    /// Address of the first cell of each PERSIST.
    addresses: HashMap<(u32, u32), usize>,
    /// Number of the current scan, and the scans from which transmitter and EEPROM are free.
    now: u64,
    line_free: u64,
    cells_free: u64,
    /// State of the elements of pulses.
    pulsers: HashMap<(u32, u32), pulses::NaivePulser>,
    encoders: HashMap<(u32, u32), pulses::NaiveEncoder>,
    /// For each NPULSE that runs: the scans that are left of all its pulses.
    trains: HashMap<(u32, u32), i64>,
    /// For each UART_SEND and UART_RECV of several bytes: those that have passed.
    transfers: HashMap<(u32, u32), Vec<u8>>,
    /// Bits of registers that are inputs and outputs, and whether a 1 directs outwards.
    homes: Vec<ports::BitHome>,
    avr: bool,
    /// For each string being sent: the index of the next character, and the number that it shows once read.
    texts: HashMap<(u32, u32), (usize, i64)>,
}

impl NaiveInterpreter {
    /// State at power-up.
    pub fn new(program: &LadderProgram) -> NaiveInterpreter {
        let widths = program.symbols().into_iter().map(|s| (s.name, s.bytes.into())).collect();
        let mut naive = NaiveInterpreter { widths, ..NaiveInterpreter::default() };
        naive.set_up_ports(program);
        let mut address = 0;
        for ProgramElement { id: ElementId { rung, index }, element, .. } in program.elements() {
            match element {
                // In LDmicro 5 a TOF begins at its end, or at -1 if that is not known.
                Element::Timer { kind: TimerKind::Tof, name, delay, adjust }
                    if program.dialect == LadderDialect::Ldmicro5 =>
                {
                    let known = matches!(delay, LadderOperand::Const { .. });
                    let scans = if known { naive.scans_of(delay, adjust.as_ref(), program) } else { -1 };
                    naive.store(name, scans);
                }
                Element::Counter { kind, name, init, .. } => {
                    // The last constant counts at power-up, the first counter of the first kind at RES.
                    let start = init.clone().unwrap_or(LadderOperand::Const { value: 0, text: String::new() });
                    if let LadderOperand::Const { value, .. } = start {
                        naive.store(name, value);
                    }
                    let kinds = [CounterKind::Ctu, CounterKind::Ctd, CounterKind::Ctc, CounterKind::Ctr];
                    let rank = kinds.iter().position(|of| of == kind).unwrap_or(9);
                    let better = naive.starts.get(name).is_none_or(|(other, _)| rank < *other);
                    if better {
                        naive.starts.insert(name.clone(), (rank, start));
                    }
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

    /// Runs one scan and returns the observations at all elements.
    pub fn scan(&mut self, program: &LadderProgram) -> Vec<ElementObservation> {
        self.seen.clear();
        self.ends = false;
        self.now += 1;
        self.sent.clear();
        self.on_buses.clear();
        self.sample_pins();
        self.jumps_back = 0;
        self.replay = std::mem::take(&mut self.log).into();
        if !self.held {
            self.replay.clear();
            self.master_relay = true;
        }
        if !self.locked {
            self.rungs_from(0, program);
        }
        self.seen.clone()
    }

    fn series(&mut self, series: &[RungNode], mut power: bool, program: &LadderProgram) -> bool {
        for node in series {
            power = match node {
                RungNode::Leaf(element, _) => {
                    let (rung, index) = self.current_element;
                    let after = self.logged_leaf(element, power, program);
                    self.current_element = (rung, index + 1);
                    after
                }
                RungNode::Parallel(branches, _) => {
                    let mut any = false;
                    for branch in branches {
                        any |= self.departure.is_none() && self.series(branch, power, program);
                    }
                    any
                }
            };
            if self.departure.is_some() {
                return false;
            }
        }
        power
    }

    fn leaf(&mut self, element: &Element, power: bool, program: &LadderProgram) -> bool {
        let before = self.remembered.get(&self.current_element).copied().unwrap_or(false);
        match element {
            Element::Comment(_) | Element::Short => power,
            Element::Open => false,
            Element::Instruction(step) => unreachable!("programs of LDmicro have no `{step}`"),
            Element::Contacts { name, negated, .. } => {
                let closed = if *negated { !self.bit(name) } else { self.bit(name) };
                power && closed
            }
            Element::Coil { name, negated, set, reset, ttrigger } => {
                let toggles = *ttrigger == Some(1) && !(*negated || *set || *reset);
                let stored = match (*negated, *set, *reset) {
                    (true, ..) => !power,
                    (_, true, _) => self.bit(name) || power,
                    (_, _, true) => self.bit(name) && !power,
                    _ if toggles => self.bit(name) != (power && !before),
                    _ => power,
                };
                if toggles {
                    self.remembered.insert(self.current_element, power);
                }
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
            Element::Odr => {
                self.remembered.insert(self.current_element, power);
                before || !power
            }
            Element::Odf | Element::Osl => {
                self.remembered.insert(self.current_element, power);
                if power {
                    self.armed.insert(self.current_element);
                }
                power || self.armed.contains(&self.current_element) && !before
            }
            Element::Osc => {
                self.remembered.insert(self.current_element, power && !before);
                power && !before
            }
            Element::Timer { kind, name, delay: LadderOperand::Var(scans), .. } => {
                let retentive = matches!(kind, TimerKind::Rto | TimerKind::Rtl);
                let scans = if retentive { -1 } else { self.integer(scans) };
                self.timer(*kind, name, scans, power, before || *kind == TimerKind::Tof)
            }
            Element::Timer { kind, name, delay, adjust } => {
                let scans = self.scans_of(delay, adjust.as_ref(), program);
                // In LDmicro 5 a TOF has begun at power-up.
                let begun = *kind == TimerKind::Tof && program.dialect == LadderDialect::Ldmicro5;
                self.timer(*kind, name, scans, power, before || begun)
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
                if let Some(LadderOperand::Var(start)) = init
                    && self.armed.insert(self.current_element)
                {
                    self.store(name, self.integer(start));
                }
                let mut carry = false;
                if counts {
                    let (n, max) = (self.integer(name), self.operand_value(max));
                    let next = match kind {
                        CounterKind::Ctu if bounded && n >= max => n,
                        CounterKind::Ctd if bounded && n <= max => n,
                        CounterKind::Ctc if !bounded && n >= max => 0,
                        CounterKind::Ctu | CounterKind::Ctc => n + 1,
                        CounterKind::Ctd | CounterKind::Ctr => n - 1,
                    };
                    self.store(name, next);
                }
                let (n, max) = (self.integer(name), self.operand_value(max));
                if counts && bounded {
                    carry = kind == &CounterKind::Ctc && n > max || kind == &CounterKind::Ctr && n < max;
                }
                if carry {
                    let start = init.as_ref().map_or(0, |init| self.operand_value(init));
                    self.store(name, start);
                }
                match kind {
                    CounterKind::Ctc | CounterKind::Ctr if bounded => carry,
                    CounterKind::Ctc | CounterKind::Ctr => power,
                    CounterKind::Ctd if bounded => n > max,
                    CounterKind::Ctu | CounterKind::Ctd => n >= max,
                }
            }
            Element::Res { name } => {
                if power {
                    let counter = self.starts.get(name).filter(|_| name.as_bytes()[0] == b'C');
                    let start = counter.map_or(0, |(_, start)| self.operand_value(start));
                    self.store(name, start);
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
            Element::PiecewiseLinear { dest, index, points, .. } => {
                let x = self.operand_value(index);
                let after = (1..points.len()).find(|&i| x <= points[i].x).filter(|_| power);
                if let Some(after) = after {
                    let (CurvePoint { x: x0, y: y0 }, CurvePoint { x: x1, y: y1 }) = (points[after - 1], points[after]);
                    let fits = |v: i64| (-0x8000..0x8000).contains(&v);
                    let short = points.iter().all(|point| fits(point.x) && fits(point.y))
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
            Element::SetPwm { duty, output, .. } => {
                if power {
                    let name = output.as_ref().map(|choice| choice.name.clone());
                    let duty = self.operand_value(duty).clamp(0, 100);
                    self.duties.insert(name, duty);
                }
                power
            }
            Element::UartSend { .. } | Element::UartRecv { .. } | Element::UartRecvAvail | Element::UartSendReady => {
                self.serial(element, power, program)
            }
            Element::Pulser { high, low, accel, count, coil } => self.pulser([high, low, accel, count], coil, power),
            Element::Npulse { count, hertz, coil } => self.npulse(count, hertz, coil, (power, program)),
            Element::NpulseOff => {
                if power {
                    self.trains.clear();
                }
                power
            }
            Element::Stepper { name, max, period, coil, .. } => {
                self.stepper(name, [max, period], coil, (power, before))
            }
            Element::QuadEncod { .. } => power && self.encoder(element),
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
            Element::BusTransfer(transfer) => self.on_bus(transfer, power),
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
            Element::Segments { .. }
            | Element::TimeValue { .. }
            | Element::Random { .. }
            | Element::SeedRandom { .. }
            | Element::Delay { .. }
            | Element::Sleep
            | Element::Text { .. }
            | Element::ClearWatchdog => {
                if power {
                    self.more(element, program);
                }
                power
            }
            Element::Lock => {
                self.locked |= power;
                self.departure = power.then_some(Departure::To(program.rungs.len()));
                power
            }
            Element::Flow { op, label } => self.flow(*op, label, power, program),
            Element::Return => {
                self.departure = power.then_some(Departure::Back);
                power
            }
            Element::Placeholder => panic!("the generator gives no placeholder"),
        }
    }
}
