//! What LDmicro 5 does with the bits of integers: remainder, shifts and rotations, single bits, bytes and
//! digits.
//!
//! Operations on the bits of an operand are done in a temporary of its width; what is stored comes from
//! there. So the destination may be any of the operands, and its width does not matter.

use ladder::{CompareOp, LadderOperand, ShiftOp, UnaryOp};

use super::{Lowering, if_accumulator};
use crate::ir::{ArithmeticOp, IrOp, RelationOp, WordComparison, WordId, WordOperand, min_bytes};

/// dst := a op b.
fn math(op: ArithmeticOp, dst: WordId, a: impl Into<WordOperand>, b: impl Into<WordOperand>) -> IrOp {
    IrOp::Math { op, dst, a: a.into(), b: b.into() }
}

/// dst := src.
fn copy(dst: WordId, src: impl Into<WordOperand>) -> IrOp {
    IrOp::Move { dst, src: src.into() }
}

impl From<WordId> for WordOperand {
    fn from(word: WordId) -> WordOperand {
        WordOperand::Cell(word)
    }
}

impl From<i32> for WordOperand {
    fn from(constant: i32) -> WordOperand {
        WordOperand::Const(constant)
    }
}

/// The lowest bits of a mask as a number of so many bytes, with sign.
fn of_width(mask: u32, bytes: u8) -> i32 {
    let spare = 32 - 8 * u32::from(bytes);
    (mask << spare) as i32 >> spare
}

/// Two to the power of `bit`, as a number of so many bytes.
fn power_of_two(bit: i32, bytes: u8) -> i32 {
    of_width(1_u32.checked_shl(bit as u32).unwrap_or(0), bytes)
}

/// By how much is shifted: 1 to the bits less one, or a cell that holds that.
#[derive(Clone, Copy)]
enum Distance {
    Known(i32),
    Held(WordId),
}

impl Lowering<'_> {
    /// Width of an operand in bytes: a constant has the fewest that hold it.
    fn operand_bytes(&self, operand: WordOperand) -> u8 {
        match operand {
            WordOperand::Cell(word) => self.ir.bytes(word),
            WordOperand::Const(constant) => min_bytes(constant),
        }
    }

    /// dst := what is left of a when it is divided by b: a where b is 0.
    pub(super) fn remainder(&mut self, dest: &str, op1: &LadderOperand, op2: &LadderOperand) {
        let (dst, a, b) = (self.word(dest), self.value(op1), self.value(op2));
        let multiple = self.temporary("multiple", self.operand_bytes(a).max(self.operand_bytes(b)));
        self.push(if_accumulator(vec![
            math(ArithmeticOp::Div, multiple, a, b),
            math(ArithmeticOp::Mul, multiple, multiple, b),
            math(ArithmeticOp::Sub, dst, a, multiple),
        ]));
    }

    /// Lowers an element that computes an integer from one operand, while it has power.
    pub(super) fn unary(&mut self, op: UnaryOp, dest: &str, src: &LadderOperand) {
        let (dst, src) = (self.word(dest), self.value(src));
        let ops = match op {
            UnaryOp::Not => vec![math(ArithmeticOp::Xor, dst, src, -1)],
            UnaryOp::Neg => vec![math(ArithmeticOp::Sub, dst, 0, src)],
            UnaryOp::Swap | UnaryOp::Opposite => {
                let bytes = self.operand_bytes(src);
                let x = self.temporary("bits", bytes);
                let mut ops = vec![copy(x, src)];
                if op == UnaryOp::Opposite {
                    [(1, 0x5555_5555), (2, 0x3333_3333)]
                        .into_iter()
                        .for_each(|(by, mask)| self.exchange(x, by, mask, &mut ops));
                }
                if op == UnaryOp::Opposite || bytes == 1 {
                    self.exchange(x, 4, 0x0F0F_0F0F, &mut ops);
                }
                self.reverse_bytes(x, &mut ops);
                ops.push(copy(dst, x));
                ops
            }
            UnaryOp::BinToBcd => self.number_to_digits(dst, src),
            UnaryOp::BcdToBin => self.digits_to_number(dst, src),
        };
        self.push(if_accumulator(ops));
    }

    /// Groups of `by` bits of x, those in `mask` and their left neighbours, change places.
    fn exchange(&mut self, x: WordId, by: i32, mask: u32, ops: &mut Vec<IrOp>) {
        let bytes = self.ir.bytes(x);
        let (high, mask) = (self.temporary("part", bytes), of_width(mask, bytes));
        ops.extend([
            math(ArithmeticOp::Shr, high, x, by),
            math(ArithmeticOp::And, high, high, mask),
            math(ArithmeticOp::And, x, x, mask),
            math(ArithmeticOp::Mul, x, x, 1 << by),
            math(ArithmeticOp::Or, x, x, high),
        ]);
    }

    /// The bytes of x in reverse order.
    fn reverse_bytes(&mut self, x: WordId, ops: &mut Vec<IrOp>) {
        let bytes = self.ir.bytes(x);
        let [part, result] = ["part", "result"].map(|name| self.temporary(name, bytes));
        let top = i32::from(bytes) - 1;
        for n in (0..=top).filter(|_| bytes > 1) {
            let out = if n == 0 { result } else { part };
            // Byte n goes to the place top - n.
            let places = top - 2 * n;
            let moved = power_of_two(8 * places, bytes);
            match places {
                0 => ops.push(math(ArithmeticOp::And, out, x, of_width(0xFF << (8 * n), bytes))),
                1.. => {
                    ops.push(math(ArithmeticOp::And, out, x, of_width(0xFF << (8 * n), bytes)));
                    ops.push(math(ArithmeticOp::Mul, out, out, moved));
                }
                _ => {
                    ops.push(math(ArithmeticOp::Shr, out, x, -8 * places));
                    ops.push(math(ArithmeticOp::And, out, out, of_width(0xFF << (8 * (top - n)), bytes)));
                }
            }
            if n > 0 {
                ops.push(math(ArithmeticOp::Or, result, result, part));
            }
        }
        if bytes > 1 {
            ops.push(copy(x, result));
        }
    }

    /// The four lowest decimal digits of the number without its sign, one a byte.
    fn number_to_digits(&mut self, dst: WordId, src: WordOperand) -> Vec<IrOp> {
        let (bytes, count) = (self.operand_bytes(src).max(2), i32::from(self.ir.bytes(dst)));
        let [rest, tens, digit] = ["rest", "tens", "digit"].map(|name| self.temporary(name, bytes));
        let wide = self.temporary("shifted", self.ir.bytes(dst));
        let result = self.temporary("result", self.ir.bytes(dst));
        let split = [
            math(ArithmeticOp::Div, tens, rest, 10),
            math(ArithmeticOp::Mul, digit, tens, 10),
            math(ArithmeticOp::Sub, digit, rest, digit),
        ];
        let mut ops = vec![copy(rest, src)];
        ops.extend(split.clone());
        // Only now, since the least number has no positive one.
        let negate = vec![math(ArithmeticOp::Sub, digit, 0, digit), math(ArithmeticOp::Sub, tens, 0, tens)];
        ops.extend(self.if_comparison(CompareOp::Les, rest.into(), 0.into(), negate, Vec::new()));
        ops.push(copy(result, digit));
        for n in 1..count {
            ops.push(copy(rest, tens));
            ops.extend(split.clone());
            ops.extend([
                math(ArithmeticOp::Mul, wide, digit, 1 << (8 * n)),
                math(ArithmeticOp::Or, result, result, wide),
            ]);
        }
        ops.push(copy(dst, result));
        ops
    }

    /// The number whose decimal digits are the low nibbles of the bytes.
    fn digits_to_number(&mut self, dst: WordId, src: WordOperand) -> Vec<IrOp> {
        let bytes = self.operand_bytes(src);
        let [x, part] = ["bits", "part"].map(|name| self.temporary(name, bytes));
        // At most 15 * 1111.
        let [digit, result] = ["digit", "result"].map(|name| self.temporary(name, 2));
        let mut ops = vec![copy(x, src), copy(result, 0)];
        for n in (0..i32::from(bytes)).rev() {
            ops.extend([
                math(ArithmeticOp::Shr, part, x, 8 * n),
                math(ArithmeticOp::And, part, part, 15),
                copy(digit, part),
                math(ArithmeticOp::Mul, result, result, 10),
                math(ArithmeticOp::Add, result, result, digit),
            ]);
        }
        ops.push(copy(dst, result));
        ops
    }

    /// Lowers a shift or rotation of the bits of an integer.
    pub(super) fn shift_bits(&mut self, op: ShiftOp, dest: &str, src: &LadderOperand, count: &LadderOperand) {
        let (dst, src, count) = (self.word(dest), self.value(src), self.value(count));
        let bytes = self.operand_bytes(src);
        let x = self.temporary("bits", if op == ShiftOp::Shl { self.ir.bytes(dst) } else { bytes });
        let mut ops = vec![copy(x, src)];
        ops.extend(self.shift_word(op, x, count));
        ops.push(copy(dst, x));
        self.push(if_accumulator(ops));
    }

    /// x shifted or rotated by a count; by 0 and less, it stays what it is.
    pub(super) fn shift_word(&mut self, op: ShiftOp, x: WordId, count: WordOperand) -> Vec<IrOp> {
        let bits = 8 * i32::from(self.ir.bytes(x));
        let mut ops = Vec::new();
        let all_out = match op {
            ShiftOp::Shl | ShiftOp::Sr0 => vec![copy(x, 0)],
            ShiftOp::Shr => self.if_comparison(CompareOp::Les, x.into(), 0.into(), vec![copy(x, -1)], vec![copy(x, 0)]),
            ShiftOp::Rol | ShiftOp::Ror => Vec::new(),
        };
        match (op, count) {
            (_, WordOperand::Const(..=0)) => {}
            (ShiftOp::Rol | ShiftOp::Ror, WordOperand::Const(by)) => {
                if by % bits > 0 {
                    self.rotate(x, op, Distance::Known(by % bits), &mut ops);
                }
            }
            (_, WordOperand::Const(by)) if by >= bits => ops.extend(all_out),
            (_, WordOperand::Const(by)) => self.shift_by(x, op, Distance::Known(by), &mut ops),
            (ShiftOp::Rol | ShiftOp::Ror, WordOperand::Cell(count)) => {
                // The remainder by the bits, of a count above 0.
                let by = self.temporary("count", self.ir.bytes(count));
                let mut turn = match bits {
                    24 => vec![
                        math(ArithmeticOp::Div, by, count, bits),
                        math(ArithmeticOp::Mul, by, by, bits),
                        math(ArithmeticOp::Sub, by, count, by),
                    ],
                    _ => vec![math(ArithmeticOp::And, by, count, bits - 1)],
                };
                let mut rotated = Vec::new();
                self.rotate(x, op, Distance::Held(by), &mut rotated);
                turn.extend(self.if_comparison(CompareOp::Grt, by.into(), 0.into(), rotated, Vec::new()));
                ops.extend(self.if_comparison(CompareOp::Grt, count.into(), 0.into(), turn, Vec::new()));
            }
            (_, WordOperand::Cell(count)) => {
                let mut shifted = Vec::new();
                self.shift_by(x, op, Distance::Held(count), &mut shifted);
                let some = self.if_comparison(CompareOp::Les, count.into(), bits.into(), shifted, all_out);
                ops.extend(self.if_comparison(CompareOp::Grt, count.into(), 0.into(), some, Vec::new()));
            }
        }
        ops
    }

    /// x rotated.
    fn rotate(&mut self, x: WordId, op: ShiftOp, by: Distance, ops: &mut Vec<IrOp>) {
        let bytes = self.ir.bytes(x);
        let bits = 8 * i32::from(bytes);
        let low = self.temporary("part", bytes);
        let back = match by {
            Distance::Known(by) => Distance::Known(bits - by),
            Distance::Held(by) => {
                let back = self.temporary("back", self.ir.bytes(by));
                ops.push(math(ArithmeticOp::Sub, back, bits, by));
                Distance::Held(back)
            }
        };
        let (left, right) = if op == ShiftOp::Rol { (by, back) } else { (back, by) };
        ops.push(copy(low, x));
        self.shift_by(low, ShiftOp::Sr0, right, ops);
        self.shift_by(x, ShiftOp::Shl, left, ops);
        ops.push(math(ArithmeticOp::Or, x, x, low));
    }

    /// x shifted by 1 bit to all but one.
    fn shift_by(&mut self, x: WordId, op: ShiftOp, by: Distance, ops: &mut Vec<IrOp>) {
        match (op, by) {
            (ShiftOp::Shl, by) => {
                let factor = self.mask_of(x, by, ops);
                ops.push(math(ArithmeticOp::Mul, x, x, factor));
            }
            (ShiftOp::Shr, by) => {
                // What comes in from above are ones where the complement is shifted.
                let (mut complement, mut shifted) = (vec![math(ArithmeticOp::Xor, x, x, -1)], Vec::new());
                self.shift_by(x, ShiftOp::Sr0, by, &mut shifted);
                complement.extend(shifted.clone());
                complement.push(math(ArithmeticOp::Xor, x, x, -1));
                ops.extend(self.if_comparison(CompareOp::Les, x.into(), 0.into(), complement, shifted));
            }
            (_, Distance::Known(by)) => ops.push(math(ArithmeticOp::Shr, x, x, by)),
            (_, Distance::Held(by)) => {
                // By the powers of two that the count is a sum of.
                let bit = self.temporary("step", self.ir.bytes(by));
                let steps = 8 * i32::from(self.ir.bytes(x));
                for step in [1, 2, 4, 8, 16].into_iter().filter(|step| *step < steps) {
                    ops.push(math(ArithmeticOp::And, bit, by, step));
                    let shifted = vec![math(ArithmeticOp::Shr, x, x, step)];
                    ops.extend(self.if_comparison(CompareOp::Neq, bit.into(), 0.into(), shifted, Vec::new()));
                }
            }
        }
    }

    /// The number of the width of `like` in which the bit is 1 and no other; the bit is one of its.
    fn mask_of(&mut self, like: WordId, bit: Distance, ops: &mut Vec<IrOp>) -> WordOperand {
        let bytes = self.ir.bytes(like);
        match bit {
            Distance::Known(bit) => power_of_two(bit, bytes).into(),
            Distance::Held(index) => {
                let dst = self.temporary("mask", bytes);
                let powers = (0..8 * i32::from(bytes)).map(|bit| power_of_two(bit, bytes)).collect();
                let table = self.table(format!("bits.{bytes}"), powers);
                ops.push(IrOp::Lookup { dst, index, table });
                dst.into()
            }
        }
    }

    /// A bit that the integer does not have is left alone.
    pub(super) fn write_bit(&mut self, name: &str, bit: &LadderOperand, value: bool) {
        let (word, bit) = (self.word(name), self.value(bit));
        let bits = 8 * i32::from(self.ir.bytes(word));
        let change = |this: &mut Self, at: Distance| {
            let mut ops = Vec::new();
            match (this.mask_of(word, at, &mut ops), value) {
                (mask, true) => ops.push(math(ArithmeticOp::Or, word, word, mask)),
                (WordOperand::Const(mask), false) => ops.push(math(ArithmeticOp::And, word, word, !mask)),
                (WordOperand::Cell(mask), false) => {
                    ops.push(math(ArithmeticOp::Xor, mask, mask, -1));
                    ops.push(math(ArithmeticOp::And, word, word, mask));
                }
            }
            ops
        };
        let ops = match bit {
            WordOperand::Const(bit) if (0..bits).contains(&bit) => change(self, Distance::Known(bit)),
            WordOperand::Const(_) => Vec::new(),
            WordOperand::Cell(at) => {
                let ops = change(self, Distance::Held(at));
                let ops = self.if_comparison(CompareOp::Les, bit, bits.into(), ops, Vec::new());
                self.if_comparison(CompareOp::Geq, bit, 0.into(), ops, Vec::new())
            }
        };
        self.push(if_accumulator(ops));
    }

    /// Beyond the width there is the sign, below 0 there is nothing.
    pub(super) fn test_bit(&mut self, name: &str, bit: &LadderOperand, value: bool) {
        let (word, bit) = (self.word(name), self.value(bit));
        let top = 8 * i32::from(self.ir.bytes(word)) - 1;
        let found = self.temporary("found", self.ir.bytes(word));
        let negative = |rel| WordComparison { a: word, rel, b: 0.into() };
        let compare = match bit {
            WordOperand::Const(..=-1) if value => return self.push(IrOp::SetAccumulator(false)),
            WordOperand::Const(..=-1) => return,
            WordOperand::Const(bit) if bit >= top => negative(if value { RelationOp::Lt } else { RelationOp::Ge }),
            WordOperand::Const(bit) => {
                self.push(math(ArithmeticOp::And, found, word, 1 << bit));
                WordComparison { a: found, rel: if value { RelationOp::Ne } else { RelationOp::Eq }, b: 0.into() }
            }
            WordOperand::Cell(at) => {
                let mut inside = Vec::new();
                let mask = self.mask_of(word, Distance::Held(at), &mut inside);
                inside.push(math(ArithmeticOp::And, found, word, mask));
                let sign = self.if_comparison(CompareOp::Les, word.into(), 0.into(), vec![copy(found, 1)], Vec::new());
                let ops = self.if_comparison(CompareOp::Les, bit, top.into(), inside, sign);
                let ops = self.if_comparison(CompareOp::Geq, bit, 0.into(), ops, Vec::new());
                self.push(copy(found, 0));
                self.push_all(ops);
                WordComparison { a: found, rel: if value { RelationOp::Ne } else { RelationOp::Eq }, b: 0.into() }
            }
        };
        self.push(IrOp::AndCompare(compare));
    }

    /// Bits that go equally far are moved together.
    pub(super) fn bus(&mut self, dest: &str, src: &LadderOperand, targets: [u8; 8]) {
        let (dst, src) = (self.word(dest), self.value(src));
        if targets == [0, 1, 2, 3, 4, 5, 6, 7] {
            return self.push(if_accumulator(vec![copy(dst, src)]));
        }
        let [x, part, result] = ["bits", "part", "result"].map(|name| self.temporary(name, 1));
        let mut ops = vec![copy(x, src), copy(result, 0)];
        for far in -7..=7 {
            // A bit whose place a higher one takes as well goes nowhere.
            let moved = (0..8_usize).filter(|&n| {
                let to = targets[n];
                i32::from(to) - n as i32 == far && !targets.iter().skip(n + 1).any(|other| *other == to)
            });
            let mask: u32 = moved.map(|n| 1 << n).sum();
            if mask == 0 {
                continue;
            }
            ops.push(math(ArithmeticOp::And, part, x, of_width(mask, 1)));
            match far {
                0 => {}
                1.. => ops.push(math(ArithmeticOp::Mul, part, part, 1 << far)),
                _ => ops.push(math(ArithmeticOp::Shr, part, part, -far)),
            }
            ops.push(math(ArithmeticOp::Or, result, result, part));
        }
        ops.push(copy(dst, result));
        if self.ir.bytes(dst) > 1 {
            ops.push(math(ArithmeticOp::And, dst, dst, 0xFF));
        }
        self.push(if_accumulator(ops));
    }
}
