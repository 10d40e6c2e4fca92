//! The data that describes a chip. Each chip is one row of type [`Chip`], written with struct update syntax.

pub use crate::family::{AssemblyWords, FamilyTraits};
use crate::image::ImageSpace;
use crate::pins::{PinId, PinLevel};
use crate::table::{DisassembledInstruction, FlowKind, InstructionLocation, InstructionRow, SyntaxAlias};

/// The chip families. Each is a crate with one instruction table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ChipFamily {
    /// Crate `emu-avr`.
    Avr,
    /// Crate `emu-8051`.
    Mcs51,
    /// Crate `emu-pic16`.
    Pic16,
    /// Crate `emu-ap101`.
    Ap101,
}

/// What tools need from the instruction table of a family.
#[derive(Debug)]
pub struct InstructionSet {
    /// Disassembles the first instruction in `words`, which is at the program word address `pc`.
    pub disassemble: fn(words: &[u16], pc: u32) -> DisassembledInstruction,
    /// The value of an erased program word. Several of them in sequence contain no program.
    pub erased_word: u16,
    /// The instruction table.
    pub rows: &'static [InstructionRow],
    /// Number of bits of a program word.
    pub word_bits: u32,
    /// Alternative spellings that the assembler accepts.
    pub aliases: &'static [SyntaxAlias],
    /// Returns the place of an instruction with `len` program words at the program word address `pc`.
    pub locate: fn(pc: u32, len: u32) -> InstructionLocation,
    /// Whether the chip lacks the instruction of this row; `row` is its position in the table.
    pub is_missing: fn(row: usize) -> bool,
    /// How the instruction of this row can change the order of execution; `row` is its position in the table.
    pub flow: fn(row: usize) -> FlowKind,
}

/// All data of one chip: memories, registers, pins, vectors.
#[derive(Debug)]
pub struct Chip {
    /// Name on the command line, such as `atmega328p`.
    pub name: &'static str,
    /// Family of the chip.
    pub family: ChipFamily,
    /// Instruction set of the chip.
    pub isa: &'static InstructionSet,
    /// One-line description for `emu chips`.
    pub title: &'static str,
    /// Data sheet from which the row is taken.
    pub data_sheet: &'static str,
    /// Name of the program memory: `flash`, `code`.
    pub code_space: &'static str,
    /// Size of program memory in bytes, a power of two, including what can be attached outside of the chip.
    pub flash_bytes: u32,
    /// Size of program memory on the chip, in bytes.
    pub on_chip_flash_bytes: u32,
    /// Name of the memory that contains the RAM of the chip: `data`, `idata`.
    pub ram_space: &'static str,
    /// First address of RAM in that memory.
    pub ram_start: u16,
    /// Number of RAM addresses: bytes, or bits on a controller that has only bits.
    pub ram_len: u16,
    /// RAM as address ranges, including mirrors, on chips whose RAM is in banks. Empty if RAM is one
    /// contiguous range.
    pub ram_ranges: &'static [RamRange],
    /// Size of EEPROM in bytes.
    pub eeprom_bytes: u16,
    /// Bytes per program word.
    pub word_bytes: u32,
    /// Highest clock, in Hz.
    pub max_hz: u64,
    /// Clock in Hz that is used if the user gives none.
    pub default_hz: u64,
    /// Memories that an Intel HEX file can fill.
    pub hex_spaces: &'static [ImageSpace],
    /// Memories that an ELF file can fill, at their load addresses.
    pub elf_spaces: &'static [ImageSpace],
    /// ELF machine number (`e_machine`).
    pub elf_machine: u16,
    /// Names of the core's registers, in display order.
    pub cpu_regs: &'static [&'static str],
    /// Name of the memory that contains the registers of the chip: `data`, `sfr`.
    pub reg_space: &'static str,
    /// Registers of the chip with their addresses in that memory.
    pub regs: &'static [NamedAddress],
    /// Named bits with their addresses in the memory `bit`. Empty if single bits have no addresses.
    pub bits: &'static [NamedAddress],
    /// Named constants from the manufacturer's headers: bit numbers in registers, values of the configuration
    /// word, last address of RAM.
    pub constants: fn() -> Vec<NamedConstant>,
    /// Pins, indexed by [`PinId`].
    pub pins: &'static [PinDef],
    /// Packages of the chip, the usual one first. Empty if the row has only the pin numbers in
    /// [`PinDef::dip`].
    pub packages: &'static [ChipPackage],
    /// Names of the interrupt vectors, by number.
    pub vectors: &'static [&'static str],
    /// Program words per vector.
    pub words_per_vector: u32,
    /// Number of program words by which all vectors after the first are nearer to address 0 than
    /// `words_per_vector` gives.
    pub later_vectors_back_words: u32,
    /// Memory spaces for `--peek`.
    pub spaces: &'static [ChipSpace],
    /// Memories whose accesses are reported to [`crate::cpu::Probe::on_data_access`], with the first address
    /// that is reported. Registers below that address are used by instructions without a report.
    pub observable_spaces: &'static [(&'static str, u32)],
    /// Ranges in those memories that instructions use without an address in the instruction: registers of the
    /// core. Only accesses to them by address are reported.
    pub implicit_accesses: &'static [(&'static str, u32)],
}

/// An address range of data memory that contains RAM.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RamRange {
    /// First address.
    pub first: u16,
    /// Last address.
    pub last: u16,
    /// The address under which the first byte is kept: `first` itself, or the address that it mirrors.
    pub canonical: u16,
}

/// A register of the chip, or a bit of one, with its address.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NamedAddress {
    /// Data-sheet name.
    pub name: &'static str,
    /// Address.
    pub addr: u16,
}

/// A pin of a chip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PinDef {
    /// Port and bit, such as `PB5`.
    pub name: &'static str,
    /// Pin number in the usual package: the dual in-line package, or the flat one if the chip has no other. 0
    /// if the package lacks the pin, [`Chip::NO_PACKAGE`] if the machine has no package.
    pub dip: u8,
    /// Other functions of the pin, or why a program should not use it freely.
    pub note: &'static str,
}

impl PinDef {
    /// The note of a pin that is an analog input of the converter and has no other function.
    pub const ANALOG_INPUT_NOTE: &str = "analog input";

    /// Returns true if an overview should show this level. A pin that is only analog has a level only while
    /// something drives it.
    #[must_use]
    pub fn is_level_meaningful(&self, level: PinLevel) -> bool {
        self.note != PinDef::ANALOG_INPUT_NOTE || level != PinLevel::Float
    }
}

/// A package of a chip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ChipPackage {
    /// Name, such as `DIP28`.
    pub name: &'static str,
    /// Pin number of each pin of [`Chip::pins`] in this package, in the same order; 0 if the package lacks
    /// the pin.
    pub pins: &'static [u8],
}

/// A memory of a chip as tools address it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ChipSpace {
    /// The name, such as `data`.
    pub name: &'static str,
    /// The number of addresses.
    pub size: u32,
    /// Bytes per address: 1, or 2 where an address counts words, which is usual for the program memory of
    /// PIC16.
    pub width: u32,
}

impl ChipSpace {
    /// Makes a memory from its name, its number of addresses and the bytes per address.
    #[must_use]
    pub const fn new(name: &'static str, size: u32, width: u32) -> ChipSpace {
        ChipSpace { name, size, width }
    }
}

/// A constant of the manufacturer's headers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct NamedConstant {
    /// The name.
    pub name: &'static str,
    /// The value.
    pub value: i32,
}

/// The name of a package in one spelling.
#[derive(Debug, Clone, PartialEq, Eq)]
struct PackageKind {
    /// The kind in upper case, such as `DIP`.
    kind: String,
    /// The number of pins in digits. Empty if the name has none.
    pins: String,
}

impl ChipPackage {
    /// Splits the name of a package into its normalised kind and its number of pins, in whichever order they
    /// are written.
    fn normalized_kind(name: &str) -> PackageKind {
        let letters: String = name.chars().filter(char::is_ascii_alphabetic).map(|c| c.to_ascii_uppercase()).collect();
        let kind = match letters.as_str() {
            "PDIP" | "SPDIP" | "SDIP" | "DIL" => "DIP",
            "QFN" | "VQFN" | "QFNMLF" | "MLFQFN" => "MLF",
            other => other,
        };
        PackageKind { kind: kind.to_owned(), pins: name.chars().filter(char::is_ascii_digit).collect() }
    }

    /// The number of `pin` in this package, or `None` if the package lacks it.
    #[must_use]
    pub fn pin_number(&self, pin: PinId) -> Option<u8> {
        self.pins.get(usize::from(pin)).copied().filter(|&number| number != 0)
    }
}

/// A pin of a chip with its id.
#[derive(Debug, Clone, Copy)]
pub struct ChipPin {
    /// The position in [`Chip::pins`].
    pub id: PinId,
    /// The row of the pin.
    pub def: &'static PinDef,
}

impl Chip {
    /// Value of [`PinDef::dip`] on a machine that has no package.
    pub const NO_PACKAGE: u8 = u8::MAX;

    /// Address of the register `name` in [`Chip::reg_space`]; case is ignored.
    #[must_use]
    pub fn reg(&self, name: &str) -> Option<u16> {
        self.regs.iter().find(|r| r.name.eq_ignore_ascii_case(name)).map(|r| r.addr)
    }

    /// Address of the bit `name`; case is ignored.
    #[must_use]
    pub fn bit(&self, name: &str) -> Option<u16> {
        self.bits.iter().find(|r| r.name.eq_ignore_ascii_case(name)).map(|r| r.addr)
    }

    /// The memory `name`; case counts.
    #[must_use]
    pub fn space(&self, name: &str) -> Option<&'static ChipSpace> {
        self.spaces.iter().find(|space| space.name == name)
    }

    /// Position of a memory in [`Chip::spaces`]; [`crate::cpu::Probe::on_data_access`] names a memory by it.
    #[must_use]
    pub fn space_index(&self, name: &str) -> Option<u8> {
        self.spaces.iter().position(|space| space.name == name).map(|index| index as u8)
    }

    /// Bytes per address of a memory in [`Chip::spaces`]; 1 if there is no such memory.
    #[must_use]
    pub fn bytes_per_address(&self, name: &str) -> u32 {
        self.space(name).map_or(1, |space| space.width.max(1))
    }

    /// First address of a memory from which accesses are reported to [`crate::cpu::Probe::on_data_access`];
    /// `None` if no accesses of it are reported.
    #[must_use]
    pub fn observable_from(&self, name: &str) -> Option<u32> {
        self.observable_spaces.iter().find(|(space, _)| *space == name).map(|found| found.1)
    }

    /// Converts a program word address into the unit that is usual for the family: bytes on AVR, words on
    /// PIC16.
    #[must_use]
    pub fn code_address(&self, word: u32) -> u32 {
        word.saturating_mul(self.word_bytes) / self.bytes_per_address(self.code_space)
    }

    /// Returns true if any package of the chip has the pin.
    #[must_use]
    pub fn has_pin(&self, pin: PinId) -> bool {
        let usual = self.pins.get(usize::from(pin)).is_some_and(|def| def.dip != 0);
        usual || self.packages.iter().any(|package| package.pin_number(pin).is_some())
    }

    /// The pins that at least one package has, with their ids.
    pub fn present_pins(&self) -> impl Iterator<Item = ChipPin> {
        (0..).zip(self.pins).map(|(id, def)| ChipPin { id, def }).filter(|pin| self.has_pin(pin.id))
    }

    /// Finds the package `name`; case is ignored. The spellings of vendors are accepted: `PDIP28`, `28-PDIP`,
    /// `SPDIP-28` are `DIP28`.
    #[must_use]
    pub fn package(&self, name: &str) -> Option<&'static ChipPackage> {
        self.packages
            .iter()
            .find(|package| ChipPackage::normalized_kind(package.name) == ChipPackage::normalized_kind(name))
    }

    /// Finds the pin `name`; case is ignored.
    #[must_use]
    pub fn pin(&self, name: &str) -> Option<PinId> {
        self.pins.iter().position(|p| p.name.eq_ignore_ascii_case(name)).map(|i| i as PinId)
    }
}

#[cfg(test)]
mod tests {
    use super::ChipPackage;

    #[test]
    fn packages_are_known_by_the_spellings_of_vendors() {
        let same = |name: &str, of: &str| ChipPackage::normalized_kind(name) == ChipPackage::normalized_kind(of);
        for (name, of) in [
            ("dip28", "DIP28"),
            ("28-PDIP", "DIP28"),
            ("PDIP28", "DIP28"),
            ("SPDIP28", "DIP28"),
            ("28 spdip", "DIP28"),
            ("TQFP-32", "TQFP32"),
            ("32-tqfp", "TQFP32"),
            ("QFN/MLF-32", "MLF32"),
            ("32-VQFN", "MLF32"),
        ] {
            assert!(same(name, of), "{name}");
        }
        for (name, of) in [("SO28", "DIP28"), ("PDIP40", "DIP28"), ("DIP", "DIP28"), ("28", "DIP28"), ("", "DIP28")] {
            assert!(!same(name, of), "{name}");
        }
    }
}
