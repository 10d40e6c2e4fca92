//! Operand kinds of the PIC16 instructions: file registers, bits, constants, jump targets.

use std::fmt::Write;

use emu_core::CoreError;
use emu_core::table::{Operand, OperandKind, PredecodedOp, RamOperand, check_field};

use crate::periph::map::Sfr;

/// Resolved address of a file register: RAM by its canonical address (below 200h), a register of the chip
/// (200h plus its number), or unimplemented.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FileAddress(pub u16);

impl FileAddress {
    /// Unimplemented: reads 0, writes have no effect.
    pub const NONE: FileAddress = FileAddress(0x3FF);

    /// Returns the address of a register of the chip.
    #[must_use]
    pub const fn sfr(sfr: Sfr) -> FileAddress {
        FileAddress(0x200 + sfr as u16)
    }
}

/// A file register by its address in the bank. As an operand value it is the seven bits of the instruction;
/// in an op (and here) it is the resolved address.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct F(pub FileAddress);

/// A file register in RAM, by its canonical address.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RamCell(pub u16);

/// A bit. As an operand value it is the bit number; in an op (and here) it is the mask.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct B(pub u8);

/// A constant byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct K(pub u8);

/// Target of CALL and GOTO: the low eleven bits of an address.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct JumpTarget(pub u16);

macro_rules! operands {
    ($( $name:ident $wide:literal $label:literal $make:expr, raw $raw:expr, text $text:expr; )*) => { $(
        impl $name {
            /// Name of the kind.
            pub const NAME: &str = $label;
        }

        impl Operand for $name {
            const KIND: OperandKind = OperandKind {
                name: $label, wide: $wide, decode: |raw, _, _| raw as i32, encode: $raw, write_text: $text,
                parse_name: OperandKind::never_a_name, check_number: OperandKind::same_number, check_register: OperandKind::same_address,
            };
            #[inline(always)]
            fn from_value(value: u16) -> Self {
                ($make)(value)
            }
        }
    )* };
}

operands! {
    F true "file register" |v| F(FileAddress(v)),
        raw |v, b, _| check_field(v & !0x180, b, "address").map_err(|_| CoreError::AddressOutOfRange { what: "address", address: v, high: 0x1FF }),
        text write_hex2;
    B false "bit" |v| B(v as u8),
        raw |v, b, _| check_field(v, b, "bit"), text |v, out| { let _ = write!(out, "{v}"); };
    K false "constant" |v| K(v as u8),
        raw |v, b, _| if (-128..0).contains(&v) { Ok(v as u32 & 0xFF) } else { check_field(v, b, "constant") },
        text write_hex2;
    JumpTarget true "target" JumpTarget,
        raw |v, b, _| check_field(v & !0x1800, b, "target").map_err(|_| CoreError::AddressOutOfRange { what: "target", address: v, high: 0x1FFF }),
        text |v, out| { let _ = write!(out, "0x{v:03X}"); };
}

macro_rules! same_in_ram {
    ($($name:ident)*) => { $(
        impl RamOperand for $name {
            type Ram = $name;
            #[inline(always)]
            fn decode_next_in_ram<T>(op: &PredecodedOp<T>, at: &mut usize) -> $name {
                Self::decode_next(op, at)
            }
        }
    )* };
}
same_in_ram! { B K JumpTarget }

impl RamOperand for F {
    type Ram = RamCell;
    #[inline(always)]
    fn decode_next_in_ram<K>(op: &PredecodedOp<K>, at: &mut usize) -> RamCell {
        RamCell(F::decode_next(op, at).0.0)
    }
}

fn write_hex2(value: i32, out: &mut String) {
    let _ = write!(out, "0x{value:02X}");
}
