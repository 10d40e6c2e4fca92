//! Images: the contents that a HEX, ELF or OMF-51 file gives to the memories of a chip.
//!
//! [`load`] looks at the first bytes and calls [`load_elf`], [`load_omf51`] or [`load_hex`]. A file is either
//! accepted or rejected with all its faults, each with a position, a stable code (see [`IMAGE_CODES`]) and a
//! hint. Parts that are left out are reported as notes. `docs/formats/hex.md`, `elf.md` and `omf51.md`
//! describe what is accepted. [`write_hex`] writes a HEX file.
//!
//! ```text
//!   hex.rs   lines to records to addresses          elf.rs   sections to load addresses, symbols
//!   hex_record.rs  one line and its faults          placement.rs  bytes into memories
//!   omf51/   records of absolute object files for MCS-51
//!   write.rs segments to HEX                        faults.rs the list of faults and its limit
//!   codes.rs the table of codes                     symbols/ symbol files of SDCC, gputils and Keil
//!   lines.rs source lines by address, and back      dwarf.rs those in ELF files
//!   stabs.rs those that older compilers write for AVR
//!   debug_info/ functions, variables and types of C in ELF files
//!   note.rs  for which AVR an ELF file was linked    simavr.rs what it says to simavr
//! ```

mod codes;
mod debug_info;
mod demangle;
mod dwarf;
mod elf;
mod faults;
mod hex;
mod hex_record;
mod note;
mod omf51;
mod placement;
mod simavr;
mod source_lines;
mod stabs;
mod symbols;
mod write;

use diag::Diagnostic;
use diag::text::into_printable;

pub use codes::{IMAGE_CODES, LINE_CODES, SYMBOL_CODES};
pub use debug_info::{
    AVR_DATA, BaseEncoding, BitRange, BlockInfo, ByteLocation, CType, CompiledFile, DebugInfo, FrameView, FunctionInfo,
    Mcs51Memory, NumberedType, SpaceAddress, StructMember, TypeDefinition, TypeId, UnwoundFrame, VariableInfo,
    VariableLocation,
};
pub use demangle::DemangledName;
pub use elf::load_elf;
pub use faults::MAX_REPORTED;
pub use hex::load_hex;
pub use note::{avr_device, avr_signature};
pub use omf51::{OMF_CODES, load_omf51};
pub use simavr::{SimavrSection, SimavrTrace, read_simavr_section};
pub use source_lines::{SourceKind, SourceLine, SourceLines};
pub use symbols::{SimulatorMessage, SymbolFile, SymbolSpaces, Symbols, load_messages, load_symbols};
pub use write::{HexSegment, write_hex, write_hex_aligned};

/// A memory that an image can fill: a window in the address space of the image file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ImageSpace {
    /// Name of the memory, such as `flash`.
    pub name: &'static str,
    /// Start of the window, a byte address of the image file (in an ELF file for AVR the EEPROM is at
    /// 0x810000).
    pub start: u32,
    /// Size in bytes.
    pub len: u32,
    /// Bytes per word: 1 or 2. If it is 2, an image must define both bytes of a word or neither.
    pub word: u32,
    /// Number of bits of a word that the memory implements. It is checked in HEX files if `word` is 2.
    pub word_bits: WordBits,
}

/// The bits of a word that a memory implements, from bit 0 on, and the reaction to a word with more bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WordBits {
    /// All bits.
    All,
    /// This many bits. A file with a word that has more is rejected, because it is not a program for the
    /// chip.
    Only(u32),
    /// This many bits. The upper bits of a word that has more are dropped with a warning.
    Low(u32),
}

/// Consecutive bytes in one memory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Segment {
    /// Name of the memory.
    pub space: &'static str,
    /// Address of the first byte within the memory, in bytes.
    pub addr: u32,
    /// The bytes; never empty.
    pub bytes: Vec<u8>,
}

/// The memory name of a symbol that is a number (`equ`), which may or may not be an address.
pub const CONSTANT_SPACE: &str = "constant";

/// A name of an address.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct SymbolAt {
    /// The name in the language of the program: the linker name, demangled if necessary
    /// ([`SymbolAt::mangled`]), or one of the names that [`load_symbols`] derives from it.
    pub name: String,
    /// Name of the memory, or [`CONSTANT_SPACE`] for a number.
    pub space: &'static str,
    /// Byte address within the memory, or the value of a constant.
    pub addr: u32,
    /// Size in bytes; 0 for a label.
    pub size: u32,
    /// The linker name, if a compiler of C++ or Rust has mangled the name.
    pub mangled: Option<Box<DemangledName>>,
}

impl SymbolAt {
    /// Makes a symbol from a linker name. Control characters in the name are escaped
    /// ([`diag::text::printable`]).
    #[must_use]
    pub fn new(name: impl Into<String>, space: &'static str, addr: u32, size: u32) -> SymbolAt {
        SymbolAt { name: into_printable(name.into()), space, addr, size, mangled: None }
    }

    /// The linker name.
    #[must_use]
    pub fn linkage_name(&self) -> &str {
        self.mangled.as_ref().map_or(&self.name, |mangled| &mangled.linkage)
    }

    /// Returns true if `text` is the whole name or the linker name. Spaces are ignored in names that were
    /// mangled.
    #[must_use]
    pub fn is_named(&self, text: &str) -> bool {
        let is_whole =
            |mangled: &DemangledName| mangled.linkage == text || without_spaces(&self.name).eq(without_spaces(text));
        self.name == text || self.mangled.as_ref().is_some_and(|mangled| is_whole(mangled))
    }

    /// Returns how well `text` matches as a shortened name of a C++ or Rust symbol, 0 best; `None` if it does
    /// not match. As in gdb, some parts can be left out. 0: without parameters (`app::compute`, and
    /// `f::count` for a static in `f(int)`). 1: also without template arguments. 2: also without outer
    /// namespaces (`compute`, `compute(int)`).
    #[must_use]
    pub fn is_shortened_to(&self, text: &str) -> Option<u8> {
        let path = &*self.mangled.as_ref()?.path;
        let bare = demangle::without_outer_parameters(path);
        let generic = demangle::without_outer_arguments(&bare);
        let (plain, generic) = (demangle::without_arguments(path), demangle::without_arguments(&generic));
        let is_tail = |name: &str| {
            let before = name.len().checked_sub(text.len()).and_then(|at| name.split_at_checked(at));
            before.is_some_and(|(before, tail)| before.ends_with("::") && tail == text)
        };
        match () {
            () if text.is_empty() => None,
            () if path == text || bare == text => Some(0),
            () if plain == text || generic == text => Some(1),
            () if [path, &*bare, plain, generic].into_iter().any(is_tail) => Some(2),
            // With parameters. Namespaces before the name can be left out; namespaces in the parameters
            // cannot.
            () if text.contains('(') => {
                let mut outer = path.match_indices("::").filter_map(|(at, _)| self.name.get(at + 2..));
                outer.any(|tail| without_spaces(tail).eq(without_spaces(text))).then_some(2)
            }
            () => None,
        }
    }
}

/// The bytes of a name without spaces.
fn without_spaces(name: &str) -> impl Iterator<Item = u8> {
    name.bytes().filter(|byte| *byte != b' ')
}

/// The contents that a file gives to the memories of a chip.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Image {
    /// The contents, in the order of the memories given to the loader, then by address. Adjacent segments are
    /// merged and none overlap.
    pub segments: Vec<Segment>,
    /// The symbols in the order of the memories, then by address, weak ones first, then by name. Empty for a
    /// HEX file.
    pub symbols: Vec<SymbolAt>,
    /// Source lines of the program. Empty unless a file of symbols was read or the caller has used
    /// [`SourceLines::from_elf`]; [`load`] does not read them from an ELF file.
    pub lines: SourceLines,
    /// Start address in the file, a byte address of the image file. For information only: a chip starts at
    /// its reset vector.
    pub entry: Option<u32>,
}

/// A byte of an image with its address.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AddressedByte {
    /// The address in the memory of the byte.
    pub addr: u32,
    /// The value.
    pub byte: u8,
}

impl Image {
    /// Copies the bytes of one memory into `into`; the rest of `into` keeps its value. Bytes beyond the end
    /// of `into` are left out.
    pub fn fill(&self, space: &str, into: &mut [u8]) {
        for AddressedByte { addr, byte } in self.bytes_in(space) {
            if let Some(cell) = into.get_mut(addr as usize) {
                *cell = byte;
            }
        }
    }

    /// The bytes of one memory with their addresses in it, in ascending order.
    pub fn bytes_in(&self, space: &str) -> impl Iterator<Item = AddressedByte> {
        self.segments_in(space).flat_map(|s| (s.addr..).zip(&s.bytes).map(|(addr, &byte)| AddressedByte { addr, byte }))
    }

    /// The highest used address of one memory plus 1; 0 if the image does not use the memory.
    #[must_use]
    pub fn end(&self, space: &str) -> u32 {
        self.segments_in(space).map(|s| s.addr + s.bytes.len() as u32).max().unwrap_or(0)
    }

    fn segments_in(&self, space: &str) -> impl Iterator<Item = &Segment> {
        self.segments.iter().filter(move |s| s.space == space)
    }
}

/// An image and the warnings about its file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LoadedImage {
    /// The image.
    pub image: Image,
    /// Warnings in the order of their positions: at most [`MAX_REPORTED`], and a closing note.
    pub warnings: Vec<Diagnostic>,
}

/// The number of a processor in an ELF file (`e_machine`; System V ABI, chapter 4, "ELF Header").
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ElfMachine(pub u16);

impl ElfMachine {
    /// Atmel AVR (EM_AVR).
    pub const AVR: Self = ElfMachine(83);
    /// Intel 8051 and variants (EM_8051).
    pub const MCS51: Self = ElfMachine(165);

    /// Name of the processor for messages, if it is a well-known one.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self.0 {
            3 => "Intel 80386",
            8 => "MIPS",
            40 => "ARM",
            62 => "x86-64",
            83 => "AVR",
            94 => "Xtensa",
            105 => "MSP430",
            165 => "8051",
            183 => "AArch64",
            204 => "PIC",
            243 => "RISC-V",
            _ => "another processor",
        }
    }
}

/// The addresses of AVR memories other than program and RAM in an ELF file: EEPROM, fuses, lock bits and
/// signature, each with 64 KB of addresses (binutils, ld/scripttempl/avr.sc). Areas above, such as the user
/// signature, are not memories of the modelled chips.
pub const AVR_AREAS: std::ops::Range<u32> = 0x81_0000..0x85_0000;

/// Returns true if a window is in [`AVR_AREAS`].
fn is_avr_elf_area(start: u32) -> bool {
    AVR_AREAS.contains(&start)
}

/// The memories that an Intel HEX file can fill: those of `hex`, and the AVR memories of `elf`, which
/// avr-objcopy by default copies to a HEX file at their ELF addresses.
#[must_use]
pub fn hex_spaces(hex: &[ImageSpace], elf: &[ImageSpace]) -> Vec<ImageSpace> {
    let carried =
        elf.iter().filter(|space| is_avr_elf_area(space.start) && hex.iter().all(|own| own.name != space.name));
    hex.iter().chain(carried).copied().collect()
}

/// Loads an image. A file that starts with the ELF magic is ELF. A file for MCS-51 that starts with a record
/// of OMF-51 is OMF-51. All others are Intel HEX. `file` is the name for messages.
///
/// # Errors
/// All faults of the file in the order of their positions: at most [`MAX_REPORTED`], and a closing note with
/// the number of further ones.
pub fn load(
    file: &str,
    bytes: &[u8],
    hex_spaces: &[ImageSpace],
    elf_spaces: &[ImageSpace],
    machine: ElfMachine,
) -> Result<LoadedImage, Vec<Diagnostic>> {
    if bytes.starts_with(elf::MAGIC) {
        load_elf(file, bytes, elf_spaces, machine.0)
    } else if machine == ElfMachine::MCS51 && omf51::guess_format(bytes).is_some() {
        load_omf51(file, bytes, hex_spaces)
    } else {
        load_hex(file, bytes, &self::hex_spaces(hex_spaces, elf_spaces))
    }
}
