//! Intermediate code to instructions.
//!
//! The accumulator is the T flag, so a contact is a skip over CLT and a coil is BLD: two clocks and one, whatever the
//! values. Words are worked on in r25:r24; what that pair holds is remembered along straight code.

use emu_avr::isa::Kind;
use emu_core::chip::Chip;

use super::emit::{Asm, Label};
use super::layout::{Home, Layout};
use crate::ir::{Bit, Compare, Cond, Math, Op, Rel, Value, Word};

/// Low register of the left operand and result.
const A: i32 = 24;
/// Low register of the right operand.
const B: i32 = 22;
/// Holds a byte of bits from RAM.
const BYTE: i32 = 18;
/// Holds a mask, the high byte of a constant, or the old value of an edge memory.
const SCRATCH: i32 = 19;
/// Always zero.
const ZERO: i32 = 1;

/// Addresses of the chip's registers by name.
#[derive(Debug, Clone, Copy)]
pub struct Regs {
    chip: &'static Chip,
}

impl Regs {
    /// The registers of `chip`.
    #[must_use]
    pub fn new(chip: &'static Chip) -> Self {
        Regs { chip }
    }

    /// Data address; a register that the chip does not have gives one that no instruction can encode.
    #[must_use]
    pub fn data(&self, name: &str) -> i32 {
        self.chip.reg(name).map_or(-1, i32::from)
    }

    /// I/O address.
    #[must_use]
    pub fn io(&self, name: &str) -> i32 {
        self.data(name) - 0x20
    }

    /// I/O address of a port's register: `PORT`, `DDR` or `PIN` and the letter.
    #[must_use]
    pub fn port(&self, register: &str, letter: char) -> i32 {
        self.io(&format!("{register}{letter}"))
    }
}

/// What is known along straight code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Known {
    /// The T flag.
    t: Option<bool>,
    /// The word that r25:r24 holds.
    a: Option<Word>,
}

impl Known {
    fn meet(self, other: Known) -> Known {
        Known { t: if self.t == other.t { self.t } else { None }, a: if self.a == other.a { self.a } else { None } }
    }
}

/// Turns operations into instructions, one list after the other.
#[derive(Debug)]
pub struct Select<'a> {
    /// The code so far.
    pub asm: &'a mut Asm,
    layout: &'a Layout,
    known: Known,
    /// The multiplication, once it is used.
    pub multiply: Option<Label>,
    /// The division, once it is used.
    pub divide: Option<Label>,
}

impl<'a> Select<'a> {
    /// Nothing is known at first.
    pub fn new(asm: &'a mut Asm, layout: &'a Layout) -> Self {
        Select { asm, layout, known: Known::default(), multiply: None, divide: None }
    }

    /// Appends the code of `ops`.
    pub fn ops(&mut self, ops: &[Op]) {
        ops.iter().for_each(|op| self.op(op));
    }

    /// Appends the code of one operation.
    pub fn op(&mut self, op: &Op) {
        match op {
            Op::Acc(value) => self.acc(*value),
            Op::Load { bit, negated: false } => {
                let (reg, n) = self.fetch(*bit);
                self.asm.op(Kind::Bst, &[reg, n]);
                self.known.t = None;
            }
            Op::Load { bit, negated: true } => {
                self.acc(true);
                self.narrow(*bit, true);
            }
            Op::And { bit, negated } => self.narrow(*bit, *negated),
            Op::Or { bit, negated } => {
                let (reg, n) = self.fetch(*bit);
                self.asm.op(if *negated { Kind::Sbrs } else { Kind::Sbrc }, &[reg, n]);
                self.asm.op(Kind::Set, &[]);
                self.known.t = None;
            }
            Op::Store { bit, negated } => {
                let (reg, n) = self.fetch(*bit);
                self.asm.op(Kind::Bld, &[reg, n]);
                if *negated {
                    self.asm.op(Kind::Ldi, &[SCRATCH, 1 << n]);
                    self.asm.op(Kind::Eor, &[reg, SCRATCH]);
                }
                self.commit(*bit);
            }
            Op::Put { bit, value } => self.put(*bit, *value),
            Op::Rising(bit) => {
                let n = self.remember(*bit);
                self.asm.op(Kind::Sbrc, &[SCRATCH, n]);
                self.asm.op(Kind::Clt, &[]);
                self.known.t = None;
            }
            Op::Falling(bit) => {
                let n = self.remember(*bit);
                let low = self.asm.label();
                self.asm.branch(Kind::Brtc, low);
                self.asm.op(Kind::Eor, &[SCRATCH, SCRATCH]);
                self.asm.place(low);
                self.asm.op(Kind::Bst, &[SCRATCH, n]);
                self.known.t = None;
            }
            Op::AndCompare(compare) => self.and_compare(compare),
            Op::Move { dst, src } => self.set(*dst, *src),
            Op::Math { op, dst, a, b } => self.math(*op, *dst, *a, *b),
            Op::If { cond, then, otherwise } => self.branch(*cond, then, otherwise),
            Op::Logic { .. } | Op::Lookup { .. } | Op::ReadAdc { .. } | Op::SetPwm { .. } | Op::Send { .. } => {}
            Op::Receive { .. } | Op::Recall { .. } | Op::Persist { .. } | Op::Module { .. } => {}
        }
    }

    fn acc(&mut self, value: bool) {
        if self.known.t != Some(value) {
            self.asm.op(if value { Kind::Set } else { Kind::Clt }, &[]);
            self.known.t = Some(value);
        }
    }

    /// T := T and bit.
    fn narrow(&mut self, bit: Bit, negated: bool) {
        let (reg, n) = self.fetch(bit);
        self.asm.op(if negated { Kind::Sbrc } else { Kind::Sbrs }, &[reg, n]);
        self.asm.op(Kind::Clt, &[]);
        self.known.t = None;
    }

    fn put(&mut self, bit: Bit, value: bool) {
        let (reg, n) = self.fetch(bit);
        let mask = if value { 1 << n } else { 0xFF ^ (1 << n) };
        if self.known.t == Some(value) {
            self.asm.op(Kind::Bld, &[reg, n]);
        } else if reg >= 16 {
            self.asm.op(if value { Kind::Ori } else { Kind::Andi }, &[reg, mask]);
        } else {
            self.asm.op(Kind::Ldi, &[SCRATCH, mask]);
            self.asm.op(if value { Kind::Or } else { Kind::And }, &[reg, SCRATCH]);
        }
        self.commit(bit);
    }

    /// The bit's old byte to the scratch register, T to the bit; returns the bit's number.
    fn remember(&mut self, bit: Bit) -> i32 {
        let (reg, n) = self.fetch(bit);
        self.asm.op(Kind::Mov, &[SCRATCH, reg]);
        self.asm.op(Kind::Bld, &[reg, n]);
        self.commit(bit);
        n
    }

    /// Register and number of a bit, loaded if it is in RAM.
    fn fetch(&mut self, bit: Bit) -> (i32, i32) {
        match self.layout.bit(bit) {
            (Home::Reg(reg), n) => (reg.into(), n.into()),
            (Home::Ram(addr), n) => {
                self.load(BYTE, addr);
                (BYTE, n.into())
            }
        }
    }

    /// Stores the byte that [`Self::fetch`] loaded.
    fn commit(&mut self, bit: Bit) {
        if let (Home::Ram(addr), _) = self.layout.bit(bit) {
            self.store(addr, BYTE);
        }
    }

    fn load(&mut self, reg: i32, addr: u16) {
        match addr - self.layout.ram_start {
            near @ 0..64 => self.asm.op(Kind::LddY, &[reg, near.into()]),
            _ => self.asm.op(Kind::Lds, &[reg, addr.into()]),
        }
    }

    fn store(&mut self, addr: u16, reg: i32) {
        match addr - self.layout.ram_start {
            near @ 0..64 => self.asm.op(Kind::StdY, &[near.into(), reg]),
            _ => self.asm.op(Kind::Sts, &[reg, addr.into()]),
        }
    }

    fn constant(&mut self, reg: i32, value: i16) {
        let [low, high] = value.to_le_bytes();
        self.asm.op(Kind::Ldi, &[reg, low.into()]);
        self.asm.op(Kind::Ldi, &[reg + 1, high.into()]);
    }

    /// The left operand.
    fn left(&mut self, value: Value) {
        match value {
            Value::Cell(word) if self.known.a == Some(word) => {}
            Value::Cell(word) => {
                let addr = self.layout.word(word);
                self.load(A, addr);
                self.load(A + 1, addr + 1);
                self.known.a = Some(word);
            }
            Value::Const(value) => {
                self.constant(A, value as i16);
                self.known.a = None;
            }
        }
    }

    /// The right operand.
    fn right(&mut self, value: Value) {
        match value {
            Value::Cell(word) if self.known.a == Some(word) => self.asm.op(Kind::Movw, &[B, A]),
            Value::Cell(word) => {
                let addr = self.layout.word(word);
                self.load(B, addr);
                self.load(B + 1, addr + 1);
            }
            Value::Const(value) => self.constant(B, value as i16),
        }
    }

    /// Both operands, the right one first where the left register pair holds it.
    fn both(&mut self, a: Value, b: Value) {
        if matches!(b, Value::Cell(word) if self.known.a == Some(word)) {
            self.right(b);
            self.left(a);
        } else {
            self.left(a);
            self.right(b);
        }
    }

    /// r25:r24 to a word.
    fn save(&mut self, dst: Word) {
        let addr = self.layout.word(dst);
        self.store(addr, A);
        self.store(addr + 1, A + 1);
        self.known.a = Some(dst);
    }

    fn set(&mut self, dst: Word, src: Value) {
        if src == Value::Const(0) {
            let addr = self.layout.word(dst);
            self.store(addr, ZERO);
            self.store(addr + 1, ZERO);
            if self.known.a == Some(dst) {
                self.known.a = None;
            }
        } else {
            self.left(src);
            self.save(dst);
        }
    }

    fn math(&mut self, op: Math, dst: Word, a: Value, b: Value) {
        match (op, a, b) {
            (Math::Add, a @ Value::Cell(_), Value::Const(c)) | (Math::Add, Value::Const(c), a) => self.add(a, c as i16),
            (Math::Sub, a, Value::Const(c)) => self.add(a, (c as i16).wrapping_neg()),
            (Math::Add, a, b) => {
                self.both(a, b);
                self.asm.op(Kind::Add, &[A, B]);
                self.asm.op(Kind::Adc, &[A + 1, B + 1]);
            }
            (Math::Sub, a, b) => {
                self.both(a, b);
                self.asm.op(Kind::Sub, &[A, B]);
                self.asm.op(Kind::Sbc, &[A + 1, B + 1]);
            }
            (Math::Mul, a, b) => {
                self.both(a, b);
                let entry = *self.multiply.get_or_insert_with(|| self.asm.label());
                self.asm.call(entry);
            }
            (Math::Div, a, b) => {
                self.both(a, b);
                let entry = *self.divide.get_or_insert_with(|| self.asm.label());
                self.asm.call(entry);
            }
        }
        self.save(dst);
    }

    fn add(&mut self, a: Value, constant: i16) {
        self.left(a);
        match constant {
            0 => {}
            1..=63 => self.asm.op(Kind::Adiw, &[A, constant.into()]),
            -63..=-1 => self.asm.op(Kind::Sbiw, &[A, -i32::from(constant)]),
            _ => {
                let [low, high] = constant.wrapping_neg().to_le_bytes();
                self.asm.op(Kind::Subi, &[A, low.into()]);
                self.asm.op(Kind::Sbci, &[A + 1, high.into()]);
            }
        }
    }

    fn and_compare(&mut self, compare: &Compare) {
        if let (Rel::Lt | Rel::Ge, Value::Const(0)) = (compare.rel, compare.b) {
            // Only the sign counts.
            self.left(Value::Cell(compare.a));
            self.asm.op(if compare.rel == Rel::Ge { Kind::Sbrc } else { Kind::Sbrs }, &[A + 1, 7]);
            self.asm.op(Kind::Clt, &[]);
        } else {
            let over = self.asm.label();
            let (holds, _) = self.compare(compare);
            self.asm.branch(holds, over);
            self.asm.op(Kind::Clt, &[]);
            self.asm.place(over);
        }
        self.known.t = None;
    }

    /// Compares; returns the branches that are taken when the comparison holds and when it does not.
    fn compare(&mut self, compare: &Compare) -> (Kind, Kind) {
        match compare.b {
            Value::Const(value) => {
                self.left(Value::Cell(compare.a));
                let [low, high] = (value as i16).to_le_bytes();
                let high_reg = if high == 0 { ZERO } else { SCRATCH };
                self.asm.op(Kind::Cpi, &[A, low.into()]);
                if high != 0 {
                    self.asm.op(Kind::Ldi, &[SCRATCH, high.into()]);
                }
                self.asm.op(Kind::Cpc, &[A + 1, high_reg]);
            }
            b => {
                self.both(Value::Cell(compare.a), b);
                self.asm.op(Kind::Cp, &[A, B]);
                self.asm.op(Kind::Cpc, &[A + 1, B + 1]);
            }
        }
        match compare.rel {
            Rel::Eq => (Kind::Breq, Kind::Brne),
            Rel::Ne => (Kind::Brne, Kind::Breq),
            Rel::Lt => (Kind::Brlt, Kind::Brge),
            Rel::Ge => (Kind::Brge, Kind::Brlt),
        }
    }

    fn branch(&mut self, cond: Cond, then: &[Op], otherwise: &[Op]) {
        // Only one arm: jump past it. Two: the first ends with a jump past the second.
        let (first, second, holds) = if then.is_empty() { (otherwise, then, false) } else { (then, otherwise, true) };
        let (other, end) = (self.asm.label(), self.asm.label());
        match cond {
            Cond::Acc => self.asm.branch(if holds { Kind::Brtc } else { Kind::Brts }, other),
            Cond::Bit(bit) => {
                let (reg, n) = self.fetch(bit);
                self.asm.op(if holds { Kind::Sbrs } else { Kind::Sbrc }, &[reg, n]);
                self.asm.jump(other);
            }
            Cond::Compare(compare) => {
                let (yes, no) = self.compare(&compare);
                self.asm.branch(if holds { no } else { yes }, other);
            }
        }
        let before = self.known;
        let with_t = |holds: bool| Known { t: if cond == Cond::Acc { Some(holds) } else { before.t }, ..before };
        self.known = with_t(holds);
        self.ops(first);
        let after_first = self.known;
        if !second.is_empty() {
            self.asm.jump(end);
        }
        self.asm.place(other);
        self.known = with_t(!holds);
        self.ops(second);
        self.asm.place(end);
        self.known = self.known.meet(after_first);
    }
}
