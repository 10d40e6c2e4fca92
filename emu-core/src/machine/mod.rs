//! The traits in which the bodies of instructions are written.
//!
//! A body is a small function, generic over a [`BodyMachine`], in which arithmetic is written with the usual
//! operators. Values are `Copy`. A condition on an emulated value never becomes a Rust `if`. One body
//! therefore has several uses: the interpreter computes with [`ByteValue`] and [`WideValue`], and a recorder
//! computes nothing and notes which registers and memory cells the body accesses.

use std::ops::{Add, BitAnd, BitOr, BitXor, Not, Shl, Shr, Sub};

pub mod unknown;

/// One emulated bit.
pub trait BitOps:
    Copy + BitAnd<Output = Self> + BitOr<Output = Self> + BitXor<Output = Self> + Not<Output = Self>
{
}

/// One emulated byte. `+` and `-` wrap; shifts are logical, by a constant.
pub trait ByteOps:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
    + BitXor<Output = Self>
    + Not<Output = Self>
    + Shl<u32, Output = Self>
    + Shr<u32, Output = Self>
    + From<u8>
{
    /// A single bit of the byte.
    type Bit: BitOps;
    /// Bit `n`, 0 to 7.
    fn bit(self, n: u8) -> Self::Bit;
    /// This byte with bit `n` replaced.
    fn with_bit(self, n: u8, bit: Self::Bit) -> Self;
    /// Whether all bits are 0.
    fn is_zero(self) -> Self::Bit;
    /// This byte if `bit` is set, else 0.
    fn when(self, bit: Self::Bit) -> Self;
    /// Whether this byte is less than `other`, unsigned.
    fn lt(self, other: Self) -> Self::Bit;
    /// Unsigned quotient and remainder. Division by 0 returns `self` and `other` unchanged.
    fn div_rem(self, other: Self) -> (Self, Self);
}

/// Two emulated bytes. `+` and `-` wrap.
pub trait WideOps: Copy + Add<Output = Self> + Sub<Output = Self> + From<u16> {
    /// A single byte of the pair.
    type Byte: ByteOps;
    /// Makes a pair from its upper byte `hi` and its lower byte `lo`.
    fn join(hi: Self::Byte, lo: Self::Byte) -> Self;
    /// The lower byte.
    fn lo(self) -> Self::Byte;
    /// The upper byte.
    fn hi(self) -> Self::Byte;
    /// Unsigned product of two bytes.
    fn mul(a: Self::Byte, b: Self::Byte) -> Self;
}

/// What all emulated machines have in common. Each family adds its registers, flags and memories.
pub trait BodyMachine {
    /// A bit.
    type Bit: BitOps;
    /// A byte.
    type Byte: ByteOps<Bit = Self::Bit>;
    /// A pair of bytes.
    type Wide: WideOps<Byte = Self::Byte>;

    /// Begins an instruction of `words` program words that takes `cycles` machine cycles. `cycles` is 0 if
    /// the body itself charges them.
    #[inline(always)]
    fn begin(&mut self, words: u32, cycles: u32) {
        self.advance(words);
        if cycles != 0 {
            self.charge(cycles);
        }
    }
    /// Advances the program counter by `words` program words and counts one instruction.
    fn advance(&mut self, words: u32);
    /// Adds `cycles` machine cycles to the clock.
    fn charge(&mut self, cycles: u32);
    /// Jumps to the program word `target`.
    fn jump(&mut self, target: u32);
    /// Jumps to the program word `target`, which the program has computed.
    fn goto(&mut self, target: Self::Wide);
    /// Jumps to `target` if `condition` is true, and charges the cycles of the family's branches.
    fn branch_if(&mut self, condition: Self::Bit, target: u32);
    /// Skips the next instruction, of `words` program words, if `condition` is true, and charges the cycles
    /// of the family's skips.
    fn skip_if(&mut self, condition: Self::Bit, words: u32);
}

/// The interpreter's byte: `u8` with wrapping arithmetic.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(transparent)]
pub struct ByteValue(pub u8);

/// The interpreter's pair of bytes: `u16` with wrapping arithmetic.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(transparent)]
pub struct WideValue(pub u16);

impl BitOps for bool {}

impl From<u8> for ByteValue {
    #[inline(always)]
    fn from(value: u8) -> ByteValue {
        ByteValue(value)
    }
}

impl From<u16> for WideValue {
    #[inline(always)]
    fn from(value: u16) -> WideValue {
        WideValue(value)
    }
}

macro_rules! operators {
    ($type:ident $($trait:ident $method:ident |$a:ident, $b:ident| $value:expr;)*) => { $(
        impl $trait for $type {
            type Output = $type;
            #[inline(always)]
            fn $method(self, other: $type) -> $type {
                let ($a, $b) = (self.0, other.0);
                $type($value)
            }
        }
    )* };
}

operators! { ByteValue
    Add    add    |a, b| a.wrapping_add(b);
    Sub    sub    |a, b| a.wrapping_sub(b);
    BitAnd bitand |a, b| a & b;
    BitOr  bitor  |a, b| a | b;
    BitXor bitxor |a, b| a ^ b;
}

operators! { WideValue
    Add    add    |a, b| a.wrapping_add(b);
    Sub    sub    |a, b| a.wrapping_sub(b);
}

impl Not for ByteValue {
    type Output = ByteValue;
    #[inline(always)]
    fn not(self) -> ByteValue {
        ByteValue(!self.0)
    }
}

impl Shl<u32> for ByteValue {
    type Output = ByteValue;
    #[inline(always)]
    fn shl(self, n: u32) -> ByteValue {
        ByteValue(self.0.wrapping_shl(n))
    }
}

impl Shr<u32> for ByteValue {
    type Output = ByteValue;
    #[inline(always)]
    fn shr(self, n: u32) -> ByteValue {
        ByteValue(self.0.wrapping_shr(n))
    }
}

impl ByteOps for ByteValue {
    type Bit = bool;
    #[inline(always)]
    fn bit(self, n: u8) -> bool {
        self.0 & (1u8.wrapping_shl(u32::from(n))) != 0
    }
    #[inline(always)]
    fn with_bit(self, n: u8, bit: bool) -> ByteValue {
        let mask = 1u8.wrapping_shl(u32::from(n));
        ByteValue(self.0 & !mask | u8::from(bit).wrapping_shl(u32::from(n)))
    }
    #[inline(always)]
    fn is_zero(self) -> bool {
        self.0 == 0
    }
    #[inline(always)]
    fn when(self, bit: bool) -> ByteValue {
        ByteValue(self.0 & u8::from(bit).wrapping_neg())
    }
    #[inline(always)]
    fn lt(self, other: ByteValue) -> bool {
        self.0 < other.0
    }
    #[inline(always)]
    fn div_rem(self, other: ByteValue) -> (ByteValue, ByteValue) {
        match (self.0.checked_div(other.0), self.0.checked_rem(other.0)) {
            (Some(quotient), Some(rest)) => (ByteValue(quotient), ByteValue(rest)),
            _ => (self, other),
        }
    }
}

impl WideOps for WideValue {
    type Byte = ByteValue;
    #[inline(always)]
    fn join(hi: ByteValue, lo: ByteValue) -> WideValue {
        WideValue(u16::from_be_bytes([hi.0, lo.0]))
    }
    #[inline(always)]
    fn lo(self) -> ByteValue {
        ByteValue(self.0 as u8)
    }
    #[inline(always)]
    fn hi(self) -> ByteValue {
        ByteValue((self.0 >> 8) as u8)
    }
    #[inline(always)]
    fn mul(a: ByteValue, b: ByteValue) -> WideValue {
        WideValue(u16::from(a.0) * u16::from(b.0))
    }
}
