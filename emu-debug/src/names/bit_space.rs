//! Single bits with addresses of their own, in the memory `bit`, and the byte that contains each of them.
//!
//! Source: "MCS 51 Microcontroller Family User's Manual" (272383-002), chapter 1, "Bit addressing": bits 00h
//! to 7Fh are in the bytes 20h to 2Fh of RAM, bits 80h to FFh in the registers whose address ends in 0 or 8.

use emu_core::chip::Chip;

use crate::names::address_names::AddressRange;

/// Name of the memory of single bits.
pub const BIT_SPACE: &str = "bit";

/// First byte of RAM with bit addresses.
const FIRST_BIT_ADDRESSABLE_BYTE: u32 = 0x20;

/// First address of a bit of a chip register.
const FIRST_SFR_BIT: u32 = 0x80;

/// Where a bit of the memory `bit` is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BitLocation {
    /// The memory of its byte.
    pub space: &'static str,
    /// Address of its byte.
    pub byte: u32,
    /// Its position in the byte, 0 to 7.
    pub bit: u32,
}

/// Returns the location of the bit `addr`; `None` if `chip` has no such bit.
#[must_use]
pub fn byte_of_bit(chip: &Chip, addr: u32) -> Option<BitLocation> {
    let size = chip.space(BIT_SPACE)?.size;
    let (space, byte) = match addr {
        _ if addr >= size => return None,
        _ if addr < FIRST_SFR_BIT => (chip.ram_space, FIRST_BIT_ADDRESSABLE_BYTE + addr / 8),
        _ => (chip.reg_space, addr & !7),
    };
    Some(BitLocation { space, byte, bit: addr % 8 })
}

/// Returns the addresses of the eight bits of a byte, as a range of the memory `bit`; `None` if they have
/// none.
#[must_use]
pub fn bits_of_byte(chip: &Chip, space: &str, byte: u32) -> Option<AddressRange> {
    let first = if space == chip.ram_space
        && (FIRST_BIT_ADDRESSABLE_BYTE..FIRST_BIT_ADDRESSABLE_BYTE + FIRST_SFR_BIT / 8).contains(&byte)
    {
        (byte - FIRST_BIT_ADDRESSABLE_BYTE) * 8
    } else {
        byte
    };
    let found = byte_of_bit(chip, first)?;
    (found.space == space && found.byte == byte && found.bit == 0).then_some(AddressRange {
        space: BIT_SPACE,
        start: first,
        end: first + 8,
    })
}
