//! The flat form of a program, and the execution of its steps on the state.

use ladder::ElementId;

use crate::arithmetic::{CountInput, CountMode, compare, count_step, math, truncate};
use crate::bit_ops;
pub(crate) use crate::element_op::{ElementOp, FlatStep, ValueSource};
use crate::flow_steps::{FlowStep, ParallelGroup, ScanPosition};
use crate::il_ops::{IlOp, IlState};
use crate::peripheral_state::{BusAddress, ByteSequence, FormattedText, PeripheralState, PiecewiseCurve, PwmChannel};
use crate::ports::FlatPort;
use crate::pulse_ops::{EncoderState, FlatEncoder, FlatNpulse, FlatPulser, FlatStepper, NpulseState, PulserState};

/// A program with its names resolved: its steps index its lists and the values of the state.
#[derive(Debug, Default)]
pub(crate) struct FlatProgram {
    /// Steps of a scan, in order.
    pub steps: Vec<FlatStep>,
    /// True if the program has jumps or subprograms.
    pub has_jumps: bool,
    /// Index of the first step of each rung, then the number of steps.
    pub rung_starts: Vec<usize>,
    /// Value of each symbol at power-up.
    pub initial_values: Vec<i32>,
    /// For each symbol, 32 minus its width in bits: a shift left and right by this many bits truncates a
    /// number to the width.
    pub cut_bits: Vec<u8>,
    /// Values of each look-up table.
    pub tables: Vec<Vec<i32>>,
    /// Curves of the PIECEWISE_LINEAR elements.
    pub curves: Vec<PiecewiseCurve>,
    /// Symbols of each shift register, from stage 0 on.
    pub shift_stages: Vec<Vec<u32>>,
    /// Texts of the FORMATTED_STRING elements.
    pub texts: Vec<FormattedText>,
    /// Symbols that READ_ADC uses, each once, in ascending order.
    pub adc_symbols: Vec<u32>,
    /// Texts of the SPI_WR elements.
    pub bus_texts: Vec<Vec<u8>>,
    /// The PULSER elements.
    pub pulsers: Vec<FlatPulser>,
    /// The NPULSE elements.
    pub npulses: Vec<FlatNpulse>,
    /// The STEPPER elements.
    pub steppers: Vec<FlatStepper>,
    /// The QUAD_ENCOD elements.
    pub encoders: Vec<FlatEncoder>,
    /// Ports of which the program names a register.
    pub ports: Vec<FlatPort>,
    /// The PWM outputs, in the order in which SET_PWM names them first.
    pub pwm_outputs: Vec<PwmChannel>,
    /// Number of scans that a byte takes on the serial line.
    pub scans_per_byte: u32,
    /// Number of UART_SEND and UART_RECV of several bytes.
    pub transfers: u32,
    /// Number of scans that writing one byte to the EEPROM takes.
    pub scans_per_eeprom_write: u32,
    /// Number of EEPROM cells in use.
    pub eeprom_cells: u32,
    /// Number of sequences of RANDOM.
    pub seeds: u32,
    /// Number of memory bits of all elements.
    pub memories: u32,
    /// Maximum nesting depth of parallel groups.
    pub max_depth: usize,
    /// The lines of Instruction List.
    pub lines: Vec<IlOp>,
    /// Number of instances of blocks.
    pub instances: u32,
    /// Time of a scan in milliseconds; 0 without timers of IEC.
    pub cycle_ms: u32,
}

/// All state that a scan can change.
#[derive(Debug, Clone)]
pub(crate) struct ScanState {
    /// Value of each symbol; bits hold 0 or 1.
    pub values: Vec<i32>,
    /// Number of scans since power-up.
    pub scans: u64,
    /// State of converter, PWM output, serial line, EEPROM and strings.
    pub parts: PeripheralState,
    /// State of each PULSER and of each QUAD_ENCOD.
    pub pulsers: Vec<PulserState>,
    pub encoders: Vec<EncoderState>,
    /// State of each NPULSE.
    pub npulses: Vec<NpulseState>,
    /// For each port: the latch when it and the outputs were last equal.
    latches: Vec<u8>,
    /// Memory bits of elements: the previous rung bit, or a flag that the element has run once.
    memories: Vec<bool>,
    /// State of each sequence of RANDOM.
    seeds: Vec<u32>,
    /// True once LOCK has stopped the program.
    is_locked: bool,
    /// Where the scan goes on that an UART_RECV holds until its bytes have come.
    held: Option<ScanPosition>,
    /// The parallel groups, by nesting depth.
    groups: Vec<ParallelGroup>,
    /// The master relay; every scan starts with it on.
    master: bool,
    /// Current result and blocks of Instruction List.
    pub il: IlState,
}

impl ScanState {
    /// State at power-up: everything is zero except the start values of counters.
    pub(crate) fn new(code: &FlatProgram) -> ScanState {
        ScanState {
            values: code.initial_values.clone(),
            scans: 0,
            parts: PeripheralState::power_up(code),
            seeds: vec![1; code.seeds as usize],
            is_locked: false,
            held: None,
            pulsers: vec![PulserState::default(); code.pulsers.len()],
            npulses: vec![NpulseState::default(); code.npulses.len()],
            encoders: vec![EncoderState::default(); code.encoders.len()],
            latches: vec![0; code.ports.len()],
            memories: vec![false; code.memories as usize],
            groups: vec![ParallelGroup::default(); code.max_depth],
            master: true,
            il: IlState::power_up(code.instances),
        }
    }

    /// Runs one scan and calls `watch` after each element.
    ///
    /// `watch` receives the element, the rung bit before and after it, and the values of all symbols after
    /// it.
    pub(crate) fn scan(&mut self, code: &FlatProgram, mut watch: impl FnMut(ElementId, bool, bool, &[i32])) {
        self.parts.start_scan();
        let held = self.held.take();
        self.master |= held.is_none();
        self.il.result = 0;
        code.ports.iter().for_each(|port| port.sample(&mut self.values));
        let mut rung = true;
        let mut position = held.unwrap_or_default();
        if self.is_locked {
            position.next = code.steps.len();
        }
        while let Some(step) = code.steps.get(position.next) {
            position.next += 1;
            match *step {
                FlatStep::Rung => rung = self.master,
                FlatStep::Split(depth) => self.groups[depth] = ParallelGroup { at_start: rung, any: false },
                FlatStep::Branch(depth) => {
                    let group = &mut self.groups[depth];
                    group.any |= rung;
                    rung = group.at_start;
                }
                FlatStep::Join(depth) => rung |= self.groups[depth].any,
                FlatStep::LoadOnce { var, from, memory } => {
                    if !self.replace_memory(memory, true) {
                        self.store(code, var, self.read_symbol(from).into());
                    }
                }
                FlatStep::Do(id, ElementOp::Flow(step)) => {
                    self.is_locked |= rung && matches!(step, FlowStep::Lock);
                    let followed = position.follow(code, step, rung, &mut self.groups);
                    watch(id, rung, followed.after, &self.values);
                    rung = followed.next;
                }
                FlatStep::Do(id, ElementOp::Line(line)) => {
                    let before = self.il.result != 0;
                    let next = self.execute_line(code, line);
                    position.follow_line(code, next);
                    watch(id, before, self.il.result != 0, &self.values);
                }
                FlatStep::Do(id, ElementOp::ReceiveAll { dest, bytes, transfer }) => {
                    let before = rung;
                    let number =
                        if before { self.parts.receive_all(ByteSequence { at: transfer, bytes }) } else { None };
                    rung = number.is_some();
                    number.into_iter().for_each(|number| self.store(code, dest, number));
                    self.share_outputs(code);
                    watch(id, before, rung, &self.values);
                    if self.parts.has_begun(transfer) {
                        self.held = Some(position.held_at(position.next - 1));
                        break;
                    }
                }
                FlatStep::Do(id, op) => {
                    let before = rung;
                    rung = self.execute_element(code, op, before);
                    self.share_outputs(code);
                    watch(id, before, rung, &self.values);
                }
            }
        }
        self.scans = self.scans.wrapping_add(1);
    }

    /// Executes one element with the rung bit `rung` and returns the rung bit after it.
    fn execute_element(&mut self, code: &FlatProgram, op: ElementOp, rung: bool) -> bool {
        match op {
            // The order of execution is not the state's.
            ElementOp::Flow(_) | ElementOp::Line(_) | ElementOp::ReceiveAll { .. } | ElementOp::Short => rung,
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
                // If the relay is off, this element turns it on whatever the rung bit is. Otherwise no later
                // rung could end the disabled part, because its own rung bit starts as false there.
                self.master = !self.master | rung;
                rung
            }
            ElementOp::Osr { memory } => rung & !self.replace_memory(memory, rung),
            ElementOp::Osf { memory } => !rung & self.replace_memory(memory, rung),
            ElementOp::Odr { memory } => !(rung & !self.replace_memory(memory, rung)),
            ElementOp::Odf { memory, seen } => {
                let falls = !rung & self.replace_memory(memory, rung);
                // It has been true only from the first true scan on.
                self.memories[seen as usize] |= rung;
                self.memories[seen as usize] & !falls
            }
            ElementOp::Osc { memory } => {
                let out = rung & !self.memories[memory as usize];
                self.replace_memory(memory, out);
                out
            }
            ElementOp::Toggle { bit, memory } => {
                if rung & !self.replace_memory(memory, rung) {
                    self.values[bit as usize] ^= 1;
                }
                rung
            }
            ElementOp::Ton { var, preset } => {
                if !rung {
                    self.values[var as usize] = 0;
                    return false;
                }
                !self.count_scan(code, var, preset)
            }
            ElementOp::Tof { var, preset, first } => {
                if first.is_some_and(|first| !self.replace_memory(first, true)) {
                    self.store(code, var, self.read_value(preset).into());
                }
                if rung {
                    self.values[var as usize] = 0;
                    return true;
                }
                self.count_scan(code, var, preset)
            }
            ElementOp::Rto { var, preset } => self.count_scans_of(code, var, preset, rung),
            ElementOp::Rtl { var, preset } => self.count_scans_of(code, var, preset, !rung),
            ElementOp::Tcy { var, preset, memory } => {
                if !rung {
                    self.values[var as usize] = 0;
                    return false;
                }
                if !self.count_scan(code, var, preset) {
                    self.values[var as usize] = 0;
                    self.memories[memory as usize] ^= true;
                }
                self.memories[memory as usize]
            }
            ElementOp::Thi { var, preset, memory } => {
                self.memories[memory as usize] |= rung;
                if !self.memories[memory as usize] {
                    return false;
                }
                let pulse = self.count_scan(code, var, preset);
                if !pulse & !rung {
                    self.values[var as usize] = 0;
                    self.memories[memory as usize] = false;
                }
                pulse
            }
            ElementOp::Tlo { var, preset, memory, seen } => {
                self.memories[seen as usize] |= rung;
                let seen = self.memories[seen as usize];
                self.memories[memory as usize] |= seen & !rung;
                if !self.memories[memory as usize] {
                    return seen;
                }
                if self.count_scan(code, var, preset) {
                    return false;
                }
                if rung {
                    self.values[var as usize] = 0;
                    self.memories[memory as usize] = false;
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
                let mut carry = false;
                if counts {
                    self.store(code, var, count_step(kind, self.read_symbol(var), self.read_value(max)));
                    let (n, max) = (self.read_symbol(var), self.read_value(max));
                    carry = match kind {
                        CountMode::UpAround => n > max,
                        CountMode::DownAround => n < max,
                        CountMode::Up | CountMode::Down | CountMode::UpTo | CountMode::DownTo | CountMode::Circular => {
                            false
                        }
                    };
                    if carry {
                        self.store(code, var, self.read_value(restart).into());
                    }
                }
                let (n, max) = (self.read_symbol(var), self.read_value(max));
                match kind {
                    CountMode::Up | CountMode::Down | CountMode::UpTo => n >= max,
                    CountMode::DownTo => n > max,
                    CountMode::Circular => rung,
                    CountMode::UpAround | CountMode::DownAround => carry,
                }
            }
            ElementOp::Compare { op, a, b } => rung & compare(op, self.read_value(a), self.read_value(b)),
            ElementOp::TestBit { var, bit, value } => {
                rung & (bit_ops::has_bit(self.read_symbol(var), self.read_value(bit)) == value)
            }
            ElementOp::Available => rung & self.parts.received_byte.is_some(),
            ElementOp::Ready => rung & (self.parts.transmitter_busy_scans == 0),
            ElementOp::Pulser { pulser } => self.pulse(code, pulser, rung),
            ElementOp::Npulse { npulse } => self.pulse_at(code, npulse, rung),
            ElementOp::Stepper { stepper, each } => self.step_motor(code, stepper, each, rung),
            ElementOp::Encoder { encoder } => self.count_steps(code, encoder, rung),
            ElementOp::Send { src } => self.parts.send(code, self.read_symbol(src), rung),
            ElementOp::SendBytes { src, bytes, transfer } => {
                self.parts.send_bytes(code, ByteSequence { at: transfer, bytes }, self.read_symbol(src), rung)
            }
            ElementOp::SendWait { src, bytes } => self.parts.send_at_once(code, bytes, self.read_symbol(src), rung),
            ElementOp::Text { text } => self.parts.send_text(code, text as usize, &self.values, rung),
            // The edge memory is updated in every scan, whether or not the rung is true.
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
            ElementOp::ReceiveBytes { dest, bytes, transfer } => {
                let whole = self.parts.receive_bytes(transfer, bytes);
                if let Some(value) = whole {
                    self.store(code, dest, value);
                }
                whole.is_some()
            }
            ElementOp::NpulseOff => {
                self.npulses.fill(NpulseState::default());
                true
            }
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
            ElementOp::Segments { display, dest, src, inverted } => {
                let (code_point, segments) = bit_ops::segments(display, self.read_value(src), inverted);
                if let ValueSource::Var(var) = src {
                    self.store(code, var, code_point.into());
                }
                self.store(code, dest, segments);
                true
            }
            ElementOp::Random { dest, seed } => {
                let state = &mut self.seeds[seed as usize];
                *state = state.wrapping_mul(1_103_515_245).wrapping_add(12_345);
                let drawn = state.rotate_left(16);
                self.store(code, dest, drawn.into());
                true
            }
            ElementOp::Seed { seed, src } => {
                self.seeds[seed as usize] = self.read_value(src) as u32;
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
            ElementOp::Transfer { op, send, device, register, recv } => {
                let (byte, register) = (self.read_value(send) as u8, self.read_value(register) as u8);
                let answer = self.parts.transfer(op, BusAddress { device, register }, byte);
                recv.into_iter().for_each(|recv| self.store(code, recv, answer.into()));
                true
            }
            ElementOp::SendText { text } => {
                self.parts.send_bus_text(&code.bus_texts[text as usize]);
                true
            }
            ElementOp::SetPwm { duty, output } => {
                self.parts.duties[output as usize] = Some(self.read_value(duty).clamp(0, 100) as u8);
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

    /// Makes the latches of ports and the outputs at their pins equal.
    pub(crate) fn share_outputs(&mut self, code: &FlatProgram) {
        for (port, held) in code.ports.iter().zip(&mut self.latches) {
            port.share_outputs(&mut self.values, held);
        }
    }

    /// Returns the value of a symbol.
    pub(crate) fn read_symbol(&self, symbol: u32) -> i32 {
        self.values[symbol as usize]
    }

    /// Returns the value of a symbol or a constant.
    pub(crate) fn read_value(&self, value: ValueSource) -> i32 {
        match value {
            ValueSource::Var(var) => self.read_symbol(var),
            ValueSource::Const(value) => value,
        }
    }

    /// Stores the low bytes of an exact result, truncated to the width of the symbol.
    pub(crate) fn store(&mut self, code: &FlatProgram, symbol: u32, exact: i64) {
        self.values[symbol as usize] = truncate(exact, code.cut_bits[symbol as usize]);
    }

    /// Stores a memory bit and gives what it held.
    pub(crate) fn replace_memory(&mut self, memory: u32, now: bool) -> bool {
        std::mem::replace(&mut self.memories[memory as usize], now)
    }
}
