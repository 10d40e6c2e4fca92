//! Operand kinds of the AVR instructions: registers, constants, addresses, jump targets.

use std::fmt::Write;

use emu_core::CoreError;
use emu_core::table::{InstructionLocation, Operand, OperandKind, check_field, check_range};

macro_rules! operands {
    ($( $(#[doc = $doc:literal])+ $name:ident($type:ty) $wide:literal $label:literal
        value $value:expr, raw $raw:expr, text $text:expr, named $named:expr, number $number:expr, register $register:expr; )*) => { $(
        $(#[doc = $doc])+
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub struct $name(pub $type);

        impl Operand for $name {
            const KIND: OperandKind =
                OperandKind {
                    name: $label, wide: $wide, decode: $value, encode: $raw, write_text: $text, parse_name: $named, check_number: $number,
                    check_register: $register,
                };
            #[inline(always)]
            fn from_value(value: u16) -> Self {
                $name(value as $type)
            }
        }
    )* };
}

/// A plain field: its bits are the value.
fn unchanged(raw: u32, _: u32, _: &InstructionLocation) -> i32 {
    raw as i32
}

/// Encodes an even register number from `low` to `high`.
fn check_even(value: i32, low: i32, high: i32, what: &'static str) -> Result<u32, CoreError> {
    if value % 2 != 0 {
        return Err(CoreError::OddRegister { what, number: value });
    }
    check_range(value, low, high, what).map(|v| v / 2)
}

fn write_register(value: i32, out: &mut String) {
    let _ = write!(out, "r{value}");
}

/// Parses r0 to r31, or XL to ZH.
fn parse_register(text: &str) -> Option<i32> {
    match text.to_ascii_uppercase().as_str() {
        "XL" => Some(26),
        "XH" => Some(27),
        "YL" => Some(28),
        "YH" => Some(29),
        "ZL" => Some(30),
        "ZH" => Some(31),
        other => other.strip_prefix('R')?.parse().ok().filter(|n| (0..32).contains(n)),
    }
}

/// Parses a register pair by its lower register, or by the name of a pointer.
fn parse_pair(text: &str) -> Option<i32> {
    match text {
        "X" | "x" => Some(26),
        "Y" | "y" => Some(28),
        "Z" | "z" => Some(30),
        other => parse_register(other),
    }
}

fn write_decimal(value: i32, out: &mut String) {
    let _ = write!(out, "{value}");
}

fn write_hex2(value: i32, out: &mut String) {
    let _ = write!(out, "0x{value:02X}");
}

fn write_hex4(value: i32, out: &mut String) {
    let _ = write!(out, "0x{value:04X}");
}

/// Writes a word address as a byte address, as objdump and gdb do for AVR programs.
fn write_target(value: i32, out: &mut String) {
    let _ = write!(out, "0x{:04X}", value * 2);
}

/// Converts a jump target in the source, which is a byte address, to a word address.
fn bytes_to_words(bytes: i32, _: &InstructionLocation) -> Result<i32, CoreError> {
    if bytes % 2 == 0 { Ok(bytes / 2) } else { Err(CoreError::OddTarget { address: bytes }) }
}

/// Converts a data address from 20h to 5Fh to an I/O address from 0 on.
fn io_address(addr: i32) -> Result<i32, CoreError> {
    if (0x20..0x60).contains(&addr) { Ok(addr - 0x20) } else { Err(CoreError::NoIoAddress { address: addr }) }
}

/// Decodes a relative jump to an absolute word address, which wraps at the end of program memory.
fn decode_relative(raw: u32, bits: u32, site: &InstructionLocation) -> i32 {
    let offset = ((raw << (32 - bits)) as i32) >> (32 - bits);
    ((site.pc as i32 + 1 + offset) as u32 & site.pc_mask) as i32
}

/// Encodes the distance to a target in words. Where program memory wraps, the shorter way counts.
fn encode_distance(value: i32, bits: u32, site: &InstructionLocation) -> Result<u32, CoreError> {
    let half = 1i32 << (bits - 1);
    let straight = value - (site.pc as i32 + 1);
    let size = site.pc_mask as i32 + 1;
    let wrapped = [straight, straight - size, straight + size];
    match wrapped.into_iter().find(|d| (-half..half).contains(d)) {
        Some(d) if (0..size).contains(&value) => Ok(d as u32 & ((1 << bits) - 1)),
        _ => Err(CoreError::TargetTooFar {
            target: value * 2,
            distance: straight,
            unit: "words",
            low: -half,
            high: half - 1,
        }),
    }
}

operands! {
    /// Any register, r0 to r31.
    R(u8) false "register"
        value unchanged, raw |v, b, _| check_field(v, b, "register"), text write_register, named parse_register, number OperandKind::same_number, register OperandKind::same_address;
    /// An upper register, r16 to r31.
    Rh(u8) false "register r16 to r31"
        value |raw, _, _| raw as i32 + 16, raw |v, _, _| check_range(v, 16, 31, "register"), text write_register, named parse_register, number OperandKind::same_number, register OperandKind::same_address;
    /// A register of MULSU and the fractional multiplications, r16 to r23.
    Rm(u8) false "register r16 to r23"
        value |raw, _, _| raw as i32 + 16, raw |v, _, _| check_range(v, 16, 23, "register"), text write_register, named parse_register, number OperandKind::same_number, register OperandKind::same_address;
    /// The lower register of a pair, r0, r2 .. r30.
    Rp(u8) false "register pair"
        value |raw, _, _| raw as i32 * 2, raw |v, _, _| check_even(v, 0, 30, "register"), text write_register, named parse_pair, number OperandKind::same_number, register OperandKind::same_address;
    /// The lower register of an upper pair, r24, r26, r28 or r30.
    Rw(u8) false "register pair from r24"
        value |raw, _, _| raw as i32 * 2 + 24, raw |v, _, _| check_even(v, 24, 30, "register"), text write_register, named parse_pair, number OperandKind::same_number, register OperandKind::same_address;
    /// A constant byte, or a smaller field of ADIW and SBIW; negative constants are encoded in two's
    /// complement.
    K(u8) false "constant"
        value unchanged,
        raw |v, b, _| if b == 8 && v < 0 { Ok(v as u32 & 0xFF) } else { check_field(v, b, "constant") },
        text write_hex2, named OperandKind::never_a_name, number OperandKind::same_number, register OperandKind::same_address;
    /// An I/O address, 0 to 63 (0 to 31 for the single-bit instructions); the data address is 0x20 higher.
    A(u8) false "I/O address"
        value unchanged, raw |v, b, _| check_field(v, b, "I/O address"), text write_hex2, named OperandKind::never_a_name, number OperandKind::same_number, register io_address;
    /// A bit number, 0 to 7.
    B(u8) false "bit"
        value unchanged, raw |v, b, _| check_field(v, b, "bit"), text write_decimal, named OperandKind::never_a_name, number OperandKind::same_number, register OperandKind::same_address;
    /// A displacement, 0 to 63.
    Q(u8) false "displacement"
        value unchanged, raw |v, b, _| check_field(v, b, "displacement"), text write_decimal, named OperandKind::never_a_name, number OperandKind::same_number, register OperandKind::same_address;
    /// A data address of the two-word loads and stores.
    D16(u16) true "data address"
        value unchanged, raw |v, b, _| check_field(v, b, "data address"), text write_hex4, named OperandKind::never_a_name, number OperandKind::same_number, register OperandKind::same_address;
    /// A relative target, kept as an absolute word address.
    Rel(u16) true "target"
        value decode_relative, raw encode_distance, text write_target, named OperandKind::never_a_name, number bytes_to_words, register OperandKind::same_address;
    /// The absolute target of JMP and CALL, a word address.
    Abs(u16) true "target"
        value unchanged, raw |v, b, _| check_field(v, b, "target"), text write_target, named OperandKind::never_a_name, number bytes_to_words, register OperandKind::same_address;
    /// Words to skip: the length of the next instruction. Not in any pattern.
    Skip(u8) false "skip"
        value |_, _, site| site.next_len as i32, raw |_, _, _| Ok(0), text |_, _| {}, named OperandKind::never_a_name, number OperandKind::same_number, register OperandKind::same_address;
}
