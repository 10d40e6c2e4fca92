//! Lowers comparisons, shift registers, tables and curves.

use ladder::{CompareOp, CurvePoint, LadderOperand};

use super::{Lowering, if_accumulator};
use crate::ir::{ArithmeticOp, ConstantTable, IrOp, RelationOp, WordComparison, WordId, WordOperand, min_bytes};

/// A comparison, reduced to a constant result or a comparison of the intermediate code.
pub(super) enum ReducedComparison {
    Always(bool),
    Compare(WordComparison),
}

impl Lowering<'_> {
    /// Converts a comparison of the language to one of the four relations with a cell on the left.
    pub(super) fn relation(&self, op: CompareOp, left: WordOperand, right: WordOperand) -> ReducedComparison {
        use CompareOp::{Equ, Geq, Grt, Leq, Les, Neq};
        let make = |a, rel, b| ReducedComparison::Compare(WordComparison { a, rel, b });
        match (left, right) {
            (WordOperand::Const(a), WordOperand::Const(b)) => ReducedComparison::Always(comparison_holds(op, a, b)),
            (WordOperand::Const(_), WordOperand::Cell(_)) => {
                let mirrored = match op {
                    Grt => Les,
                    Geq => Leq,
                    Les => Grt,
                    Leq => Geq,
                    same => same,
                };
                self.relation(mirrored, right, left)
            }
            (WordOperand::Cell(a), WordOperand::Cell(b)) if a == b => {
                ReducedComparison::Always(comparison_holds(op, 0, 0))
            }
            (WordOperand::Cell(a), WordOperand::Cell(b)) => match op {
                Equ => make(a, RelationOp::Eq, right),
                Neq => make(a, RelationOp::Ne, right),
                Les => make(a, RelationOp::Lt, right),
                Geq => make(a, RelationOp::Ge, right),
                Grt => make(b, RelationOp::Lt, left),
                Leq => make(b, RelationOp::Ge, left),
            },
            (WordOperand::Cell(a), WordOperand::Const(b)) => {
                let bytes = self.ir.bytes(a);
                let high = i32::MAX >> (32 - 8 * u32::from(bytes));
                // A constant outside the range of the width compares in the same way with every number.
                if min_bytes(b) > bytes {
                    return ReducedComparison::Always(comparison_holds(op, 0, b));
                }
                match op {
                    Equ => make(a, RelationOp::Eq, right),
                    Neq => make(a, RelationOp::Ne, right),
                    // No number is below the lowest or above the highest.
                    Les | Geq if b == -high - 1 => ReducedComparison::Always(op == Geq),
                    Grt | Leq if b == high => ReducedComparison::Always(op == Leq),
                    Les => make(a, RelationOp::Lt, right),
                    Geq => make(a, RelationOp::Ge, right),
                    Grt => make(a, RelationOp::Ge, WordOperand::Const(b + 1)),
                    Leq => make(a, RelationOp::Lt, WordOperand::Const(b + 1)),
                }
            }
        }
    }

    /// Lowers SHIFT_REGISTER: on a rising edge every stage takes the value of the previous one.
    pub(super) fn shift(&mut self, name: &str, stages: u32) {
        let stages: Vec<WordId> = (0..stages).map(|n| self.word(&format!("{name}{n}"))).collect();
        let moves = stages.windows(2).rev().filter_map(|pair| match pair {
            [from, to] => Some(IrOp::Move { dst: *to, src: WordOperand::Cell(*from) }),
            _ => None,
        });
        let moves = moves.collect();
        let memory = self.new_memory();
        self.push(IrOp::Rising(memory));
        self.push(if_accumulator(moves));
        // The edge memory now holds the rung state of this scan.
        self.push(IrOp::Load { bit: memory, negated: false });
    }

    /// Returns the number of the table with these values; equal tables are shared.
    pub(super) fn table(&mut self, name: String, values: Vec<i32>) -> u32 {
        let byte = values.iter().all(|value| (0..=255).contains(value));
        let bytes = if byte { 1 } else { values.iter().copied().map(min_bytes).max().unwrap_or(1) };
        let known = self.ir.tables.iter().position(|table| table.values == values);
        let at = known.unwrap_or_else(|| {
            self.ir.tables.push(ConstantTable { name, bytes, values });
            self.ir.tables.len() - 1
        });
        at as u32
    }

    /// Lowers LOOK_UP_TABLE; an index outside of the table stores nothing.
    pub(super) fn look_up(&mut self, dest: &str, index: &LadderOperand, values: &[i64]) {
        let (dst, at) = (self.word(dest), self.value(index));
        let values: Vec<i32> = values.iter().map(|value| *value as i32).collect();
        let ops = match at {
            WordOperand::Const(at) => {
                let found = usize::try_from(at).ok().and_then(|at| values.get(at));
                found.map(|value| IrOp::Move { dst, src: WordOperand::Const(*value) }).into_iter().collect()
            }
            WordOperand::Cell(_) if values.is_empty() => Vec::new(),
            WordOperand::Cell(index) => {
                let count = values.len() as i32;
                let name = self.element_name("table");
                let table = self.table(name, values);
                let read = vec![IrOp::Lookup { dst, index, table }];
                let below = self.if_comparison(CompareOp::Les, at, WordOperand::Const(count), read, Vec::new());
                self.if_comparison(CompareOp::Geq, at, WordOperand::Const(0), below, Vec::new())
            }
        };
        self.push(if_accumulator(ops));
    }

    /// Lowers PIECEWISE_LINEAR: a binary search finds the segment of an index up to the last point.
    pub(super) fn piecewise(&mut self, dest: &str, index: &LadderOperand, points: &[CurvePoint]) {
        let (dst, at) = (self.word(dest), self.value(index));
        let points: Vec<(i32, i32)> = points.iter().map(|point| (point.x as i32, point.y as i32)).collect();
        let Some(&(last, _)) = points.last().filter(|_| points.len() > 1) else { return };
        let of = |value: WordOperand| match value {
            WordOperand::Cell(word) => self.ir.bytes(word),
            WordOperand::Const(constant) => min_bytes(constant),
        };
        let constants = points.iter().flat_map(|&(x, y)| [min_bytes(x), min_bytes(y)]).max().unwrap_or(1);
        let bytes = if constants.max(of(at)).max(self.ir.bytes(dst)) > 2 { 4 } else { 2 };
        let work = if self.ir.bytes(dst) == bytes { dst } else { self.temporary("curve", bytes) };
        let found = self.find_segment((work, dst, at), &points, true);
        let ops = self.if_comparison(CompareOp::Leq, at, WordOperand::Const(last), found, Vec::new());
        self.push(if_accumulator(ops));
    }

    /// Finds the segment between `points` that holds the index; `first` if `points` begins with the first
    /// point of the curve.
    fn find_segment(&self, words: (WordId, WordId, WordOperand), points: &[(i32, i32)], first: bool) -> Vec<IrOp> {
        match points {
            [] | [_] => Vec::new(),
            [from, to] => self.segment(words, (*from, *to), first),
            _ => {
                let middle = points.len() / 2;
                let (low, high) = (&points[..=middle], &points[middle..]);
                let (below, above) = (self.find_segment(words, low, first), self.find_segment(words, high, false));
                self.if_comparison(CompareOp::Leq, words.2, WordOperand::Const(points[middle].0), below, above)
            }
        }
    }

    /// Computes y + ((index - x) * dy) / dx. After the first point the product cannot wrap, so shorter forms
    /// are allowed.
    fn segment(
        &self,
        (work, dst, at): (WordId, WordId, WordOperand),
        ((x, y), (next_x, next_y)): ((i32, i32), (i32, i32)),
        first: bool,
    ) -> Vec<IrOp> {
        let (dx, dy) = (next_x.wrapping_sub(x), next_y.wrapping_sub(y));
        if dy == 0 {
            return vec![IrOp::Move { dst, src: WordOperand::Const(y) }];
        }
        let (times, by) = match (first, dx, dy) {
            (false, dx, dy) if dy % dx == 0 => (dy / dx, 1),
            (false, dx, dy) if dx % dy == 0 => (1, dx / dy),
            _ => (dy, dx),
        };
        let mut ops = Vec::new();
        let mut held = at;
        let mut step = |op: ArithmeticOp, by: i32, none: i32| {
            if by != none {
                ops.push(IrOp::Math { op, dst: work, a: held, b: WordOperand::Const(by) });
                held = WordOperand::Cell(work);
            }
        };
        step(ArithmeticOp::Sub, x, 0);
        step(ArithmeticOp::Mul, times, 1);
        step(ArithmeticOp::Div, by, 1);
        ops.push(match y {
            0 => IrOp::Move { dst, src: held },
            y => IrOp::Math { op: ArithmeticOp::Add, dst, a: held, b: WordOperand::Const(y) },
        });
        ops
    }
}

fn comparison_holds(op: CompareOp, a: i32, b: i32) -> bool {
    match op {
        CompareOp::Equ => a == b,
        CompareOp::Neq => a != b,
        CompareOp::Grt => a > b,
        CompareOp::Geq => a >= b,
        CompareOp::Les => a < b,
        CompareOp::Leq => a <= b,
    }
}
