//! Values with unknown bits, on which instruction bodies compute while a probe asks for diagnostics.
//!
//! A bit is unknown if, after what the program has done, it can be 0 or 1. The rules are exact for logic and
//! shifts. A sum or difference is computed for the lowest and the highest operands that the unknown bits
//! allow; bits that differ between the two results are unknown too.

use std::ops::{Add, BitAnd, BitOr, BitXor, Not, Shl, Shr, Sub};

use emu_core::machine::{BitOps, ByteOps, WideOps};

/// The unknown bits of a byte, and their origin.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct UnknownBits {
    /// Mask of the unknown bits.
    pub bits: u8,
    /// Mask of the bits of the source byte from which they come. Equal to `bits` until the bits are moved.
    pub source: u8,
    /// True if the bits have been moved to other positions.
    were_moved: bool,
    /// Data address of the register, RAM cell or port that nobody has written or driven. Meaningless if
    /// `bits` is 0.
    pub from: u16,
}

impl UnknownBits {
    /// No unknown bits.
    pub(super) const NONE: UnknownBits = UnknownBits { bits: 0, source: 0, were_moved: false, from: 0 };

    /// The bits `bits` of the byte at the data address `addr` are unknown.
    pub(super) const fn at(addr: u16, bits: u8) -> UnknownBits {
        UnknownBits { bits, source: bits, were_moved: false, from: addr }
    }

    /// Returns the same origin with other unknown bits.
    pub(super) const fn with_bits(self, bits: u8) -> UnknownBits {
        UnknownBits { bits, source: if self.were_moved { self.source } else { bits }, ..self }
    }

    /// Returns the same origin with unknown bits that may be at other positions than in the source.
    const fn moved_to(self, bits: u8) -> UnknownBits {
        UnknownBits { bits, were_moved: true, ..self }
    }

    /// Returns `self` if it has unknown bits, otherwise `other`.
    pub(super) const fn or_else(self, other: UnknownBits) -> UnknownBits {
        if self.bits != 0 { self } else { other }
    }
}

/// A bit that may be unknown: it is unknown if `doubt` has any bits.
#[derive(Debug, Clone, Copy)]
pub(super) struct TrackedBit {
    /// The bit.
    pub on: bool,
    /// Unknown bits of the byte from which the bit was computed.
    pub doubt: UnknownBits,
}

/// A byte with its unknown bits.
#[derive(Debug, Clone, Copy)]
pub(super) struct TrackedByte {
    /// The byte.
    pub byte: u8,
    /// The unknown bits.
    pub doubt: UnknownBits,
    /// True if the byte was computed from the stack pointer.
    pub from_stack_pointer: bool,
}

/// A 16-bit number with its unknown bits.
#[derive(Debug, Clone, Copy)]
pub(super) struct TrackedPair {
    /// The upper byte.
    pub hi: TrackedByte,
    /// The lower byte.
    pub lo: TrackedByte,
}

/// The range of possible values of a number, both ends included.
#[derive(Debug, Clone, Copy)]
pub(super) struct ValueBounds<T> {
    /// The lowest possible value.
    pub(super) lowest: T,
    /// The highest possible value.
    pub(super) highest: T,
}

impl TrackedByte {
    /// Returns a byte without unknown bits.
    pub(super) const fn known(byte: u8) -> TrackedByte {
        TrackedByte { byte, doubt: UnknownBits::NONE, from_stack_pointer: false }
    }

    /// Returns the lowest and the highest possible value.
    const fn bounds(self) -> ValueBounds<u8> {
        ValueBounds { lowest: self.byte & !self.doubt.bits, highest: self.byte | self.doubt.bits }
    }

    /// Returns the result `byte` of a bitwise operation with `other`; `bits` are unknown.
    const fn with(self, other: TrackedByte, byte: u8, bits: u8) -> TrackedByte {
        TrackedByte {
            byte,
            doubt: self.doubt.or_else(other.doubt).with_bits(bits),
            from_stack_pointer: self.from_stack_pointer || other.from_stack_pointer,
        }
    }

    /// Returns the result `byte` of a sum or difference with `other`; `bits` are unknown.
    const fn summed(self, other: TrackedByte, byte: u8, bits: u8) -> TrackedByte {
        let doubt = self.doubt.or_else(other.doubt).moved_to(bits);
        TrackedByte { byte, doubt, from_stack_pointer: self.from_stack_pointer || other.from_stack_pointer }
    }
}

impl TrackedPair {
    /// Returns a number without unknown bits.
    pub(super) const fn known(number: u16) -> TrackedPair {
        let [hi, lo] = number.to_be_bytes();
        TrackedPair { hi: TrackedByte::known(hi), lo: TrackedByte::known(lo) }
    }

    /// Returns the number.
    pub(super) const fn number(self) -> u16 {
        u16::from_be_bytes([self.hi.byte, self.lo.byte])
    }

    const fn doubts(self) -> u16 {
        u16::from_be_bytes([self.hi.doubt.bits, self.lo.doubt.bits])
    }

    /// Returns the unknown bits of the lower byte, or of the upper byte if the lower has none.
    pub(super) const fn doubt(self) -> UnknownBits {
        self.lo.doubt.or_else(self.hi.doubt)
    }

    const fn bounds(self) -> ValueBounds<u16> {
        ValueBounds { lowest: self.number() & !self.doubts(), highest: self.number() | self.doubts() }
    }

    /// Returns the result `number` of an operation with `other`; `bits` are unknown.
    const fn with(self, other: TrackedPair, number: u16, bits: u16) -> TrackedPair {
        let doubt = self.lo.doubt.or_else(self.hi.doubt).or_else(other.lo.doubt).or_else(other.hi.doubt);
        let stack = self.lo.from_stack_pointer
            || self.hi.from_stack_pointer
            || other.lo.from_stack_pointer
            || other.hi.from_stack_pointer;
        let ([hi, lo], [hi_bits, lo_bits]) = (number.to_be_bytes(), bits.to_be_bytes());
        TrackedPair {
            hi: TrackedByte { byte: hi, doubt: doubt.moved_to(hi_bits), from_stack_pointer: stack },
            lo: TrackedByte { byte: lo, doubt: doubt.moved_to(lo_bits), from_stack_pointer: stack },
        }
    }
}

impl From<u8> for TrackedByte {
    fn from(byte: u8) -> TrackedByte {
        TrackedByte::known(byte)
    }
}

impl From<u16> for TrackedPair {
    fn from(number: u16) -> TrackedPair {
        TrackedPair::known(number)
    }
}

impl Add for TrackedByte {
    type Output = TrackedByte;
    fn add(self, other: TrackedByte) -> TrackedByte {
        let (ValueBounds { lowest: a, highest: b }, ValueBounds { lowest: c, highest: d }) =
            (self.bounds(), other.bounds());
        let bits = self.doubt.bits | other.doubt.bits | a.wrapping_add(c) ^ b.wrapping_add(d);
        self.summed(other, self.byte.wrapping_add(other.byte), bits)
    }
}

impl Sub for TrackedByte {
    type Output = TrackedByte;
    fn sub(self, other: TrackedByte) -> TrackedByte {
        let (ValueBounds { lowest: a, highest: b }, ValueBounds { lowest: c, highest: d }) =
            (self.bounds(), other.bounds());
        let bits = self.doubt.bits | other.doubt.bits | a.wrapping_sub(d) ^ b.wrapping_sub(c);
        self.summed(other, self.byte.wrapping_sub(other.byte), bits)
    }
}

impl BitAnd for TrackedByte {
    type Output = TrackedByte;
    fn bitand(self, other: TrackedByte) -> TrackedByte {
        let can_be_1 = self.bounds().highest & other.bounds().highest;
        self.with(other, self.byte & other.byte, (self.doubt.bits | other.doubt.bits) & can_be_1)
    }
}

impl BitOr for TrackedByte {
    type Output = TrackedByte;
    fn bitor(self, other: TrackedByte) -> TrackedByte {
        let can_be_0 = !(self.bounds().lowest | other.bounds().lowest);
        self.with(other, self.byte | other.byte, (self.doubt.bits | other.doubt.bits) & can_be_0)
    }
}

impl BitXor for TrackedByte {
    type Output = TrackedByte;
    fn bitxor(self, other: TrackedByte) -> TrackedByte {
        self.with(other, self.byte ^ other.byte, self.doubt.bits | other.doubt.bits)
    }
}

impl Not for TrackedByte {
    type Output = TrackedByte;
    fn not(self) -> TrackedByte {
        TrackedByte { byte: !self.byte, ..self }
    }
}

impl Shl<u32> for TrackedByte {
    type Output = TrackedByte;
    fn shl(self, n: u32) -> TrackedByte {
        let doubt = self.doubt.moved_to(self.doubt.bits.wrapping_shl(n));
        TrackedByte { byte: self.byte.wrapping_shl(n), doubt, from_stack_pointer: false }
    }
}

impl Shr<u32> for TrackedByte {
    type Output = TrackedByte;
    fn shr(self, n: u32) -> TrackedByte {
        let doubt = self.doubt.moved_to(self.doubt.bits.wrapping_shr(n));
        TrackedByte { byte: self.byte.wrapping_shr(n), doubt, from_stack_pointer: false }
    }
}

impl ByteOps for TrackedByte {
    type Bit = TrackedBit;
    fn bit(self, n: u8) -> TrackedBit {
        let mask = 1u8.wrapping_shl(n.into());
        TrackedBit { on: self.byte & mask != 0, doubt: self.doubt.with_bits(self.doubt.bits & mask) }
    }
    fn with_bit(self, n: u8, bit: TrackedBit) -> TrackedByte {
        let mask = 1u8.wrapping_shl(n.into());
        let byte = self.byte & !mask | if bit.on { mask } else { 0 };
        let rest = self.doubt.with_bits(self.doubt.bits & !mask);
        if bit.doubt.bits == 0 {
            return TrackedByte { byte, doubt: rest, ..self };
        }
        let moved = rest.bits != 0 || bit.doubt.bits != mask;
        let doubt = rest.or_else(bit.doubt).with_bits(rest.bits | mask);
        TrackedByte { byte, doubt: if moved { doubt.moved_to(doubt.bits) } else { doubt }, ..self }
    }
    /// A bit that is known to be 1 decides the result.
    fn is_zero(self) -> TrackedBit {
        let settled = self.bounds().lowest != 0;
        TrackedBit { on: self.byte == 0, doubt: if settled { UnknownBits::NONE } else { self.doubt } }
    }
    fn when(self, bit: TrackedBit) -> TrackedByte {
        let mask = TrackedByte { byte: if bit.on { 0xFF } else { 0 }, ..TrackedByte::known(0) };
        if bit.doubt.bits == 0 { self & mask } else { self & TrackedByte { doubt: bit.doubt.moved_to(0xFF), ..mask } }
    }
    fn lt(self, other: TrackedByte) -> TrackedBit {
        let doubt = self.doubt.or_else(other.doubt);
        TrackedBit { on: self.byte < other.byte, doubt }
    }
    fn div_rem(self, other: TrackedByte) -> (TrackedByte, TrackedByte) {
        let bits = if self.doubt.bits | other.doubt.bits == 0 { 0 } else { 0xFF };
        match (self.byte.checked_div(other.byte), self.byte.checked_rem(other.byte)) {
            (Some(quotient), Some(rest)) => (self.with(other, quotient, bits), self.with(other, rest, bits)),
            _ => (self, other),
        }
    }
}

impl TrackedBit {
    fn with(self, other: TrackedBit, on: bool) -> TrackedBit {
        TrackedBit { on, doubt: self.doubt.or_else(other.doubt) }
    }
}

impl BitAnd for TrackedBit {
    type Output = TrackedBit;
    fn bitand(self, other: TrackedBit) -> TrackedBit {
        self.with(other, self.on & other.on)
    }
}

impl BitOr for TrackedBit {
    type Output = TrackedBit;
    fn bitor(self, other: TrackedBit) -> TrackedBit {
        self.with(other, self.on | other.on)
    }
}

impl BitXor for TrackedBit {
    type Output = TrackedBit;
    fn bitxor(self, other: TrackedBit) -> TrackedBit {
        self.with(other, self.on ^ other.on)
    }
}

impl Not for TrackedBit {
    type Output = TrackedBit;
    fn not(self) -> TrackedBit {
        TrackedBit { on: !self.on, ..self }
    }
}

impl BitOps for TrackedBit {}

impl Add for TrackedPair {
    type Output = TrackedPair;
    fn add(self, other: TrackedPair) -> TrackedPair {
        let (ValueBounds { lowest: a, highest: b }, ValueBounds { lowest: c, highest: d }) =
            (self.bounds(), other.bounds());
        let bits = self.doubts() | other.doubts() | a.wrapping_add(c) ^ b.wrapping_add(d);
        self.with(other, self.number().wrapping_add(other.number()), bits)
    }
}

impl Sub for TrackedPair {
    type Output = TrackedPair;
    fn sub(self, other: TrackedPair) -> TrackedPair {
        let (ValueBounds { lowest: a, highest: b }, ValueBounds { lowest: c, highest: d }) =
            (self.bounds(), other.bounds());
        let bits = self.doubts() | other.doubts() | a.wrapping_sub(d) ^ b.wrapping_sub(c);
        self.with(other, self.number().wrapping_sub(other.number()), bits)
    }
}

impl WideOps for TrackedPair {
    type Byte = TrackedByte;
    fn join(hi: TrackedByte, lo: TrackedByte) -> TrackedPair {
        TrackedPair { hi, lo }
    }
    fn lo(self) -> TrackedByte {
        self.lo
    }
    fn hi(self) -> TrackedByte {
        self.hi
    }
    /// All bits of a product are unknown if a factor has unknown bits, unless the other factor is 0.
    fn mul(a: TrackedByte, b: TrackedByte) -> TrackedPair {
        let nothing = a.bounds().highest == 0 || b.bounds().highest == 0;
        let bits = if nothing || a.doubt.bits | b.doubt.bits == 0 { 0 } else { u16::MAX };
        let (x, y) =
            (TrackedPair { hi: TrackedByte::known(0), lo: a }, TrackedPair { hi: TrackedByte::known(0), lo: b });
        x.with(y, u16::from(a.byte).wrapping_mul(b.byte.into()), bits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bits that differ between any two results, over all values of the unknown bits.
    fn unknown_result_bits(a: TrackedByte, b: TrackedByte, does: impl Fn(u8, u8) -> u8) -> u8 {
        let (mut ones, mut zeros) = (0, 0);
        for x in 0..=255u8 {
            for y in 0..=255u8 {
                if x & !a.doubt.bits == 0 && y & !b.doubt.bits == 0 {
                    let out = does(a.bounds().lowest | x, b.bounds().lowest | y);
                    (ones, zeros) = (ones | out, zeros | !out);
                }
            }
        }
        ones & zeros
    }

    fn of(byte: u8, bits: u8) -> TrackedByte {
        TrackedByte { byte, doubt: UnknownBits::at(5, bits), from_stack_pointer: false }
    }

    /// Bytes with various unknown bits.
    const SAMPLES: [(u8, u8); 12] = [
        (0x00, 0x00),
        (0x00, 0x01),
        (0xFF, 0x80),
        (0x0F, 0x10),
        (0xF0, 0x81),
        (0x55, 0x24),
        (0x80, 0x7F),
        (0x01, 0xFE),
        (0x7E, 0x00),
        (0xAA, 0x00),
        (0x33, 0xFF),
        (0x10, 0x0C),
    ];

    /// Logic is exact; for sums and differences, every bit that can vary is unknown.
    #[test]
    fn nothing_that_varies_is_known() {
        for (x, p) in SAMPLES {
            for (y, q) in SAMPLES {
                let (a, b) = (of(x, p), of(y, q));
                assert_eq!(
                    (a & b).doubt.bits,
                    unknown_result_bits(a, b, |a, b| a & b),
                    "{x:02x} & {y:02x}, {p:02x} {q:02x}"
                );
                assert_eq!(
                    (a | b).doubt.bits,
                    unknown_result_bits(a, b, |a, b| a | b),
                    "{x:02x} | {y:02x}, {p:02x} {q:02x}"
                );
                assert_eq!(
                    (a ^ b).doubt.bits,
                    unknown_result_bits(a, b, |a, b| a ^ b),
                    "{x:02x} ^ {y:02x}, {p:02x} {q:02x}"
                );
                let sum = unknown_result_bits(a, b, u8::wrapping_add);
                assert_eq!((a + b).doubt.bits & sum, sum, "{x:02x} + {y:02x}, {p:02x} {q:02x}");
                let difference = unknown_result_bits(a, b, u8::wrapping_sub);
                assert_eq!((a - b).doubt.bits & difference, difference, "{x:02x} - {y:02x}, {p:02x} {q:02x}");
                let product = unknown_result_bits(a, b, |a, b| (u16::from(a) * u16::from(b)) as u8);
                assert_eq!(
                    TrackedPair::mul(a, b).lo().doubt.bits & product,
                    product,
                    "{x:02x} * {y:02x}, {p:02x} {q:02x}"
                );
            }
            let (a, none) = (of(x, p), of(0, 0));
            assert_eq!((!a).doubt.bits, unknown_result_bits(a, none, |a, _| !a));
            assert_eq!((a << 3).doubt.bits, unknown_result_bits(a, none, |a, _| a << 3));
            assert_eq!((a >> 4).doubt.bits, unknown_result_bits(a, none, |a, _| a >> 4));
            assert_eq!(
                a.is_zero().doubt.bits != 0,
                unknown_result_bits(a, none, |a, _| u8::from(a == 0)) != 0,
                "{x:02x} {p:02x}"
            );
        }
    }

    /// Operands without unknown bits give results without unknown bits.
    #[test]
    fn what_is_known_stays_known() {
        for (x, _) in SAMPLES {
            for (y, _) in SAMPLES {
                let (a, b) = (TrackedByte::known(x), TrackedByte::known(y));
                for out in [a + b, a - b, a & b, a | b, a ^ b, !a, a << 1, a >> 7, TrackedPair::mul(a, b).hi()] {
                    assert_eq!(out.doubt.bits, 0);
                }
                assert_eq!((a + b).byte, x.wrapping_add(y));
                assert_eq!(TrackedPair::mul(a, b).number(), u16::from(x) * u16::from(y));
            }
        }
    }
}
