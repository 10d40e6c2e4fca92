//! Lowers the model to intermediate code: defines the meaning of each element once for all targets.
//!
//! It follows the documents of the language: the accumulator is the state of the rung, every element
//! transforms it, and every element is executed in every scan. The code is deliberately simple;
//! [`crate::optimise`] removes what is not needed.

mod bit_elements;
mod buses;
mod flow;
mod groups;
mod initial_bits;
mod instruction_blocks;
mod instruction_functions;
mod instruction_numbers;
mod instructions;
mod more_elements;
mod peripherals;
mod ports;
mod pulses;
mod pwm;
mod three_address;
mod timing;
mod word_elements;

use std::collections::HashMap;

use ladder::{
    CompareOp, Element, ElementId, LadderDialect, LadderOperand, LadderProgram, MathOp, ProgramElement, RungNode,
    SymbolKind,
    registers::{self, PortRegister, RegisterKind, SharedPin},
};

use crate::ir::{
    ArithmeticOp, BitCell, BitId, BitRole, BranchCondition, Ir, IrOp, IrStep, RungCode, WordCell, WordId, WordOperand,
    WordRole,
};
use flow::JumpPlan;
use instructions::InstructionState;
use peripherals::TransmitterBusy;
use timing::CounterStart;
use word_elements::ReducedComparison;

pub use peripherals::eeprom_cells;
pub use three_address::to_three_address;
pub use timing::timer_scans;

/// Lowers `program` to unoptimised intermediate code.
///
/// The program must have passed the checks of `ladder` and [`crate::element_checks`]: unsupported elements
/// get no operations.
#[must_use]
pub fn lower(program: &LadderProgram) -> Ir {
    lower_with_modules(program, false)
}

/// Lowers `program` as [`lower`] does, but with `modules` each timer and counter becomes an [`IrOp::Module`].
#[must_use]
pub fn lower_with_modules(program: &LadderProgram, modules: bool) -> Ir {
    let mut lower = Lowering::new(program, modules);
    let initial: HashMap<&str, i64> = program.declarations.iter().map(|v| (v.name.as_str(), v.initial)).collect();
    for symbol in program.symbols() {
        if symbol.kind.is_bit() {
            lower.new_symbol_bit(symbol.name, symbol.kind);
        } else {
            let start = lower.counter_starts.get(symbol.name.as_str());
            let unused = 32 - 8 * u32::from(symbol.bytes.clamp(1, 4));
            let initial = match PortRegister::from_name(&symbol.name) {
                Some(PortRegister { port, kind: RegisterKind::Direction }) => {
                    i32::from(registers::initial_directions(program, port) as i8)
                }
                _ => match initial.get(symbol.name.as_str()) {
                    Some(value) => (*value as i32) << unused >> unused,
                    None => start.map_or(0, |start| start.power_up) << unused >> unused,
                },
            };
            lower.new_word(symbol.name, symbol.kind, symbol.bytes, initial);
        }
    }
    lower.plan_jumps();
    if program.elements().any(|ProgramElement { element, .. }| matches!(element, Element::MasterRelay)) {
        // A jump back reads it in a rung above.
        let role = if lower.jumps.is_some() { BitRole::Memory } else { BitRole::Temporary };
        let master = lower.new_bit("master".to_owned(), role);
        lower.master = Some(master);
        // A scan that is held goes on with it.
        let on = IrOp::SetBit { bit: master, value: true };
        let held = lower.jumps.as_ref().map_or_else(Vec::new, JumpPlan::held_bits);
        let on = held.into_iter().fold(on, |on, bit| IrOp::If {
            cond: BranchCondition::Bit(bit),
            if_true: Vec::new(),
            if_false: vec![on],
        });
        lower.ir.prologue.push(on);
    }
    lower.set_up_ports();
    lower.set_up_peripherals();
    lower.preset_off_delays();
    lower.plan_pulse_trains();
    lower.set_initial_bits();
    for (number, rung) in program.rungs.iter().enumerate() {
        lower.element = ElementId { rung: number as u32, index: 0 };
        lower.next = 0;
        lower.steps = Vec::new();
        lower.place_rung_label(number as u32);
        match lower.master {
            _ if program.dialect == LadderDialect::Iec => lower.begin_network(number as u32),
            Some(bit) => lower.push(IrOp::Load { bit, negated: false }),
            None => lower.push(IrOp::SetAccumulator(true)),
        }
        lower.series(&rung.series, 0);
        lower.end_network(rung);
        if number + 1 == program.rungs.len() {
            lower.place_rung_label(number as u32 + 1);
        }
        let steps = std::mem::take(&mut lower.steps);
        lower.ir.rungs.push(RungCode { element_count: lower.next, steps });
    }
    lower.ir
}

/// State of the lowering of one program.
struct Lowering<'a> {
    program: &'a LadderProgram,
    ir: Ir,
    bits: HashMap<String, BitId>,
    words: HashMap<String, WordId>,
    /// Input and output bit of the parallel groups, by the subprogram that they are in and the nesting depth:
    /// those of a rung that calls a subprogram are still needed when it returns.
    groups: HashMap<(Option<u32>, usize), (BitId, BitId)>,
    /// State of each sequence of RANDOM, by the name of its destination.
    seeds: HashMap<String, WordId>,
    /// Where jumps go, if the program has any.
    jumps: Option<JumpPlan<'a>>,
    /// The master relay, if the program uses it.
    master: Option<BitId>,
    /// For each PWM output, if several elements set it: the last value of this scan, and whether one was set.
    duties: Vec<Option<(WordId, BitId)>>,
    /// Zero in the first scan, one afterwards; for TOF timers that cannot be preset before the rungs.
    after_first_scan: Option<BitId>,
    /// TOF elements that are preset before the rungs.
    preset_timers: Vec<ElementId>,
    /// For each NPULSE: the words of its pulses that are left.
    trains: HashMap<ElementId, WordId>,
    /// State of transmitter and EEPROM, if the program uses them.
    transmitter_busy: Option<TransmitterBusy>,
    /// The byte that was received, and whether it waits, if the program tests that.
    received: Option<(WordId, BitId)>,
    /// The word that counts the scans until the EEPROM is ready, and its start value.
    eeprom_busy: Option<(WordId, i32)>,
    /// EEPROM cells of the remaining PERSIST elements.
    eeprom_cells: std::vec::IntoIter<(u16, u8)>,
    /// Inputs and outputs at the ports whose registers the program names.
    shared_pins: Vec<SharedPin>,
    /// Start values of counters, which RES stores too.
    counter_starts: HashMap<&'a str, CounterStart>,
    /// What the lines of Instruction List need.
    instructions: InstructionState,
    /// Timers and counters become [`IrOp::Module`] instead of simpler operations.
    keep_modules: bool,
    /// True if counters have the bounds of dialect `ldmicro-5`.
    bounded_counters: bool,
    /// Element being lowered, which owns the operations pushed.
    element: ElementId,
    /// Index of the next element of the rung in text order.
    next: u32,
    /// Operations of the current rung.
    steps: Vec<IrStep>,
}

impl<'a> Lowering<'a> {
    fn new(program: &'a LadderProgram, modules: bool) -> Self {
        Lowering {
            program,
            ir: Ir::default(),
            bits: HashMap::new(),
            words: HashMap::new(),
            groups: HashMap::new(),
            jumps: None,
            seeds: HashMap::new(),
            master: None,
            duties: Vec::new(),
            after_first_scan: None,
            preset_timers: Vec::new(),
            trains: HashMap::new(),
            transmitter_busy: None,
            received: None,
            eeprom_busy: None,
            eeprom_cells: eeprom_cells(program).into_iter(),
            shared_pins: Vec::new(),
            counter_starts: timing::counter_starts(program),
            instructions: InstructionState::new(program),
            keep_modules: modules,
            bounded_counters: program.dialect == LadderDialect::Ldmicro5,
            element: ElementId { rung: 0, index: 0 },
            next: 0,
            steps: Vec::new(),
        }
    }

    fn push(&mut self, op: IrOp) {
        self.steps.push(IrStep { element: self.element, op });
    }

    fn push_all(&mut self, ops: Vec<IrOp>) {
        ops.into_iter().for_each(|op| self.push(op));
    }

    fn new_bit(&mut self, name: String, role: BitRole) -> BitId {
        self.ir.bits.push(BitCell { name, role, initial: false });
        BitId(self.ir.bits.len() as u32 - 1)
    }

    fn symbol_bit(&mut self, name: &str) -> BitId {
        if let Some(&bit) = self.bits.get(name) {
            return bit;
        }
        self.new_symbol_bit(name.to_owned(), ladder::symbols::kind_by_letter(name))
    }

    fn new_symbol_bit(&mut self, name: String, kind: SymbolKind) -> BitId {
        let role = match kind {
            SymbolKind::Input => BitRole::Input,
            SymbolKind::Output => BitRole::Output,
            _ => BitRole::Relay,
        };
        let bit = self.new_bit(name.clone(), role);
        self.bits.insert(name, bit);
        bit
    }

    fn word(&mut self, name: &str) -> WordId {
        if let Some(&word) = self.words.get(name) {
            return word;
        }
        self.new_word(name.to_owned(), SymbolKind::Variable, 2, 0)
    }

    fn new_word(&mut self, name: String, kind: SymbolKind, bytes: u8, initial: i32) -> WordId {
        let word = self.new_word_cell(name.clone(), WordRole::Symbol(kind), bytes, initial);
        self.words.insert(name, word);
        word
    }

    fn new_word_cell(&mut self, name: String, role: WordRole, bytes: u8, initial: i32) -> WordId {
        self.ir.words.push(WordCell { name, role, bytes, initial });
        WordId(self.ir.words.len() as u32 - 1)
    }

    /// Returns a temporary integer; the same `use_` and width give the same cell.
    fn temporary(&mut self, use_: &str, bytes: u8) -> WordId {
        let name = format!("{use_}.{bytes}");
        if let Some(at) = self.ir.words.iter().position(|w| w.role == WordRole::Temporary && w.name == name) {
            return WordId(at as u32);
        }
        self.new_word_cell(name, WordRole::Temporary, bytes, 0)
    }

    fn value(&mut self, operand: &LadderOperand) -> WordOperand {
        match operand {
            LadderOperand::Var(name) => WordOperand::Cell(self.word(name)),
            LadderOperand::Const { value, .. } => WordOperand::Const(*value as i32),
        }
    }

    /// Name of a cell that belongs to the current element.
    fn element_name(&self, what: &str) -> String {
        format!("{what}({}.{})", self.element.rung + 1, self.element.index + 1)
    }

    /// Allocates an edge memory of the current element.
    fn new_memory(&mut self) -> BitId {
        self.new_bit(self.element_name("edge"), BitRole::Memory)
    }

    fn series(&mut self, nodes: &[RungNode], depth: usize) {
        for node in nodes {
            match node {
                RungNode::Leaf(element, _) => {
                    self.element.index = self.next;
                    self.next += 1;
                    self.element(element);
                    self.share_outputs(element);
                }
                RungNode::Parallel(branches, _) => self.parallel(branches, depth),
            }
        }
    }

    fn element(&mut self, element: &Element) {
        match element {
            Element::Contacts { name, negated, .. } => {
                let bit = self.symbol_bit(name);
                self.push(IrOp::And { bit, negated: *negated });
            }
            // The first flag that is set counts.
            Element::Coil { name, negated, set, reset, ttrigger } => {
                let bit = self.symbol_bit(name);
                let toggles = ttrigger.is_some_and(|flag| flag != 0);
                match (negated, set, reset, toggles) {
                    (true, ..) => self.push(IrOp::Store { bit, negated: true }),
                    (_, true, ..) => self.push(if_accumulator(vec![IrOp::SetBit { bit, value: true }])),
                    (_, _, true, _) => self.push(if_accumulator(vec![IrOp::SetBit { bit, value: false }])),
                    (_, _, _, true) => self.toggle(bit),
                    _ => self.push(IrOp::Store { bit, negated: false }),
                }
            }
            Element::Open => self.push(IrOp::SetAccumulator(false)),
            Element::MasterRelay => self.master_relay(),
            Element::Osr => {
                let memory = self.new_memory();
                self.push(IrOp::Rising(memory));
            }
            Element::Osf => {
                let memory = self.new_memory();
                self.push(IrOp::Falling(memory));
            }
            Element::Odr => {
                let memory = self.new_memory();
                self.push(IrOp::Rising(memory));
                self.complement();
            }
            Element::Odf | Element::Osl => {
                let (memory, armed) = (self.new_memory(), self.new_bit(self.element_name("armed"), BitRole::Memory));
                self.push(if_accumulator(vec![IrOp::SetBit { bit: armed, value: true }]));
                self.push(IrOp::Falling(memory));
                self.push(IrOp::If {
                    cond: BranchCondition::Acc,
                    if_true: vec![IrOp::SetAccumulator(false)],
                    if_false: vec![IrOp::Load { bit: armed, negated: false }],
                });
            }
            Element::Osc => {
                let bit = self.new_memory();
                self.push(IrOp::And { bit, negated: true });
                self.push(IrOp::Store { bit, negated: false });
            }
            Element::Timer { kind, name, delay, adjust } => self.timer(*kind, name, delay, adjust.as_ref()),
            Element::Counter { kind, name, max, init, input } => {
                self.counter(*kind, name, max, (init.as_ref(), *input));
            }
            Element::Res { name } => {
                let start = self.counter_starts.get(name.as_str()).and_then(|start| start.reset.clone());
                let src = start.map_or(WordOperand::Const(0), |(_, start)| self.value(&start));
                let dst = self.word(name);
                self.push(if_accumulator(vec![IrOp::Move { dst, src }]));
            }
            Element::Move { dest, src } => {
                let op = IrOp::Move { dst: self.word(dest), src: self.value(src) };
                self.push(if_accumulator(vec![op]));
            }
            Element::Math { op, dest, op1, op2 } => {
                let op = match op {
                    MathOp::Add => ArithmeticOp::Add,
                    MathOp::Sub => ArithmeticOp::Sub,
                    MathOp::Mul => ArithmeticOp::Mul,
                    MathOp::Div => ArithmeticOp::Div,
                    MathOp::Mod => return self.remainder(dest, op1, op2),
                    MathOp::And => ArithmeticOp::And,
                    MathOp::Or => ArithmeticOp::Or,
                    MathOp::Xor => ArithmeticOp::Xor,
                };
                let op = IrOp::Math { op, dst: self.word(dest), a: self.value(op1), b: self.value(op2) };
                self.push(if_accumulator(vec![op]));
            }
            Element::Unary { op, dest, src } => self.unary(*op, dest, src),
            Element::Shift { op, dest, src, count } => self.shift_bits(*op, dest, src, count),
            Element::BitWrite { name, bit, value } => self.write_bit(name, bit, *value),
            Element::BitTest { name, bit, value } => self.test_bit(name, bit, *value),
            Element::Bus { dest, src, targets } => self.bus(dest, src, *targets),
            Element::Flow { op, label } => self.flow(*op, label),
            Element::Return => self.return_from_subprogram(),
            Element::Lock => self.lock(),
            Element::Segments { display, dest, src, common } => self.segments(*display, dest, src, *common != 'C'),
            Element::TimeValue { is_scans, dest, time } => self.time_value(*is_scans, dest, time),
            Element::Random { dest } => self.random(dest),
            Element::SeedRandom { dest, src } => self.seed_random(dest, src),
            // They only pass time, or act on a part that is off.
            Element::Delay { .. } | Element::Sleep | Element::ClearWatchdog | Element::Text { .. } => {}
            Element::Compare { op, op1, op2 } => {
                let (a, b) = (self.value(op1), self.value(op2));
                let ops = self.and_comparison(*op, a, b);
                self.push_all(ops);
            }
            Element::ShiftRegister { name, stages } => self.shift(name, *stages),
            Element::LookUpTable { dest, index, values, .. } => self.look_up(dest, index, values),
            Element::PiecewiseLinear { dest, index, points, .. } => self.piecewise(dest, index, points),
            Element::ReadAdc { name, refs } => self.read_adc(name, refs.unwrap_or(0) as u8),
            Element::SetPwm { duty, output, .. } => self.set_pwm(duty, output.as_ref()),
            Element::UartSend { name, rest } => self.send(name, rest.unwrap_or_default()),
            Element::UartRecv { name, rest } => self.receive(name, rest.unwrap_or_default()),
            Element::UartRecvAvail => self.test_received(),
            Element::UartSendReady => self.test_transmitter(),
            Element::NpulseOff => self.stop_pulses(),
            Element::Pulser { .. } | Element::Npulse { .. } | Element::Stepper { .. } | Element::QuadEncod { .. } => {
                self.pulse_element(element)
            }
            Element::FormattedString { var, text, quoted } => self.send_string(var.as_deref(), text, *quoted),
            Element::BusTransfer(transfer) => self.bus_transfer(transfer),
            Element::Persist { name } => self.persist(name),
            Element::Instruction(step) => self.instruction(step),
            // SHORT passes power, COMMENT has no effect, and the checks refuse PLACEHOLDER.
            Element::Short | Element::Comment(_) | Element::Placeholder => {}
        }
    }

    /// acc := not acc.
    fn complement(&mut self) {
        let (if_true, if_false) = (vec![IrOp::SetAccumulator(false)], vec![IrOp::SetAccumulator(true)]);
        self.push(IrOp::If { cond: BranchCondition::Acc, if_true, if_false });
    }

    /// A rising edge complements the bit; acc stays.
    fn toggle(&mut self, bit: BitId) {
        let memory = self.new_memory();
        self.push(IrOp::Rising(memory));
        self.push(if_accumulator(vec![IrOp::If {
            cond: BranchCondition::Bit(bit),
            if_true: vec![IrOp::SetBit { bit, value: false }],
            if_false: vec![IrOp::SetBit { bit, value: true }],
        }]));
        // The memory is the rung state of this scan.
        self.push(IrOp::Load { bit: memory, negated: false });
    }

    /// acc := acc and the comparison.
    fn and_comparison(&self, op: CompareOp, a: WordOperand, b: WordOperand) -> Vec<IrOp> {
        match self.relation(op, a, b) {
            ReducedComparison::Always(true) => Vec::new(),
            ReducedComparison::Always(false) => vec![IrOp::SetAccumulator(false)],
            ReducedComparison::Compare(compare) => vec![IrOp::AndCompare(compare)],
        }
    }

    /// Executes `then` if the comparison is true, else `otherwise`.
    fn if_comparison(
        &self,
        op: CompareOp,
        a: WordOperand,
        b: WordOperand,
        then: Vec<IrOp>,
        otherwise: Vec<IrOp>,
    ) -> Vec<IrOp> {
        match self.relation(op, a, b) {
            ReducedComparison::Always(true) => then,
            ReducedComparison::Always(false) => otherwise,
            ReducedComparison::Compare(compare) => {
                vec![IrOp::If { cond: BranchCondition::Compare(compare), if_true: then, if_false: otherwise }]
            }
        }
    }

    /// MASTER_RELAY: an off relay is turned on whatever the rung is; an on relay takes the state of the rung.
    fn master_relay(&mut self) {
        if let Some(bit) = self.master {
            self.push(IrOp::If {
                cond: BranchCondition::Bit(bit),
                if_true: vec![IrOp::Store { bit, negated: false }],
                if_false: vec![IrOp::SetBit { bit, value: true }],
            });
        }
    }
}

/// Executes `ops` if the accumulator is true.
fn if_accumulator(ops: Vec<IrOp>) -> IrOp {
    IrOp::If { cond: BranchCondition::Acc, if_true: ops, if_false: Vec::new() }
}

/// Increments or decrements a word by one.
fn step_word(word: WordId, op: ArithmeticOp) -> IrOp {
    IrOp::Math { op, dst: word, a: WordOperand::Cell(word), b: WordOperand::Const(1) }
}
