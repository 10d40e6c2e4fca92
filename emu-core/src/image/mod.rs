//! Images: what a HEX or ELF file puts into the memories of a chip.
//!
//! [`load`] looks at the first bytes and hands on to [`load_elf`], [`load_omf51`] or [`load_hex`]. A file is either taken or refused
//! with all its faults, each with a place, a stable code (see [`IMAGE_CODES`]) and a hint; what of it is left out is noted. What is
//! accepted is in `docs/formats/hex.md`, `elf.md` and `omf51.md`. [`write_hex`] is the way back.
//!
//! ```text
//!   hex.rs   lines to records to addresses          elf.rs   sections to load addresses, symbols
//!   hex_record.rs  one line and its faults                place.rs bytes into memories: outside, overlap, half words
//!   omf51/   records of absolute object files for MCS-51
//!   write.rs segments to HEX                        faults.rs the list of faults and its limit
//!   codes.rs the table of codes                     symbols/ the files beside an image that SDCC and gputils write
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
    AVR_DATA, BaseEncoding, BlockInfo, ByteLocation, CType, DebugInfo, FrameView, FunctionInfo, StructMember, TypeId,
    UnwoundFrame, VariableInfo, VariableLocation,
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
pub use write::{write_hex, write_hex_aligned};

/// One memory that an image may fill: a window in the address space of the image file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ImageSpace {
    /// Name of the memory, such as `flash`.
    pub name: &'static str,
    /// Where the window begins, a byte address of the image file (in an ELF file for AVR the EEPROM is at 0x810000).
    pub start: u32,
    /// Size in bytes.
    pub len: u32,
    /// Bytes in a word: 1 or 2. Where it is 2 an image must define both bytes of a word or none.
    pub word: u32,
    /// Bits of a word that the memory has; looked at in HEX files where `word` is 2.
    pub word_bits: WordBits,
}

/// Bits of a word that a memory has, from bit 0 on, and what becomes of a word with more.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WordBits {
    /// All.
    All,
    /// So many, and a file with a word that has more is refused: it is no program for the chip.
    Only(u32),
    /// So many, and of a word that has more only these are kept, with a warning.
    Low(u32),
}

/// Bytes that lie side by side in one memory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Segment {
    /// Name of the memory.
    pub space: &'static str,
    /// Byte address of the first byte within the memory.
    pub addr: u32,
    /// The bytes, never none.
    pub bytes: Vec<u8>,
}

/// What stands in place of a memory where a name is that of a number (`equ`), which may be an address or not.
pub const CONSTANT_SPACE: &str = "constant";

/// A name for an address.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct SymbolAt {
    /// The name in the language of the program: as the linker wrote it, demangled ([`SymbolAt::mangled`]), or one of the names
    /// that [`load_symbols`] derives from it.
    pub name: String,
    /// Name of the memory; [`CONSTANT_SPACE`] for a mere number.
    pub space: &'static str,
    /// Byte address within the memory; the value of a constant.
    pub addr: u32,
    /// Size in bytes; 0 for a mere label.
    pub size: u32,
    /// What the linker calls it, where a compiler of C++ or Rust has mangled the name.
    pub mangled: Option<Box<DemangledName>>,
}

impl SymbolAt {
    /// A symbol whose name is the linker's, its control characters escaped ([`diag::text::printable`]).
    #[must_use]
    pub fn new(name: impl Into<String>, space: &'static str, addr: u32, size: u32) -> SymbolAt {
        SymbolAt { name: into_printable(name.into()), space, addr, size, mangled: None }
    }

    /// What the linker calls it.
    #[must_use]
    pub fn linkage_name(&self) -> &str {
        self.mangled.as_ref().map_or(&self.name, |mangled| &mangled.linkage)
    }

    /// True for the whole name, with or without spaces where a compiler has mangled it, and for that of the linker.
    #[must_use]
    pub fn is_named(&self, text: &str) -> bool {
        let is_whole =
            |mangled: &DemangledName| mangled.linkage == text || without_spaces(&self.name).eq(without_spaces(text));
        self.name == text || self.mangled.as_ref().is_some_and(|mangled| is_whole(mangled))
    }

    /// How well a text that is not the whole name stands for a symbol of C++ or Rust, 0 best, as gdb lets one leave out
    /// parts: the name without parameters (`app::compute`, and `f::count` for a static in `f(int)`, 0), without those of templates
    /// too (1), and without outer namespaces (`compute`, `compute(int)`, 2). Nothing where it does not.
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
            // With parameters; those of the name come without its namespaces, which may have some themselves.
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

/// What a file puts into the memories of a chip.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Image {
    /// The bytes: in the order of the memories given to the loader, then by address; neighbours are merged and none
    /// overlap.
    pub segments: Vec<Segment>,
    /// The symbols in the order of the memories, then by address, weak ones first, then by name. Empty for a HEX file.
    pub symbols: Vec<SymbolAt>,
    /// Source lines of the program; none unless a file of symbols was read, or an ELF file was given to [`Lines::from_elf`],
    /// which [`load`] leaves to those who want lines.
    pub lines: SourceLines,
    /// Start address that the file names, a byte address of the image file. For information: a chip starts at its
    /// reset vector.
    pub entry: Option<u32>,
}

impl Image {
    /// Copies the bytes of one memory to their places in `into`; the rest of `into` keeps its value. Bytes beyond the
    /// end of `into` are left out.
    pub fn fill(&self, space: &str, into: &mut [u8]) {
        for (addr, byte) in self.bytes_in(space) {
            if let Some(cell) = into.get_mut(addr as usize) {
                *cell = byte;
            }
        }
    }

    /// The bytes of one memory with their addresses in it, ascending.
    pub fn bytes_in(&self, space: &str) -> impl Iterator<Item = (u32, u8)> {
        self.segments_in(space).flat_map(|s| (s.addr..).zip(s.bytes.iter().copied()))
    }

    /// The highest used address of one memory plus 1; 0 when the image puts nothing there.
    #[must_use]
    pub fn end(&self, space: &str) -> u32 {
        self.segments_in(space).map(|s| s.addr + s.bytes.len() as u32).max().unwrap_or(0)
    }

    fn segments_in(&self, space: &str) -> impl Iterator<Item = &Segment> {
        self.segments.iter().filter(move |s| s.space == space)
    }
}

/// An image and what is odd about its file, though not wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LoadedImage {
    /// The image.
    pub image: Image,
    /// Warnings in the order of their places, at most [`MAX_REPORTED`] and a closing note.
    pub warnings: Vec<Diagnostic>,
}

/// The number by which an ELF file names its processor (`e_machine`; System V ABI, chapter 4, "ELF Header").
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ElfMachine(pub u16);

impl ElfMachine {
    /// Atmel AVR (EM_AVR).
    pub const AVR: Self = ElfMachine(83);
    /// Intel 8051 and variants (EM_8051).
    pub const MCS51: Self = ElfMachine(165);

    /// Name of the processor for messages, where it is a well known one.
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

/// Where an ELF file for an AVR has its memories beside program and RAM: EEPROM, fuses, lock bits and signature, each in 64 KB of
/// addresses (binutils, ld/scripttempl/avr.sc). What lies above is no memory of a chip that is modelled, as the user signature.
pub const AVR_AREAS: std::ops::Range<u32> = 0x81_0000..0x85_0000;

/// A window that lies there.
fn is_avr_elf_area(start: u32) -> bool {
    AVR_AREAS.contains(&start)
}

/// The memories that an Intel HEX file may fill: those of `hex`, and of `elf` those of an AVR that avr-objcopy carries over at the
/// addresses of the ELF file, unless told otherwise.
#[must_use]
pub fn hex_spaces(hex: &[ImageSpace], elf: &[ImageSpace]) -> Vec<ImageSpace> {
    let carried =
        elf.iter().filter(|space| is_avr_elf_area(space.start) && hex.iter().all(|own| own.name != space.name));
    hex.iter().chain(carried).copied().collect()
}

/// Loads an image: ELF if the file begins with the ELF magic, OMF-51 if it is for MCS-51 and begins with a record of that format, and
/// Intel HEX otherwise. `file` is the name for messages.
///
/// # Errors
/// All faults of the file in the order of their places; at most [`MAX_REPORTED`] and a closing note with the number of others.
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
