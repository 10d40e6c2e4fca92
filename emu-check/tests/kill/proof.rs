//! Proves that the intermediate code of a faulty compiler has the same meaning. One scan of both codes is
//! executed symbolically with an unknown state at its start, bits as decision diagrams and integers as terms.
//! Both must end with the same bits and terms in everything that outlasts the scan.
//!
//! Codes without a proof may still have the same meaning: terms know only arithmetic of constants, and the
//! only invariants known are which memories of elements are always 0 or always equal.

mod parts;

use std::collections::{HashMap, HashSet};

use ladder_compile::ir::{
    ArithmeticOp, BitId, BitRole, BranchCondition, Ir, IrOp, LogicOp, RelationOp, WordComparison, WordId, WordOperand,
    WordRole,
};

/// Number of nodes after which a proof is given up.
const MAX_NODES: usize = 400_000;

/// The condition that a node of a decision diagram tests.
#[derive(Clone, PartialEq, Eq, Hash)]
enum DiagramQuestion {
    /// A bit at the start of the scan, and its owner: [`BOTH`], unless its value has no meaning at that time.
    Bit(u32, usize),
    Acc(usize),
    Equal(usize, usize),
    Less(usize, usize),
    /// The term is not 0.
    True(usize),
}

#[derive(Clone, PartialEq, Eq, Hash)]
enum IntegerTerm {
    /// An integer at the start of the scan: its number, its width in bytes, and its owner.
    Cell(u32, u8, usize),
    Const(i32),
    /// A choice between two terms by a diagram.
    If(usize, usize, usize),
    /// An uninterpreted function of other terms; it equals only itself.
    Of(String, Vec<usize>),
}

/// The owner of values that both codes see, and of the correct code.
const BOTH: usize = 2;

/// All diagrams and terms, each stored once, so that equal numbers mean equal values.
struct ProofSpace {
    /// (Question, diagram for no, diagram for yes). Node 0 is false and node 1 is true.
    nodes: Vec<(usize, usize, usize)>,
    known: HashMap<(usize, usize, usize), usize>,
    chosen: HashMap<(usize, usize, usize), usize>,
    questions: HashMap<DiagramQuestion, usize>,
    terms: Vec<IntegerTerm>,
    numbers: HashMap<IntegerTerm, usize>,
    related: HashMap<(usize, usize, bool), usize>,
    fitted: HashMap<(usize, u8), usize>,
    /// True if timers and counters are modules, which notice a write to their integer.
    modules: bool,
    gave_up: bool,
}

/// The symbolic state during a scan.
#[derive(Clone, PartialEq, Eq)]
struct SymbolicState {
    acc: usize,
    bits: Vec<usize>,
    words: Vec<usize>,
    /// State of the modules, by their integer.
    modules: Vec<usize>,
    /// The history of everything that happened to the peripherals.
    parts: usize,
}

/// True if the two codes of one program are proved to have the same meaning.
pub fn same_meaning(sound: &Ir, faulty: &Ir) -> bool {
    let modules = sound.rungs.iter().flat_map(|rung| &rung.steps).any(|step| matches!(step.op, IrOp::Module { .. }));
    let mut space = ProofSpace {
        nodes: vec![(usize::MAX, 0, 0), (usize::MAX, 1, 1)],
        known: HashMap::new(),
        chosen: HashMap::new(),
        questions: HashMap::new(),
        terms: Vec::new(),
        numbers: HashMap::new(),
        related: HashMap::new(),
        fitted: HashMap::new(),
        modules,
        gave_up: false,
    };
    let known = space.known_of(sound);
    // A memory that the faulty code uses differently has no meaning, as long as nothing else depends on its
    // value.
    let mut loose = HashSet::new();
    loop {
        let (one, other) = (space.scan(sound, BOTH, &known, &loose), space.scan(faulty, 1, &known, &loose));
        if space.gave_up {
            return false;
        }
        let (one, other) = (lasting_values(sound, &one), lasting_values(sound, &other));
        let more: HashSet<LastingCell> = one
            .iter()
            .filter(|(cell, holds)| !loose.contains(*cell) && other.get(*cell) != Some(*holds))
            .map(|(cell, _)| *cell)
            .collect();
        if more.is_empty() {
            return true;
        }
        if !more.iter().all(|cell| cell.is_memory(sound)) {
            return false;
        }
        loose.extend(more);
    }
}

/// Something that outlasts the scan.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum LastingCell {
    Bit(usize),
    Word(usize),
    Module(usize),
    Parts,
}

impl LastingCell {
    /// True if only the code itself reads the cell.
    fn is_memory(self, ir: &Ir) -> bool {
        match self {
            LastingCell::Bit(n) => ir.bits[n].role == BitRole::Memory,
            LastingCell::Word(n) => ir.words[n].role == WordRole::Memory,
            LastingCell::Module(_) | LastingCell::Parts => false,
        }
    }
}

/// The values of everything that outlasts the scan.
fn lasting_values(ir: &Ir, state: &SymbolicState) -> HashMap<LastingCell, usize> {
    let bits = ir.bits.iter().zip(&state.bits).enumerate().filter(|(_, (cell, _))| cell.role != BitRole::Temporary);
    let words = ir.words.iter().zip(&state.words).enumerate().filter(|(_, (cell, _))| cell.role != WordRole::Temporary);
    let modules = state.modules.iter().enumerate().map(|(n, holds)| (LastingCell::Module(n), *holds));
    bits.map(|(n, (_, holds))| (LastingCell::Bit(n), *holds))
        .chain(words.map(|(n, (_, holds))| (LastingCell::Word(n), *holds)))
        .chain(modules)
        .chain([(LastingCell::Parts, state.parts)])
        .collect()
}

impl ProofSpace {
    /// The invariants of the memories at the start of every scan: those that are 0 (`None`), and those that
    /// equal another one.
    fn known_of(&mut self, ir: &Ir) -> HashMap<usize, Option<usize>> {
        let memory = |n: &usize| ir.bits[*n].role == BitRole::Memory;
        let mut known: HashMap<usize, Option<usize>> = (0..ir.bits.len()).filter(memory).map(|n| (n, None)).collect();
        loop {
            let after = self.scan(ir, BOTH, &known, &HashSet::new());
            // Memories that were equal stay equal if they end equal; the first of them represents all.
            let mut first: HashMap<(Option<usize>, usize), usize> = HashMap::new();
            let mut next = HashMap::new();
            for n in (0..ir.bits.len()).filter(memory) {
                let (was, holds) = (known[&n], after.bits[n]);
                let is = if was.is_none() && holds == 0 { None } else { Some(*first.entry((was, holds)).or_insert(n)) };
                next.insert(n, is);
            }
            if next == known || self.gave_up {
                return known;
            }
            known = next;
        }
    }

    /// Executes one scan of `ir`. Cells without a meaning at its start, which are temporaries and the cells
    /// of `loose`, are owned by `own`.
    fn scan(
        &mut self,
        ir: &Ir,
        own: usize,
        known: &HashMap<usize, Option<usize>>,
        loose: &HashSet<LastingCell>,
    ) -> SymbolicState {
        let mut bits = Vec::new();
        for (n, cell) in ir.bits.iter().enumerate() {
            let is = known.get(&n).copied().unwrap_or(Some(n));
            let bit = match is {
                _ if loose.contains(&LastingCell::Bit(n)) && own != BOTH => {
                    self.question_diagram(DiagramQuestion::Bit(n as u32, own))
                }
                None => 0,
                Some(_) if cell.role == BitRole::Temporary => {
                    self.question_diagram(DiagramQuestion::Bit(n as u32, own))
                }
                Some(n) => self.question_diagram(DiagramQuestion::Bit(n as u32, BOTH)),
            };
            bits.push(bit);
        }
        let (mut words, mut modules) = (Vec::new(), Vec::new());
        for (cell, n) in ir.words.iter().zip(0..) {
            let loose = cell.role == WordRole::Temporary || loose.contains(&LastingCell::Word(n as usize));
            words.push(self.term(IntegerTerm::Cell(n, cell.bytes, if loose { own } else { BOTH })));
            modules.push(self.opaque_term(&format!("module {n}"), &[]));
        }
        let mut state = SymbolicState {
            acc: self.question_diagram(DiagramQuestion::Acc(own)),
            bits,
            words,
            modules,
            parts: self.opaque_term("parts", &[]),
        };
        let rungs = ir.rungs.iter().flat_map(|rung| &rung.steps).map(|step| &step.op);
        for op in ir.prologue.iter().chain(rungs).chain(&ir.epilogue) {
            if !self.gave_up {
                self.run(ir, op, &mut state);
            }
        }
        state
    }

    fn run(&mut self, ir: &Ir, op: &IrOp, s: &mut SymbolicState) {
        match op {
            IrOp::SetAccumulator(value) => s.acc = usize::from(*value),
            IrOp::Load { bit, negated } => s.acc = self.bit(s, *bit, *negated),
            IrOp::And { bit, negated } => {
                let bit = self.bit(s, *bit, *negated);
                s.acc = self.choose_diagram(s.acc, bit, 0);
            }
            IrOp::Or { bit, negated } => {
                let bit = self.bit(s, *bit, *negated);
                s.acc = self.choose_diagram(s.acc, 1, bit);
            }
            IrOp::Store { bit, negated } => {
                s.bits[bit.0 as usize] = if *negated { self.choose_diagram(s.acc, 0, 1) } else { s.acc };
            }
            IrOp::SetBit { bit, value } => s.bits[bit.0 as usize] = usize::from(*value),
            IrOp::Rising(bit) => {
                let was = std::mem::replace(&mut s.bits[bit.0 as usize], s.acc);
                let not = self.choose_diagram(was, 0, 1);
                s.acc = self.choose_diagram(s.acc, not, 0);
            }
            IrOp::Falling(bit) => {
                let was = std::mem::replace(&mut s.bits[bit.0 as usize], s.acc);
                s.acc = self.choose_diagram(s.acc, 0, was);
            }
            IrOp::AndCompare(compare) => {
                let holds = self.compare(s, compare);
                s.acc = self.choose_diagram(s.acc, holds, 0);
            }
            IrOp::Move { dst, src } => {
                let value = self.value(s, *src);
                if self.modules {
                    let module = &mut s.modules[dst.0 as usize];
                    *module = self.opaque_term("moved", &[*module, value]);
                }
                self.set(ir, s, *dst, value);
            }
            IrOp::Math { op, dst, a, b } => {
                let width = ir.width(*op, *dst, *a, *b);
                let (a, b) = (self.value(s, *a), self.value(s, *b));
                let value = self.math(*op, a, b, width);
                self.set(ir, s, *dst, value);
            }
            IrOp::Logic { dst, function: is } => {
                s.bits[dst.0 as usize] = match *is {
                    LogicOp::Copy(a) => self.bit(s, a, false),
                    LogicOp::Not(a) => self.bit(s, a, true),
                    LogicOp::And(a, b) => self.choose_diagram(s.bits[a.0 as usize], s.bits[b.0 as usize], 0),
                    LogicOp::Or(a, b) => self.choose_diagram(s.bits[a.0 as usize], 1, s.bits[b.0 as usize]),
                };
            }
            IrOp::Lookup { dst, index, table } => {
                let table = &ir.tables[*table as usize];
                let value =
                    self.opaque_term(&format!("{} {:?}", table.bytes, table.values), &[s.words[index.0 as usize]]);
                self.set(ir, s, *dst, value);
            }
            // A voltage is constant during a scan.
            IrOp::ReadAdc { dst, input } => {
                let value = self.opaque_term(&format!("adc {input}"), &[]);
                self.set(ir, s, *dst, value);
            }
            IrOp::SetPwm { output, duty } => self.record_output(&format!("duty {output}"), *duty, s),
            IrOp::Send { value } => self.record_output("send", *value, s),
            IrOp::Receive { dst } => {
                let (waits, byte) = (self.opaque_term("waits", &[s.parts]), self.opaque_term("byte", &[s.parts]));
                s.acc = self.question_diagram(DiagramQuestion::True(waits));
                let value = self.choose_term(s.acc, byte, s.words[dst.0 as usize]);
                self.set(ir, s, *dst, value);
                s.parts = self.opaque_term("received", &[s.parts]);
            }
            IrOp::WaitSent => s.parts = self.opaque_term("wait", &[s.parts]),
            IrOp::Transfer { action: a, register: r, value: v, dst } => self.record_transfer(ir, s, (*a, *r, *v), *dst),
            IrOp::ReadEeprom { dst, addr } => {
                let value = self.opaque_term(&format!("cell {addr} {}", ir.words[dst.0 as usize].bytes), &[s.parts]);
                self.set(ir, s, *dst, value);
            }
            IrOp::WriteEeprom { src, addr, busy, scans } => {
                let how = format!("{addr} {scans} {}", ir.words[src.0 as usize].bytes);
                let from = [s.words[src.0 as usize], s.words[busy.0 as usize], s.parts];
                let value = self.opaque_term(&format!("busy {how}"), &from);
                self.set(ir, s, *busy, value);
                s.parts = self.opaque_term(&format!("persist {how}"), &from);
            }
            IrOp::Module { module: is, word, limit } => {
                let (one, none) = (self.term(IntegerTerm::Const(1)), self.term(IntegerTerm::Const(0)));
                let acc = self.choose_term(s.acc, one, none);
                let at = word.0 as usize;
                let from = [acc, s.words[at], s.modules[at], self.value(s, *limit)];
                let [q, value, module] =
                    ["q", "value", "state"].map(|part| self.opaque_term(&format!("{part} {is:?}"), &from));
                s.acc = self.question_diagram(DiagramQuestion::True(q));
                self.set(ir, s, *word, value);
                s.modules[at] = module;
            }
            IrOp::Label(_) | IrOp::Jump { .. } => self.gave_up = true,
            IrOp::If { cond, if_true: then, if_false: otherwise } => {
                let holds = match cond {
                    BranchCondition::Acc => s.acc,
                    BranchCondition::Bit(bit) => self.bit(s, *bit, false),
                    BranchCondition::Compare(compare) => self.compare(s, compare),
                };
                let mut no = s.clone();
                then.iter().for_each(|op| self.run(ir, op, s));
                otherwise.iter().for_each(|op| self.run(ir, op, &mut no));
                s.acc = self.choose_diagram(holds, s.acc, no.acc);
                s.bits.iter_mut().zip(no.bits).for_each(|(yes, no)| *yes = self.choose_diagram(holds, *yes, no));
                s.words.iter_mut().zip(no.words).for_each(|(yes, no)| *yes = self.choose_term(holds, *yes, no));
                s.modules.iter_mut().zip(no.modules).for_each(|(yes, no)| *yes = self.choose_term(holds, *yes, no));
                s.parts = self.choose_term(holds, s.parts, no.parts);
            }
        }
    }

    /// Records a value that goes out through a peripheral.
    fn bit(&mut self, s: &SymbolicState, bit: BitId, negated: bool) -> usize {
        let bit = s.bits[bit.0 as usize];
        if negated { self.choose_diagram(bit, 0, 1) } else { bit }
    }

    fn value(&mut self, s: &SymbolicState, value: WordOperand) -> usize {
        match value {
            WordOperand::Cell(word) => s.words[word.0 as usize],
            WordOperand::Const(value) => self.term(IntegerTerm::Const(value)),
        }
    }

    fn set(&mut self, ir: &Ir, s: &mut SymbolicState, word: WordId, value: usize) {
        s.words[word.0 as usize] = self.truncate_term(value, ir.words[word.0 as usize].bytes);
    }

    /// A term truncated to `bytes` bytes.
    fn truncate_term(&mut self, term: usize, bytes: u8) -> usize {
        if let Some(known) = self.fitted.get(&(term, bytes)) {
            return *known;
        }
        let fitted = match self.terms[term].clone() {
            IntegerTerm::Const(value) => self.term(IntegerTerm::Const(wrapped(value.into(), bytes))),
            IntegerTerm::Cell(_, own, _) if own <= bytes => term,
            IntegerTerm::If(by, yes, no) => {
                let (yes, no) = (self.truncate_term(yes, bytes), self.truncate_term(no, bytes));
                self.choose_term(by, yes, no)
            }
            IntegerTerm::Cell(..) | IntegerTerm::Of(..) => self.opaque_term(&format!("bytes {bytes}"), &[term]),
        };
        self.fitted.insert((term, bytes), fitted);
        fitted
    }

    fn math(&mut self, op: ArithmeticOp, a: usize, b: usize, bytes: u8) -> usize {
        let (IntegerTerm::Const(x), IntegerTerm::Const(y)) = (&self.terms[a], &self.terms[b]) else {
            return self.opaque_term(&format!("{op:?} {bytes}"), &[a, b]);
        };
        let (x, y) = (i64::from(*x), i64::from(*y));
        let value = match op {
            ArithmeticOp::Add => x + y,
            ArithmeticOp::Sub => x - y,
            ArithmeticOp::Mul => x * y,
            ArithmeticOp::Div if y == 0 => 1 - 2 * i64::from(x >= 0),
            ArithmeticOp::Div => x / y,
            ArithmeticOp::And => x & y,
            ArithmeticOp::Or => x | y,
            ArithmeticOp::Xor => x ^ y,
            ArithmeticOp::Shr => (x & ((1 << (8 * u32::from(bytes))) - 1)) >> y.clamp(0, 63),
        };
        self.term(IntegerTerm::Const(wrapped(value, bytes)))
    }

    fn compare(&mut self, s: &SymbolicState, compare: &WordComparison) -> usize {
        let (a, b) = (s.words[compare.a.0 as usize], self.value(s, compare.b));
        match compare.rel {
            RelationOp::Eq => self.related(a, b, true),
            RelationOp::Lt => self.related(a, b, false),
            RelationOp::Ne | RelationOp::Ge => {
                let other = self.related(a, b, compare.rel == RelationOp::Ne);
                self.choose_diagram(other, 0, 1)
            }
        }
    }

    /// The diagram of a = b if `equal`, or else of a < b.
    fn related(&mut self, a: usize, b: usize, equal: bool) -> usize {
        if self.gave_up {
            return 0;
        }
        if let Some(known) = self.related.get(&(a, b, equal)) {
            return *known;
        }
        let related = match (self.terms[a].clone(), self.terms[b].clone()) {
            _ if a == b => usize::from(equal),
            (IntegerTerm::Const(x), IntegerTerm::Const(y)) => usize::from(if equal { x == y } else { x < y }),
            (IntegerTerm::If(by, yes, no), _) => {
                let (yes, no) = (self.related(yes, b, equal), self.related(no, b, equal));
                self.choose_diagram(by, yes, no)
            }
            (_, IntegerTerm::If(by, yes, no)) => {
                let (yes, no) = (self.related(a, yes, equal), self.related(a, no, equal));
                self.choose_diagram(by, yes, no)
            }
            _ if equal => self.question_diagram(DiagramQuestion::Equal(a.min(b), a.max(b))),
            _ => self.question_diagram(DiagramQuestion::Less(a, b)),
        };
        self.related.insert((a, b, equal), related);
        related
    }

    fn opaque_term(&mut self, what: &str, terms: &[usize]) -> usize {
        self.term(IntegerTerm::Of(what.to_owned(), terms.to_vec()))
    }

    fn choose_term(&mut self, by: usize, yes: usize, no: usize) -> usize {
        match by {
            0 => no,
            1 => yes,
            _ if yes == no => yes,
            _ => self.term(IntegerTerm::If(by, yes, no)),
        }
    }

    fn term(&mut self, term: IntegerTerm) -> usize {
        let next = self.terms.len();
        self.gave_up |= next > MAX_NODES;
        *self.numbers.entry(term.clone()).or_insert_with(|| {
            self.terms.push(term);
            next
        })
    }

    fn question_diagram(&mut self, question: DiagramQuestion) -> usize {
        let next = self.questions.len();
        let question = *self.questions.entry(question).or_insert(next);
        self.node(question, 0, 1)
    }

    fn node(&mut self, question: usize, no: usize, yes: usize) -> usize {
        if no == yes {
            return no;
        }
        let next = self.nodes.len();
        self.gave_up |= next > MAX_NODES;
        *self.known.entry((question, no, yes)).or_insert_with(|| {
            self.nodes.push((question, no, yes));
            next
        })
    }

    /// The diagram `yes` if `by` is true, or else `no`.
    fn choose_diagram(&mut self, by: usize, yes: usize, no: usize) -> usize {
        match (by, yes, no) {
            (0, ..) => return no,
            (1, ..) => return yes,
            (_, 1, 0) => return by,
            _ if yes == no => return yes,
            _ if self.gave_up => return 0,
            _ => {}
        }
        if let Some(known) = self.chosen.get(&(by, yes, no)) {
            return *known;
        }
        let first = [by, yes, no].map(|n| self.nodes[n].0).into_iter().min().unwrap_or(usize::MAX);
        let [lows, highs] = [false, true].map(|side| {
            [by, yes, no].map(|n| match self.nodes[n] {
                (question, low, high) if question == first => {
                    if side {
                        high
                    } else {
                        low
                    }
                }
                _ => n,
            })
        });
        let low = self.choose_diagram(lows[0], lows[1], lows[2]);
        let high = self.choose_diagram(highs[0], highs[1], highs[2]);
        let chosen = self.node(first, low, high);
        self.chosen.insert((by, yes, no), chosen);
        chosen
    }
}

/// `value` truncated to `bytes` bytes, with sign extension.
fn wrapped(value: i64, bytes: u8) -> i32 {
    let unused = 64 - 8 * u32::from(bytes.clamp(1, 4));
    (value << unused >> unused) as i32
}
