//! Operations on bits: the accumulator and the cells.

use emu_8051::isa::Kind;

use super::regs::{ACC, B, F0};
use super::select::Select;
use super::state::{Acc, Byte, Flag};
use crate::ir::{Bit, Logic};

impl Select<'_> {
    /// Bit address of a flag, in A where it has none of its own.
    pub(super) fn look(&mut self, flag: Flag) -> i32 {
        let Flag::Cell(bit) = flag else { return F0 };
        let (byte, n) = self.layout.bit(bit);
        own_address(byte, n).unwrap_or_else(|| {
            self.load(Byte::At(byte));
            ACC + i32::from(n)
        })
    }

    /// Makes the carry the accumulator; returns whether complemented.
    pub(super) fn acc_to_carry(&mut self) -> bool {
        let inverted = match (self.now.in_carry(), self.now.acc.known, self.now.acc.flag) {
            (Some(inverted), ..) => inverted,
            (_, Some(value), _) => {
                self.set_carry(value);
                false
            }
            (_, _, Some((flag, negated))) => {
                let at = self.look(flag);
                self.emit(Kind::MovCBit, &[at]);
                self.now.carry = None;
                negated
            }
            _ => false,
        };
        self.now.acc.carry = Some(inverted);
        inverted
    }

    /// Makes the carry the accumulator, complemented if `inverted`.
    pub(super) fn acc_to_carry_as(&mut self, inverted: bool) {
        if let (None, Some(value)) = (self.now.in_carry(), self.now.acc.known) {
            self.set_carry(value ^ inverted);
        } else if self.acc_to_carry() != inverted {
            self.emit(Kind::CplC, &[]);
            self.now.carry = self.now.carry.map(|value| !value);
        }
        self.now.acc.carry = Some(inverted);
    }

    pub(super) fn set_carry(&mut self, value: bool) {
        self.emit(if value { Kind::SetbC } else { Kind::ClrC }, &[]);
        self.now.carry = Some(value);
    }

    /// The carry is about to change: what must last goes to F0.
    pub(super) fn lose_carry(&mut self, live: bool) {
        if live
            && self.now.only_in_carry()
            && let Some(inverted) = self.now.acc.carry
        {
            self.emit(Kind::MovBitC, &[F0]);
            self.now.acc.flag = Some((Flag::Saved, inverted));
        }
        self.now.acc.carry = None;
        self.now.carry = None;
    }

    /// acc := acc and bit, or acc or bit: an "or" is an "and" of complements.
    pub(super) fn combine(&mut self, and: bool, flag: Flag, negated: bool) {
        let negated = negated ^ !and;
        if let Some(known) = self.now.acc.known {
            if known == and {
                self.now.acc = Acc { flag: Some((flag, negated ^ !and)), ..Acc::default() };
            }
            return;
        }
        let inverted = match (self.now.in_carry(), self.now.acc.flag) {
            (Some(carry), _) => carry ^ !and,
            // Whichever is not complemented is loaded, and the other one joins it.
            (None, Some((first, first_negated))) => {
                let (loaded, joined, inverted) = match (first_negated ^ !and, negated) {
                    (false, _) => (first, (flag, negated), false),
                    (true, false) => (flag, (first, true), false),
                    (true, true) => (first, (flag, true), true),
                };
                let at = self.look(loaded);
                self.emit(Kind::MovCBit, &[at]);
                return self.join(joined.0, joined.1, inverted, and);
            }
            _ => false,
        };
        self.join(flag, negated, inverted, and);
    }

    /// The carry, complemented if `inverted`, and the bit, complemented if `negated`: a complemented carry takes the complement
    /// by "or".
    fn join(&mut self, flag: Flag, negated: bool, inverted: bool, and: bool) {
        let at = self.look(flag);
        let kind = match (inverted, negated) {
            (false, false) => Kind::AnlC,
            (false, true) => Kind::AnlCNot,
            (true, true) => Kind::OrlC,
            (true, false) => Kind::OrlCNot,
        };
        self.emit(kind, &[at]);
        self.now.carry = None;
        self.now.acc = Acc { carry: Some(inverted ^ !and), ..Acc::default() };
    }

    pub(super) fn store_acc(&mut self, bit: Bit, negated: bool) {
        if let Some(value) = self.now.acc.known {
            self.write_constant(bit, value ^ negated);
        } else {
            self.acc_to_carry();
            self.acc_to_carry_as(negated);
            self.write_carry(bit);
        }
        self.now.acc.flag = Some((Flag::Cell(bit), negated));
    }

    pub(super) fn put_bit(&mut self, bit: Bit, value: bool, live: bool) {
        if let Some((Flag::Cell(same), _)) = self.now.acc.flag
            && same == bit
        {
            if live && self.now.acc.known.is_none() {
                self.acc_to_carry();
            }
            self.now.acc.flag = None;
        }
        self.write_constant(bit, value);
    }

    /// bit := carry.
    fn write_carry(&mut self, bit: Bit) {
        let (byte, n) = self.layout.bit(bit);
        if let Some(at) = own_address(byte, n) {
            self.emit(Kind::MovBitC, &[at]);
            self.changed(byte);
        } else {
            self.load(Byte::At(byte));
            self.emit(Kind::MovBitC, &[ACC + i32::from(n)]);
            self.now.a = None;
            self.save(byte);
        }
    }

    /// bit := constant; the carry stays.
    pub(super) fn write_constant(&mut self, bit: Bit, value: bool) {
        let (byte, n) = self.layout.bit(bit);
        if let Some(at) = own_address(byte, n) {
            self.emit(if value { Kind::SetbBit } else { Kind::ClrBit }, &[at]);
            self.changed(byte);
            return;
        }
        let mask = if value { 1 << n } else { 0xFF ^ (1 << n) };
        if byte < 0x80 {
            self.emit(if value { Kind::OrlDirImm } else { Kind::AnlDirImm }, &[byte.into(), mask]);
            self.changed(byte);
        } else {
            self.load(Byte::At(byte));
            self.emit(if value { Kind::OrlImm } else { Kind::AnlImm }, &[mask]);
            self.now.a = None;
            self.save(byte);
        }
    }

    /// An edge: the old byte of the memory goes to A, the memory becomes the accumulator, and the two meet.
    pub(super) fn edge(&mut self, bit: Bit, rising: bool) {
        self.acc_to_carry();
        self.acc_to_carry_as(false);
        let (byte, n) = self.layout.bit(bit);
        self.load(Byte::At(byte));
        let old = if own_address(byte, n).is_some() {
            ACC
        } else {
            self.emit(Kind::MovDirA, &[B]);
            B
        };
        self.write_carry(bit);
        // Rising: in and not old. Falling: not (in or not old).
        self.emit(if rising { Kind::AnlCNot } else { Kind::OrlCNot }, &[old + i32::from(n)]);
        self.now.carry = None;
        self.now.acc = Acc { carry: Some(!rising), ..Acc::default() };
    }

    /// The templates of plain translation: one temporary for each operation.
    pub(super) fn logic(&mut self, dst: Bit, is: Logic) {
        let (a, b) = match is {
            Logic::Copy(a) | Logic::Not(a) => (a, None),
            Logic::And(a, b) => (a, Some((Kind::AnlC, b))),
            Logic::Or(a, b) => (a, Some((Kind::OrlC, b))),
        };
        let at = self.look(Flag::Cell(a));
        self.emit(Kind::MovCBit, &[at]);
        if let Some((kind, b)) = b {
            let at = self.look(Flag::Cell(b));
            self.emit(kind, &[at]);
        }
        if matches!(is, Logic::Not(_)) {
            self.emit(Kind::CplC, &[]);
        }
        self.write_carry(dst);
        (self.now.carry, self.now.acc) = (None, Acc::default());
    }
}

/// The bit address of a bit, where it has one.
fn own_address(byte: u8, n: u8) -> Option<i32> {
    (0x20..0x30).contains(&byte).then(|| i32::from(byte - 0x20) * 8 + i32::from(n))
}
