//! The intermediate code: one scan as operations on bits and integers of one to four bytes, for any target.
//!
//! The model of the machine is the one that every target has in some form: *one bit accumulator* (the AVR's T flag, the
//! 8051's carry, the result bit of a 1-bit controller) that carries the state of the rung, bit cells and word cells. Bit
//! operations change the accumulator or store it; word operations leave it alone. Control flow is structured ([`Op::If`])
//! and there are no loops, so the longest path of a scan is a sum and a maximum.

use std::fmt;

use ladder::{ElementId, SymbolKind};

pub use crate::arithmetic::{ArithmeticOp, min_bytes, shift_count};
pub use crate::timed_module::TimedModule;

/// A bit cell, an index into [`Ir::bits`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BitId(pub u32);

/// A word cell, an index into [`Ir::words`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct WordId(pub u32);

/// What a bit cell is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BitRole {
    /// Latched from a pin at the start of the scan.
    Input,
    /// Written to a pin at the end of the scan.
    Output,
    /// An internal relay.
    Relay,
    /// What an element remembers from the scan before: the edge memory of one shots and counters.
    Memory,
    /// Holds a value within one scan only; nobody sees it between scans.
    Temporary,
}

/// A bit cell. All are zero after reset.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BitCell {
    /// The symbol's name, or a description such as `edge of rung 2, element 1`.
    pub name: String,
    /// What it is for.
    pub role: BitRole,
}

/// What a word cell is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WordRole {
    /// An integer of the program.
    Symbol(SymbolKind),
    /// What an element or a peripheral remembers from the scan before.
    Memory,
    /// Holds a value within one scan only; nobody sees it between scans.
    Temporary,
}

/// A word cell: an integer with sign, least byte first where a target keeps it in bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WordCell {
    /// The symbol's name, or a description such as `position of rung 2, element 1`.
    pub name: String,
    /// What it is for.
    pub role: WordRole,
    /// Width in bytes, 1 to 4.
    pub bytes: u8,
    /// Value after reset; 0 but for counters with a start value.
    pub initial: i32,
}

/// A constant table, kept in program memory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConstantTable {
    /// What it belongs to, such as `table of rung 2, element 1`.
    pub name: String,
    /// Width of a value in bytes, 1 to 4.
    pub bytes: u8,
    /// The values, at least one; each fits the width, as a number with or without sign in one byte, else with sign.
    pub values: Vec<i32>,
}

/// What a program uses of the serial line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct UartUse {
    /// It sends.
    pub send: bool,
    /// It receives.
    pub receive: bool,
}

/// A word operand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WordOperand {
    /// The content of a cell.
    Cell(WordId),
    /// A constant. In a comparison it fits the width of the left operand.
    Const(i32),
}

/// Relations, signed. The other two of the language turn into these by swapping operands or moving a constant by one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RelationOp {
    /// Equal.
    Eq,
    /// Not equal.
    Ne,
    /// Less.
    Lt,
    /// Greater or equal.
    Ge,
}

/// A comparison `a rel b`, with sign, at the larger width of the two.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WordComparison {
    /// Left operand.
    pub a: WordId,
    /// Relation.
    pub rel: RelationOp,
    /// Right operand.
    pub b: WordOperand,
}

/// A bit as a function of bits: the three-address form of code that is not optimised.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LogicOp {
    /// a.
    Copy(BitId),
    /// not a.
    Not(BitId),
    /// a and b.
    And(BitId, BitId),
    /// a or b.
    Or(BitId, BitId),
}

/// What an [`Op::If`] looks at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BranchCondition {
    /// The accumulator.
    Acc,
    /// A bit cell.
    Bit(BitId),
    /// A comparison.
    Compare(WordComparison),
}

/// One operation. "acc" is the bit accumulator.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum IrOp {
    /// acc := constant.
    SetAccumulator(bool),
    /// acc := bit, complemented if `negated`.
    Load {
        /// The bit.
        bit: BitId,
        /// Complement it.
        negated: bool,
    },
    /// acc := acc and bit.
    And {
        /// The bit.
        bit: BitId,
        /// Complement it.
        negated: bool,
    },
    /// acc := acc or bit.
    Or {
        /// The bit.
        bit: BitId,
        /// Complement it.
        negated: bool,
    },
    /// bit := acc, complemented if `negated`; acc stays.
    Store {
        /// The bit.
        bit: BitId,
        /// Complement it.
        negated: bool,
    },
    /// bit := constant; acc stays.
    SetBit {
        /// The bit.
        bit: BitId,
        /// The constant.
        value: bool,
    },
    /// Rising edge: (acc, memory) := (acc and not memory, acc).
    Rising(BitId),
    /// Falling edge: (acc, memory) := (not acc and memory, acc).
    Falling(BitId),
    /// acc := acc and the comparison.
    AndCompare(WordComparison),
    /// dst := src; acc stays.
    Move {
        /// Destination.
        dst: WordId,
        /// Source.
        src: WordOperand,
    },
    /// dst := a op b; acc stays. The destination may be an operand.
    Math {
        /// Which operation.
        op: ArithmeticOp,
        /// Destination.
        dst: WordId,
        /// Left operand.
        a: WordOperand,
        /// Right operand.
        b: WordOperand,
    },
    /// bit := logic; acc stays or is lost. Only in code that is not optimised, where nothing else uses acc across it.
    Logic {
        /// Destination.
        dst: BitId,
        /// Its value.
        function: LogicOp,
    },
    /// dst := table[index]; acc stays. The index is in range, the destination may be the index.
    Lookup {
        /// Destination; a narrower table value is extended with sign, one byte wide tables of values above 127 without.
        dst: WordId,
        /// Index from 0.
        index: WordId,
        /// An index into [`Ir::tables`].
        table: u32,
    },
    /// dst := the conversion of an analog input now, 0 to 1023; acc stays.
    ReadAdc {
        /// Destination.
        dst: WordId,
        /// An index into [`Ir::adcs`].
        input: u32,
    },
    /// The duty of the PWM output := the value, clamped to 0..=100 percent; acc stays.
    SetPwm {
        /// The duty.
        duty: WordOperand,
    },
    /// The low byte goes to the transmitter, which has finished with the byte before but for what a scan shifts about; acc stays.
    Send {
        /// The byte.
        value: WordOperand,
    },
    /// acc := a byte has been received and not yet taken; if so, dst := the byte, 0 to 255, and it is taken.
    Receive {
        /// Destination.
        dst: WordId,
    },
    /// dst := EEPROM, least byte first; acc stays. No write is under way.
    ReadEeprom {
        /// Destination.
        dst: WordId,
        /// Address of its first cell.
        addr: u16,
    },
    /// If a byte of src differs from its cell of the EEPROM, the write of the lowest such byte begins and busy := scans; acc stays. No
    /// write is under way.
    WriteEeprom {
        /// Source.
        src: WordId,
        /// Address of its first cell.
        addr: u16,
        /// Counts the scans until the EEPROM is free.
        busy: WordId,
        /// What a write takes.
        scans: i32,
    },
    /// acc := what a timer or counter gives whose in is acc; the word is its integer, all other state is the operation's own. Only for
    /// chips that have such modules ([`CompileTarget::has_modules`](crate::target::CompileTarget::has_modules)); for others it is lowered to the operations above.
    Module {
        /// What it is.
        module: TimedModule,
        /// Its integer.
        word: WordId,
        /// P or max.
        limit: WordOperand,
    },
    /// Executes one of two lists.
    If {
        /// What decides.
        cond: BranchCondition,
        /// Executed when it holds.
        if_true: Vec<IrOp>,
        /// Executed when it does not.
        if_false: Vec<IrOp>,
    },
}

/// An operation and the element that it belongs to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IrStep {
    /// The element. What joins parallel branches belongs to the element that ends the branch.
    pub element: ElementId,
    /// The operation.
    pub op: IrOp,
}

/// A rung.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RungCode {
    /// Number of its elements in the program.
    pub element_count: u32,
    /// What to do, in order of the elements.
    pub steps: Vec<IrStep>,
}

/// A scan.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Ir {
    /// Bit cells.
    pub bits: Vec<BitCell>,
    /// Word cells.
    pub words: Vec<WordCell>,
    /// Constant tables.
    pub tables: Vec<ConstantTable>,
    /// Symbols of the analog inputs.
    pub adcs: Vec<String>,
    /// Frequency of the PWM output in Hz, where there is one.
    pub pwm_hz: Option<u32>,
    /// What is used of the serial line.
    pub uart: UartUse,
    /// Bytes of EEPROM in use, from address 0.
    pub eeprom_bytes: u16,
    /// After the inputs are latched, before the first rung.
    pub prologue: Vec<IrOp>,
    /// The rungs of the program, all of them, in order.
    pub rungs: Vec<RungCode>,
    /// After the last rung, before the outputs are written.
    pub epilogue: Vec<IrOp>,
}

impl Ir {
    /// True for bits that hold a value within one scan only.
    #[must_use]
    pub fn is_temporary(&self, bit: BitId) -> bool {
        self.bits.get(bit.0 as usize).is_some_and(|cell| cell.role == BitRole::Temporary)
    }

    /// Width of a word cell in bytes.
    #[must_use]
    pub fn bytes(&self, word: WordId) -> u8 {
        self.words.get(word.0 as usize).map_or(2, |cell| cell.bytes)
    }

    /// Width at which an operation is done, in bytes: that of the destination where more cannot matter, and for a division
    /// the largest of destination, operands and what constants need.
    #[must_use]
    pub fn width(&self, op: ArithmeticOp, dst: WordId, a: WordOperand, b: WordOperand) -> u8 {
        let of = |value: WordOperand| match value {
            WordOperand::Cell(word) => self.bytes(word),
            WordOperand::Const(constant) => min_bytes(constant),
        };
        match op {
            ArithmeticOp::Div => self.bytes(dst).max(of(a)).max(of(b)),
            ArithmeticOp::Add
            | ArithmeticOp::Sub
            | ArithmeticOp::Mul
            | ArithmeticOp::And
            | ArithmeticOp::Or
            | ArithmeticOp::Xor
            | ArithmeticOp::Shr => self.bytes(dst),
        }
    }

    fn bit(&self, bit: BitId, negated: bool) -> String {
        let name = self.bits.get(bit.0 as usize).map_or("?", |cell| &cell.name);
        format!("{}{name}", if negated { "!" } else { "" })
    }

    fn word(&self, word: WordId) -> &str {
        self.words.get(word.0 as usize).map_or("?", |cell| &cell.name)
    }

    fn value(&self, value: WordOperand) -> String {
        match value {
            WordOperand::Cell(word) => self.word(word).to_owned(),
            WordOperand::Const(constant) => constant.to_string(),
        }
    }

    fn compare(&self, c: &WordComparison) -> String {
        let rel = match c.rel {
            RelationOp::Eq => "==",
            RelationOp::Ne => "!=",
            RelationOp::Lt => "<",
            RelationOp::Ge => ">=",
        };
        format!("{} {rel} {}", self.word(c.a), self.value(c.b))
    }

    /// One operation as text; an [`Op::If`] gives several lines, the inner ones indented.
    #[must_use]
    pub fn op_text(&self, op: &IrOp) -> String {
        match op {
            IrOp::SetAccumulator(value) => format!("acc {}", u8::from(*value)),
            IrOp::Load { bit, negated } => format!("load {}", self.bit(*bit, *negated)),
            IrOp::And { bit, negated } => format!("and {}", self.bit(*bit, *negated)),
            IrOp::Or { bit, negated } => format!("or {}", self.bit(*bit, *negated)),
            IrOp::Store { bit, negated } => format!("store {}", self.bit(*bit, *negated)),
            IrOp::SetBit { bit, value } => format!("put {} {}", self.bit(*bit, false), u8::from(*value)),
            IrOp::Rising(bit) => format!("rising {}", self.bit(*bit, false)),
            IrOp::Falling(bit) => format!("falling {}", self.bit(*bit, false)),
            IrOp::AndCompare(compare) => format!("and {}", self.compare(compare)),
            IrOp::Move { dst, src } => format!("{} := {}", self.word(*dst), self.value(*src)),
            IrOp::Math { op, dst, a, b } => {
                format!("{} := {} {} {}", self.word(*dst), self.value(*a), op.sign(), self.value(*b))
            }
            IrOp::Logic { dst, function: is } => {
                let bit = |bit: &BitId| self.bit(*bit, false);
                let is = match is {
                    LogicOp::Copy(a) => bit(a),
                    LogicOp::Not(a) => format!("not {}", bit(a)),
                    LogicOp::And(a, b) => format!("{} and {}", bit(a), bit(b)),
                    LogicOp::Or(a, b) => format!("{} or {}", bit(a), bit(b)),
                };
                format!("{} := {is}", bit(dst))
            }
            IrOp::Lookup { dst, index, table } => {
                let name = self.tables.get(*table as usize).map_or("?", |table| &table.name);
                format!("{} := {name}[{}]", self.word(*dst), self.word(*index))
            }
            IrOp::ReadAdc { dst, input } => {
                let name = self.adcs.get(*input as usize).map_or("?", String::as_str);
                format!("{} := adc {name}", self.word(*dst))
            }
            IrOp::SetPwm { duty } => format!("pwm {}", self.value(*duty)),
            IrOp::Send { value } => format!("send {}", self.value(*value)),
            IrOp::Receive { dst } => format!("receive {}", self.word(*dst)),
            IrOp::ReadEeprom { dst, addr } => format!("{} := eeprom {addr}", self.word(*dst)),
            IrOp::WriteEeprom { src, addr, busy, scans } => {
                format!("eeprom {addr} := {}, {} := {scans}", self.word(*src), self.word(*busy))
            }
            IrOp::Module { module: is, word, limit } => format!("{is} {}, {}", self.word(*word), self.value(*limit)),
            IrOp::If { cond, if_true: then, if_false: otherwise } => {
                let cond = match cond {
                    BranchCondition::Acc => "acc".to_owned(),
                    BranchCondition::Bit(bit) => self.bit(*bit, false),
                    BranchCondition::Compare(compare) => self.compare(compare),
                };
                let block = |ops: &[IrOp]| -> String {
                    ops.iter()
                        .flat_map(|op| self.op_text(op).lines().map(|l| format!("  {l}\n")).collect::<Vec<_>>())
                        .collect()
                };
                let other = if otherwise.is_empty() { String::new() } else { format!("else\n{}", block(otherwise)) };
                format!("if {cond}\n{}{other}end", block(then))
            }
        }
    }
}

/// The whole scan as text: `rung 1`, then per step the number of its element and the operation.
impl fmt::Display for Ir {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let block = |f: &mut fmt::Formatter<'_>, title: &str, ops: &[IrOp]| -> fmt::Result {
            if !ops.is_empty() {
                writeln!(f, "{title}")?;
            }
            ops.iter().try_for_each(|op| self.op_text(op).lines().try_for_each(|line| writeln!(f, "     {line}")))
        };
        block(f, "begin", &self.prologue)?;
        for (number, rung) in self.rungs.iter().enumerate() {
            writeln!(f, "rung {}", number + 1)?;
            for step in &rung.steps {
                for (i, line) in self.op_text(&step.op).lines().enumerate() {
                    let element = if i == 0 { (step.element.index + 1).to_string() } else { String::new() };
                    writeln!(f, "{element:>3}  {line}")?;
                }
            }
        }
        block(f, "end", &self.epilogue)
    }
}
