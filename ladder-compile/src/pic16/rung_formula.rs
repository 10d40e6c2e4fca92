//! Formula over bits and comparisons that holds the state of a rung until code for it is needed.

use emu_pic16::isa::Pic16OpKind;

use crate::ir::{RelationOp, WordComparison, WordId, WordOperand};

/// A bit of data memory, or its complement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BitLiteral {
    /// Address of the byte, and number of the bit.
    pub at: (u16, u8),
    /// True for the bit, false for its complement.
    pub is: bool,
}

impl BitLiteral {
    /// Returns the complement.
    #[must_use]
    pub fn opposite(self) -> BitLiteral {
        BitLiteral { is: !self.is, ..self }
    }

    /// Instruction that skips the next one if this literal is false.
    #[must_use]
    pub fn skip_unless(self) -> Pic16OpKind {
        if self.is { Pic16OpKind::Btfsc } else { Pic16OpKind::Btfss }
    }
}

/// A Boolean formula over data memory.
///
/// It refers to cells at the time when it was formed. So code that writes a cell must first compute all
/// formulas that read it and are still needed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RungFormula {
    /// A constant.
    Const(bool),
    /// A bit or its complement.
    Lit(BitLiteral),
    /// A comparison.
    Cmp(WordComparison),
    /// Whether a word is in the range `first..end`, within 0..=256, or outside of it.
    Range {
        /// The word.
        word: WordId,
        /// First value of the range.
        first: i32,
        /// Value after the last of the range.
        end: i32,
        /// True for inside the range, false for outside.
        is: bool,
    },
    /// Conjunction of two or more formulas.
    And(Vec<RungFormula>),
    /// Disjunction of two or more formulas.
    Or(Vec<RungFormula>),
}

impl RungFormula {
    /// Returns the complement.
    #[must_use]
    pub fn opposite(&self) -> RungFormula {
        match self {
            RungFormula::Const(value) => RungFormula::Const(!value),
            RungFormula::Lit(lit) => RungFormula::Lit(lit.opposite()),
            RungFormula::Cmp(c) => {
                let rel = match c.rel {
                    RelationOp::Eq => RelationOp::Ne,
                    RelationOp::Ne => RelationOp::Eq,
                    RelationOp::Lt => RelationOp::Ge,
                    RelationOp::Ge => RelationOp::Lt,
                };
                RungFormula::Cmp(WordComparison { rel, ..*c })
            }
            RungFormula::Range { word, first, end, is } => {
                RungFormula::Range { word: *word, first: *first, end: *end, is: !is }
            }
            RungFormula::And(all) => RungFormula::Or(all.iter().map(RungFormula::opposite).collect()),
            RungFormula::Or(all) => RungFormula::And(all.iter().map(RungFormula::opposite).collect()),
        }
    }

    /// Returns the complement if `not` is true.
    #[must_use]
    pub fn opposite_if(self, not: bool) -> RungFormula {
        if not { self.opposite() } else { self }
    }

    /// Conjunction of two formulas.
    #[must_use]
    pub fn and(self, other: RungFormula) -> RungFormula {
        match (self, other) {
            (RungFormula::Const(true), other) | (other, RungFormula::Const(true)) => other,
            (RungFormula::Const(false), _) | (_, RungFormula::Const(false)) => RungFormula::Const(false),
            (a, b) => {
                let mut all = if let RungFormula::And(all) = a { all } else { vec![a] };
                for more in if let RungFormula::And(more) = b { more } else { vec![b] } {
                    if all.contains(&more.opposite()) {
                        return RungFormula::Const(false);
                    }
                    if !all.contains(&more) {
                        all.push(more);
                    }
                }
                if let [one] = all.as_slice() { one.clone() } else { RungFormula::And(all) }
            }
        }
    }

    /// Disjunction of two formulas.
    #[must_use]
    pub fn or(self, other: RungFormula) -> RungFormula {
        self.opposite().and(other.opposite()).opposite()
    }

    /// True for a constant or a literal.
    #[must_use]
    pub fn is_simple(&self) -> bool {
        matches!(self, RungFormula::Const(_) | RungFormula::Lit(_))
    }

    /// True if the formula reads this bit of data memory. Bits of words do not count.
    #[must_use]
    pub fn reads_bit(&self, at: (u16, u8)) -> bool {
        match self {
            RungFormula::Lit(lit) => lit.at == at,
            RungFormula::And(all) | RungFormula::Or(all) => all.iter().any(|e| e.reads_bit(at)),
            _ => false,
        }
    }

    /// True if the formula reads this word.
    #[must_use]
    pub fn reads_word(&self, word: WordId) -> bool {
        match self {
            RungFormula::Cmp(c) => c.a == word || c.b == WordOperand::Cell(word),
            RungFormula::Range { word: read, .. } => *read == word,
            RungFormula::And(all) | RungFormula::Or(all) => all.iter().any(|e| e.reads_word(word)),
            _ => false,
        }
    }

    /// Replaces pairs of comparisons that bound the same word by a single range test.
    #[must_use]
    pub fn merge_ranges(self) -> RungFormula {
        match self {
            RungFormula::And(all) => {
                let mut all: Vec<RungFormula> = all.into_iter().map(RungFormula::merge_ranges).collect();
                while let Some((low, high, range)) = range_of(&all) {
                    all =
                        all.into_iter().enumerate().filter(|(n, _)| *n != low && *n != high).map(|(_, e)| e).collect();
                    all.push(range);
                }
                all.into_iter().fold(RungFormula::Const(true), RungFormula::and)
            }
            RungFormula::Or(all) => {
                RungFormula::And(all.iter().map(RungFormula::opposite).collect()).merge_ranges().opposite()
            }
            other => other,
        }
    }
}

/// Finds a lower and an upper bound of one word between 0 and 256; returns their indices and the range.
fn range_of(all: &[RungFormula]) -> Option<(usize, usize, RungFormula)> {
    let bound = |e: &RungFormula, rel: RelationOp| match e {
        RungFormula::Cmp(WordComparison { a, rel: r, b: WordOperand::Const(k) })
            if *r == rel && (0..=256).contains(k) =>
        {
            Some((*a, *k))
        }
        _ => None,
    };
    for (low, e) in all.iter().enumerate() {
        let Some((word, first)) = bound(e, RelationOp::Ge) else { continue };
        for (high, e) in all.iter().enumerate() {
            if let Some((other, end)) = bound(e, RelationOp::Lt)
                && other == word
                && first < end
            {
                return Some((low, high, RungFormula::Range { word, first, end, is: true }));
            }
        }
    }
    None
}
