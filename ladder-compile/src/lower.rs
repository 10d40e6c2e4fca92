//! From the model to intermediate code: what each element means, told once for all targets.
//!
//! Written from the language's documents (LDmicro release 2.3): the rung state is the accumulator, every element
//! transforms it, and every element is executed in every scan. Nothing here is clever; [`crate::optimise`] removes what
//! is not needed.

use std::collections::HashMap;

use ladder::{
    CompareOp, CounterKind, Dialect, Element, ElementId, MathOp, Node, Operand, Program, SymbolKind, TimerKind,
};

use crate::ir::{
    Bit, BitCell, BitRole, Compare, Cond, Ir, Math, Module, Op, Rel, RungCode, Step, Value, Word, WordCell, WordRole,
};

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
    let mut lower = Lower::new(program.settings.cycle_us);
    lower.modules = modules;
    lower.bounded = program.dialect == Dialect::Ldmicro5;
    for symbol in program.symbols() {
        if symbol.kind.is_bit() {
            lower.symbol_bit(&symbol.name);
        } else {
            lower.new_word(symbol.name, symbol.kind);
        }
    }
    if program.elements().any(|(_, element, _)| matches!(element, Element::MasterRelay)) {
        let master = lower.new_bit("master".to_owned(), BitRole::Temporary);
        lower.master = Some(master);
        lower.ir.begin.push(Op::Put { bit: master, value: true });
    }
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
    if let Some(bit) = lower.scanned {
        lower.ir.end.push(Op::Put { bit, value: true });
    }
    lower.ir
}

struct Lower {
    ir: Ir,
    bits: HashMap<String, Bit>,
    words: HashMap<String, Word>,
    /// Rung-in and rung-out of the groups, by nesting depth.
    groups: Vec<(Bit, Bit)>,
    /// A temporary for counters that pass their rung-in on.
    spare: Option<Bit>,
    master: Option<Bit>,
    /// Zero in the first scan, one afterwards.
    scanned: Option<Bit>,
    cycle_us: u64,
    /// Timers and counters stay whole.
    modules: bool,
    /// Counters have the bounds of dialect `ldmicro-5`.
    bounded: bool,
    at: ElementId,
    next: u32,
    steps: Vec<Step>,
}

impl Lower {
    fn new(cycle_us: u64) -> Self {
        Lower {
            ir: Ir::default(),
            bits: HashMap::new(),
            words: HashMap::new(),
            groups: Vec::new(),
            spare: None,
            master: None,
            scanned: None,
            cycle_us,
            modules: false,
            bounded: false,
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
        self.new_word(name.to_owned(), SymbolKind::Variable)
    }

    fn new_word(&mut self, name: String, kind: SymbolKind) -> Word {
        let word = Word(self.ir.words.len() as u32);
        self.words.insert(name.clone(), word);
        self.ir.words.push(WordCell { name, role: WordRole::Symbol(kind), bytes: 2, initial: 0 });
        word
    }

    fn value(&mut self, operand: &Operand) -> Value {
        match operand {
            Operand::Var(name) => Value::Cell(self.word(name)),
            Operand::Const { value, .. } => Value::Const(*value as i32),
        }
    }

    /// A bit of this element that lasts from scan to scan.
    fn memory(&mut self) -> Bit {
        let name = format!("edge({}.{})", self.at.rung + 1, self.at.index + 1);
        self.new_bit(name, BitRole::Memory)
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
            Element::Timer { kind, name, delay, .. } => {
                let word = self.word(name);
                // A timer that cannot be counted was refused before.
                let Some(limit) = scans(delay, self.cycle_us) else { return };
                if self.modules {
                    self.push(Op::Module { is: Module::Timer(*kind), word, limit: Value::Const(limit.into()) });
                } else {
                    self.timer(*kind, word, limit.into());
                }
            }
            Element::Counter { kind, name, max, input, .. } => {
                let word = self.word(name);
                let max = self.value(max);
                if self.modules {
                    let is = Module::Counter { kind: *kind, input: input.unwrap_or('/'), bounded: self.bounded };
                    self.push(Op::Module { is, word, limit: max });
                } else {
                    self.counter(*kind, word, max);
                }
            }
            Element::Res { name } => {
                let dst = self.word(name);
                self.push(when(vec![Op::Move { dst, src: Value::Const(0) }]));
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
                match relation(*op, a, b) {
                    Relation::Always(true) => {}
                    Relation::Always(false) => self.push(Op::Acc(false)),
                    Relation::Compare(compare) => self.push(Op::AndCompare(compare)),
                }
            }
            // SHORT passes and COMMENT means nothing; the others never get here.
            _ => {}
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

    fn timer(&mut self, kind: TimerKind, word: Word, limit: i32) {
        let running = Cond::Compare(Compare { a: word, rel: Rel::Lt, b: Value::Const(limit) });
        let count = add(word, Math::Add);
        let clear = Op::Move { dst: word, src: Value::Const(0) };
        match kind {
            TimerKind::Ton => self.push(Op::If {
                cond: Cond::Acc,
                then: vec![Op::If { cond: running, then: vec![count, Op::Acc(false)], otherwise: vec![] }],
                otherwise: vec![clear],
            }),
            TimerKind::Tof => {
                // Every element is executed in every scan, so "for the first time" is "in the first scan".
                let scanned = match self.scanned {
                    Some(bit) => bit,
                    None => self.new_bit("scanned".to_owned(), BitRole::Memory),
                };
                self.scanned = Some(scanned);
                let preset = Op::Move { dst: word, src: Value::Const(limit) };
                self.push(Op::If { cond: Cond::Bit(scanned), then: vec![], otherwise: vec![preset] });
                self.push(Op::If {
                    cond: Cond::Acc,
                    then: vec![clear],
                    otherwise: vec![Op::If { cond: running, then: vec![count, Op::Acc(true)], otherwise: vec![] }],
                });
            }
            TimerKind::Rto => self.push(Op::If {
                cond: running,
                then: vec![when(vec![count]), Op::Acc(false)],
                otherwise: vec![Op::Acc(true)],
            }),
        }
    }

    fn counter(&mut self, kind: CounterKind, word: Word, max: Value) {
        let memory = self.memory();
        let full = relation(CompareOp::Geq, Value::Cell(word), max);
        if kind == CounterKind::Ctc {
            let spare = match self.spare {
                Some(bit) => bit,
                None => self.new_bit("spare".to_owned(), BitRole::Temporary),
            };
            self.spare = Some(spare);
            let (wrap, count) = (Op::Move { dst: word, src: Value::Const(0) }, add(word, Math::Add));
            let turn = match full {
                Relation::Always(true) => wrap,
                Relation::Always(false) => count,
                Relation::Compare(compare) => {
                    Op::If { cond: Cond::Compare(compare), then: vec![wrap], otherwise: vec![count] }
                }
            };
            self.push(Op::Store { bit: spare, negated: false });
            self.push(Op::Rising(memory));
            self.push(when(vec![turn]));
            self.push(Op::Load { bit: spare, negated: false });
        } else {
            self.push(Op::Rising(memory));
            self.push(when(vec![add(word, if kind == CounterKind::Ctd { Math::Sub } else { Math::Add })]));
            match full {
                Relation::Always(value) => self.push(Op::Acc(value)),
                Relation::Compare(compare) => {
                    self.push(Op::Acc(true));
                    self.push(Op::AndCompare(compare));
                }
            }
        }
    }
}

/// The number of scans that a timer counts: delay / cycle, truncated, less one; `None` outside of 1..=32767 or where the
/// delay is no constant.
#[must_use]
pub fn scans(delay: &Operand, cycle_us: u64) -> Option<i16> {
    let Operand::Const { value, .. } = delay else { return None };
    let delay = u64::try_from(*value).ok()?;
    let scans = i16::try_from(delay.checked_div(cycle_us)?.checked_sub(1)?).ok()?;
    (scans >= 1).then_some(scans)
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

enum Relation {
    Always(bool),
    Compare(Compare),
}

/// The lowest and the highest integer.
const LOWEST: i32 = i16::MIN as i32;
const HIGHEST: i32 = i16::MAX as i32;

/// A comparison of the language as one of the four relations with a cell on its left.
fn relation(op: CompareOp, left: Value, right: Value) -> Relation {
    use CompareOp::{Equ, Geq, Grt, Leq, Les, Neq};
    let make = |a, rel, b| Relation::Compare(Compare { a, rel, b });
    match (left, right) {
        (Value::Const(a), Value::Const(b)) => Relation::Always(match op {
            Equ => a == b,
            Neq => a != b,
            Grt => a > b,
            Geq => a >= b,
            Les => a < b,
            Leq => a <= b,
        }),
        (Value::Const(_), Value::Cell(_)) => {
            let mirrored = match op {
                Grt => Les,
                Geq => Leq,
                Les => Grt,
                Leq => Geq,
                same => same,
            };
            relation(mirrored, right, left)
        }
        (Value::Cell(a), Value::Cell(b)) => match op {
            Equ => make(a, Rel::Eq, right),
            Neq => make(a, Rel::Ne, right),
            Les => make(a, Rel::Lt, right),
            Geq => make(a, Rel::Ge, right),
            Grt => make(b, Rel::Lt, left),
            Leq => make(b, Rel::Ge, left),
        },
        (Value::Cell(a), Value::Const(b)) => match op {
            Equ => make(a, Rel::Eq, right),
            Neq => make(a, Rel::Ne, right),
            // No number is below the lowest, none above the highest.
            Les if b == LOWEST => Relation::Always(false),
            Geq if b == LOWEST => Relation::Always(true),
            Les => make(a, Rel::Lt, right),
            Geq => make(a, Rel::Ge, right),
            Grt if b == HIGHEST => Relation::Always(false),
            Leq if b == HIGHEST => Relation::Always(true),
            Grt => make(a, Rel::Ge, Value::Const(b + 1)),
            Leq => make(a, Rel::Lt, Value::Const(b + 1)),
        },
    }
}
