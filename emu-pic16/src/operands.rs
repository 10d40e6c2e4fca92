//! Operand kinds of the mid-range PIC16: file registers, bits, constants, targets.

use std::fmt::Write;

use emu_core::table::{InRam, Op, Operand, OperandKind};

use crate::periph::map::Sfr;

/// Where a file register lies: RAM by the address under which it is kept (below 200h), a register of the chip (200h and its
/// number), or nowhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place(pub u16);

impl Place {
    /// Nothing is there: reads 0, writes do nothing.
    pub const NONE: Place = Place(0x3FF);

    /// A register of the chip.
    #[must_use]
    pub const fn sfr(sfr: Sfr) -> Place {
        Place(0x200 + sfr as u16)
    }
}

/// A file register by its address in the bank: as a value the seven bits of the instruction, in an op (and here) its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct F(pub Place);

/// A file register that is RAM, by the address under which it is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ram(pub u16);

/// A bit: as a value its number, in an op (and here) its mask.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct B(pub u8);

/// A constant byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct K(pub u8);

/// Target of CALL and GOTO: the lower eleven bits of an address.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Target(pub u16);

macro_rules! operands {
    ($( $name:ident $wide:literal $label:literal $make:expr, raw $raw:expr, text $text:expr; )*) => { $(
        impl $name {
            /// Name of the kind.
            pub const NAME: &str = $label;
        }

        impl Operand for $name {
            const KIND: OperandKind = OperandKind {
                name: $label, wide: $wide, value: |raw, _, _| raw as i32, raw: $raw, text: $text,
                named: OperandKind::no_name, number: OperandKind::itself, register: OperandKind::its_address,
            };
            #[inline(always)]
            fn from_value(value: u16) -> Self {
                ($make)(value)
            }
        }
    )* };
}

operands! {
    F true "file register" |v| F(Place(v)),
        raw |v, b, _| fits(v & !0x180, b, "address").map_err(|_| format!("address 0x{v:X} is not in 0..=0x1FF")),
        text hex2;
    B false "bit" |v| B(v as u8),
        raw |v, b, _| fits(v, b, "bit"), text |v, out| { let _ = write!(out, "{v}"); };
    K false "constant" |v| K(v as u8),
        raw |v, b, _| if (-128..0).contains(&v) { Ok(v as u32 & 0xFF) } else { fits(v, b, "constant") },
        text hex2;
    Target true "target" Target,
        raw |v, b, _| fits(v & !0x1800, b, "target").map_err(|_| format!("target 0x{v:X} is not in 0..=0x1FFF")),
        text |v, out| { let _ = write!(out, "0x{v:03X}"); };
}

macro_rules! the_same_in_ram {
    ($($name:ident)*) => { $(
        impl InRam for $name {
            type Ram = $name;
            #[inline(always)]
            fn take_in_ram<T>(op: &Op<T>, at: &mut usize) -> $name {
                Self::take(op, at)
            }
        }
    )* };
}
the_same_in_ram! { B K Target }

impl InRam for F {
    type Ram = Ram;
    #[inline(always)]
    fn take_in_ram<K>(op: &Op<K>, at: &mut usize) -> Ram {
        Ram(F::take(op, at).0.0)
    }
}

fn fits(value: i32, bits: u32, what: &str) -> Result<u32, String> {
    let most = (1 << bits) - 1;
    if (0..=most).contains(&value) { Ok(value as u32) } else { Err(format!("{what} {value} is not in 0..={most}")) }
}

fn hex2(value: i32, out: &mut String) {
    let _ = write!(out, "0x{value:02X}");
}
