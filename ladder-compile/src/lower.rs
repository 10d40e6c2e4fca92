//! From the model to intermediate code: what each element means, told once for all targets.
//!
//! Written from the language's documents: the rung state is the accumulator, every element transforms it, and every element
//! is executed in every scan. Nothing here is clever; [`crate::optimise`] removes what is not needed.

mod numbers;
mod parts;
mod plain;
mod timing;

use std::collections::HashMap;

use ladder::{CompareOp, Dialect, Element, ElementId, MathOp, Node, Operand, Program, SymbolKind};

use crate::ir::{Bit, BitCell, BitRole, Cond, Ir, Math, Op, RungCode, Step, Value, Word, WordCell, WordRole};
use numbers::Relation;
use parts::Busy;

pub use parts::eeprom;
pub use plain::plain;
pub use timing::scans;

/// The scan of `program`, not yet optimised.
///
/// The program must have passed the checks of `ladder` and [`crate::refuse`]: elements that are not compiled have no
/// operations here.
#[must_use]
pub fn lower(program: &Program) -> Ir {
    lower_for(program, false)
}

/// The same; with `modules` timers and counters stay whole, each an [`Op::Module`].
#[must_use]
pub fn lower_for(program: &Program, modules: bool) -> Ir {
    let mut lower = Lower::new(program, modules);
    for symbol in program.symbols() {
        if symbol.kind.is_bit() {
            lower.symbol_bit(&symbol.name);
        } else {
            let initial = lower.starts.get(symbol.name.as_str()).copied().unwrap_or(0);
            lower.new_word(symbol.name, symbol.kind, symbol.bytes, initial);
        }
    }
    if program.elements().any(|(_, element, _)| matches!(element, Element::MasterRelay)) {
        let master = lower.new_bit("master".to_owned(), BitRole::Temporary);
        lower.master = Some(master);
        lower.ir.begin.push(Op::Put { bit: master, value: true });
    }
    lower.parts();
    lower.presets();
    for (number, rung) in program.rungs.iter().enumerate() {
        lower.at = ElementId { rung: number as u32, index: 0 };
        lower.next = 0;
        lower.steps = Vec::new();
        match lower.master {
            Some(bit) => lower.push(Op::Load { bit, negated: false }),
            None => lower.push(Op::Acc(true)),
        }
        lower.series(&rung.series, 0);
        let steps = std::mem::take(&mut lower.steps);
        lower.ir.rungs.push(RungCode { elements: lower.next, steps });
    }
    lower.ir
}

struct Lower<'a> {
    program: &'a Program,
    ir: Ir,
    bits: HashMap<String, Bit>,
    words: HashMap<String, Word>,
    /// Rung-in and rung-out of the groups, by nesting depth.
    groups: Vec<(Bit, Bit)>,
    master: Option<Bit>,
    /// The duty and whether one was given in this scan, where several elements set it.
    duty: Option<(Word, Bit)>,
    /// Zero in the first scan, one afterwards: for timers that cannot be preset before the rungs.
    scanned: Option<Bit>,
    /// The TOF elements that are preset before the rungs.
    preset: Vec<ElementId>,
    /// The transmitter and the EEPROM, where the program uses them.
    busy: Option<Busy>,
    writing: Option<(Word, i32)>,
    /// Where the next PERSIST has its cells.
    cells: std::vec::IntoIter<(u16, u8)>,
    /// What counters start with, and RES stores.
    starts: HashMap<&'a str, i32>,
    /// Timers and counters stay whole.
    modules: bool,
    /// Counters have the bounds of dialect `ldmicro-5`.
    bounded: bool,
    at: ElementId,
    next: u32,
    steps: Vec<Step>,
}

impl<'a> Lower<'a> {
    fn new(program: &'a Program, modules: bool) -> Self {
        Lower {
            program,
            ir: Ir::default(),
            bits: HashMap::new(),
            words: HashMap::new(),
            groups: Vec::new(),
            master: None,
            duty: None,
            scanned: None,
            preset: Vec::new(),
            busy: None,
            writing: None,
            cells: eeprom(program).into_iter(),
            starts: timing::starts(program),
            modules,
            bounded: program.dialect == Dialect::Ldmicro5,
            at: ElementId { rung: 0, index: 0 },
            next: 0,
            steps: Vec::new(),
        }
    }

    fn push(&mut self, op: Op) {
        self.steps.push(Step { at: self.at, op });
    }

    fn new_bit(&mut self, name: String, role: BitRole) -> Bit {
        self.ir.bits.push(BitCell { name, role });
        Bit(self.ir.bits.len() as u32 - 1)
    }

    fn symbol_bit(&mut self, name: &str) -> Bit {
        if let Some(&bit) = self.bits.get(name) {
            return bit;
        }
        let role = match ladder::symbols::by_letter(name) {
            SymbolKind::Input => BitRole::Input,
            SymbolKind::Output => BitRole::Output,
            _ => BitRole::Relay,
        };
        let bit = self.new_bit(name.to_owned(), role);
        self.bits.insert(name.to_owned(), bit);
        bit
    }

    fn word(&mut self, name: &str) -> Word {
        if let Some(&word) = self.words.get(name) {
            return word;
        }
        self.new_word(name.to_owned(), SymbolKind::Variable, 2, 0)
    }

    fn new_word(&mut self, name: String, kind: SymbolKind, bytes: u8, initial: i32) -> Word {
        let word = self.cell(name.clone(), WordRole::Symbol(kind), bytes, initial);
        self.words.insert(name, word);
        word
    }

    fn cell(&mut self, name: String, role: WordRole, bytes: u8, initial: i32) -> Word {
        self.ir.words.push(WordCell { name, role, bytes, initial });
        Word(self.ir.words.len() as u32 - 1)
    }

    /// An integer for the moment; the same `use_` and width give the same one.
    fn temporary(&mut self, use_: &str, bytes: u8) -> Word {
        let name = format!("{use_}.{bytes}");
        if let Some(at) = self.ir.words.iter().position(|w| w.role == WordRole::Temporary && w.name == name) {
            return Word(at as u32);
        }
        self.cell(name, WordRole::Temporary, bytes, 0)
    }

    fn value(&mut self, operand: &Operand) -> Value {
        match operand {
            Operand::Var(name) => Value::Cell(self.word(name)),
            Operand::Const { value, .. } => Value::Const(*value as i32),
        }
    }

    /// The name of something that belongs to the element.
    fn named(&self, what: &str) -> String {
        format!("{what}({}.{})", self.at.rung + 1, self.at.index + 1)
    }

    /// A bit of this element that lasts from scan to scan.
    fn memory(&mut self) -> Bit {
        self.new_bit(self.named("edge"), BitRole::Memory)
    }

    fn series(&mut self, nodes: &[Node], depth: usize) {
        for node in nodes {
            match node {
                Node::Leaf(element, _) => {
                    self.at.index = self.next;
                    self.next += 1;
                    self.element(element);
                }
                Node::Parallel(branches, _) => self.parallel(branches, depth),
            }
        }
    }

    /// Each branch starts from the group's rung-in, in order; rung-out is the OR of the branches.
    fn parallel(&mut self, branches: &[Vec<Node>], depth: usize) {
        self.at.index = self.next;
        if self.groups.len() <= depth {
            let input = self.new_bit(format!("in{depth}"), BitRole::Temporary);
            let output = self.new_bit(format!("out{depth}"), BitRole::Temporary);
            self.groups.push((input, output));
        }
        let (input, output) = self.groups[depth];
        // Branches that only ever narrow the rung state and touch nothing else are the same when computed from true and
        // joined with rung-in afterwards, which keeps plain ORs of contacts plain.
        let pure = branches.iter().flatten().all(is_pure);
        self.push(Op::Store { bit: input, negated: false });
        for (i, branch) in branches.iter().enumerate() {
            match (pure, i) {
                (true, _) => self.push(Op::Acc(true)),
                (false, 0) => {}
                (false, _) => self.push(Op::Load { bit: input, negated: false }),
            }
            self.series(branch, depth + 1);
            if i > 0 {
                self.push(Op::Or { bit: output, negated: false });
            }
            if i + 1 < branches.len() {
                self.push(Op::Store { bit: output, negated: false });
            }
        }
        if pure {
            self.push(Op::And { bit: input, negated: false });
        }
    }

    fn element(&mut self, element: &Element) {
        match element {
            Element::Contacts { name, negated, .. } => {
                let bit = self.symbol_bit(name);
                self.push(Op::And { bit, negated: *negated });
            }
            Element::Coil { name, negated, set, reset, .. } => {
                let bit = self.symbol_bit(name);
                self.push(match (set, reset) {
                    (true, _) => when(vec![Op::Put { bit, value: true }]),
                    (_, true) => when(vec![Op::Put { bit, value: false }]),
                    _ => Op::Store { bit, negated: *negated },
                });
            }
            Element::Open => self.push(Op::Acc(false)),
            Element::MasterRelay => self.master_relay(),
            Element::Osr => {
                let memory = self.memory();
                self.push(Op::Rising(memory));
            }
            Element::Osf => {
                let memory = self.memory();
                self.push(Op::Falling(memory));
            }
            Element::Timer { kind, name, delay, adjust } => self.timer(*kind, name, delay, adjust.as_ref()),
            Element::Counter { kind, name, max, init, input } => {
                self.counter(*kind, name, max, (init.as_ref(), *input));
            }
            Element::Res { name } => {
                let (dst, start) = (self.word(name), self.starts.get(name.as_str()).copied().unwrap_or(0));
                self.push(when(vec![Op::Move { dst, src: Value::Const(start) }]));
            }
            Element::Move { dest, src } => {
                let op = Op::Move { dst: self.word(dest), src: self.value(src) };
                self.push(when(vec![op]));
            }
            Element::Math { op, dest, op1, op2 } => {
                let op = match op {
                    MathOp::Add => Math::Add,
                    MathOp::Sub => Math::Sub,
                    MathOp::Mul => Math::Mul,
                    MathOp::Div => Math::Div,
                };
                let op = Op::Math { op, dst: self.word(dest), a: self.value(op1), b: self.value(op2) };
                self.push(when(vec![op]));
            }
            Element::Compare { op, op1, op2 } => {
                let (a, b) = (self.value(op1), self.value(op2));
                let ops = self.narrow(*op, a, b);
                ops.into_iter().for_each(|op| self.push(op));
            }
            Element::ShiftRegister { name, stages } => self.shift(name, *stages),
            Element::LookUpTable { dest, index, values, .. } => self.look_up(dest, index, values),
            Element::PiecewiseLinear { dest, index, points } => self.piecewise(dest, index, points),
            Element::ReadAdc { name, .. } => self.read_adc(name),
            Element::SetPwm { duty, .. } => self.set_pwm(duty),
            Element::UartSend { name, .. } => self.send(name),
            Element::UartRecv { name, .. } => {
                let dst = self.word(name);
                self.push(when(vec![Op::Receive { dst }]));
            }
            Element::FormattedString { var, text, quoted } => self.string(var.as_deref(), text, *quoted),
            Element::Persist { name } => self.persist(name),
            // SHORT passes, COMMENT means nothing, and PLACEHOLDER never gets here.
            Element::Short | Element::Comment(_) | Element::Placeholder => {}
        }
    }

    /// acc := acc and the comparison.
    fn narrow(&self, op: CompareOp, a: Value, b: Value) -> Vec<Op> {
        match self.relation(op, a, b) {
            Relation::Always(true) => Vec::new(),
            Relation::Always(false) => vec![Op::Acc(false)],
            Relation::Compare(compare) => vec![Op::AndCompare(compare)],
        }
    }

    /// `then` where the comparison holds.
    fn where_(&self, op: CompareOp, a: Value, b: Value, then: Vec<Op>, otherwise: Vec<Op>) -> Vec<Op> {
        match self.relation(op, a, b) {
            Relation::Always(true) => then,
            Relation::Always(false) => otherwise,
            Relation::Compare(compare) => vec![Op::If { cond: Cond::Compare(compare), then, otherwise }],
        }
    }

    /// Off: turned on whatever the rung says; on: becomes the rung state.
    fn master_relay(&mut self) {
        if let Some(bit) = self.master {
            self.push(Op::If {
                cond: Cond::Bit(bit),
                then: vec![Op::Store { bit, negated: false }],
                otherwise: vec![Op::Put { bit, value: true }],
            });
        }
    }
}

/// `ops` when the accumulator is true.
fn when(ops: Vec<Op>) -> Op {
    Op::If { cond: Cond::Acc, then: ops, otherwise: Vec::new() }
}

/// One more, or one less.
fn add(word: Word, op: Math) -> Op {
    Op::Math { op, dst: word, a: Value::Cell(word), b: Value::Const(1) }
}

/// True for nodes that narrow the rung state and do nothing else.
fn is_pure(node: &Node) -> bool {
    match node {
        Node::Leaf(element, _) => matches!(
            element,
            Element::Contacts { .. } | Element::Compare { .. } | Element::Short | Element::Open | Element::Comment(_)
        ),
        Node::Parallel(branches, _) => branches.iter().flatten().all(is_pure),
    }
}
