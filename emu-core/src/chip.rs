//! Chips are data: one row each, written with struct update syntax.

use crate::image::ImageSpace;
use crate::pins::{PinId, PinLevel};
use crate::table::{DisassembledInstruction, FlowKind, InstructionLocation, InstructionRow, SyntaxAlias};

/// The families of chips, each a crate with one instruction table.
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

/// What tools need of a family's instruction table.
#[derive(Debug)]
pub struct InstructionSet {
    /// Disassembles the instruction at the front of some program words, which stands at the given program word address.
    pub disassemble: fn(words: &[u16], pc: u32) -> DisassembledInstruction,
    /// Program words that read so are erased, and hold no program where several stand in a row.
    pub erased_word: u16,
    /// The table.
    pub rows: &'static [InstructionRow],
    /// Bits of a program word.
    pub word_bits: u32,
    /// Other spellings that the assembler takes.
    pub aliases: &'static [SyntaxAlias],
    /// Where an instruction of `len` program words stands whose address in program words is `pc`.
    pub locate: fn(pc: u32, len: u32) -> InstructionLocation,
    /// The chip does not have the instruction of this row, by its position in the table.
    pub is_missing: fn(row: usize) -> bool,
    /// What the instruction of this row, by its position in the table, may do to the order in which a program runs.
    pub flow: fn(row: usize) -> FlowKind,
}

/// A chip.
#[derive(Debug)]
pub struct Chip {
    /// Name on the command line, such as `atmega328p`.
    pub name: &'static str,
    /// Its family.
    pub family: ChipFamily,
    /// Its instructions.
    pub isa: &'static InstructionSet,
    /// One line for `emu chips`.
    pub title: &'static str,
    /// Data sheet that the row comes from.
    pub data_sheet: &'static str,
    /// Name of the memory that holds the program: `flash`, `code`.
    pub code_space: &'static str,
    /// Program memory in bytes, a power of two; with what can be attached outside.
    pub flash_bytes: u32,
    /// Program memory on the chip in bytes.
    pub on_chip_flash_bytes: u32,
    /// Name of the memory in which the RAM of the chip lies: `data`, `idata`.
    pub ram_space: &'static str,
    /// First address of RAM in it.
    pub ram_start: u16,
    /// Addresses of RAM: bytes, or bits on a controller that has only those.
    pub ram_len: u16,
    /// RAM by ranges of addresses, mirrors included, on chips whose RAM lies in banks; empty where it lies in one piece.
    pub ram_ranges: &'static [RamRange],
    /// EEPROM in bytes.
    pub eeprom_bytes: u16,
    /// Bytes per program word.
    pub word_bytes: u32,
    /// Highest clock, in Hz.
    pub max_hz: u64,
    /// Clock assumed when none is given, in Hz.
    pub default_hz: u64,
    /// Memories that an Intel HEX file may fill.
    pub hex_spaces: &'static [ImageSpace],
    /// Memories that an ELF file may fill, at their load addresses.
    pub elf_spaces: &'static [ImageSpace],
    /// ELF machine number.
    pub elf_machine: u16,
    /// Registers of the core, by name, in the order in which they are shown.
    pub cpu_regs: &'static [&'static str],
    /// Name of the memory in which the registers of the chip lie: `data`, `sfr`.
    pub reg_space: &'static str,
    /// Registers of the chip at their addresses in it.
    pub regs: &'static [NamedAddress],
    /// Named bits, and their addresses in the memory `bit`; none where single bits have no addresses of their own.
    pub bits: &'static [NamedAddress],
    /// Named numbers of the chip as its makers' headers have them: bits of registers by number, values for the configuration
    /// word, last address of RAM.
    pub constants: fn() -> Vec<(&'static str, i32)>,
    /// Pins in the order of their [`PinId`].
    pub pins: &'static [PinDef],
    /// Packages that the chip comes in, the usual one first. None where the row knows only the numbers in [`PinDef::dip`].
    pub packages: &'static [ChipPackage],
    /// Interrupt vectors by number.
    pub vectors: &'static [&'static str],
    /// Program words per vector.
    pub words_per_vector: u32,
    /// Program words by which those behind the first stand nearer to the front than that makes them.
    pub later_vectors_back_words: u32,
    /// Memory spaces for `--peek`: name, number of addresses, bytes per address (1, or 2 where addresses count words, as
    /// the users of PIC16 have it for program memory).
    pub spaces: &'static [(&'static str, u32, u32)],
    /// Memories of whose accesses [`crate::cpu::Probe::data`] is told, and the first address of which it is: below it lie registers
    /// that instructions use without a word of it.
    pub observable_spaces: &'static [(&'static str, u32)],
    /// Places in those memories that instructions use without naming them: registers of the core, of which only the accesses by
    /// address are told.
    pub implicit_accesses: &'static [(&'static str, u32)],
}

/// A range of data memory that holds RAM.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RamRange {
    /// First address.
    pub first: u16,
    /// Last address.
    pub last: u16,
    /// The address under which the first byte is kept: `first` itself, or what it mirrors.
    pub canonical: u16,
}

/// A register of the chip, or a bit of one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NamedAddress {
    /// Data-sheet name.
    pub name: &'static str,
    /// Address.
    pub addr: u16,
}

/// A pin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PinDef {
    /// Port and bit, such as `PB5`.
    pub name: &'static str,
    /// Pin of the usual package: the dual in-line one, or the flat one of a chip that comes in no other; 0 where it has none,
    /// [`Chip::NO_PACKAGE`] where the machine has no package.
    pub dip: u8,
    /// What else it does, or why a program should not use it freely.
    pub note: &'static str,
}

impl PinDef {
    /// The note of a pin that is an input of the converter and nothing else.
    pub const ANALOG_INPUT_NOTE: &str = "analog input";

    /// This level is worth a place in an overview: a pin that is analog alone has one only while something drives it.
    #[must_use]
    pub fn is_level_meaningful(&self, level: PinLevel) -> bool {
        self.note != PinDef::ANALOG_INPUT_NOTE || level != PinLevel::Float
    }
}

/// A package that a chip comes in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ChipPackage {
    /// Name, such as `DIP28`.
    pub name: &'static str,
    /// Number of each pin of [`Chip::pins`] in it, in their order; 0 for one that it does not have.
    pub pins: &'static [u8],
}

impl ChipPackage {
    /// What a name says of a package: its kind by one name and the number of its pins, however both are put together.
    fn normalized_kind(name: &str) -> (String, String) {
        let letters: String = name.chars().filter(char::is_ascii_alphabetic).map(|c| c.to_ascii_uppercase()).collect();
        let kind = match letters.as_str() {
            "PDIP" | "SPDIP" | "SDIP" | "DIL" => "DIP",
            "QFN" | "VQFN" | "QFNMLF" | "MLFQFN" => "MLF",
            other => other,
        };
        (kind.to_owned(), name.chars().filter(char::is_ascii_digit).collect())
    }

    /// The number of `pin` in this package; none where it does not have that pin.
    #[must_use]
    pub fn pin_number(&self, pin: PinId) -> Option<u8> {
        self.pins.get(usize::from(pin)).copied().filter(|&number| number != 0)
    }
}

impl Chip {
    /// What stands for the number of a pin of a machine that comes in no package.
    pub const NO_PACKAGE: u8 = u8::MAX;

    /// Address of the register `name` (case aside) in [`Chip::reg_space`].
    #[must_use]
    pub fn reg(&self, name: &str) -> Option<u16> {
        self.regs.iter().find(|r| r.name.eq_ignore_ascii_case(name)).map(|r| r.addr)
    }

    /// Address of the bit `name` (case aside).
    #[must_use]
    pub fn bit(&self, name: &str) -> Option<u16> {
        self.bits.iter().find(|r| r.name.eq_ignore_ascii_case(name)).map(|r| r.addr)
    }

    /// Position of a memory in [`Chip::spaces`], by which [`crate::cpu::Probe::data`] names it.
    #[must_use]
    pub fn space_index(&self, name: &str) -> Option<u8> {
        self.spaces.iter().position(|(space, ..)| *space == name).map(|i| i as u8)
    }

    /// Bytes per address of a memory in [`Chip::spaces`]; 1 for one that is not there.
    #[must_use]
    pub fn bytes_per_address(&self, name: &str) -> u32 {
        self.spaces.iter().find(|(space, ..)| *space == name).map_or(1, |&(.., width)| width.max(1))
    }

    /// First address of a memory of whose accesses [`crate::cpu::Probe::data`] is told; none where it is told of none.
    #[must_use]
    pub fn observable_from(&self, name: &str) -> Option<u32> {
        self.observable_spaces.iter().find(|(space, _)| *space == name).map(|found| found.1)
    }

    /// The address of the program word `word` as it is written for this chip: in bytes on AVR, in words on PIC16.
    #[must_use]
    pub fn code_address(&self, word: u32) -> u32 {
        word.saturating_mul(self.word_bytes) / self.bytes_per_address(self.code_space)
    }

    /// Some package of the chip has the pin.
    #[must_use]
    pub fn has_pin(&self, pin: PinId) -> bool {
        let usual = self.pins.get(usize::from(pin)).is_some_and(|def| def.dip != 0);
        usual || self.packages.iter().any(|package| package.pin_number(pin).is_some())
    }

    /// The pins that some package has, with their identities.
    pub fn present_pins(&self) -> impl Iterator<Item = (PinId, &'static PinDef)> {
        (0..).zip(self.pins).filter(|(id, _)| self.has_pin(*id))
    }

    /// The package `name` (case aside), which vendors spell in many ways: `PDIP28`, `28-PDIP`, `SPDIP-28` are `DIP28`.
    #[must_use]
    pub fn package(&self, name: &str) -> Option<&'static ChipPackage> {
        self.packages
            .iter()
            .find(|package| ChipPackage::normalized_kind(package.name) == ChipPackage::normalized_kind(name))
    }

    /// The pin `name` (case aside).
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
