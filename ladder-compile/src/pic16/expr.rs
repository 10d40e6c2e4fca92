//! The state of a rung as a formula over bits and comparisons, kept until it is needed.

use emu_pic16::isa::Kind;

use crate::ir::{Compare, Rel, Value, Word};

/// A bit of data memory, or its complement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lit {
    /// Address of its byte and number in it.
    pub at: (u16, u8),
    /// False for the complement.
    pub is: bool,
}

impl Lit {
    /// The complement.
    #[must_use]
    pub fn opposite(self) -> Lit {
        Lit { is: !self.is, ..self }
    }

    /// The instruction that leaves out the next one when this is false.
    #[must_use]
    pub fn only_if(self) -> Kind {
        if self.is { Kind::Btfsc } else { Kind::Btfss }
    }
}

/// A formula. Its comparisons are of the time when it was formed: whoever writes a cell makes sure that no formula that is
/// still needed reads it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Expr {
    /// Known.
    Const(bool),
    /// A bit.
    Lit(Lit),
    /// A comparison.
    Cmp(Compare),
    /// Whether a word lies in `first..end` within 0..=256, or whether it does not.
    Range {
        /// The word.
        word: Word,
        /// First of the range.
        first: i32,
        /// Behind its last.
        end: i32,
        /// It lies there.
        is: bool,
    },
    /// All of two or more.
    And(Vec<Expr>),
    /// One of two or more.
    Or(Vec<Expr>),
}

impl Expr {
    /// The complement.
    #[must_use]
    pub fn opposite(&self) -> Expr {
        match self {
            Expr::Const(value) => Expr::Const(!value),
            Expr::Lit(lit) => Expr::Lit(lit.opposite()),
            Expr::Cmp(c) => {
                let rel = match c.rel {
                    Rel::Eq => Rel::Ne,
                    Rel::Ne => Rel::Eq,
                    Rel::Lt => Rel::Ge,
                    Rel::Ge => Rel::Lt,
                };
                Expr::Cmp(Compare { rel, ..*c })
            }
            Expr::Range { word, first, end, is } => Expr::Range { word: *word, first: *first, end: *end, is: !is },
            Expr::And(all) => Expr::Or(all.iter().map(Expr::opposite).collect()),
            Expr::Or(all) => Expr::And(all.iter().map(Expr::opposite).collect()),
        }
    }

    /// The complement if `not`.
    #[must_use]
    pub fn opposite_if(self, not: bool) -> Expr {
        if not { self.opposite() } else { self }
    }

    /// Both.
    #[must_use]
    pub fn and(self, other: Expr) -> Expr {
        match (self, other) {
            (Expr::Const(true), other) | (other, Expr::Const(true)) => other,
            (Expr::Const(false), _) | (_, Expr::Const(false)) => Expr::Const(false),
            (a, b) => {
                let mut all = if let Expr::And(all) = a { all } else { vec![a] };
                for more in if let Expr::And(more) = b { more } else { vec![b] } {
                    if all.contains(&more.opposite()) {
                        return Expr::Const(false);
                    }
                    if !all.contains(&more) {
                        all.push(more);
                    }
                }
                if let [one] = all.as_slice() { one.clone() } else { Expr::And(all) }
            }
        }
    }

    /// One of both.
    #[must_use]
    pub fn or(self, other: Expr) -> Expr {
        self.opposite().and(other.opposite()).opposite()
    }

    /// Neither a formula of several parts nor a comparison.
    #[must_use]
    pub fn is_simple(&self) -> bool {
        matches!(self, Expr::Const(_) | Expr::Lit(_))
    }

    /// Reads this bit of data memory. Bits of words are no cells of their own.
    #[must_use]
    pub fn reads_bit(&self, at: (u16, u8)) -> bool {
        match self {
            Expr::Lit(lit) => lit.at == at,
            Expr::And(all) | Expr::Or(all) => all.iter().any(|e| e.reads_bit(at)),
            _ => false,
        }
    }

    /// Reads this word.
    #[must_use]
    pub fn reads_word(&self, word: Word) -> bool {
        match self {
            Expr::Cmp(c) => c.a == word || c.b == Value::Cell(word),
            Expr::Range { word: read, .. } => *read == word,
            Expr::And(all) | Expr::Or(all) => all.iter().any(|e| e.reads_word(word)),
            _ => false,
        }
    }

    /// The same with pairs of comparisons that bound a word turned into one look at a range.
    #[must_use]
    pub fn ranged(self) -> Expr {
        match self {
            Expr::And(all) => {
                let mut all: Vec<Expr> = all.into_iter().map(Expr::ranged).collect();
                while let Some((low, high, range)) = range_of(&all) {
                    all =
                        all.into_iter().enumerate().filter(|(n, _)| *n != low && *n != high).map(|(_, e)| e).collect();
                    all.push(range);
                }
                all.into_iter().fold(Expr::Const(true), Expr::and)
            }
            Expr::Or(all) => Expr::And(all.iter().map(Expr::opposite).collect()).ranged().opposite(),
            other => other,
        }
    }
}

/// A lower and an upper bound of one word between 0 and 256: where they stand, and what they are together.
fn range_of(all: &[Expr]) -> Option<(usize, usize, Expr)> {
    let bound = |e: &Expr, rel: Rel| match e {
        Expr::Cmp(Compare { a, rel: r, b: Value::Const(k) }) if *r == rel && (0..=256).contains(k) => Some((*a, *k)),
        _ => None,
    };
    for (low, e) in all.iter().enumerate() {
        let Some((word, first)) = bound(e, Rel::Ge) else { continue };
        for (high, e) in all.iter().enumerate() {
            if let Some((other, end)) = bound(e, Rel::Lt)
                && other == word
                && first < end
            {
                return Some((low, high, Expr::Range { word, first, end, is: true }));
            }
        }
    }
    None
}
