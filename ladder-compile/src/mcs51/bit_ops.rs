//! Selects instructions for bits: the accumulator and bit cells.

use super::registers::ByteBit;
use emu_8051::isa::Mcs51OpKind;

use super::known_state::{AccumulatorState, BitSource, ByteOperand};
use super::registers::{ACC, B, F0};
use super::select::Mcs51Selector;
use crate::ir::{BitId, LogicOp};

impl Mcs51Selector<'_> {
    /// Returns the bit address of a flag; loads its byte into A if the flag is not bit-addressable.
    pub(super) fn load_flag(&mut self, flag: BitSource) -> i32 {
        let BitSource::Cell(bit) = flag else { return F0 };
        let ByteBit { byte, bit: n } = self.layout.bit(bit);
        own_address(byte, n).unwrap_or_else(|| {
            self.load(ByteOperand::At(byte));
            ACC + i32::from(n)
        })
    }

    /// Loads the accumulator into the carry; returns whether it is complemented.
    pub(super) fn acc_to_carry(&mut self) -> bool {
        let inverted = match (self.state.in_carry(), self.state.acc.known, self.state.acc.flag) {
            (Some(inverted), ..) => inverted,
            (_, Some(value), _) => {
                self.set_carry(value);
                false
            }
            (_, _, Some((flag, negated))) => {
                let at = self.load_flag(flag);
                self.emit(Mcs51OpKind::MovCBit, &[at]);
                self.state.carry = None;
                negated
            }
            _ => false,
        };
        self.state.acc.carry = Some(inverted);
        inverted
    }

    /// Loads the accumulator into the carry, complemented if `inverted`.
    pub(super) fn acc_to_carry_as(&mut self, inverted: bool) {
        if let (None, Some(value)) = (self.state.in_carry(), self.state.acc.known) {
            self.set_carry(value ^ inverted);
        } else if self.acc_to_carry() != inverted {
            self.emit(Mcs51OpKind::CplC, &[]);
            self.state.carry = self.state.carry.map(|value| !value);
        }
        self.state.acc.carry = Some(inverted);
    }

    /// Emits carry := constant.
    pub(super) fn set_carry(&mut self, value: bool) {
        self.emit(if value { Mcs51OpKind::SetbC } else { Mcs51OpKind::ClrC }, &[]);
        self.state.carry = Some(value);
    }

    /// Saves the accumulator in F0 before the carry changes, if it is `live` and only in the carry.
    pub(super) fn save_carry(&mut self, live: bool) {
        if live
            && self.state.only_in_carry()
            && let Some(inverted) = self.state.acc.carry
        {
            self.emit(Mcs51OpKind::MovBitC, &[F0]);
            self.state.acc.flag = Some((BitSource::Saved, inverted));
        }
        self.state.acc.carry = None;
        self.state.carry = None;
    }

    /// acc := acc and bit, or acc := acc or bit; an OR is an AND of complements.
    pub(super) fn combine(&mut self, and: bool, flag: BitSource, negated: bool) {
        let negated = negated ^ !and;
        if let Some(known) = self.state.acc.known {
            if known == and {
                self.state.acc = AccumulatorState { flag: Some((flag, negated ^ !and)), ..AccumulatorState::default() };
            }
            return;
        }
        let inverted = match (self.state.in_carry(), self.state.acc.flag) {
            (Some(carry), _) => carry ^ !and,
            // Load an operand that is not complemented, and combine the other one with it.
            (None, Some((first, first_negated))) => {
                let (loaded, joined, inverted) = match (first_negated ^ !and, negated) {
                    (false, _) => (first, (flag, negated), false),
                    (true, false) => (flag, (first, true), false),
                    (true, true) => (first, (flag, true), true),
                };
                let at = self.load_flag(loaded);
                self.emit(Mcs51OpKind::MovCBit, &[at]);
                return self.combine_carry(joined.0, joined.1, inverted, and);
            }
            _ => false,
        };
        self.combine_carry(flag, negated, inverted, and);
    }

    /// Combines the carry, complemented if `inverted`, with a bit, complemented if `negated`.
    ///
    /// A complemented carry is combined with the complement by OR.
    fn combine_carry(&mut self, flag: BitSource, negated: bool, inverted: bool, and: bool) {
        let at = self.load_flag(flag);
        let kind = match (inverted, negated) {
            (false, false) => Mcs51OpKind::AnlC,
            (false, true) => Mcs51OpKind::AnlCNot,
            (true, true) => Mcs51OpKind::OrlC,
            (true, false) => Mcs51OpKind::OrlCNot,
        };
        self.emit(kind, &[at]);
        self.state.carry = None;
        self.state.acc = AccumulatorState { carry: Some(inverted ^ !and), ..AccumulatorState::default() };
    }

    /// Emits bit := acc, complemented if `negated`.
    pub(super) fn store_acc(&mut self, bit: BitId, negated: bool) {
        if let Some(value) = self.state.acc.known {
            self.write_constant(bit, value ^ negated);
        } else {
            self.acc_to_carry();
            self.acc_to_carry_as(negated);
            self.write_carry(bit);
        }
        self.state.acc.flag = Some((BitSource::Cell(bit), negated));
    }

    /// Emits bit := constant, and saves the accumulator first if only this bit holds it and it is `live`.
    pub(super) fn put_bit(&mut self, bit: BitId, value: bool, live: bool) {
        if let Some((BitSource::Cell(same), _)) = self.state.acc.flag
            && same == bit
        {
            if live && self.state.acc.known.is_none() {
                self.acc_to_carry();
            }
            self.state.acc.flag = None;
        }
        self.write_constant(bit, value);
    }

    /// bit := carry.
    fn write_carry(&mut self, bit: BitId) {
        let ByteBit { byte, bit: n } = self.layout.bit(bit);
        if let Some(at) = own_address(byte, n) {
            self.emit(Mcs51OpKind::MovBitC, &[at]);
            self.invalidate(byte);
        } else {
            self.load(ByteOperand::At(byte));
            self.emit(Mcs51OpKind::MovBitC, &[ACC + i32::from(n)]);
            self.state.a = None;
            self.save(byte);
        }
    }

    /// bit := constant; the carry is preserved.
    pub(super) fn write_constant(&mut self, bit: BitId, value: bool) {
        let ByteBit { byte, bit: n } = self.layout.bit(bit);
        if let Some(at) = own_address(byte, n) {
            self.emit(if value { Mcs51OpKind::SetbBit } else { Mcs51OpKind::ClrBit }, &[at]);
            self.invalidate(byte);
            return;
        }
        let mask = if value { 1 << n } else { 0xFF ^ (1 << n) };
        if byte < 0x80 {
            self.emit(if value { Mcs51OpKind::OrlDirImm } else { Mcs51OpKind::AnlDirImm }, &[byte.into(), mask]);
            self.invalidate(byte);
        } else {
            self.load(ByteOperand::At(byte));
            self.emit(if value { Mcs51OpKind::OrlImm } else { Mcs51OpKind::AnlImm }, &[mask]);
            self.state.a = None;
            self.save(byte);
        }
    }

    /// Emits an edge: saves the old byte of the memory in A, stores the accumulator in the memory, and
    /// combines both.
    pub(super) fn edge(&mut self, bit: BitId, rising: bool) {
        self.acc_to_carry();
        self.acc_to_carry_as(false);
        let ByteBit { byte, bit: n } = self.layout.bit(bit);
        self.load(ByteOperand::At(byte));
        let old = if own_address(byte, n).is_some() {
            ACC
        } else {
            self.emit(Mcs51OpKind::MovDirA, &[B]);
            B
        };
        self.write_carry(bit);
        // Rising: input and not old. Falling: not (input or not old).
        self.emit(if rising { Mcs51OpKind::AnlCNot } else { Mcs51OpKind::OrlCNot }, &[old + i32::from(n)]);
        self.state.carry = None;
        self.state.acc = AccumulatorState { carry: Some(!rising), ..AccumulatorState::default() };
    }

    /// Emits a three-address operation, which stores its result in a temporary.
    pub(super) fn logic(&mut self, dst: BitId, is: LogicOp) {
        let (a, b) = match is {
            LogicOp::Copy(a) | LogicOp::Not(a) => (a, None),
            LogicOp::And(a, b) => (a, Some((Mcs51OpKind::AnlC, b))),
            LogicOp::Or(a, b) => (a, Some((Mcs51OpKind::OrlC, b))),
        };
        let at = self.load_flag(BitSource::Cell(a));
        self.emit(Mcs51OpKind::MovCBit, &[at]);
        if let Some((kind, b)) = b {
            let at = self.load_flag(BitSource::Cell(b));
            self.emit(kind, &[at]);
        }
        if matches!(is, LogicOp::Not(_)) {
            self.emit(Mcs51OpKind::CplC, &[]);
        }
        self.write_carry(dst);
        (self.state.carry, self.state.acc) = (None, AccumulatorState::default());
    }
}

/// Bit address of a bit; `None` if its byte is not bit-addressable.
fn own_address(byte: u8, n: u8) -> Option<i32> {
    (0x20..0x30).contains(&byte).then(|| i32::from(byte - 0x20) * 8 + i32::from(n))
}
