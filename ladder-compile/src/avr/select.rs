//! Intermediate code to instructions: bits, and what chooses between lists of operations.
//!
//! The accumulator is the T flag, so a contact is a skip over CLT and a coil is BLD: two clocks and one, whatever the
//! values. Words are the matter of [`super::words`] and [`super::compare`], peripherals that of [`super::devices`].

use emu_avr::isa::Kind;

use super::arch::{Asm, Jump};
use super::compare::Row;
use super::devices::Devices;
use super::layout::{Home, Layout};
use super::regs::{BYTE, Regs, SCRATCH};
use super::runtime::{Around, Routine};
use crate::code::Label;
use crate::ir::{Bit, Cond, Ir, Logic, Op, Word};

/// What is known along straight code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Known {
    /// The T flag.
    pub t: Option<bool>,
    /// A word that A holds, and to how many bytes, extended with sign.
    pub a: Option<(Word, usize)>,
}

impl Known {
    /// What is known where two paths meet.
    fn meet(self, other: Known) -> Known {
        Known { t: self.t.filter(|_| self.t == other.t), a: self.a.filter(|_| self.a == other.a) }
    }
}

/// A subroutine, where it begins, and how often it is wanted.
pub type Wanted = (Routine, Label, u32);

/// The code being selected.
pub struct Select<'a> {
    /// Takes the instructions.
    pub asm: &'a mut Asm,
    /// The scan.
    pub ir: &'a Ir,
    /// Places of the cells.
    pub layout: &'a Layout,
    /// Names of registers.
    pub regs: &'a Regs,
    /// How the peripherals are set.
    pub devices: &'a Devices,
    /// Some divisor may be zero or less.
    pub signed_divisors: bool,
    /// What is known here.
    pub known: Known,
    /// The row of comparisons here.
    pub row: Row,
    /// Subroutines so far.
    pub routines: Vec<Wanted>,
    /// Subroutines that are wanted once in the whole program, so that they need be none.
    pub single: &'a [Routine],
    /// What this chip cannot do though it was asked to: a fault of the compiler.
    pub fault: Option<String>,
}

impl Select<'_> {
    /// Appends the code of `ops`.
    pub fn ops(&mut self, ops: &[Op]) {
        ops.iter().zip(1..).for_each(|(op, next)| self.op(op, ops.get(next)));
    }

    /// Appends the code of one operation; `next` is the one that follows it whatever happens.
    pub fn op(&mut self, op: &Op, next: Option<&Op>) {
        match op {
            Op::Acc(value) => self.acc(*value),
            Op::Load { bit, negated } => self.load_bit(*bit, *negated),
            Op::And { bit, negated } => match self.known.t {
                Some(true) => self.load_bit(*bit, *negated),
                Some(false) => {}
                None => self.narrow(*bit, *negated),
            },
            Op::Or { bit, negated } => match self.known.t {
                Some(false) => self.load_bit(*bit, *negated),
                Some(true) => {}
                None => {
                    let (reg, n) = self.fetch(*bit);
                    self.asm.op(if *negated { Kind::Sbrs } else { Kind::Sbrc }, &[reg, n]);
                    self.asm.op(Kind::Set, &[]);
                }
            },
            Op::Store { bit, negated } => self.store_bit(*bit, *negated),
            Op::Put { bit, value } => self.put(*bit, *value),
            Op::Rising(bit) => {
                let n = self.remember(*bit);
                self.asm.op(Kind::Sbrc, &[SCRATCH, n]);
                self.asm.op(Kind::Clt, &[]);
                self.known.t = self.known.t.filter(|t| !t);
            }
            Op::Falling(bit) => {
                let n = self.remember(*bit);
                match self.known.t {
                    Some(true) => self.acc(false),
                    Some(false) => {
                        self.asm.op(Kind::Bst, &[SCRATCH, n]);
                        self.known.t = None;
                    }
                    None => {
                        let low = self.asm.label();
                        self.asm.jump(Jump::If(Kind::Brtc), low);
                        self.asm.op(Kind::Eor, &[SCRATCH, SCRATCH]);
                        self.asm.place(low);
                        self.asm.op(Kind::Bst, &[SCRATCH, n]);
                    }
                }
            }
            Op::AndCompare(compare) => self.and_compare(compare, next),
            Op::Move { dst, src } => self.move_word(*dst, *src),
            Op::Math { op, dst, a, b } => self.math(*op, *dst, *a, *b),
            Op::If { cond, then, otherwise } => self.branch(*cond, then, otherwise),
            Op::Logic { dst, is } => self.logic(*dst, *is),
            Op::Lookup { dst, index, table } => self.look_up(*dst, *index, *table),
            Op::ReadAdc { dst, input } => self.read_adc(*dst, *input),
            Op::SetPwm { duty } => self.set_pwm(*duty),
            Op::Send { value } => self.send(*value),
            Op::Receive { dst } => self.receive(*dst),
            Op::Recall { dst, addr } => self.recall(*dst, *addr),
            Op::Persist { src, addr, busy, scans } => self.persist(*src, *addr, *busy, *scans),
            Op::Module { .. } => self.fault = Some(format!("no code for `{}`", self.ir.text(op))),
        }
    }

    /// A subroutine: called, or in its place where it is the only one of its kind. A is lost but for its result.
    pub fn routine(&mut self, routine: Routine) {
        let known = self.routines.iter_mut().find(|(known, ..)| *known == routine);
        let label = match known {
            Some((_, label, count)) => {
                *count += 1;
                *label
            }
            None => {
                let label = self.asm.label();
                self.routines.push((routine, label, 1));
                label
            }
        };
        if self.single.contains(&routine) {
            let around = Around { regs: self.regs, layout: self.layout, eeprom: self.ir.eeprom };
            routine.body(self.asm, &around);
        } else {
            self.asm.jump(Jump::Call, label);
        }
        self.known.a = None;
    }

    fn acc(&mut self, value: bool) {
        if self.known.t != Some(value) {
            self.asm.op(if value { Kind::Set } else { Kind::Clt }, &[]);
            self.known.t = Some(value);
        }
    }

    fn load_bit(&mut self, bit: Bit, negated: bool) {
        if negated {
            self.acc(true);
            self.narrow(bit, true);
        } else {
            let (reg, n) = self.fetch(bit);
            self.asm.op(Kind::Bst, &[reg, n]);
            self.known.t = None;
        }
    }

    /// T := T and bit.
    fn narrow(&mut self, bit: Bit, negated: bool) {
        let (reg, n) = self.fetch(bit);
        self.asm.op(if negated { Kind::Sbrc } else { Kind::Sbrs }, &[reg, n]);
        self.asm.op(Kind::Clt, &[]);
        self.known.t = None;
    }

    fn store_bit(&mut self, bit: Bit, negated: bool) {
        if let (true, Some(t)) = (negated, self.known.t) {
            return self.put(bit, !t);
        }
        let (reg, n) = self.fetch(bit);
        self.asm.op(Kind::Bld, &[reg, n]);
        if negated {
            self.asm.op(Kind::Ldi, &[SCRATCH, 1 << n]);
            self.asm.op(Kind::Eor, &[reg, SCRATCH]);
        }
        self.commit(bit);
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

    /// A bit of its own for every operation: cleared or set, then changed by a skip for each operand.
    fn logic(&mut self, dst: Bit, is: Logic) {
        let skip = |this: &mut Self, first: bool, skips: Kind, bit: Bit, sets: bool| {
            if first {
                this.asm.op(if sets { Kind::Clt } else { Kind::Set }, &[]);
            }
            let (reg, n) = this.fetch(bit);
            this.asm.op(skips, &[reg, n]);
            this.asm.op(if sets { Kind::Set } else { Kind::Clt }, &[]);
        };
        match is {
            Logic::Copy(a) => skip(self, true, Kind::Sbrc, a, true),
            Logic::Not(a) => skip(self, true, Kind::Sbrs, a, true),
            Logic::And(a, b) => {
                skip(self, true, Kind::Sbrs, a, false);
                skip(self, false, Kind::Sbrs, b, false);
            }
            Logic::Or(a, b) => {
                skip(self, true, Kind::Sbrc, a, true);
                skip(self, false, Kind::Sbrc, b, true);
            }
        }
        self.known.t = None;
        self.store_bit(dst, false);
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
                self.layout.load(self.asm, BYTE, addr);
                (BYTE, n.into())
            }
        }
    }

    /// Stores the byte that [`Self::fetch`] loaded.
    fn commit(&mut self, bit: Bit) {
        if let (Home::Ram(addr), _) = self.layout.bit(bit) {
            self.layout.store(self.asm, addr, BYTE);
        }
    }

    fn branch(&mut self, cond: Cond, then: &[Op], otherwise: &[Op]) {
        if let (Cond::Acc, Some(t)) = (cond, self.known.t) {
            return self.ops(if t { then } else { otherwise });
        }
        // Only one arm: jump past it. Two: the first ends with a jump past the second.
        let (first, second, holds) = if then.is_empty() { (otherwise, then, false) } else { (then, otherwise, true) };
        let (other, end) = (self.asm.label(), self.asm.label());
        match cond {
            Cond::Acc => self.asm.jump(Jump::If(if holds { Kind::Brtc } else { Kind::Brts }), other),
            Cond::Bit(bit) => {
                let (reg, n) = self.fetch(bit);
                if let ([Op::Acc(value)], []) = (first, second)
                    && self.known.t != Some(*value)
                {
                    // One instruction: the skip goes past it.
                    self.asm.op(if holds { Kind::Sbrc } else { Kind::Sbrs }, &[reg, n]);
                    self.asm.op(if *value { Kind::Set } else { Kind::Clt }, &[]);
                    self.known.t = None;
                    return;
                }
                self.asm.op(if holds { Kind::Sbrs } else { Kind::Sbrc }, &[reg, n]);
                self.asm.jump(Jump::To, other);
            }
            Cond::Compare(compare) => {
                let (yes, no) = self.compare(&compare);
                self.asm.jump(Jump::If(if holds { no } else { yes }), other);
            }
        }
        let before = self.known;
        let with_t = |holds: bool| Known { t: if cond == Cond::Acc { Some(holds) } else { before.t }, ..before };
        self.known = with_t(holds);
        self.ops(first);
        let after_first = self.known;
        if !second.is_empty() {
            self.asm.jump(Jump::To, end);
        }
        self.asm.place(other);
        self.known = with_t(!holds);
        self.ops(second);
        self.asm.place(end);
        self.known = self.known.meet(after_first);
    }
}
