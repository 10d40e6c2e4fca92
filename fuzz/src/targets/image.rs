//! Targets of image files and symbol files.

use emu_core::chip::{Chip, ChipFamily};
use emu_core::cpu::Cpu;
use emu_core::image::{
    HexSegment, Image, SourceLines, SymbolFile, SymbolSpaces, avr_device, avr_signature, load_elf, load_hex,
    load_messages, load_omf51, load_symbols, write_hex,
};
use emu_debug::{AddressNames, cod};

use crate::machines::{MachineVisitor, family_chip, family_chips, visit_machine};
use crate::omf51::right;

/// Machine cycles of a run with commands.
const CYCLES: u64 = 5_000;

/// Reads an image; written and read again, it must be the same.
pub(crate) fn hex(data: &[u8]) {
    for chip in family_chips() {
        let Ok(loaded) = load_hex("fuzz.hex", data, chip.hex_spaces) else { continue };
        let text = image_to_hex(chip, &loaded.image);
        let again = load_hex("fuzz.hex", text.as_bytes(), chip.hex_spaces).map(|again| again.image.segments);
        assert_eq!(again.as_ref(), Ok(&loaded.image.segments), "{}: {text}", chip.name);
    }
}

fn image_to_hex(chip: &Chip, image: &Image) -> String {
    let place =
        |space: &str| chip.hex_spaces.iter().find(|window| window.name == space).map_or(0, |window| window.start);
    let pieces = image
        .segments
        .iter()
        .map(|segment| HexSegment { addr: place(segment.space) + segment.addr, bytes: &segment.bytes });
    write_hex(&pieces.collect::<Vec<_>>())
}

/// Reads an ELF file with symbols, notes and source lines, and looks up lines by address and by name.
pub(crate) fn elf(data: &[u8]) {
    _ = (avr_device(data), avr_signature(data));
    for family in [ChipFamily::Avr, ChipFamily::Mcs51] {
        let chip = family_chip(family);
        _ = load_elf("fuzz.elf", data, chip.elf_spaces, chip.elf_machine);
    }
    let lines = SourceLines::from_elf("fuzz.elf", data);
    for line in lines.all_lines().iter().take(64) {
        _ = lines.line_at(line.addr, 0);
        assert!(lines.addresses_of_line(&line.file, line.line).is_ok(), "a line that is there is found: {line:?}");
        _ = lines.folder(&line.file);
    }
    _ = lines.warnings();
    let info = lines.debug_info();
    info.types().for_each(|one| _ = info.size(Some(one.id)));
    _ = info.functions.iter().map(|function| function.block.blocks_around(0).len()).sum::<usize>();
}

/// Reads symbol files of SDCC. The file name selects the kind of a listing if its contents do not.
pub(crate) fn symbols_sdcc(data: &[u8]) {
    read_symbols(data, &["fuzz.rst", "fuzz.lst"], SymbolSpaces::MCS51);
}

/// Reads symbol files of gputils.
pub(crate) fn symbols_gputils(data: &[u8]) {
    read_symbols(data, &["fuzz.lst", "fuzz.cod"], SymbolSpaces::PIC16);
}

/// Reads maps of Keil's linkers, the older and the newer one.
pub(crate) fn symbols_keil(data: &[u8]) {
    read_symbols(data, &["fuzz.m51", "fuzz.map"], SymbolSpaces::MCS51);
}

fn read_symbols(data: &[u8], names: &[&str], spaces: SymbolSpaces) {
    for name in names {
        let Ok(found) = load_symbols(&[SymbolFile { name, bytes: data }], spaces) else { continue };
        assert_printable(found.symbols.iter().map(|symbol| &*symbol.name));
        assert_printable(found.unplaced.iter().map(|(name, _)| &**name));
        assert_printable(found.lines.iter().map(|line| &*line.file));
    }
}

fn assert_printable<'n>(names: impl Iterator<Item = &'n str>) {
    names.for_each(|name| assert!(!name.contains(|c: char| c.is_control() && c != '\t'), "{name:?}"));
}

/// Reads object files. A wrong checksum would stop the reader early, so a copy with correct checksums is read
/// too.
pub(crate) fn omf51(data: &[u8]) {
    let chip = family_chip(ChipFamily::Mcs51);
    for bytes in [data, &right(data)] {
        let Ok(loaded) = load_omf51("fuzz.omf", bytes, chip.hex_spaces) else { continue };
        assert_printable(loaded.image.symbols.iter().map(|symbol| &*symbol.name));
        assert_printable(loaded.image.lines.all_lines().iter().map(|line| &*line.file));
    }
}

/// Reads the messages in a file, and executes them on an empty program.
pub(crate) fn cod_messages(data: &[u8]) {
    let Ok(messages) = load_messages(&SymbolFile { name: "fuzz.cod", bytes: data }) else { return };
    let Ok(script) = cod::CodScript::read(&messages) else { return };
    let symbols = load_symbols(&[SymbolFile { name: "fuzz.cod", bytes: data }], SymbolSpaces::PIC16);
    let symbols = symbols.map_or(Vec::new(), |found| found.symbols);
    let chip = family_chip(ChipFamily::Pic16);
    visit_machine(chip, &Image::default(), CodCommands { script, names: AddressNames { chip, symbols: &symbols } });
}

struct CodCommands<'a> {
    script: cod::CodScript,
    names: AddressNames<'a>,
}

impl MachineVisitor for CodCommands<'_> {
    type Output = ();

    fn visit<C: Cpu + 'static>(self, mut cpu: C) {
        let limits = cod::CodRunLimits { cycle: CYCLES, hz: 4_000_000 };
        let analog = |cpu: &mut C, at, pin, millivolts: i64| {
            cpu.drive_volts(at, pin, u32::try_from(millivolts).unwrap_or(0));
        };
        _ = cod::run_script(&mut cpu, &self.script, self.names, limits, &mut { analog });
    }
}
