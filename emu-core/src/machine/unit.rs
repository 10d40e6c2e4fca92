//! Values of which nothing is known: what a recorder of instruction bodies computes with.

use std::ops::{Add, BitAnd, BitOr, BitXor, Not, Shl, Shr, Sub};

use super::{BitOps, WideOps, WordOps};

/// A bit or a byte of which nothing is known.
#[derive(Debug, Clone, Copy)]
pub struct Unit;

/// A pair of bytes: known only when it is a constant of the instruction.
#[derive(Debug, Clone, Copy)]
pub struct Wide(pub Option<u16>);

macro_rules! unit_operators {
    ($($trait:ident $method:ident)*) => { $(
        impl $trait for Unit {
            type Output = Unit;
            fn $method(self, _: Unit) -> Unit { Unit }
        }
    )* };
}
unit_operators! { Add add Sub sub BitAnd bitand BitOr bitor BitXor bitxor }

macro_rules! wide_operators {
    ($($trait:ident $method:ident)*) => { $(
        impl $trait for Wide {
            type Output = Wide;
            fn $method(self, _: Wide) -> Wide { Wide(None) }
        }
    )* };
}
wide_operators! { Add add Sub sub }

impl Not for Unit {
    type Output = Unit;
    fn not(self) -> Unit {
        Unit
    }
}
impl Shl<u32> for Unit {
    type Output = Unit;
    fn shl(self, _: u32) -> Unit {
        Unit
    }
}
impl Shr<u32> for Unit {
    type Output = Unit;
    fn shr(self, _: u32) -> Unit {
        Unit
    }
}
impl From<u8> for Unit {
    fn from(_: u8) -> Unit {
        Unit
    }
}
impl From<u16> for Wide {
    fn from(value: u16) -> Wide {
        Wide(Some(value))
    }
}
impl BitOps for Unit {}
impl WordOps for Unit {
    type Bit = Unit;
    fn bit(self, _: u8) -> Unit {
        Unit
    }
    fn with_bit(self, _: u8, _: Unit) -> Unit {
        Unit
    }
    fn is_zero(self) -> Unit {
        Unit
    }
    fn when(self, _: Unit) -> Unit {
        Unit
    }
    fn lt(self, _: Unit) -> Unit {
        Unit
    }
    fn div_rem(self, _: Unit) -> (Unit, Unit) {
        (Unit, Unit)
    }
}
impl WideOps for Wide {
    type Word = Unit;
    fn join(_: Unit, _: Unit) -> Wide {
        Wide(None)
    }
    fn lo(self) -> Unit {
        Unit
    }
    fn hi(self) -> Unit {
        Unit
    }
    fn mul(_: Unit, _: Unit) -> Wide {
        Wide(None)
    }
}
