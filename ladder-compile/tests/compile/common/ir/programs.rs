//! Generates random intermediate code with every operation at every width, as valid as the output of
//! lowering.
//!
//! The accumulator and temporaries are written before they are read, indices are within their tables, and the
//! serial line and the EEPROM are used only when they are free.

use std::collections::HashSet;

use emu_core::rng::Rng;
use ladder::{ElementId, SymbolKind};
use ladder_compile::ir::{
    ArithmeticOp, BitCell, BitId, BitRole, BranchCondition, ConstantTable, Ir, IrOp, IrPwm, IrStep, LogicOp,
    RelationOp, RungCode, UartUse, WordCell, WordComparison, WordId, WordOperand, WordRole,
};

/// Kinds of operations besides those on bits, for [`IrLimits::ops`].
pub mod ops {
    pub const MOVE: u32 = 1;
    pub const ADD: u32 = 2;
    pub const MUL: u32 = 4;
    pub const DIV: u32 = 8;
    pub const COMPARE: u32 = 16;
    pub const LOOKUP: u32 = 32;
    pub const IF: u32 = 64;
    /// Unoptimised code: `IrOp::Logic` replaces most operations on the accumulator.
    pub const LOGIC: u32 = 128;
    pub const ADC: u32 = 256;
    pub const PWM: u32 = 512;
    pub const SEND: u32 = 1024;
    pub const RECEIVE: u32 = 2048;
    pub const EEPROM: u32 = 4096;
    pub const BITWISE: u32 = 8192;
    /// All integer operations, no peripherals, optimised form.
    pub const INTEGERS: u32 = MOVE | ADD | MUL | DIV | BITWISE | COMPARE | LOOKUP | IF;
}

/// Limits of a generated program.
#[derive(Debug, Clone, Copy)]
pub struct IrLimits {
    pub ops: u32,
    pub inputs: u32,
    pub outputs: u32,
    /// Relays, edge memories and temporaries: one third each.
    pub bits: u32,
    pub words: u32,
    /// Widths of words in bytes, drawn with equal probability.
    pub widths: &'static [u8],
    pub rungs: u32,
    /// Number of operations per rung, without nested ones.
    pub steps: u32,
    /// Nesting depth of `IrOp::If`.
    pub depth: u32,
    pub tables: u32,
    pub adcs: u32,
    /// Number of scans that a byte takes on the serial line.
    pub byte_scans: i32,
    /// Number of scans that the EEPROM takes per byte.
    pub eeprom_scans: i32,
}

impl IrLimits {
    /// Only bits.
    pub const BITS: IrLimits = IrLimits {
        ops: ops::IF,
        inputs: 4,
        outputs: 4,
        bits: 12,
        words: 0,
        widths: &[2],
        rungs: 6,
        steps: 10,
        depth: 2,
        tables: 0,
        adcs: 0,
        byte_scans: 1,
        eeprom_scans: 1,
    };
    /// Bits and 16-bit integers.
    pub const WORDS: IrLimits = IrLimits { ops: ops::INTEGERS, words: 6, tables: 2, ..IrLimits::BITS };
    /// Integers of every width.
    pub const WIDTHS: IrLimits = IrLimits { widths: &[1, 2, 3, 4], words: 10, ..IrLimits::WORDS };
}

struct IrGenerator<'a> {
    rng: &'a mut Rng,
    limits: IrLimits,
    ir: Ir,
    /// Temporaries that hold a value.
    set: HashSet<BitId>,
    /// True if the accumulator holds a value.
    acc: bool,
    /// Counters that are above 0 while the serial line, or the EEPROM, is busy.
    busy: Option<WordId>,
    eebusy: Option<WordId>,
    /// Number of words that the program may use freely.
    free: u32,
}

/// Generates a program within the limits. The same seed gives the same program.
pub fn random_ir(rng: &mut Rng, wish: IrLimits) -> Ir {
    let mut ir = Ir::default();
    let bit = |ir: &mut Ir, name: String, role| ir.bits.push(BitCell { name, role, initial: false });
    (0..wish.inputs).for_each(|n| bit(&mut ir, format!("X{n}"), BitRole::Input));
    (0..wish.outputs).for_each(|n| bit(&mut ir, format!("Y{n}"), BitRole::Output));
    for n in 0..wish.bits {
        let role = [BitRole::Relay, BitRole::Memory, BitRole::Temporary][n as usize % 3];
        let name = match role {
            BitRole::Relay => format!("R{n}"),
            BitRole::Memory => format!("edge{n}"),
            _ => format!("t{n}"),
        };
        bit(&mut ir, name, role);
    }
    for n in 0..wish.words {
        let bytes = wish.widths[rng.below(wish.widths.len() as u64) as usize];
        let role = WordRole::Symbol(SymbolKind::Variable);
        let initial = if rng.one_in(8) { super::interp::truncate_to_bytes(rng.next_u64() as i64, bytes) } else { 0 };
        ir.words.push(WordCell { name: format!("v{n}"), role, bytes, initial });
    }
    let mut draw = IrGenerator {
        rng,
        limits: wish,
        ir,
        set: HashSet::new(),
        acc: false,
        busy: None,
        eebusy: None,
        free: wish.words,
    };
    draw.peripherals();
    draw.tables();
    for number in 0..wish.rungs {
        let mut rung = RungCode { element_count: wish.steps, steps: Vec::new() };
        let first = if draw.rng.one_in(3) { draw.load() } else { IrOp::SetAccumulator(true) };
        draw.acc = true;
        let mut index = 0;
        rung.steps.push(IrStep { element: ElementId { rung: number, index }, op: first });
        for _ in 0..wish.steps {
            index = (index + draw.rng.below(2) as u32).min(wish.steps - 1);
            for op in draw.random_ops(wish.depth) {
                rung.steps.push(IrStep { element: ElementId { rung: number, index }, op });
            }
        }
        draw.ir.rungs.push(rung);
    }
    draw.ir
}

impl IrGenerator<'_> {
    fn wants(&self, op: u32) -> bool {
        self.limits.ops & op != 0
    }

    /// Adds the counters of busy peripherals, and declares the peripherals that the program uses.
    fn peripherals(&mut self) {
        let counter = |ir: &mut Ir, name: &str| {
            let word = WordId(ir.words.len() as u32);
            ir.words.push(WordCell { name: name.to_owned(), role: WordRole::Memory, bytes: 1, initial: 0 });
            let one =
                IrOp::Math { op: ArithmeticOp::Sub, dst: word, a: WordOperand::Cell(word), b: WordOperand::Const(1) };
            let some =
                BranchCondition::Compare(WordComparison { a: word, rel: RelationOp::Ne, b: WordOperand::Const(0) });
            ir.prologue.push(IrOp::If { cond: some, if_true: vec![one], if_false: Vec::new() });
            word
        };
        if self.limits.ops & ops::SEND != 0 {
            self.busy = Some(counter(&mut self.ir, "busy"));
        }
        if self.limits.ops & ops::EEPROM != 0 {
            self.eebusy = Some(counter(&mut self.ir, "eebusy"));
            self.ir.eeprom_bytes = self.ir.words[..self.free as usize].iter().map(|cell| u16::from(cell.bytes)).sum();
        }
        self.ir.uart = UartUse { send: self.wants(ops::SEND), receive: self.wants(ops::RECEIVE), waits: false };
        self.ir.pwms.extend(self.wants(ops::PWM).then(|| pwm_output(1000)));
        self.ir.adcs = (0..self.limits.adcs).map(|n| format!("A{n}")).collect();
    }

    fn tables(&mut self) {
        for n in 0..self.limits.tables {
            let bytes = self.limits.widths[self.rng.below(self.limits.widths.len() as u64) as usize];
            let plain = bytes == 1 && self.rng.one_in(2);
            let most = if self.rng.one_in(8) { 100 } else { 12 };
            let length = 1 + self.rng.below(most);
            let values = (0..length).map(|_| {
                if plain {
                    self.rng.below(256) as i32
                } else {
                    super::interp::truncate_to_bytes(self.rng.next_u64() as i64, bytes)
                }
            });
            let values = values.collect();
            self.ir.tables.push(ConstantTable { name: format!("table{n}"), bytes, values });
        }
    }

    fn any_bit(&mut self, which: impl Fn(BitRole) -> bool) -> Option<BitId> {
        let all: Vec<BitId> =
            (0..self.ir.bits.len() as u32).map(BitId).filter(|bit| which(self.ir.bits[bit.0 as usize].role)).collect();
        let n = self.rng.below(all.len() as u64) as usize;
        all.get(n).copied()
    }

    /// Picks a bit that holds a value.
    fn source(&mut self) -> BitId {
        let bit = self.any_bit(|_| true).expect("a program has bits");
        let temporary = self.ir.is_temporary(bit);
        if temporary && !self.set.contains(&bit) {
            return self.any_bit(|role| role != BitRole::Temporary).expect("a program has bits that last");
        }
        bit
    }

    /// Picks a bit to write, never an input.
    fn target(&mut self) -> BitId {
        let bit = self.any_bit(|role| role != BitRole::Input).expect("a program has bits to write");
        if self.ir.is_temporary(bit) {
            self.set.insert(bit);
        }
        bit
    }

    fn load(&mut self) -> IrOp {
        self.acc = true;
        IrOp::Load { bit: self.source(), negated: self.rng.one_in(2) }
    }

    fn word(&mut self) -> WordId {
        WordId(self.rng.below(self.free.into()) as u32)
    }

    /// Maximum width of the words in bytes.
    fn widest(&self) -> u8 {
        self.limits.widths.iter().copied().max().unwrap_or(2)
    }

    /// A constant that fits `bytes`, usually at a boundary.
    fn constant(&mut self, bytes: u8) -> i32 {
        let bits = 8 * u32::from(bytes) - 1;
        let (low, high) = ((-1i64 << bits), (1i64 << bits) - 1);
        const SOME: &[i64] = &[0, 1, -1, 2, 10, 100, 127, 128, -128, -129, 255, 256, -256, 1000, 32767, -32768, 65536];
        let drawn = match self.rng.below(6) {
            0 => low + self.rng.below(2) as i64,
            1 => high - self.rng.below(2) as i64,
            2 => self.rng.next_u64() as i64 >> self.rng.below(64),
            _ => SOME[self.rng.below(SOME.len() as u64) as usize],
        };
        super::interp::truncate_to_bytes(drawn, bytes)
    }

    fn value(&mut self, bytes: u8) -> WordOperand {
        if self.rng.one_in(2) { WordOperand::Cell(self.word()) } else { WordOperand::Const(self.constant(bytes)) }
    }

    fn compare(&mut self) -> WordComparison {
        let a = self.word();
        let rel = [RelationOp::Eq, RelationOp::Ne, RelationOp::Lt, RelationOp::Ge][self.rng.below(4) as usize];
        let b = self.value(self.ir.bytes(a));
        WordComparison { a, rel, b }
    }

    /// Generates one operation, or two that belong together.
    fn random_ops(&mut self, depth: u32) -> Vec<IrOp> {
        let mut out = Vec::new();
        let words = self.free > 0;
        let kinds: Vec<u32> = (0..14)
            .map(|n| 1 << n)
            .filter(|&kind| self.wants(kind) && (words || kind & (ops::IF | ops::LOGIC) != 0))
            .filter(|&kind| depth > 0 || kind & (ops::IF | ops::LOOKUP | ops::SEND | ops::EEPROM) == 0)
            .collect();
        let bits = if self.wants(ops::LOGIC) && kinds.len() > 1 { 6 } else { 2 };
        if kinds.is_empty() || self.rng.below(bits) == 0 {
            return vec![self.random_bit_op()];
        }
        let kind = kinds[self.rng.below(kinds.len() as u64) as usize];
        let op = match kind {
            ops::MOVE => {
                let dst = self.word();
                let bytes = self.widest();
                IrOp::Move { dst, src: self.value(bytes) }
            }
            ops::ADD | ops::MUL | ops::DIV | ops::BITWISE => {
                let op = match kind {
                    ops::ADD if self.rng.one_in(2) => ArithmeticOp::Add,
                    ops::ADD => ArithmeticOp::Sub,
                    ops::MUL => ArithmeticOp::Mul,
                    ops::BITWISE => {
                        let all = [ArithmeticOp::And, ArithmeticOp::Or, ArithmeticOp::Xor, ArithmeticOp::Shr];
                        all[self.rng.below(4) as usize]
                    }
                    _ => ArithmeticOp::Div,
                };
                let (dst, a) = (self.word(), self.word());
                let bytes = if self.rng.one_in(6) { self.widest() } else { self.ir.bytes(dst).max(self.ir.bytes(a)) };
                let a = if self.rng.one_in(4) { self.value(bytes) } else { WordOperand::Cell(a) };
                let b = self.value(bytes);
                // Often the destination is also an operand.
                let dst = match (self.rng.below(4), a, b) {
                    (0, WordOperand::Cell(word), _) | (1, _, WordOperand::Cell(word)) => word,
                    _ => dst,
                };
                let b = match op {
                    ArithmeticOp::Shr => WordOperand::Const(self.rng.below(8 * u64::from(self.ir.bytes(dst))) as i32),
                    _ => b,
                };
                IrOp::Math { op, dst, a, b }
            }
            ops::COMPARE => {
                if !self.acc {
                    out.push(self.load());
                }
                IrOp::AndCompare(self.compare())
            }
            ops::LOOKUP if !self.ir.tables.is_empty() => {
                let table = self.rng.below(self.ir.tables.len() as u64) as u32;
                let (index, dst) = (self.word(), self.word());
                let count = self.ir.tables[table as usize].values.len() as i32;
                let under = |b: i32| {
                    BranchCondition::Compare(WordComparison { a: index, rel: RelationOp::Lt, b: WordOperand::Const(b) })
                };
                let read = IrOp::If {
                    cond: under(count),
                    if_true: vec![IrOp::Lookup { dst, index, table }],
                    if_false: vec![],
                };
                IrOp::If { cond: under(0), if_true: vec![], if_false: vec![read] }
            }
            ops::IF => self.branch(depth),
            ops::LOGIC => self.logic(),
            ops::ADC if self.limits.adcs > 0 => {
                let dst = self.word();
                IrOp::ReadAdc { dst, input: self.rng.below(self.limits.adcs.into()) as u32 }
            }
            ops::PWM => {
                let value = if self.rng.one_in(2) { self.rng.below(104) as i32 - 2 } else { self.constant(2) };
                IrOp::SetPwm {
                    output: 0,
                    duty: if self.rng.one_in(2) { WordOperand::Const(value) } else { WordOperand::Cell(self.word()) },
                }
            }
            ops::SEND => {
                let send = IrOp::Send { value: self.value(2) };
                let busy = self.busy.expect("a program that sends has its counter");
                let count = IrOp::Move { dst: busy, src: WordOperand::Const(self.limits.byte_scans) };
                if_free(busy, vec![send, count])
            }
            ops::RECEIVE => {
                self.acc = true;
                IrOp::Receive { dst: self.word() }
            }
            ops::EEPROM => {
                let word = self.word();
                let addr = self.ir.words[..word.0 as usize].iter().map(|cell| u16::from(cell.bytes)).sum();
                let busy = self.eebusy.expect("a program with EEPROM has its counter");
                let scans = self.limits.eeprom_scans;
                let op = if self.rng.one_in(3) {
                    IrOp::ReadEeprom { dst: word, addr }
                } else {
                    IrOp::WriteEeprom { src: word, addr, busy, scans }
                };
                if_free(busy, vec![op])
            }
            _ => self.random_bit_op(),
        };
        out.push(op);
        out
    }

    fn random_bit_op(&mut self) -> IrOp {
        if !self.acc {
            return self.load();
        }
        match self.rng.below(10) {
            0 => IrOp::SetAccumulator(self.rng.one_in(2)),
            1 => self.load(),
            2 | 3 => IrOp::And { bit: self.source(), negated: self.rng.one_in(2) },
            4 | 5 => IrOp::Or { bit: self.source(), negated: self.rng.one_in(2) },
            6 | 7 => IrOp::Store { bit: self.target(), negated: self.rng.one_in(3) },
            8 => IrOp::SetBit { bit: self.target(), value: self.rng.one_in(2) },
            _ => match self.any_bit(|role| role == BitRole::Memory) {
                Some(bit) if self.rng.one_in(2) => IrOp::Rising(bit),
                Some(bit) => IrOp::Falling(bit),
                None => IrOp::SetAccumulator(true),
            },
        }
    }

    fn logic(&mut self) -> IrOp {
        let (a, b) = (self.source(), self.source());
        let dst = self.target();
        self.acc = false;
        let is = match self.rng.below(4) {
            0 => LogicOp::Copy(a),
            1 => LogicOp::Not(a),
            2 => LogicOp::And(a, b),
            _ => LogicOp::Or(a, b),
        };
        IrOp::Logic { dst, function: is }
    }

    fn branch(&mut self, depth: u32) -> IrOp {
        let cond = match self.rng.below(3) {
            0 if self.wants(ops::COMPARE) && self.free > 0 => BranchCondition::Compare(self.compare()),
            1 if self.acc => BranchCondition::Acc,
            _ => BranchCondition::Bit(self.source()),
        };
        let (acc, set) = (self.acc, self.set.clone());
        let then = self.block(depth - 1);
        let (then_acc, then_set) = (self.acc, std::mem::replace(&mut self.set, set));
        self.acc = acc;
        let otherwise = if self.rng.one_in(2) { Vec::new() } else { self.block(depth - 1) };
        self.acc &= then_acc;
        self.set.retain(|bit| then_set.contains(bit));
        IrOp::If { cond, if_true: then, if_false: otherwise }
    }

    fn block(&mut self, depth: u32) -> Vec<IrOp> {
        (0..self.rng.below(4)).flat_map(|_| self.random_ops(depth)).collect()
    }
}

/// Executes `then` if the counter is 0.
fn if_free(busy: WordId, then: Vec<IrOp>) -> IrOp {
    let free = BranchCondition::Compare(WordComparison { a: busy, rel: RelationOp::Eq, b: WordOperand::Const(0) });
    IrOp::If { cond: free, if_true: then, if_false: Vec::new() }
}

/// A PWM output of a frequency in Hz.
pub fn pwm_output(hertz: u32) -> IrPwm {
    IrPwm { name: None, hertz, element: ElementId { rung: 0, index: 0 } }
}
