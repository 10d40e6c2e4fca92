//! Operand kinds of the MCS-51: registers, addresses of bytes and bits, constants, targets.
//!
//! Each kind is also an operand of instruction bodies: `operand_place.rs` defines how it is read, how its
//! latch is read, and how it is written.

use std::fmt::Write;

use emu_core::CoreError;
use emu_core::table::{InstructionLocation, Operand, OperandKind, PredecodedOp, RamOperand, check_field};

use crate::chips::{BITS, SFRS};

macro_rules! operands {
    ($( $(#[doc = $doc:literal])+ $name:ident($type:ty) $wide:literal $label:literal
        value $value:expr, raw $raw:expr, text $text:expr, named $named:expr, number $number:expr; )*) => { $(
        $(#[doc = $doc])+
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub struct $name(pub $type);

        impl $name {
            /// Name of the kind.
            pub const NAME: &str = $label;
        }

        impl Operand for $name {
            const KIND: OperandKind =
                OperandKind {
                    name: $label, wide: $wide, decode: $value, encode: $raw, write_text: $text, parse_name: $named, check_number: $number,
                    check_register: OperandKind::same_address,
                };
            #[inline(always)]
            fn from_value(value: u16) -> Self {
                $name(value as $type)
            }
        }
    )* };
}

operands! {
    /// A register of the selected bank, R0 to R7.
    Rn(u8) false "register R0 to R7"
        value unchanged, raw |v, b, _| check_field(v, b, "register"), text write_register, named |t| parse_register(t, 8), number reject_number;
    /// A register used as a pointer, R0 or R1.
    Ri(u8) false "register R0 or R1"
        value unchanged, raw |v, b, _| check_field(v, b, "register"), text write_register, named |t| parse_register(t, 2), number reject_number;
    /// A direct address: RAM below 80h, special function registers from 80h on.
    Dir(u8) false "direct address"
        value unchanged, raw |v, b, _| check_field(v, b, "address"), text write_byte, named parse_byte, number OperandKind::same_number;
    /// A bit address: below 80h a bit of the RAM bytes 20h to 2Fh, from 80h on a bit of a special function
    /// register whose address is divisible by 8.
    BitAddr(u8) false "bit address"
        value unchanged, raw |v, b, _| check_field(v, b, "bit address"), text write_bit, named parse_bit, number OperandKind::same_number;
    /// A constant byte. A negative value is the low byte of its 16-bit two's complement, whose high byte must
    /// be all ones (Intel, MCS-51 Macro Assembler User's Guide, range of 8-bit values): `NOT 0F0H` is 0Fh.
    Imm(u8) false "constant"
        value unchanged, raw |v, b, _| if (-0x100..0).contains(&v) { Ok(v as u32 & 0xFF) } else { check_field(v, b, "constant") },
        text write_hex2, named OperandKind::never_a_name, number OperandKind::same_number;
    /// The constant of MOV DPTR.
    Imm16(u16) true "constant"
        value unchanged, raw |v, b, _| if (-0x1_0000..0).contains(&v) { Ok(v as u32 & 0xFFFF) } else { check_field(v, b, "constant") },
        text write_hex4, named OperandKind::never_a_name, number OperandKind::same_number;
    /// The target of LJMP and LCALL.
    Abs(u16) true "target"
        value unchanged, raw |v, b, _| check_field(v, b, "target"), text write_hex4, named OperandKind::never_a_name, number OperandKind::same_number;
    /// The target of AJMP and ACALL, in the 2 KB page of the next instruction.
    Page(u16) true "target in the page"
        value |raw, _, site| (next_address(site) & 0xF800 | raw as i32) & 0xFFFF, raw in_page, text write_hex4, named OperandKind::never_a_name, number OperandKind::same_number;
    /// A relative target. Its value is the address; in an op, and in this type, it is the distance from the
    /// next instruction.
    Rel(i8) false "target"
        value |raw, _, site| (next_address(site) + i32::from(raw as u8 as i8)) & 0xFFFF, raw encode_distance, text write_hex4, named OperandKind::never_a_name, number OperandKind::same_number;
}

/// A direct address in RAM.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RamByte(pub u8);

/// A bit in RAM: byte address and mask.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RamBit {
    /// Byte address, 20h to 2Fh.
    pub byte: u8,
    /// Mask with one bit set.
    pub mask: u8,
}

impl RamBit {
    /// Makes the bit with the bit address `addr`, which must be below 80h.
    #[must_use]
    pub const fn of_address(addr: u8) -> RamBit {
        RamBit { byte: 0x20 | (addr >> 3 & 0x0F), mask: 1 << (addr & 7) }
    }

    /// The bit address.
    #[must_use]
    pub const fn addr(self) -> u8 {
        (self.byte & 0x0F) << 3 | self.mask.trailing_zeros() as u8
    }
}

macro_rules! same_in_ram {
    ($($name:ident)*) => { $(
        impl RamOperand for $name {
            type Ram = $name;
            #[inline(always)]
            fn decode_next_in_ram<K>(op: &PredecodedOp<K>, at: &mut usize) -> $name {
                Self::decode_next(op, at)
            }
        }
    )* };
}
same_in_ram! { Rn Ri Imm Rel }

impl RamOperand for Dir {
    type Ram = RamByte;
    #[inline(always)]
    fn decode_next_in_ram<K>(op: &PredecodedOp<K>, at: &mut usize) -> RamByte {
        RamByte(Dir::decode_next(op, at).0)
    }
}

impl RamOperand for BitAddr {
    type Ram = RamBit;
    #[inline(always)]
    fn decode_next_in_ram<K>(op: &PredecodedOp<K>, at: &mut usize) -> RamBit {
        *at += 2;
        RamBit { byte: op.args[*at - 2], mask: op.args[*at - 1] }
    }
}

/// Converts a plain field: the value is the field.
fn unchanged(raw: u32, _: u32, _: &InstructionLocation) -> i32 {
    raw as i32
}

/// Address of the next instruction.
fn next_address(site: &InstructionLocation) -> i32 {
    site.pc.wrapping_add(site.len) as i32 & 0xFFFF
}

fn in_page(value: i32, _: u32, site: &InstructionLocation) -> Result<u32, CoreError> {
    let page = next_address(site) & 0xF800;
    if value & !0x7FF == page {
        Ok(value as u32 & 0x7FF)
    } else {
        Err(CoreError::OutsidePage { target: value, page_start: page, page_end: page + 0x7FF })
    }
}

fn encode_distance(value: i32, _: u32, site: &InstructionLocation) -> Result<u32, CoreError> {
    let straight = value.wrapping_sub(next_address(site));
    let around = straight as i16;
    if (0..0x1_0000).contains(&value) && i8::try_from(around).is_ok() {
        Ok(around as u32 & 0xFF)
    } else {
        Err(CoreError::TargetTooFar { target: value, distance: straight, unit: "bytes", low: -128, high: 127 })
    }
}

fn write_register(value: i32, out: &mut String) {
    let _ = write!(out, "R{value}");
}

fn parse_register(text: &str, count: i32) -> Option<i32> {
    text.strip_prefix(['R', 'r'])?.parse().ok().filter(|n| (0..count).contains(n))
}

fn write_hex2(value: i32, out: &mut String) {
    let _ = write!(out, "0x{value:02X}");
}

fn write_hex4(value: i32, out: &mut String) {
    let _ = write!(out, "0x{value:04X}");
}

fn reject_number(value: i32, _: &InstructionLocation) -> Result<i32, CoreError> {
    Err(CoreError::NumberForRegister { value })
}

/// Writes a direct address as the data-sheet name of its special function register, or as a number.
fn write_byte(value: i32, out: &mut String) {
    match SFRS.iter().find(|r| i32::from(r.addr) == value) {
        Some(register) => out.push_str(register.name),
        None => write_hex2(value, out),
    }
}

/// The address of a special function register that any chip of the family has.
fn parse_byte(text: &str) -> Option<i32> {
    SFRS.iter().find(|r| r.name.eq_ignore_ascii_case(text)).map(|r| i32::from(r.addr))
}

/// Parses the byte address before the dot of a bit, as the disassembler writes it.
fn parse_number(text: &str) -> Option<i32> {
    text.strip_prefix("0x").map_or_else(|| text.parse().ok(), |hex| i32::from_str_radix(hex, 16).ok())
}

/// Writes a bit as `P1.0`, `PSW.7` or `0x20.3`.
fn write_bit(value: i32, out: &mut String) {
    let byte = if value < 0x80 { 0x20 + (value >> 3) } else { value & 0xF8 };
    write_byte(byte, out);
    let _ = write!(out, ".{}", value & 7);
}

/// Parses the name of a bit that any chip of the family has, or a bit of a byte by number.
fn parse_bit(text: &str) -> Option<i32> {
    if let Some(named) = BITS.iter().find(|b| b.name.eq_ignore_ascii_case(text)) {
        return Some(i32::from(named.addr));
    }
    let (at, n) = text.rsplit_once('.')?;
    let n = n.parse::<i32>().ok().filter(|n| (0..8).contains(n))?;
    match parse_byte(at).or_else(|| parse_number(at))? {
        byte @ 0x20..=0x2F => Some((byte - 0x20) * 8 + n),
        byte @ 0x80..=0xFF if byte % 8 == 0 => Some(byte + n),
        _ => None,
    }
}
