//! Unknown values: the recorder runs instruction bodies on them.

use std::ops::{Add, BitAnd, BitOr, BitXor, Not, Shl, Shr, Sub};

use super::{BitOps, ByteOps, WideOps};

/// An unknown bit or byte.
#[derive(Debug, Clone, Copy)]
pub struct UnknownValue;

/// A pair of bytes. Its value is known only if it is a constant of the instruction.
#[derive(Debug, Clone, Copy)]
pub struct UnknownWide(pub Option<u16>);

macro_rules! unit_operators {
    ($($trait:ident $method:ident)*) => { $(
        impl $trait for UnknownValue {
            type Output = UnknownValue;
            fn $method(self, _: UnknownValue) -> UnknownValue { UnknownValue }
        }
    )* };
}
unit_operators! { Add add Sub sub BitAnd bitand BitOr bitor BitXor bitxor }

macro_rules! wide_operators {
    ($($trait:ident $method:ident)*) => { $(
        impl $trait for UnknownWide {
            type Output = UnknownWide;
            fn $method(self, _: UnknownWide) -> UnknownWide { UnknownWide(None) }
        }
    )* };
}
wide_operators! { Add add Sub sub }

impl Not for UnknownValue {
    type Output = UnknownValue;
    fn not(self) -> UnknownValue {
        UnknownValue
    }
}
impl Shl<u32> for UnknownValue {
    type Output = UnknownValue;
    fn shl(self, _: u32) -> UnknownValue {
        UnknownValue
    }
}
impl Shr<u32> for UnknownValue {
    type Output = UnknownValue;
    fn shr(self, _: u32) -> UnknownValue {
        UnknownValue
    }
}
impl From<u8> for UnknownValue {
    fn from(_: u8) -> UnknownValue {
        UnknownValue
    }
}
impl From<u16> for UnknownWide {
    fn from(value: u16) -> UnknownWide {
        UnknownWide(Some(value))
    }
}
impl BitOps for UnknownValue {}
impl ByteOps for UnknownValue {
    type Bit = UnknownValue;
    fn bit(self, _: u8) -> UnknownValue {
        UnknownValue
    }
    fn with_bit(self, _: u8, _: UnknownValue) -> UnknownValue {
        UnknownValue
    }
    fn is_zero(self) -> UnknownValue {
        UnknownValue
    }
    fn when(self, _: UnknownValue) -> UnknownValue {
        UnknownValue
    }
    fn lt(self, _: UnknownValue) -> UnknownValue {
        UnknownValue
    }
    fn div_rem(self, _: UnknownValue) -> (UnknownValue, UnknownValue) {
        (UnknownValue, UnknownValue)
    }
}
impl WideOps for UnknownWide {
    type Byte = UnknownValue;
    fn join(_: UnknownValue, _: UnknownValue) -> UnknownWide {
        UnknownWide(None)
    }
    fn lo(self) -> UnknownValue {
        UnknownValue
    }
    fn hi(self) -> UnknownValue {
        UnknownValue
    }
    fn mul(_: UnknownValue, _: UnknownValue) -> UnknownWide {
        UnknownWide(None)
    }
}
