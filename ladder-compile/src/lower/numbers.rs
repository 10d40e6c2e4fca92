//! Comparisons, shift registers, tables and curves.

use ladder::{CompareOp, Operand};

use super::{Lower, when};
use crate::ir::{Compare, Math, Op, Rel, Table, Value, Word, bytes_of};

/// What a comparison comes down to.
pub(super) enum Relation {
    Always(bool),
    Compare(Compare),
}

impl Lower<'_> {
    /// A comparison of the language as one of the four relations with a cell on its left.
    pub(super) fn relation(&self, op: CompareOp, left: Value, right: Value) -> Relation {
        use CompareOp::{Equ, Geq, Grt, Leq, Les, Neq};
        let make = |a, rel, b| Relation::Compare(Compare { a, rel, b });
        match (left, right) {
            (Value::Const(a), Value::Const(b)) => Relation::Always(holds(op, a, b)),
            (Value::Const(_), Value::Cell(_)) => {
                let mirrored = match op {
                    Grt => Les,
                    Geq => Leq,
                    Les => Grt,
                    Leq => Geq,
                    same => same,
                };
                self.relation(mirrored, right, left)
            }
            (Value::Cell(a), Value::Cell(b)) if a == b => Relation::Always(holds(op, 0, 0)),
            (Value::Cell(a), Value::Cell(b)) => match op {
                Equ => make(a, Rel::Eq, right),
                Neq => make(a, Rel::Ne, right),
                Les => make(a, Rel::Lt, right),
                Geq => make(a, Rel::Ge, right),
                Grt => make(b, Rel::Lt, left),
                Leq => make(b, Rel::Ge, left),
            },
            (Value::Cell(a), Value::Const(b)) => {
                let bytes = self.ir.bytes(a);
                let high = i32::MAX >> (32 - 8 * u32::from(bytes));
                // A constant beyond all numbers of the width compares with them as it does with any one of them.
                if bytes_of(b) > bytes {
                    return Relation::Always(holds(op, 0, b));
                }
                match op {
                    Equ => make(a, Rel::Eq, right),
                    Neq => make(a, Rel::Ne, right),
                    // No number is below the lowest, none above the highest.
                    Les | Geq if b == -high - 1 => Relation::Always(op == Geq),
                    Grt | Leq if b == high => Relation::Always(op == Leq),
                    Les => make(a, Rel::Lt, right),
                    Geq => make(a, Rel::Ge, right),
                    Grt => make(a, Rel::Ge, Value::Const(b + 1)),
                    Leq => make(a, Rel::Lt, Value::Const(b + 1)),
                }
            }
        }
    }

    /// On a rising edge every stage takes the value of the one before.
    pub(super) fn shift(&mut self, name: &str, stages: u32) {
        let stages: Vec<Word> = (0..stages).map(|n| self.word(&format!("{name}{n}"))).collect();
        let moves = stages.windows(2).rev().filter_map(|pair| match pair {
            [from, to] => Some(Op::Move { dst: *to, src: Value::Cell(*from) }),
            _ => None,
        });
        let moves = moves.collect();
        let memory = self.memory();
        self.push(Op::Rising(memory));
        self.push(when(moves));
        // The memory is the rung state of this scan.
        self.push(Op::Load { bit: memory, negated: false });
    }

    /// The number of the table with these values; equal tables are one.
    pub(super) fn table(&mut self, name: String, values: Vec<i32>) -> u32 {
        let byte = values.iter().all(|value| (0..=255).contains(value));
        let bytes = if byte { 1 } else { values.iter().copied().map(bytes_of).max().unwrap_or(1) };
        let known = self.ir.tables.iter().position(|table| table.values == values);
        let at = known.unwrap_or_else(|| {
            self.ir.tables.push(Table { name, bytes, values });
            self.ir.tables.len() - 1
        });
        at as u32
    }

    pub(super) fn look_up(&mut self, dest: &str, index: &Operand, values: &[i64]) {
        let (dst, at) = (self.word(dest), self.value(index));
        let values: Vec<i32> = values.iter().map(|value| *value as i32).collect();
        let ops = match at {
            Value::Const(at) => {
                let found = usize::try_from(at).ok().and_then(|at| values.get(at));
                found.map(|value| Op::Move { dst, src: Value::Const(*value) }).into_iter().collect()
            }
            Value::Cell(_) if values.is_empty() => Vec::new(),
            Value::Cell(index) => {
                let count = values.len() as i32;
                let name = self.named("table");
                let table = self.table(name, values);
                let read = vec![Op::Lookup { dst, index, table }];
                let below = self.where_(CompareOp::Les, at, Value::Const(count), read, Vec::new());
                self.where_(CompareOp::Geq, at, Value::Const(0), below, Vec::new())
            }
        };
        self.push(when(ops));
    }

    /// Up to the last point the segment is looked for by halves.
    pub(super) fn piecewise(&mut self, dest: &str, index: &Operand, points: &[(i64, i64)]) {
        let (dst, at) = (self.word(dest), self.value(index));
        let points: Vec<(i32, i32)> = points.iter().map(|&(x, y)| (x as i32, y as i32)).collect();
        let Some(&(last, _)) = points.last().filter(|_| points.len() > 1) else { return };
        let of = |value: Value| match value {
            Value::Cell(word) => self.ir.bytes(word),
            Value::Const(constant) => bytes_of(constant),
        };
        let constants = points.iter().flat_map(|&(x, y)| [bytes_of(x), bytes_of(y)]).max().unwrap_or(1);
        let bytes = if constants.max(of(at)).max(self.ir.bytes(dst)) > 2 { 4 } else { 2 };
        let work = if self.ir.bytes(dst) == bytes { dst } else { self.temporary("curve", bytes) };
        let found = self.find((work, dst, at), &points, true);
        let ops = self.where_(CompareOp::Leq, at, Value::Const(last), found, Vec::new());
        self.push(when(ops));
    }

    /// The segments between `points`, one of which holds the index; `first` if they begin with the curve's first.
    fn find(&self, words: (Word, Word, Value), points: &[(i32, i32)], first: bool) -> Vec<Op> {
        match points {
            [] | [_] => Vec::new(),
            [from, to] => self.segment(words, (*from, *to), first),
            _ => {
                let middle = points.len() / 2;
                let (low, high) = (&points[..=middle], &points[middle..]);
                let (below, above) = (self.find(words, low, first), self.find(words, high, false));
                self.where_(CompareOp::Leq, words.2, Value::Const(points[middle].0), below, above)
            }
        }
    }

    /// y + ((index - x) * dy) / dx. Behind the first point the product cannot wrap, so that it may be written shorter.
    fn segment(
        &self,
        (work, dst, at): (Word, Word, Value),
        ((x, y), (next_x, next_y)): ((i32, i32), (i32, i32)),
        first: bool,
    ) -> Vec<Op> {
        let (dx, dy) = (next_x.wrapping_sub(x), next_y.wrapping_sub(y));
        if dy == 0 {
            return vec![Op::Move { dst, src: Value::Const(y) }];
        }
        let (times, by) = match (first, dx, dy) {
            (false, dx, dy) if dy % dx == 0 => (dy / dx, 1),
            (false, dx, dy) if dx % dy == 0 => (1, dx / dy),
            _ => (dy, dx),
        };
        let mut ops = Vec::new();
        let mut held = at;
        let mut step = |op: Math, by: i32, none: i32| {
            if by != none {
                ops.push(Op::Math { op, dst: work, a: held, b: Value::Const(by) });
                held = Value::Cell(work);
            }
        };
        step(Math::Sub, x, 0);
        step(Math::Mul, times, 1);
        step(Math::Div, by, 1);
        ops.push(match y {
            0 => Op::Move { dst, src: held },
            y => Op::Math { op: Math::Add, dst, a: held, b: Value::Const(y) },
        });
        ops
    }
}

fn holds(op: CompareOp, a: i32, b: i32) -> bool {
    match op {
        CompareOp::Equ => a == b,
        CompareOp::Neq => a != b,
        CompareOp::Grt => a > b,
        CompareOp::Geq => a >= b,
        CompareOp::Les => a < b,
        CompareOp::Leq => a <= b,
    }
}
