//! How instructions read and write operands that are bytes or bits.
//!
//! `read` reads the way most instructions do (pins of a port), `read_latch` the way read-modify-write
//! instructions do, and `write` writes. Which of the first two a body calls *is* the port rule (user's
//! manual, "Read-modify-write feature").

use crate::exec::Mcs51Machine;
use crate::operands::{BitAddr, Dir, Imm, RamBit, RamByte, Ri, Rn};

/// A byte that can be read.
pub(crate) trait OperandSource: Copy {
    /// Reads the byte.
    fn read<M: Mcs51Machine>(self, m: &mut M) -> M::Byte;
}

/// A byte that can be read and written.
pub(crate) trait OperandPlace: OperandSource {
    /// Reads the byte for a read-modify-write instruction.
    #[inline(always)]
    fn read_latch<M: Mcs51Machine>(self, m: &mut M) -> M::Byte {
        self.read(m)
    }
    /// Writes the byte.
    fn write<M: Mcs51Machine>(self, m: &mut M, value: M::Byte);
}

/// A bit that can be read and written.
pub(crate) trait BitOperandPlace: Copy {
    /// Reads the bit.
    fn read<M: Mcs51Machine>(self, m: &mut M) -> M::Bit;
    /// Reads the bit for a read-modify-write instruction.
    #[inline(always)]
    fn read_latch<M: Mcs51Machine>(self, m: &mut M) -> M::Bit {
        self.read(m)
    }
    /// Writes the bit if `condition` is true; otherwise its byte is not accessed.
    fn write_if<M: Mcs51Machine>(self, m: &mut M, condition: M::Bit, value: M::Bit);
    /// Writes the bit.
    #[inline(always)]
    fn write<M: Mcs51Machine>(self, m: &mut M, value: M::Bit) {
        self.write_if(m, M::bit_from_bool(true), value);
    }
}

/// The accumulator as an operand.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AccPlace;

/// CY as an operand.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CarryPlace;

macro_rules! sources {
    ($($type:ty: |$p:ident, $m:ident| $get:expr;)*) => { $(
        impl OperandSource for $type {
            #[inline(always)]
            fn read<M: Mcs51Machine>(self, $m: &mut M) -> M::Byte {
                let $p = self;
                $get
            }
        }
    )* };
}

macro_rules! places {
    ($($type:ty: |$p:ident, $m:ident, $v:ident| $set:expr;)*) => { $(
        impl OperandPlace for $type {
            #[inline(always)]
            fn write<M: Mcs51Machine>(self, $m: &mut M, $v: M::Byte) {
                let $p = self;
                $set
            }
        }
    )* };
}

sources! {
    AccPlace: |_p, m| m.acc();
    Rn:  |p, m| m.reg(p.0);
    Ri:  |p, m| { let at = m.reg(p.0); m.idata(at) };
    RamByte: |p, m| m.ram(p.0);
    Dir: |p, m| m.direct(p.0);
    Imm: |p, _m| M::Byte::from(p.0);
}

places! {
    AccPlace: |_p, m, v| m.set_acc(v);
    Rn:  |p, m, v| m.set_reg(p.0, v);
    Ri:  |p, m, v| { let at = m.reg(p.0); m.set_idata(at, v) };
    RamByte: |p, m, v| m.set_ram(p.0, v);
}

impl OperandPlace for Dir {
    #[inline(always)]
    fn read_latch<M: Mcs51Machine>(self, m: &mut M) -> M::Byte {
        m.direct_latch(self.0)
    }
    #[inline(always)]
    fn write<M: Mcs51Machine>(self, m: &mut M, value: M::Byte) {
        m.set_direct(self.0, value);
    }
}

impl BitOperandPlace for CarryPlace {
    #[inline(always)]
    fn read<M: Mcs51Machine>(self, m: &mut M) -> M::Bit {
        m.carry()
    }
    #[inline(always)]
    fn write_if<M: Mcs51Machine>(self, m: &mut M, condition: M::Bit, value: M::Bit) {
        let kept = m.carry() & !condition;
        m.set_carry(kept | value & condition);
    }
    #[inline(always)]
    fn write<M: Mcs51Machine>(self, m: &mut M, value: M::Bit) {
        m.set_carry(value);
    }
}

impl BitOperandPlace for RamBit {
    #[inline(always)]
    fn read<M: Mcs51Machine>(self, m: &mut M) -> M::Bit {
        m.ram_bit(self)
    }
    #[inline(always)]
    fn write_if<M: Mcs51Machine>(self, m: &mut M, condition: M::Bit, value: M::Bit) {
        let kept = m.ram_bit(self) & !condition;
        m.set_ram_bit(self, kept | value & condition);
    }
    #[inline(always)]
    fn write<M: Mcs51Machine>(self, m: &mut M, value: M::Bit) {
        m.set_ram_bit(self, value);
    }
}

impl BitOperandPlace for BitAddr {
    #[inline(always)]
    fn read<M: Mcs51Machine>(self, m: &mut M) -> M::Bit {
        m.direct_bit(self.0)
    }
    #[inline(always)]
    fn read_latch<M: Mcs51Machine>(self, m: &mut M) -> M::Bit {
        m.direct_bit_latch(self.0)
    }
    #[inline(always)]
    fn write_if<M: Mcs51Machine>(self, m: &mut M, condition: M::Bit, value: M::Bit) {
        m.set_direct_bit_if(condition, self.0, value);
    }
}
