//! Chips are data: one row each, written with struct update syntax.

use crate::image::Space;
use crate::pins::PinId;

/// A chip.
#[derive(Debug)]
pub struct Chip {
    /// Name on the command line, such as `atmega328p`.
    pub name: &'static str,
    /// One line for `emu chips`.
    pub title: &'static str,
    /// Data sheet that the row comes from.
    pub source: &'static str,
    /// Program memory in bytes, a power of two.
    pub flash: u32,
    /// First data address of RAM.
    pub ram_start: u16,
    /// RAM in bytes.
    pub ram_len: u16,
    /// EEPROM in bytes.
    pub eeprom: u16,
    /// Bytes per program word.
    pub word_bytes: u32,
    /// Highest clock, in Hz.
    pub max_hz: u64,
    /// Clock assumed when none is given, in Hz.
    pub default_hz: u64,
    /// Memories that an Intel HEX file may fill.
    pub hex: &'static [Space],
    /// Memories that an ELF file may fill, at their load addresses.
    pub elf: &'static [Space],
    /// ELF machine number.
    pub elf_machine: u16,
    /// Registers of the core, by name, in the order in which they are shown.
    pub cpu_regs: &'static [&'static str],
    /// Peripheral registers at their data addresses.
    pub regs: &'static [Reg],
    /// Pins in the order of their [`PinId`].
    pub pins: &'static [PinDef],
    /// Interrupt vectors by number.
    pub vectors: &'static [&'static str],
    /// Program words per vector.
    pub vector_words: u32,
    /// Memory spaces for `--peek`: name and size in bytes.
    pub spaces: &'static [(&'static str, u32)],
}

/// A peripheral register.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reg {
    /// Data-sheet name.
    pub name: &'static str,
    /// Data address.
    pub addr: u16,
}

/// A pin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PinDef {
    /// Port and bit, such as `PB5`.
    pub name: &'static str,
    /// Pin of the 28-pin package; 0 where it has none.
    pub dip: u8,
    /// What else it does, or why a program should not use it freely.
    pub note: &'static str,
}

impl Chip {
    /// Data address of the register `name` (case aside).
    #[must_use]
    pub fn reg(&self, name: &str) -> Option<u16> {
        self.regs.iter().find(|r| r.name.eq_ignore_ascii_case(name)).map(|r| r.addr)
    }

    /// The pin `name` (case aside).
    #[must_use]
    pub fn pin(&self, name: &str) -> Option<PinId> {
        self.pins.iter().position(|p| p.name.eq_ignore_ascii_case(name)).map(|i| i as PinId)
    }
}
