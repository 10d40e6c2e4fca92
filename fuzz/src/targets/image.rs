//! Files of images and of symbols.

use emu_core::chip::{Chip, Family};
use emu_core::cpu::Cpu;
use emu_core::image::{
    Image, Lines, SymbolFile, SymbolSpaces, avr_device, avr_signature, load_elf, load_hex, load_messages, load_omf51,
    load_symbols, write_hex,
};
use emu_debug::{Names, cod};

use crate::machine::{MachineVisitor, chip, chips, on_machine};
use crate::omf51::right;

/// Machine cycles for which a program with commands runs.
const CYCLES: u64 = 5_000;

/// What is read, written and read again is the same image.
pub(crate) fn hex(data: &[u8]) {
    for chip in chips() {
        let Ok(loaded) = load_hex("fuzz.hex", data, chip.hex) else { continue };
        let text = written(chip, &loaded.image);
        let again = load_hex("fuzz.hex", text.as_bytes(), chip.hex).map(|again| again.image.segments);
        assert_eq!(again.as_ref(), Ok(&loaded.image.segments), "{}: {text}", chip.name);
    }
}

fn written(chip: &Chip, image: &Image) -> String {
    let place = |space: &str| chip.hex.iter().find(|window| window.name == space).map_or(0, |window| window.start);
    let pieces = image.segments.iter().map(|segment| (place(segment.space) + segment.addr, segment.bytes.as_slice()));
    write_hex(&pieces.collect::<Vec<_>>())
}

/// Symbols, notes and lines are read too, and lines are looked up by their addresses and their names.
pub(crate) fn elf(data: &[u8]) {
    _ = (avr_device(data), avr_signature(data));
    for family in [Family::Avr, Family::Mcs51] {
        let chip = chip(family);
        _ = load_elf("fuzz.elf", data, chip.elf, chip.elf_machine);
    }
    let lines = Lines::of_elf("fuzz.elf", data);
    for line in lines.all().iter().take(64) {
        _ = lines.at(line.addr, 0);
        assert!(lines.of(&line.file, line.line).is_ok(), "a line that is there is found: {line:?}");
        _ = lines.folder(&line.file);
    }
    _ = lines.warnings();
    let info = lines.debug_info();
    info.kinds().for_each(|(id, _)| _ = info.size(Some(id)));
    _ = info.functions.iter().map(|function| function.block.around(0).len()).sum::<usize>();
}

/// The name of a listing decides where its content does not.
pub(crate) fn symbols_sdcc(data: &[u8]) {
    symbols(data, &["fuzz.rst", "fuzz.lst"], SymbolSpaces::MCS51);
}

/// Files of gputils.
pub(crate) fn symbols_gputils(data: &[u8]) {
    symbols(data, &["fuzz.lst", "fuzz.cod"], SymbolSpaces::PIC16);
}

/// Maps of Keil's linkers, of the older and of the newer one.
pub(crate) fn symbols_keil(data: &[u8]) {
    symbols(data, &["fuzz.m51", "fuzz.map"], SymbolSpaces::MCS51);
}

fn symbols(data: &[u8], names: &[&str], spaces: SymbolSpaces) {
    for name in names {
        let Ok(found) = load_symbols(&[SymbolFile { name, bytes: data }], spaces) else { continue };
        printable(found.symbols.iter().map(|symbol| &*symbol.name));
        printable(found.unplaced.iter().map(|(name, _)| &**name));
        printable(found.lines.iter().map(|line| &*line.file));
    }
}

fn printable<'n>(names: impl Iterator<Item = &'n str>) {
    names.for_each(|name| assert!(!name.contains(|c: char| c.is_control() && c != '\t'), "{name:?}"));
}

/// Object files; those with wrong check sums get no further, so they are made right too.
pub(crate) fn omf51(data: &[u8]) {
    let chip = chip(Family::Mcs51);
    for bytes in [data, &right(data)] {
        let Ok(loaded) = load_omf51("fuzz.omf", bytes, chip.hex) else { continue };
        printable(loaded.image.symbols.iter().map(|symbol| &*symbol.name));
        printable(loaded.image.lines.all().iter().map(|line| &*line.file));
    }
}

/// Messages are read from the file, and carried out over a program that does nothing.
pub(crate) fn cod_messages(data: &[u8]) {
    let Ok(messages) = load_messages(&SymbolFile { name: "fuzz.cod", bytes: data }) else { return };
    let Ok(script) = cod::Script::read(&messages) else { return };
    let symbols = load_symbols(&[SymbolFile { name: "fuzz.cod", bytes: data }], SymbolSpaces::PIC16);
    let symbols = symbols.map_or(Vec::new(), |found| found.symbols);
    let chip = chip(Family::Pic16);
    on_machine(chip, &Image::default(), Commands { script, names: Names { chip, symbols: &symbols } });
}

struct Commands<'a> {
    script: cod::Script,
    names: Names<'a>,
}

impl MachineVisitor for Commands<'_> {
    type Out = ();

    fn visit<C: Cpu + 'static>(self, mut cpu: C) {
        let limits = cod::Limits { cycle: CYCLES, hz: 4_000_000 };
        let analog = |cpu: &mut C, at, pin, millivolts: i64| {
            cpu.drive_volts(at, pin, u32::try_from(millivolts).unwrap_or(0));
        };
        _ = cod::run(&mut cpu, &self.script, self.names, limits, &mut { analog });
    }
}
