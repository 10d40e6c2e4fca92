//! The intermediate code: one scan as operations on bits and 16-bit words, for any target.
//!
//! The model of the machine is the one that every target has in some form: *one bit accumulator* (the AVR's T flag, the
//! 8051's carry, the result bit of a 1-bit controller) that carries the state of the rung, bit cells and word cells. Bit
//! operations change the accumulator or store it; word operations leave it alone. Control flow is structured ([`Op::If`])
//! and there are no loops, so the longest path of a scan is a sum and a maximum.

use std::fmt;

use ladder::{ElementId, SymbolKind};

/// A bit cell, an index into [`Ir::bits`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Bit(pub u32);

/// A word cell, an index into [`Ir::words`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Word(pub u32);

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

/// A word cell: 16 bits with sign. All are zero after reset.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WordCell {
    /// The symbol's name.
    pub name: String,
    /// The symbol's kind.
    pub kind: SymbolKind,
}

/// A word operand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Value {
    /// The content of a cell.
    Cell(Word),
    /// A constant.
    Const(i16),
}

/// Relations, signed. The other two of the language turn into these by swapping operands or moving a constant by one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rel {
    /// Equal.
    Eq,
    /// Not equal.
    Ne,
    /// Less.
    Lt,
    /// Greater or equal.
    Ge,
}

/// A comparison `a rel b`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Compare {
    /// Left operand.
    pub a: Word,
    /// Relation.
    pub rel: Rel,
    /// Right operand.
    pub b: Value,
}

/// Arithmetic modulo 2^16. `Div` truncates; x / 0 is -1 for x >= 0 and 1 for x < 0; -32768 / -1 is -32768.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Math {
    /// Sum.
    Add,
    /// Difference.
    Sub,
    /// Low word of the product.
    Mul,
    /// Quotient.
    Div,
}

/// What an [`Op::If`] looks at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cond {
    /// The accumulator.
    Acc,
    /// A bit cell.
    Bit(Bit),
    /// A comparison.
    Compare(Compare),
}

/// One operation. "acc" is the bit accumulator.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Op {
    /// acc := constant.
    Acc(bool),
    /// acc := bit, complemented if `negated`.
    Load {
        /// The bit.
        bit: Bit,
        /// Complement it.
        negated: bool,
    },
    /// acc := acc and bit.
    And {
        /// The bit.
        bit: Bit,
        /// Complement it.
        negated: bool,
    },
    /// acc := acc or bit.
    Or {
        /// The bit.
        bit: Bit,
        /// Complement it.
        negated: bool,
    },
    /// bit := acc, complemented if `negated`; acc stays.
    Store {
        /// The bit.
        bit: Bit,
        /// Complement it.
        negated: bool,
    },
    /// bit := constant; acc stays.
    Put {
        /// The bit.
        bit: Bit,
        /// The constant.
        value: bool,
    },
    /// Rising edge: (acc, memory) := (acc and not memory, acc).
    Rising(Bit),
    /// Falling edge: (acc, memory) := (not acc and memory, acc).
    Falling(Bit),
    /// acc := acc and the comparison.
    AndCompare(Compare),
    /// dst := src; acc stays.
    Move {
        /// Destination.
        dst: Word,
        /// Source.
        src: Value,
    },
    /// dst := a op b; acc stays. The destination may be an operand.
    Math {
        /// Which operation.
        op: Math,
        /// Destination.
        dst: Word,
        /// Left operand.
        a: Value,
        /// Right operand.
        b: Value,
    },
    /// Executes one of two lists.
    If {
        /// What decides.
        cond: Cond,
        /// Executed when it holds.
        then: Vec<Op>,
        /// Executed when it does not.
        otherwise: Vec<Op>,
    },
}

/// An operation and the element that it belongs to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Step {
    /// The element. What joins parallel branches belongs to the element that ends the branch.
    pub at: ElementId,
    /// The operation.
    pub op: Op,
}

/// A rung.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RungCode {
    /// Number of its elements in the program.
    pub elements: u32,
    /// What to do, in order of the elements.
    pub steps: Vec<Step>,
}

/// A scan.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Ir {
    /// Bit cells.
    pub bits: Vec<BitCell>,
    /// Word cells.
    pub words: Vec<WordCell>,
    /// After the inputs are latched, before the first rung.
    pub begin: Vec<Op>,
    /// The rungs of the program, all of them, in order.
    pub rungs: Vec<RungCode>,
    /// After the last rung, before the outputs are written.
    pub end: Vec<Op>,
}

impl Ir {
    /// True for bits that hold a value within one scan only.
    #[must_use]
    pub fn is_temporary(&self, bit: Bit) -> bool {
        self.bits.get(bit.0 as usize).is_some_and(|cell| cell.role == BitRole::Temporary)
    }

    fn bit(&self, bit: Bit, negated: bool) -> String {
        let name = self.bits.get(bit.0 as usize).map_or("?", |cell| &cell.name);
        format!("{}{name}", if negated { "!" } else { "" })
    }

    fn word(&self, word: Word) -> &str {
        self.words.get(word.0 as usize).map_or("?", |cell| &cell.name)
    }

    fn value(&self, value: Value) -> String {
        match value {
            Value::Cell(word) => self.word(word).to_owned(),
            Value::Const(constant) => constant.to_string(),
        }
    }

    fn compare(&self, c: &Compare) -> String {
        let rel = match c.rel {
            Rel::Eq => "==",
            Rel::Ne => "!=",
            Rel::Lt => "<",
            Rel::Ge => ">=",
        };
        format!("{} {rel} {}", self.word(c.a), self.value(c.b))
    }

    /// One operation as text; an [`Op::If`] gives several lines, the inner ones indented.
    #[must_use]
    pub fn text(&self, op: &Op) -> String {
        match op {
            Op::Acc(value) => format!("acc {}", u8::from(*value)),
            Op::Load { bit, negated } => format!("load {}", self.bit(*bit, *negated)),
            Op::And { bit, negated } => format!("and {}", self.bit(*bit, *negated)),
            Op::Or { bit, negated } => format!("or {}", self.bit(*bit, *negated)),
            Op::Store { bit, negated } => format!("store {}", self.bit(*bit, *negated)),
            Op::Put { bit, value } => format!("put {} {}", self.bit(*bit, false), u8::from(*value)),
            Op::Rising(bit) => format!("rising {}", self.bit(*bit, false)),
            Op::Falling(bit) => format!("falling {}", self.bit(*bit, false)),
            Op::AndCompare(compare) => format!("and {}", self.compare(compare)),
            Op::Move { dst, src } => format!("{} := {}", self.word(*dst), self.value(*src)),
            Op::Math { op, dst, a, b } => {
                let sign = match op {
                    Math::Add => '+',
                    Math::Sub => '-',
                    Math::Mul => '*',
                    Math::Div => '/',
                };
                format!("{} := {} {sign} {}", self.word(*dst), self.value(*a), self.value(*b))
            }
            Op::If { cond, then, otherwise } => {
                let cond = match cond {
                    Cond::Acc => "acc".to_owned(),
                    Cond::Bit(bit) => self.bit(*bit, false),
                    Cond::Compare(compare) => self.compare(compare),
                };
                let block = |ops: &[Op]| -> String {
                    ops.iter()
                        .flat_map(|op| self.text(op).lines().map(|l| format!("  {l}\n")).collect::<Vec<_>>())
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
        let block = |f: &mut fmt::Formatter<'_>, title: &str, ops: &[Op]| -> fmt::Result {
            if !ops.is_empty() {
                writeln!(f, "{title}")?;
            }
            ops.iter().try_for_each(|op| self.text(op).lines().try_for_each(|line| writeln!(f, "     {line}")))
        };
        block(f, "begin", &self.begin)?;
        for (number, rung) in self.rungs.iter().enumerate() {
            writeln!(f, "rung {}", number + 1)?;
            for step in &rung.steps {
                for (i, line) in self.text(&step.op).lines().enumerate() {
                    let element = if i == 0 { (step.at.index + 1).to_string() } else { String::new() };
                    writeln!(f, "{element:>3}  {line}")?;
                }
            }
        }
        block(f, "end", &self.end)
    }
}
