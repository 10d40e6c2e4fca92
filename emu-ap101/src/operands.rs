//! Operand kinds of AP101: addresses of single bits, jump targets, data; and the location of an address on a
//! machine.

use std::fmt::Write;

use emu_core::CoreError;
use emu_core::table::{Operand, OperandKind, PredecodedOp, RamOperand, check_field};

/// Letters of the zones, indexed by bits 10 and 9 of an address.
pub const ZONE_LETTERS: [char; 4] = ['I', 'E', 'R', 'M'];

/// Number of addresses per zone.
pub const ZONE_BITS: u16 = 512;

/// Number of bits of memory that are read and written directly: input latches, then M with the images of the
/// outputs.
pub const CELL_COUNT: usize = 1024;

/// The first cell of M.
pub const M_START: u16 = 512;
/// The first cell of the images of the outputs.
pub const IMAGE_START: u16 = M_START + 256;

/// The location of an address on a machine with its channels and modules, in 16 bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BitAddress(pub u16);

/// What a [`BitAddress`] refers to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BitLocation {
    /// A cell: below 512 an input latch, from 512 on a bit of M.
    Cell(u16),
    /// An output channel, by number.
    Output(u16),
    /// A module, by number: its input when written, its output Q when read.
    Module(u16),
    /// The running bit of a module; writing 1 resets the module.
    Running(u16),
    /// The preset port of a module.
    Port(u16),
    /// Nothing; the value is the address in the instruction.
    Nothing(u16),
}

impl BitAddress {
    /// Packs a location into 16 bits.
    #[must_use]
    pub const fn from_location(spot: BitLocation) -> BitAddress {
        BitAddress(match spot {
            BitLocation::Cell(cell) => cell % CELL_COUNT as u16,
            BitLocation::Output(n) => 0x400 + n % 256,
            BitLocation::Module(n) => 0x500 + n % 128,
            BitLocation::Running(n) => 0x580 + n % 128,
            BitLocation::Port(n) => 0x600 + n % 128,
            BitLocation::Nothing(addr) => 0x800 + addr % 0x800,
        })
    }

    /// Unpacks the location.
    #[inline(always)]
    #[must_use]
    pub const fn location(self) -> BitLocation {
        match self.0 {
            0..=0x3FF => BitLocation::Cell(self.0),
            0x400..=0x4FF => BitLocation::Output(self.0 % 256),
            0x500..=0x57F => BitLocation::Module(self.0 % 128),
            0x580..=0x5FF => BitLocation::Running(self.0 % 128),
            0x600..=0x67F => BitLocation::Port(self.0 % 128),
            _ => BitLocation::Nothing(self.0 % 0x800),
        }
    }
}

/// Address of a bit. Its value is the eleven bits of the instruction; in an op, and in this type, it is the
/// location.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct A(pub BitAddress);

/// Address of a bit that is a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CellOperand(pub u16);

/// Address relative to RX. Its value is the eleven bits of the instruction. In an op, and in this type, it is
/// the location after the index has been added, since RX is constant while a program runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct X(pub BitAddress);

/// Target of a jump. In an op, and in this type, the index has been added if the instruction requires it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct JumpTarget(pub u16);

/// Data after an instruction that takes data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct D(pub u16);

macro_rules! operands {
    ($( $name:ident $label:literal $make:expr, raw $raw:expr, text $text:expr, named $named:expr; )*) => { $(
        impl $name {
            /// Name of the kind.
            pub const NAME: &str = $label;
        }

        impl Operand for $name {
            const KIND: OperandKind = OperandKind {
                name: $label, wide: true, decode: |raw, _, _| raw as i32, encode: $raw, write_text: $text, parse_name: $named,
                check_number: OperandKind::same_number, check_register: OperandKind::same_address,
            };
            #[inline(always)]
            fn from_value(value: u16) -> Self {
                ($make)(value)
            }
        }
    )* };
}

operands! {
    A "bit" |v| A(BitAddress(v)), raw |v, b, _| check_field(v, b, "address"), text write_address, named parse_zone;
    X "bit behind RX" |v| X(BitAddress(v)), raw |v, b, _| check_field(v, b, "address"), text write_address, named parse_zone;
    JumpTarget "target" JumpTarget, raw |v, b, _| check_field(v, b, "target"), text |v, out| { let _ = write!(out, "0x{v:03X}"); },
        named OperandKind::never_a_name;
    D "data" D, raw |v, _, _| Err(CoreError::NopWithData { word: 0xF000 | v & 0xFFF }),
        text |v, out| { let _ = write!(out, "{v}"); }, named OperandKind::never_a_name;
}

impl RamOperand for A {
    type Ram = CellOperand;
    #[inline(always)]
    fn decode_next_in_ram<K>(op: &PredecodedOp<K>, at: &mut usize) -> CellOperand {
        CellOperand(A::decode_next(op, at).0.0)
    }
}

/// Writes an address as `I5`, `E300`, `R129`, `M256`.
fn write_address(value: i32, out: &mut String) {
    let (zone, offset) = (value as usize / usize::from(ZONE_BITS) % 4, value as u16 % ZONE_BITS);
    let _ = write!(out, "{}{offset}", ZONE_LETTERS[zone]);
}

/// Parses an address given by letter and number: `I5`, `I_5`, `I₅`; case is ignored. T means R, and O means
/// E. The assembler checks that T and O are only read.
fn parse_zone(text: &str) -> Option<i32> {
    let letter = text.chars().next()?.to_ascii_uppercase();
    let zone = match letter {
        'T' => 2,
        'O' => 1,
        _ => ZONE_LETTERS.iter().position(|&zone| zone == letter)? as i32,
    };
    let number = text.get(1..)?;
    let number = number.strip_prefix('_').unwrap_or(number);
    let digit = |c: char| match c {
        '\u{2080}'..='\u{2089}' => char::from_digit(c as u32 - 0x2080, 10),
        '0'..='9' => Some(c),
        _ => None,
    };
    let digits: String = number.chars().map(digit).collect::<Option<String>>()?;
    let offset = digits.parse::<u16>().ok().filter(|&offset| offset < ZONE_BITS)?;
    Some(zone * i32::from(ZONE_BITS) + i32::from(offset))
}
