//! Operand kinds of AP101: addresses of single bits, targets of jumps, data. And what an address comes to on a machine.

use std::fmt::Write;

use emu_core::table::{InRam, Op, Operand, OperandKind};

/// Letters of the zones, by bits 10 and 9 of an address.
pub const ZONES: [char; 4] = ['I', 'E', 'R', 'M'];

/// Addresses of a zone.
pub const ZONE: u16 = 512;

/// Bits of memory that are read and written as they stand: input latches, then M with the images of the outputs.
pub const CELLS: usize = 1024;

/// The first cell of M, and the first one of the images.
pub const M: u16 = 512;
/// See [`M`].
pub const IMAGE: u16 = M + 256;

/// What an address is on a machine with its channels and modules.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place(pub u16);

/// What a [`Place`] is, taken apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spot {
    /// A cell: below 512 an input latch, from 512 on M.
    Cell(u16),
    /// An output channel.
    Output(u16),
    /// The input of a module, or its Q; its number.
    Module(u16),
    /// Its running bit; writing 1 resets it.
    Running(u16),
    /// Its preset.
    Port(u16),
    /// Nothing is there; the address as an instruction has it.
    Nothing(u16),
}

impl Place {
    /// Puts a spot into 16 bits.
    #[must_use]
    pub const fn of(spot: Spot) -> Place {
        Place(match spot {
            Spot::Cell(cell) => cell % CELLS as u16,
            Spot::Output(n) => 0x400 + n % 256,
            Spot::Module(n) => 0x500 + n % 128,
            Spot::Running(n) => 0x580 + n % 128,
            Spot::Port(n) => 0x600 + n % 128,
            Spot::Nothing(addr) => 0x800 + addr % 0x800,
        })
    }

    /// Takes it apart.
    #[inline(always)]
    #[must_use]
    pub const fn spot(self) -> Spot {
        match self.0 {
            0..=0x3FF => Spot::Cell(self.0),
            0x400..=0x4FF => Spot::Output(self.0 % 256),
            0x500..=0x57F => Spot::Module(self.0 % 128),
            0x580..=0x5FF => Spot::Running(self.0 % 128),
            0x600..=0x67F => Spot::Port(self.0 % 128),
            _ => Spot::Nothing(self.0 % 0x800),
        }
    }
}

/// Address of a bit: as a value the eleven bits of the instruction, in an op (and here) what is there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct A(pub Place);

/// Address of a bit that is a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cell(pub u16);

/// Address relative to RX: as a value the eleven bits of the instruction, in an op (and here) what is there once the index has
/// been added, which is known while a program runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct X(pub Place);

/// Target of a jump; in an op (and here) with the index added where the instruction says so.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Target(pub u16);

/// Data behind an instruction that takes some.
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
                name: $label, wide: true, value: |raw, _, _| raw as i32, raw: $raw, text: $text, named: $named,
                number: OperandKind::itself, register: OperandKind::its_address,
            };
            #[inline(always)]
            fn from_value(value: u16) -> Self {
                ($make)(value)
            }
        }
    )* };
}

operands! {
    A "bit" |v| A(Place(v)), raw |v, b, _| fits(v, b, "address"), text address, named zone;
    X "bit behind RX" |v| X(Place(v)), raw |v, b, _| fits(v, b, "address"), text address, named zone;
    Target "target" Target, raw |v, b, _| fits(v, b, "target"), text |v, out| { let _ = write!(out, "0x{v:03X}"); },
        named OperandKind::no_name;
    D "data" D, raw |v, _, _| Err(format!("a NOP with data in it is written .word 0x{:04X}", 0xF000 | v & 0xFFF)),
        text |v, out| { let _ = write!(out, "{v}"); }, named OperandKind::no_name;
}

impl InRam for A {
    type Ram = Cell;
    #[inline(always)]
    fn take_in_ram<K>(op: &Op<K>, at: &mut usize) -> Cell {
        Cell(A::take(op, at).0.0)
    }
}

fn fits(value: i32, bits: u32, what: &str) -> Result<u32, String> {
    let most = (1 << bits) - 1;
    if (0..=most).contains(&value) { Ok(value as u32) } else { Err(format!("{what} {value} is not in 0..={most}")) }
}

/// `I5`, `E300`, `R129`, `M256`.
fn address(value: i32, out: &mut String) {
    let (zone, offset) = (value as usize / usize::from(ZONE) % 4, value as u16 % ZONE);
    let _ = write!(out, "{}{offset}", ZONES[zone]);
}

/// The address that a letter and a number stand for (case aside): `I5`, `I_5`, `I₅`. T is R and O is E; that these two are only
/// read the assembler knows.
fn zone(text: &str) -> Option<i32> {
    let letter = text.chars().next()?.to_ascii_uppercase();
    let zone = match letter {
        'T' => 2,
        'O' => 1,
        _ => ZONES.iter().position(|&zone| zone == letter)? as i32,
    };
    let number = text.get(1..)?;
    let number = number.strip_prefix('_').unwrap_or(number);
    let digit = |c: char| match c {
        '\u{2080}'..='\u{2089}' => char::from_digit(c as u32 - 0x2080, 10),
        '0'..='9' => Some(c),
        _ => None,
    };
    let digits: String = number.chars().map(digit).collect::<Option<String>>()?;
    let offset = digits.parse::<u16>().ok().filter(|&offset| offset < ZONE)?;
    Some(zone * i32::from(ZONE) + i32::from(offset))
}
