//! Counts how often a program uses each cell, and finds the registers that its operations need.

use crate::ir::{ArithmeticOp, BitId, BranchCondition, Ir, IrOp, LogicOp, WordComparison, WordId, WordOperand};

/// Usage counts and register needs of a program.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct AvrUsage {
    /// Number of occurrences of each bit, by [`BitId`].
    pub bits: Vec<u32>,
    /// Number of occurrences of each word, by [`WordId`].
    pub words: Vec<u32>,
    /// True if the program divides.
    pub divides: bool,
    /// True if some divisor may be zero or negative.
    pub signed_divisors: bool,
    /// True if the program reads a table, through pointer Z.
    pub tables: bool,
    /// True if some value has more than two bytes.
    pub wide: bool,
}

impl AvrUsage {
    /// Counts the cells of a program.
    #[must_use]
    pub fn of(ir: &Ir) -> AvrUsage {
        let mut uses = AvrUsage {
            bits: vec![0; ir.bits.len()],
            words: vec![0; ir.words.len()],
            wide: ir.words.iter().any(|word| word.bytes > 2),
            ..AvrUsage::default()
        };
        let steps = ir.rungs.iter().flat_map(|rung| &rung.steps).map(|step| &step.op);
        ir.prologue.iter().chain(steps).chain(&ir.epilogue).for_each(|op| uses.op(ir, op));
        uses
    }

    fn bit(&mut self, bit: BitId) {
        self.bits.get_mut(bit.0 as usize).into_iter().for_each(|count| *count += 1);
    }

    fn word(&mut self, word: WordId) {
        self.words.get_mut(word.0 as usize).into_iter().for_each(|count| *count += 1);
    }

    fn value(&mut self, value: WordOperand) {
        if let WordOperand::Cell(word) = value {
            self.word(word);
        }
    }

    fn compare(&mut self, compare: &WordComparison) {
        self.word(compare.a);
        self.value(compare.b);
    }

    fn op(&mut self, ir: &Ir, op: &IrOp) {
        match op {
            IrOp::SetAccumulator(_) | IrOp::Label(_) | IrOp::Jump { .. } => {}
            IrOp::Load { bit, .. } | IrOp::And { bit, .. } | IrOp::Or { bit, .. } | IrOp::Store { bit, .. } => {
                self.bit(*bit)
            }
            IrOp::SetBit { bit, .. } | IrOp::Rising(bit) | IrOp::Falling(bit) => self.bit(*bit),
            IrOp::AndCompare(compare) => self.compare(compare),
            IrOp::Move { dst, src } => {
                self.word(*dst);
                self.value(*src);
            }
            IrOp::Math { op, dst, a, b } => {
                self.word(*dst);
                self.value(*a);
                self.value(*b);
                if *op == ArithmeticOp::Div {
                    self.divides = true;
                    self.signed_divisors |= !matches!(b, WordOperand::Const(1..));
                }
                self.wide |= ir.width(*op, *dst, *a, *b) > 2;
            }
            IrOp::Logic { dst, function: is } => {
                self.bit(*dst);
                match is {
                    LogicOp::Copy(a) | LogicOp::Not(a) => self.bit(*a),
                    LogicOp::And(a, b) | LogicOp::Or(a, b) => {
                        self.bit(*a);
                        self.bit(*b);
                    }
                }
            }
            // AVR chips have no timer and counter modules.
            IrOp::Module { .. } | IrOp::WaitSent => {}
            IrOp::Lookup { dst, index, .. } => {
                self.tables = true;
                self.word(*dst);
                self.word(*index);
            }
            IrOp::ReadAdc { dst, .. } | IrOp::Receive { dst } | IrOp::ReadEeprom { dst, .. } => self.word(*dst),
            IrOp::Transfer { register, value, dst, .. } => {
                self.value(*register);
                self.value(*value);
                dst.iter().for_each(|dst| self.word(*dst));
            }
            IrOp::SetPwm { duty: value, .. } | IrOp::Send { value } => self.value(*value),
            IrOp::WriteEeprom { src, busy, .. } => {
                self.word(*src);
                self.word(*busy);
            }
            IrOp::If { cond, if_true: then, if_false: otherwise } => {
                match cond {
                    BranchCondition::Acc => {}
                    BranchCondition::Bit(bit) => self.bit(*bit),
                    BranchCondition::Compare(compare) => self.compare(compare),
                }
                then.iter().chain(otherwise).for_each(|op| self.op(ir, op));
            }
        }
    }
}
