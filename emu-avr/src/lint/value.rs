//! Values of which it is known which bits are known: what the bodies of instructions compute with while a probe asks for
//! diagnostics.
//!
//! A bit is unknown where it could be 0 or 1 for all that the program has done. The rules are exact for logic and shifts; a sum
//! or difference is worked out for the least and the greatest that its unknown bits can make of it, and bits in which those two
//! differ are unknown with them.

use std::ops::{Add, BitAnd, BitOr, BitXor, Not, Shl, Shr, Sub};

use emu_core::machine::{BitOps, WideOps, WordOps};

/// What is not known of a byte, and where that comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Doubt {
    /// The bits.
    pub bits: u8,
    /// The bits of the byte from which they come: the same, until they are moved.
    pub source: u8,
    /// They were moved.
    moved: bool,
    /// The data address of the register, the cell or the port that nobody has written or driven. Means nothing without bits.
    pub from: u16,
}

impl Doubt {
    /// Everything is known.
    pub(super) const NONE: Doubt = Doubt { bits: 0, source: 0, moved: false, from: 0 };

    /// These bits of the byte at a data address are not known.
    pub(super) const fn at(addr: u16, bits: u8) -> Doubt {
        Doubt { bits, source: bits, moved: false, from: addr }
    }

    /// The same doubt of other bits.
    pub(super) const fn of(self, bits: u8) -> Doubt {
        Doubt { bits, source: if self.moved { self.source } else { bits }, ..self }
    }

    /// The same doubt of bits that need not stand where they stood.
    const fn moved(self, bits: u8) -> Doubt {
        Doubt { bits, moved: true, ..self }
    }

    /// This one, or where there is none the other.
    pub(super) const fn or(self, other: Doubt) -> Doubt {
        if self.bits != 0 { self } else { other }
    }
}

/// A bit and what is not known of it: any bits of doubt make it unknown.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bit {
    /// The bit.
    pub on: bool,
    /// The bits of the byte from which it was made that are unknown, if it is.
    pub doubt: Doubt,
}

/// A byte and what is not known of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Value {
    /// The byte.
    pub byte: u8,
    /// What is not known.
    pub doubt: Doubt,
    /// It was worked out from the stack pointer.
    pub stack: bool,
}

/// Two bytes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pair {
    /// The upper byte.
    pub hi: Value,
    /// The lower byte.
    pub lo: Value,
}

impl Value {
    /// A byte that is known.
    pub(super) const fn known(byte: u8) -> Value {
        Value { byte, doubt: Doubt::NONE, stack: false }
    }

    /// The least and the greatest that it can be.
    const fn bounds(self) -> (u8, u8) {
        (self.byte & !self.doubt.bits, self.byte | self.doubt.bits)
    }

    /// The outcome of an operation on this and another byte, of which these bits are unknown.
    const fn with(self, other: Value, byte: u8, bits: u8) -> Value {
        Value { byte, doubt: self.doubt.or(other.doubt).of(bits), stack: self.stack || other.stack }
    }

    /// The outcome of a sum or difference with another byte, of which these bits are unknown.
    const fn summed(self, other: Value, byte: u8, bits: u8) -> Value {
        let doubt = self.doubt.or(other.doubt).moved(bits);
        Value { byte, doubt, stack: self.stack || other.stack }
    }
}

impl Pair {
    /// A number that is known.
    pub(super) const fn known(number: u16) -> Pair {
        let [hi, lo] = number.to_be_bytes();
        Pair { hi: Value::known(hi), lo: Value::known(lo) }
    }

    /// The number.
    pub(super) const fn number(self) -> u16 {
        u16::from_be_bytes([self.hi.byte, self.lo.byte])
    }

    const fn doubts(self) -> u16 {
        u16::from_be_bytes([self.hi.doubt.bits, self.lo.doubt.bits])
    }

    /// What is not known of it, the lower byte first.
    pub(super) const fn doubt(self) -> Doubt {
        self.lo.doubt.or(self.hi.doubt)
    }

    const fn bounds(self) -> (u16, u16) {
        (self.number() & !self.doubts(), self.number() | self.doubts())
    }

    /// The outcome of an operation on this and another number, of which these bits are unknown.
    const fn with(self, other: Pair, number: u16, bits: u16) -> Pair {
        let doubt = self.lo.doubt.or(self.hi.doubt).or(other.lo.doubt).or(other.hi.doubt);
        let stack = self.lo.stack || self.hi.stack || other.lo.stack || other.hi.stack;
        let ([hi, lo], [hi_bits, lo_bits]) = (number.to_be_bytes(), bits.to_be_bytes());
        Pair {
            hi: Value { byte: hi, doubt: doubt.moved(hi_bits), stack },
            lo: Value { byte: lo, doubt: doubt.moved(lo_bits), stack },
        }
    }
}

impl From<u8> for Value {
    fn from(byte: u8) -> Value {
        Value::known(byte)
    }
}

impl From<u16> for Pair {
    fn from(number: u16) -> Pair {
        Pair::known(number)
    }
}

impl Add for Value {
    type Output = Value;
    fn add(self, other: Value) -> Value {
        let ((a, b), (c, d)) = (self.bounds(), other.bounds());
        let bits = self.doubt.bits | other.doubt.bits | a.wrapping_add(c) ^ b.wrapping_add(d);
        self.summed(other, self.byte.wrapping_add(other.byte), bits)
    }
}

impl Sub for Value {
    type Output = Value;
    fn sub(self, other: Value) -> Value {
        let ((a, b), (c, d)) = (self.bounds(), other.bounds());
        let bits = self.doubt.bits | other.doubt.bits | a.wrapping_sub(d) ^ b.wrapping_sub(c);
        self.summed(other, self.byte.wrapping_sub(other.byte), bits)
    }
}

impl BitAnd for Value {
    type Output = Value;
    fn bitand(self, other: Value) -> Value {
        let can_be_1 = self.bounds().1 & other.bounds().1;
        self.with(other, self.byte & other.byte, (self.doubt.bits | other.doubt.bits) & can_be_1)
    }
}

impl BitOr for Value {
    type Output = Value;
    fn bitor(self, other: Value) -> Value {
        let can_be_0 = !(self.bounds().0 | other.bounds().0);
        self.with(other, self.byte | other.byte, (self.doubt.bits | other.doubt.bits) & can_be_0)
    }
}

impl BitXor for Value {
    type Output = Value;
    fn bitxor(self, other: Value) -> Value {
        self.with(other, self.byte ^ other.byte, self.doubt.bits | other.doubt.bits)
    }
}

impl Not for Value {
    type Output = Value;
    fn not(self) -> Value {
        Value { byte: !self.byte, ..self }
    }
}

impl Shl<u32> for Value {
    type Output = Value;
    fn shl(self, n: u32) -> Value {
        let doubt = self.doubt.moved(self.doubt.bits.wrapping_shl(n));
        Value { byte: self.byte.wrapping_shl(n), doubt, stack: false }
    }
}

impl Shr<u32> for Value {
    type Output = Value;
    fn shr(self, n: u32) -> Value {
        let doubt = self.doubt.moved(self.doubt.bits.wrapping_shr(n));
        Value { byte: self.byte.wrapping_shr(n), doubt, stack: false }
    }
}

impl WordOps for Value {
    type Bit = Bit;
    fn bit(self, n: u8) -> Bit {
        let mask = 1u8.wrapping_shl(n.into());
        Bit { on: self.byte & mask != 0, doubt: self.doubt.of(self.doubt.bits & mask) }
    }
    fn with_bit(self, n: u8, bit: Bit) -> Value {
        let mask = 1u8.wrapping_shl(n.into());
        let byte = self.byte & !mask | if bit.on { mask } else { 0 };
        let rest = self.doubt.of(self.doubt.bits & !mask);
        if bit.doubt.bits == 0 {
            return Value { byte, doubt: rest, ..self };
        }
        let moved = rest.bits != 0 || bit.doubt.bits != mask;
        let doubt = rest.or(bit.doubt).of(rest.bits | mask);
        Value { byte, doubt: if moved { doubt.moved(doubt.bits) } else { doubt }, ..self }
    }
    /// A bit that is known to be 1 settles it, whatever the others are.
    fn is_zero(self) -> Bit {
        let settled = self.bounds().0 != 0;
        Bit { on: self.byte == 0, doubt: if settled { Doubt::NONE } else { self.doubt } }
    }
    fn when(self, bit: Bit) -> Value {
        let mask = Value { byte: if bit.on { 0xFF } else { 0 }, ..Value::known(0) };
        if bit.doubt.bits == 0 { self & mask } else { self & Value { doubt: bit.doubt.moved(0xFF), ..mask } }
    }
    fn lt(self, other: Value) -> Bit {
        let doubt = self.doubt.or(other.doubt);
        Bit { on: self.byte < other.byte, doubt }
    }
    fn div_rem(self, other: Value) -> (Value, Value) {
        let bits = if self.doubt.bits | other.doubt.bits == 0 { 0 } else { 0xFF };
        match (self.byte.checked_div(other.byte), self.byte.checked_rem(other.byte)) {
            (Some(quotient), Some(rest)) => (self.with(other, quotient, bits), self.with(other, rest, bits)),
            _ => (self, other),
        }
    }
}

impl Bit {
    fn with(self, other: Bit, on: bool) -> Bit {
        Bit { on, doubt: self.doubt.or(other.doubt) }
    }
}

impl BitAnd for Bit {
    type Output = Bit;
    fn bitand(self, other: Bit) -> Bit {
        self.with(other, self.on & other.on)
    }
}

impl BitOr for Bit {
    type Output = Bit;
    fn bitor(self, other: Bit) -> Bit {
        self.with(other, self.on | other.on)
    }
}

impl BitXor for Bit {
    type Output = Bit;
    fn bitxor(self, other: Bit) -> Bit {
        self.with(other, self.on ^ other.on)
    }
}

impl Not for Bit {
    type Output = Bit;
    fn not(self) -> Bit {
        Bit { on: !self.on, ..self }
    }
}

impl BitOps for Bit {}

impl Add for Pair {
    type Output = Pair;
    fn add(self, other: Pair) -> Pair {
        let ((a, b), (c, d)) = (self.bounds(), other.bounds());
        let bits = self.doubts() | other.doubts() | a.wrapping_add(c) ^ b.wrapping_add(d);
        self.with(other, self.number().wrapping_add(other.number()), bits)
    }
}

impl Sub for Pair {
    type Output = Pair;
    fn sub(self, other: Pair) -> Pair {
        let ((a, b), (c, d)) = (self.bounds(), other.bounds());
        let bits = self.doubts() | other.doubts() | a.wrapping_sub(d) ^ b.wrapping_sub(c);
        self.with(other, self.number().wrapping_sub(other.number()), bits)
    }
}

impl WideOps for Pair {
    type Word = Value;
    fn join(hi: Value, lo: Value) -> Pair {
        Pair { hi, lo }
    }
    fn lo(self) -> Value {
        self.lo
    }
    fn hi(self) -> Value {
        self.hi
    }
    /// Nothing of a product is known where a factor is not, unless the other is 0.
    fn mul(a: Value, b: Value) -> Pair {
        let nothing = a.bounds().1 == 0 || b.bounds().1 == 0;
        let bits = if nothing || a.doubt.bits | b.doubt.bits == 0 { 0 } else { u16::MAX };
        let (x, y) = (Pair { hi: Value::known(0), lo: a }, Pair { hi: Value::known(0), lo: b });
        x.with(y, u16::from(a.byte).wrapping_mul(b.byte.into()), bits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The bits that differ between any two outcomes, whatever the unknown bits are.
    fn varies(a: Value, b: Value, does: impl Fn(u8, u8) -> u8) -> u8 {
        let (mut ones, mut zeros) = (0, 0);
        for x in 0..=255u8 {
            for y in 0..=255u8 {
                if x & !a.doubt.bits == 0 && y & !b.doubt.bits == 0 {
                    let out = does(a.bounds().0 | x, b.bounds().0 | y);
                    (ones, zeros) = (ones | out, zeros | !out);
                }
            }
        }
        ones & zeros
    }

    fn of(byte: u8, bits: u8) -> Value {
        Value { byte, doubt: Doubt::at(5, bits), stack: false }
    }

    /// Bytes and unknown bits of all sorts.
    const SOME: [(u8, u8); 12] = [
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

    /// Logic is exact; of sums and differences nothing that varies is taken for known.
    #[test]
    fn nothing_that_varies_is_known() {
        for (x, p) in SOME {
            for (y, q) in SOME {
                let (a, b) = (of(x, p), of(y, q));
                assert_eq!((a & b).doubt.bits, varies(a, b, |a, b| a & b), "{x:02x} & {y:02x}, {p:02x} {q:02x}");
                assert_eq!((a | b).doubt.bits, varies(a, b, |a, b| a | b), "{x:02x} | {y:02x}, {p:02x} {q:02x}");
                assert_eq!((a ^ b).doubt.bits, varies(a, b, |a, b| a ^ b), "{x:02x} ^ {y:02x}, {p:02x} {q:02x}");
                let sum = varies(a, b, u8::wrapping_add);
                assert_eq!((a + b).doubt.bits & sum, sum, "{x:02x} + {y:02x}, {p:02x} {q:02x}");
                let difference = varies(a, b, u8::wrapping_sub);
                assert_eq!((a - b).doubt.bits & difference, difference, "{x:02x} - {y:02x}, {p:02x} {q:02x}");
                let product = varies(a, b, |a, b| (u16::from(a) * u16::from(b)) as u8);
                assert_eq!(Pair::mul(a, b).lo().doubt.bits & product, product, "{x:02x} * {y:02x}, {p:02x} {q:02x}");
            }
            let (a, none) = (of(x, p), of(0, 0));
            assert_eq!((!a).doubt.bits, varies(a, none, |a, _| !a));
            assert_eq!((a << 3).doubt.bits, varies(a, none, |a, _| a << 3));
            assert_eq!((a >> 4).doubt.bits, varies(a, none, |a, _| a >> 4));
            assert_eq!(a.is_zero().doubt.bits != 0, varies(a, none, |a, _| u8::from(a == 0)) != 0, "{x:02x} {p:02x}");
        }
    }

    /// Where nothing is in doubt nothing comes into doubt.
    #[test]
    fn what_is_known_stays_known() {
        for (x, _) in SOME {
            for (y, _) in SOME {
                let (a, b) = (Value::known(x), Value::known(y));
                for out in [a + b, a - b, a & b, a | b, a ^ b, !a, a << 1, a >> 7, Pair::mul(a, b).hi()] {
                    assert_eq!(out.doubt.bits, 0);
                }
                assert_eq!((a + b).byte, x.wrapping_add(y));
                assert_eq!(Pair::mul(a, b).number(), u16::from(x) * u16::from(y));
            }
        }
    }
}
