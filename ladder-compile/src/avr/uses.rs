//! What a program uses: how often each cell occurs, and which registers its operations need for themselves.

use crate::ir::{Bit, Compare, Cond, Ir, Logic, Math, Op, Value, Word};

/// Occurrences and needs of a program.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Uses {
    /// Occurrences by [`Bit`].
    pub bits: Vec<u32>,
    /// Occurrences by [`Word`].
    pub words: Vec<u32>,
    /// Something is divided.
    pub divides: bool,
    /// Something is divided by what may be zero or less.
    pub signed_divisors: bool,
    /// A table is read, by the pointer Z.
    pub tables: bool,
    /// There are integers of more than two bytes.
    pub wide: bool,
}

impl Uses {
    /// Counts a program.
    #[must_use]
    pub fn of(ir: &Ir) -> Uses {
        let mut uses = Uses {
            bits: vec![0; ir.bits.len()],
            words: vec![0; ir.words.len()],
            wide: ir.words.iter().any(|word| word.bytes > 2),
            ..Uses::default()
        };
        let steps = ir.rungs.iter().flat_map(|rung| &rung.steps).map(|step| &step.op);
        ir.begin.iter().chain(steps).chain(&ir.end).for_each(|op| uses.op(ir, op));
        uses
    }

    fn bit(&mut self, bit: Bit) {
        self.bits.get_mut(bit.0 as usize).into_iter().for_each(|count| *count += 1);
    }

    fn word(&mut self, word: Word) {
        self.words.get_mut(word.0 as usize).into_iter().for_each(|count| *count += 1);
    }

    fn value(&mut self, value: Value) {
        if let Value::Cell(word) = value {
            self.word(word);
        }
    }

    fn compare(&mut self, compare: &Compare) {
        self.word(compare.a);
        self.value(compare.b);
    }

    fn op(&mut self, ir: &Ir, op: &Op) {
        match op {
            Op::Acc(_) => {}
            Op::Load { bit, .. } | Op::And { bit, .. } | Op::Or { bit, .. } | Op::Store { bit, .. } => self.bit(*bit),
            Op::Put { bit, .. } | Op::Rising(bit) | Op::Falling(bit) => self.bit(*bit),
            Op::AndCompare(compare) => self.compare(compare),
            Op::Move { dst, src } => {
                self.word(*dst);
                self.value(*src);
            }
            Op::Math { op, dst, a, b } => {
                self.word(*dst);
                self.value(*a);
                self.value(*b);
                if *op == Math::Div {
                    self.divides = true;
                    self.signed_divisors |= !matches!(b, Value::Const(1..));
                }
                self.wide |= ir.width(*op, *dst, *a, *b) > 2;
            }
            Op::Logic { dst, is } => {
                self.bit(*dst);
                match is {
                    Logic::Copy(a) | Logic::Not(a) => self.bit(*a),
                    Logic::And(a, b) | Logic::Or(a, b) => {
                        self.bit(*a);
                        self.bit(*b);
                    }
                }
            }
            // The back end has no modules.
            Op::Module { .. } => {}
            Op::Lookup { dst, index, .. } => {
                self.tables = true;
                self.word(*dst);
                self.word(*index);
            }
            Op::ReadAdc { dst, .. } | Op::Receive { dst } | Op::Recall { dst, .. } => self.word(*dst),
            Op::SetPwm { duty: value } | Op::Send { value } => self.value(*value),
            Op::Persist { src, busy, .. } => {
                self.word(*src);
                self.word(*busy);
            }
            Op::If { cond, then, otherwise } => {
                match cond {
                    Cond::Acc => {}
                    Cond::Bit(bit) => self.bit(*bit),
                    Cond::Compare(compare) => self.compare(compare),
                }
                then.iter().chain(otherwise).for_each(|op| self.op(ir, op));
            }
        }
    }
}
