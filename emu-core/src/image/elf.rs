//! Loads ELF32 little-endian files: sections to load addresses, and symbols. System V ABI, chapters 4 and 5;
//! parsed by `object`.

use std::borrow::Cow;
use std::cmp::Ordering;
use std::collections::{HashMap, HashSet};

use diag::text::into_printable;
use diag::{Diagnostic, Pos};
use object::LittleEndian as Le;
use object::elf::{
    self, FileHeader32, PF_X, PT_LOAD, ProgramHeader32, SHF_ALLOC, SHF_COMPRESSED, SHF_EXECINSTR, SHT_NOBITS,
    SHT_SYMTAB, STB_LOCAL, STB_WEAK, STT_FILE, STT_SECTION,
};
use object::read::Error;
use object::read::elf::{FileHeader, ProgramHeader, SectionHeader, SectionTable, Sym};

use super::demangle::{SourceName, demangle};
use super::faults::FaultList;
use super::placement::{PlacedBytes, PlacementConflict, STAYS_ERASED, SourceSpan, address_range, describe_spaces};
use super::{AVR_AREAS, DemangledName, ElfMachine, Image, ImageSpace, LoadedImage, SourceLines, SymbolAt, simavr};

/// The first bytes of every ELF file.
pub(super) const MAGIC: &[u8] = &elf::ELFMAG;

/// Maximum number of program headers; a file with more is broken. A program for a small chip has about five.
const MAX_SEGMENTS: usize = 1024;
/// All symbol names together may have this many times the bytes of the file. Linkers share the tails of
/// names, but a broken table that refers to one long string a million times must not exhaust memory.
const NAME_SHARING: usize = 4;

/// Loads an ELF32 executable. `file` is the name for messages, `spaces` are the memories of the chip as
/// windows of the file's address space, and `e_machine` is the required processor. Bytes go to their load
/// (physical) addresses: initialized data is placed in flash after the code, from where the start-up code
/// copies it.
///
/// # Errors
/// All faults of the file (codes ELF001 to ELF015): at most [`super::MAX_REPORTED`], and a closing note with
/// the number of further ones.
pub fn load_elf(
    file: &str,
    bytes: &[u8],
    spaces: &[ImageSpace],
    e_machine: u16,
) -> Result<LoadedImage, Vec<Diagnostic>> {
    let mut faults = FaultList::new(file, "ELF011");
    check_header(bytes, ElfMachine(e_machine), &mut faults);
    if !faults.is_empty() {
        return faults.finish(Image::default());
    }
    let image = read_elf(&aligned(bytes), spaces, &mut faults).unwrap_or_else(|error| {
        corrupt(&mut faults, &error.to_string());
        Image::default()
    });
    faults.finish(image)
}

/// Returns the bytes at an aligned address, because the tables are read in place. A slice of a larger buffer
/// may be unaligned and is copied.
pub(super) fn aligned(bytes: &[u8]) -> Cow<'_, [u8]> {
    if bytes.as_ptr().align_offset(8) == 0 { Cow::Borrowed(bytes) } else { Cow::Owned(bytes.to_vec()) }
}

/// A section with debugging information.
pub(super) enum DebugSection<'b> {
    /// The section's bytes.
    Plain(&'b [u8]),
    /// The section is compressed (System V ABI, "Compressed sections", or the older form of GNU tools:
    /// `.zdebug_info`).
    Compressed,
}

impl<'b> DebugSection<'b> {
    /// The bytes of the section; empty if it is compressed.
    pub(super) fn bytes(&self) -> &'b [u8] {
        match self {
            DebugSection::Plain(bytes) => bytes,
            DebugSection::Compressed => &[],
        }
    }
}

/// A section with debugging information and its name.
pub(super) struct NamedSection<'b> {
    /// The name in the section table, with the dot.
    pub(super) name: &'b str,
    /// The content.
    pub(super) section: DebugSection<'b>,
}

/// The sections with debugging information, by name. Returns `None` if the section table, or one of these
/// sections, is outside of the file.
pub(super) fn debug_sections(bytes: &[u8]) -> Option<Vec<NamedSection<'_>>> {
    let header = FileHeader32::<Le>::parse(bytes).ok()?;
    let sections = header.sections(Le, bytes).ok()?;
    let mut found = Vec::new();
    for section in sections.iter() {
        let Some(name) = sections.section_name(Le, section).ok().and_then(|name| str::from_utf8(name).ok()) else {
            continue;
        };
        if name.starts_with(".zdebug_") || name.starts_with(".debug_") && section.sh_flags(Le) & SHF_COMPRESSED != 0 {
            found.push(NamedSection { name, section: DebugSection::Compressed });
        } else if name.starts_with(".debug_") || matches!(name, ".stab" | ".stabstr") {
            found.push(NamedSection { name, section: DebugSection::Plain(section.data(Le, bytes).ok()?) });
        }
    }
    Some(found)
}

/// Names of the symbols at an address, in sections with code; empty if the file has no symbol table.
pub(super) fn code_names_at(bytes: &[u8], addr: u32) -> Vec<&[u8]> {
    let named = || {
        let header = FileHeader32::<Le>::parse(bytes).ok()?;
        let sections = header.sections(Le, bytes).ok()?;
        let table = sections.symbols(Le, bytes, SHT_SYMTAB).ok()?;
        let here = table.iter().filter(|symbol| symbol.st_value(Le) == addr && symbol.st_type() != STT_SECTION);
        let code = here.filter(|symbol| {
            let home = object::SectionIndex(symbol.st_shndx(Le).into());
            sections.section(home).is_ok_and(|home| home.sh_flags(Le) & SHF_EXECINSTR != 0)
        });
        Some(code.filter_map(|symbol| symbol.name(Le, table.strings()).ok()).filter(|name| !name.is_empty()).collect())
    };
    named().unwrap_or_default()
}

/// What a table of symbols says.
#[derive(Default)]
pub(super) struct SymbolTable<'b> {
    /// Addresses of what other modules see, by name.
    pub addresses: HashMap<&'b [u8], u32>,
    /// Bytes of what has an address.
    pub sizes: HashMap<u32, u32>,
}

/// The symbols of a file; none where it has no table of them.
pub(super) fn symbol_table(bytes: &[u8]) -> SymbolTable<'_> {
    let read = || {
        let header = FileHeader32::<Le>::parse(bytes).ok()?;
        let table = header.sections(Le, bytes).ok()?.symbols(Le, bytes, SHT_SYMTAB).ok()?;
        let (mut found, mut left) = (SymbolTable::default(), bytes.len() * NAME_SHARING);
        for symbol in table.iter().filter(|symbol| !symbol.is_undefined(Le)) {
            let (addr, size) = (symbol.st_value(Le), symbol.st_size(Le));
            if size > 0 {
                found.sizes.insert(addr, size);
            }
            if let Some(name) = symbol.name(Le, table.strings()).ok().filter(|_| symbol.st_bind() != STB_LOCAL) {
                left = left.checked_sub(name.len())?;
                found.addresses.insert(name, addr);
            }
        }
        Some(found)
    };
    read().unwrap_or_default()
}

/// Checks what can be read without knowing the layout of the rest.
fn check_header(bytes: &[u8], wanted: ElfMachine, faults: &mut FaultList) {
    let rebuild = "link the program for this chip and load that file";
    if !bytes.starts_with(MAGIC) {
        let found = bytes.iter().take(4).map(|b| format!("{b:02X}")).collect::<Vec<_>>().join(" ");
        let cause = || format!("the file begins with [{found}], an ELF file with [7F 45 4C 46]");
        faults.error("ELF001", Pos::default(), cause, "load an ELF or an Intel HEX file");
        return;
    }
    let &[_, _, _, _, class, order, _, _, _, _, _, _, _, _, _, _, type_0, type_1, machine_0, machine_1, ..] = bytes
    else {
        return corrupt(faults, &format!("the header is cut off after {} bytes", bytes.len()));
    };
    if class != elf::ELFCLASS32 {
        let cause =
            || format!("the class is {class} ({}), wanted 1 (32 bits)", if class == 2 { "64 bits" } else { "unknown" });
        faults.error("ELF002", Pos::default(), cause, rebuild);
    }
    if order != elf::ELFDATA2LSB {
        let name = if order == elf::ELFDATA2MSB { "big-endian" } else { "unknown" };
        let cause = || format!("the byte order is {order} ({name}), wanted 1 (little-endian)");
        faults.error("ELF003", Pos::default(), cause, rebuild);
    }
    let half = |bytes| if order == elf::ELFDATA2MSB { u16::from_be_bytes(bytes) } else { u16::from_le_bytes(bytes) };
    let machine = ElfMachine(half([machine_0, machine_1]));
    if machine != wanted {
        let cause = || {
            let names = (machine.name(), wanted.name());
            format!("the program is for machine {} ({}), wanted {} ({})", machine.0, names.0, wanted.0, names.1)
        };
        faults.error("ELF004", Pos::default(), cause, rebuild);
    }
    let kind = half([type_0, type_1]);
    if kind != elf::ET_EXEC {
        let name = match kind {
            elf::ET_REL => "relocatable object, not linked",
            elf::ET_DYN => "shared object",
            elf::ET_CORE => "core dump",
            _ => "unknown",
        };
        let cause = || format!("the file type is {kind} ({name}), wanted 2 (executable)");
        faults.error("ELF005", Pos::default(), cause, "link the object files and load the result");
    }
}

fn corrupt(faults: &mut FaultList, what: &str) {
    let hint = "the file is cut off or damaged: build or get it again";
    faults.error("ELF006", Pos::default(), || format!("the file cannot be read: {what}"), hint);
}

/// Bytes to load, from a section or a segment.
struct LoadPiece<'b> {
    name: String,
    addr: u64,
    bytes: &'b [u8],
    code: bool,
}

fn read_elf(bytes: &[u8], spaces: &[ImageSpace], faults: &mut FaultList) -> Result<Image, Error> {
    let header = FileHeader32::<Le>::parse(bytes)?;
    let segments = header.program_headers(Le, bytes)?;
    if segments.len() > MAX_SEGMENTS {
        corrupt(faults, &format!("{} program headers, at most {MAX_SEGMENTS} are read", segments.len()));
        return Ok(Image::default());
    }
    let sections = header.sections(Le, bytes)?;
    let pieces = if sections.is_empty() {
        pieces_from_segments(segments, bytes, faults)
    } else {
        pieces_from_sections(&sections, segments, bytes, faults)
    };
    let mut placed = PlacedBytes::new(spaces);
    for (piece, number) in pieces.iter().zip(0..) {
        placed.place_bytes(piece.addr, piece.bytes, SourceSpan { line: number, column: 0 }, |trouble| {
            report_trouble(trouble, &pieces, piece, spaces, faults);
        });
        if faults.is_full() {
            break;
        }
    }
    for half in placed.half_words() {
        let name = pieces.get(half.from.line as usize).map_or("", |piece| &piece.name);
        let cause = || format!("{name} defines half a word: {} {}{STAYS_ERASED}", half.space.name, half.bytes());
        faults.note("ELF009", Pos::default(), cause, "align the end of the section to a word in the linker script");
    }
    placed.fill_half_words();
    if faults.is_empty() && !pieces.iter().any(|piece| piece.code) {
        let cause = || format!("no executable section contains bytes ({} sections to load)", pieces.len());
        faults.error("ELF010", Pos::default(), cause, "link a program, not only data");
    }
    let symbols = symbols(&sections, bytes, spaces, faults)?;
    Ok(Image {
        segments: placed.into_segments(),
        symbols,
        lines: SourceLines::default(),
        entry: Some(header.e_entry(Le)),
    })
}

fn report_trouble(
    trouble: PlacementConflict,
    pieces: &[LoadPiece],
    piece: &LoadPiece,
    spaces: &[ImageSpace],
    faults: &mut FaultList,
) {
    let name = &piece.name;
    match trouble {
        // The section is for a simulator. If the linker script does not know it, it is placed in flash like
        // constants.
        PlacementConflict::Outside { .. } if name == simavr::SECTION => {}
        PlacementConflict::Outside { start, end } => {
            let span = format!("{name}: 0x{start:04X} to 0x{:04X} ({} bytes) lies", end - 1, end - start);
            // No AVR program is loaded there, on any chip: the section is for other tools.
            if start >= AVR_AREAS.end.into() && !piece.code {
                let hint = "programmers do not write it either; avr-objcopy -R removes it";
                let cause = || format!("{span} where no AVR has a memory: ignored");
                return faults.note("ELF015", Pos::default(), cause, hint);
            }
            let cause = || format!("{span} outside the memories of the chip: {}", describe_spaces(spaces));
            faults.error("ELF007", Pos::default(), cause, "link for this chip, or choose the chip it was linked for");
        }
        PlacementConflict::Overlap { start, end, with } | PlacementConflict::Replaced { start, end, with } => {
            let cause = || {
                let other = pieces.get(with.line as usize).map_or("", |piece| &piece.name);
                format!("{name}: 0x{start:04X} to 0x{:04X} ({} bytes) overlaps {other}", end - 1, end - start)
            };
            faults.error("ELF008", Pos::default(), cause, "correct the load addresses in the linker script");
        }
    }
}

/// The sections that a loader loads, with their load addresses: that of the program header around the
/// section, or else their own.
fn pieces_from_sections<'b>(
    sections: &SectionTable<'b, FileHeader32<Le>>,
    segments: &[ProgramHeader32<Le>],
    bytes: &'b [u8],
    faults: &mut FaultList,
) -> Vec<LoadPiece<'b>> {
    let mut pieces = Vec::new();
    for section in sections.iter() {
        let flags = section.sh_flags(Le);
        if flags & SHF_ALLOC == 0 || section.sh_type(Le) == SHT_NOBITS || section.sh_size(Le) == 0 {
            continue;
        }
        let name =
            sections.section_name(Le, section).map(lossy_text).unwrap_or_else(|_| "a section without name".to_owned());
        let Ok(data) = section.data(Le, bytes) else {
            corrupt(faults, &format!("{name} extends beyond the end of the file"));
            continue;
        };
        let (offset, vaddr) = (section.sh_offset(Le), section.sh_addr(Le));
        let load = |segment: &ProgramHeader32<Le>| {
            let into = u64::from(offset.checked_sub(segment.p_offset(Le))?);
            let fits = into + data.len() as u64 <= u64::from(segment.p_filesz(Le));
            let same = vaddr.wrapping_sub(segment.p_vaddr(Le)) as u64 == into;
            (segment.p_type(Le) == PT_LOAD && fits && same).then(|| u64::from(segment.p_paddr(Le)) + into)
        };
        let addr = segments.iter().find_map(load).unwrap_or(u64::from(vaddr));
        pieces.push(LoadPiece { name, addr, bytes: data, code: flags & SHF_EXECINSTR != 0 });
    }
    pieces
}

/// The pieces of a file without section headers.
fn pieces_from_segments<'b>(
    segments: &[ProgramHeader32<Le>],
    bytes: &'b [u8],
    faults: &mut FaultList,
) -> Vec<LoadPiece<'b>> {
    let mut pieces = Vec::new();
    for (segment, number) in segments.iter().zip(0..).filter(|(s, _)| s.p_type(Le) == PT_LOAD && s.p_filesz(Le) > 0) {
        let name = format!("program header {number}");
        match segment.data(Le, bytes) {
            Ok(data) => {
                let (addr, code) = (u64::from(segment.p_paddr(Le)), segment.p_flags(Le) & PF_X != 0);
                pieces.push(LoadPiece { name, addr, bytes: data, code });
            }
            Err(()) => corrupt(faults, &format!("{name} extends beyond the end of the file")),
        }
    }
    pieces
}

/// Functions, objects and labels in a memory. Left out are names of files and sections, absolute values,
/// undefined symbols, the assembler's own labels (`.L...`) and mapping symbols (`$d`, `$t`).
fn symbols(
    sections: &SectionTable<FileHeader32<Le>>,
    bytes: &[u8],
    spaces: &[ImageSpace],
    faults: &mut FaultList,
) -> Result<Vec<SymbolAt>, Error> {
    let table = sections.symbols(Le, bytes, SHT_SYMTAB)?;
    let mut found = Vec::new();
    let mut budget = bytes.len().saturating_mul(NAME_SHARING);
    // The local symbols of a module follow the symbol with the name of its file (System V ABI, "Symbol
    // Table").
    let mut module: &[u8] = &[];
    for symbol in table.iter() {
        let kind = symbol.st_type();
        let home = symbol.st_shndx(Le);
        if kind == STT_FILE {
            module = symbol.name(Le, table.strings()).unwrap_or_default();
            continue;
        }
        if kind == STT_SECTION || matches!(home, elf::SHN_UNDEF | elf::SHN_ABS | elf::SHN_COMMON) {
            continue;
        }
        let addr = symbol.st_value(Le);
        let Some(at) = spaces.iter().position(|space| address_range(space).contains(&u64::from(addr))) else {
            continue;
        };
        let name = symbol.name(Le, table.strings())?;
        let Some(left) = budget.checked_sub(name.len()) else {
            corrupt(faults, "the names of the symbols are much larger than the file");
            break;
        };
        budget = left;
        if name.is_empty() || name.starts_with(b"$") || name.starts_with(b".L") {
            continue;
        }
        let Some(space) = spaces.get(at) else { continue };
        let (local, weak) = (symbol.st_bind() == STB_LOCAL, symbol.st_bind() == STB_WEAK);
        let name = String::from_utf8_lossy(name).into_owned();
        let at_addr = SymbolAt::new(name, space.name, addr - space.start, symbol.st_size(Le));
        let module = if local { module.get(..module.len().min(MAX_MODULE_NAME)).unwrap_or_default() } else { &[] };
        found.push(NamedSymbol { at, weak, module, symbol: at_addr });
    }
    let shared = needs_module_name(&found);
    found.iter_mut().zip(shared).for_each(|(named, shared)| named.give_name(shared));
    found.sort_by(|a, b| a.order(b));
    Ok(found.into_iter().map(|named| named.symbol).collect())
}

/// Maximum length in bytes of a module name that becomes part of symbol names.
const MAX_MODULE_NAME: usize = 60;

/// A symbol with the values by which symbols are sorted.
struct NamedSymbol<'b> {
    /// Index of its memory.
    at: usize,
    weak: bool,
    /// File of the module of a local symbol; empty for a global symbol.
    module: &'b [u8],
    symbol: SymbolAt,
}

impl NamedSymbol<'_> {
    /// The order by memory and address; of one address weak names first, then by name.
    fn order(&self, other: &NamedSymbol<'_>) -> Ordering {
        let key = |a: &NamedSymbol<'_>| (a.at, a.symbol.addr, !a.weak);
        let name = |a: &NamedSymbol<'_>, b: &NamedSymbol<'_>| a.symbol.name.cmp(&b.symbol.name);
        key(self).cmp(&key(other)).then_with(|| name(self, other)).then(self.symbol.size.cmp(&other.symbol.size))
    }

    /// Demangles the name. If `shared`, another symbol has the same name, so the name of the module is added:
    /// `main.count`.
    fn give_name(&mut self, shared: bool) {
        let file = String::from_utf8_lossy(self.module);
        let stem = file.rsplit('/').next().unwrap_or_default().split('.').next().unwrap_or_default();
        // A demangled name can contain characters that the linker name does not have.
        let full = |name: String| into_printable(if shared { format!("{stem}.{name}") } else { name });
        let linkage = std::mem::take(&mut self.symbol.name);
        match demangle(&linkage) {
            Some(SourceName { whole: name, path }) => {
                let mangled = DemangledName { linkage: full(linkage), path: full(path) };
                (self.symbol.name, self.symbol.mangled) = (full(name), Some(Box::new(mangled)));
            }
            None => self.symbol.name = full(linkage),
        }
    }
}

/// Returns for each symbol whether it is a local one whose name occurs at several addresses, so that it needs
/// the name of its module. A global symbol keeps its name.
fn needs_module_name(found: &[NamedSymbol<'_>]) -> Vec<bool> {
    let mut places: HashMap<(usize, &str), HashSet<u32>> = HashMap::new();
    for named in found {
        places.entry((named.at, &named.symbol.name)).or_default().insert(named.symbol.addr);
    }
    let several =
        |named: &NamedSymbol<'_>| places.get(&(named.at, &*named.symbol.name)).is_some_and(|all| all.len() > 1);
    found.iter().map(|named| !named.module.is_empty() && several(named)).collect()
}

/// The name of a section for messages, cut to 60 bytes.
fn lossy_text(name: &[u8]) -> String {
    String::from_utf8_lossy(name.get(..name.len().min(60)).unwrap_or_default()).into_owned()
}
