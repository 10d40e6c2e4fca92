//! Damaged files give lines or warnings and nothing else, in a short time.

use emu_core::image::{BlockInfo, ElfMachine, FrameView, FunctionInfo, NumberedType, SourceLines, load};
use emu_core::rng::Rng;

use crate::elf::build;
use crate::input;

/// A frame of a machine with made-up registers and memory; the number is its program counter.
struct Frame(u32);

impl FrameView for Frame {
    fn pc_byte(&self) -> u32 {
        self.0
    }
    fn register(&self, number: u16) -> Option<u32> {
        (number % 7 != 3).then_some(u32::from(number) & 0xFF)
    }
    fn memory(&self, address: u32) -> Option<u8> {
        Some(address as u8)
    }
    fn cfa(&self) -> Option<u32> {
        Some(0x8FF)
    }
}

/// Locates all variables in the blocks of a function.
fn ask_places(lines: &SourceLines, function: &FunctionInfo) {
    let info = lines.debug_info();
    let mut blocks: Vec<&BlockInfo> = vec![&function.block];
    let frame = Frame(function.block.ranges.first().map_or(0, |range| range.start));
    _ = info.unwind(&frame);
    while let Some(block) = blocks.pop() {
        for variable in &block.variables {
            let size = info.size(variable.variable_type).unwrap_or(0).min(1 << 16);
            assert_eq!(info.locate_bytes(variable, Some(function), &frame).len(), size as usize);
        }
        blocks.extend(&block.blocks);
    }
}

/// Reads everything that can be requested; returns the number of lines and of warnings.
fn ask(bytes: &[u8]) -> (usize, usize) {
    let lines = SourceLines::from_elf("a.elf", bytes);
    for byte in (0..0x60).chain([0x7FFE, u32::MAX]) {
        if let Some(line) = lines.line_at(byte, 0) {
            assert!(line.line > 0 && line.addr <= byte);
        }
    }
    for line in lines.all_lines() {
        assert!(lines.addresses_of_line(&line.file, line.line).is_ok_and(|places| places.contains(&line.addr)));
    }
    for warning in lines.warnings() {
        assert!(!warning.is_error() && ["ELF012", "ELF013", "ELF014"].contains(&warning.code), "{warning:?}");
    }
    let info = lines.debug_info();
    info.functions.iter().for_each(|function| ask_places(&lines, function));
    for variable in &info.globals {
        _ = info.locate_bytes(variable, None, &Frame(0));
    }
    info.types().for_each(|NumberedType { id, .. }| _ = info.size(Some(id)));
    // The image in the file can still be read, or is rejected.
    _ = load("a.elf", bytes, &[], &[], ElfMachine::AVR);
    (lines.all_lines().len(), lines.warnings().len())
}

/// The file with DWARF and the one with stabs, and where their debugging information lies.
const FILES: [(&str, std::ops::Range<u64>); 2] = [("lines.elf", 0xF8..0x6FC), ("stabs.elf", 0x1A8..0xEAB)];

#[test]
fn the_places_are_those_of_debugging_information() {
    for (name, place) in FILES {
        let (file, whole) = (input(name), ask(&input(name)));
        let mut bytes = file.clone();
        bytes[place.start as usize..place.end as usize].fill(0xFF);
        assert!(whole.0 > 1 && whole.1 == 0 && ask(&bytes).0 == 0, "{name}: {whole:?}");
    }
}

#[test]
fn cut_files() {
    for (name, _) in FILES {
        let file = input(name);
        let mut warned = 0;
        for end in 0..file.len() {
            let (lines, warnings) = ask(&file[..end]);
            // The table of sections follows all debugging information, so a file without it has no lines.
            assert!(lines == 0 || warnings == 0, "{name} {end}");
            warned += warnings;
        }
        assert!(warned > file.len() / 2, "{name} {warned}");
    }
}

#[test]
fn flipped_bits() {
    for (name, place) in FILES {
        flip_bits(name, place);
    }
}

fn flip_bits(name: &str, debugging: std::ops::Range<u64>) {
    let file = input(name);
    let whole = ask(&file);
    let (mut fewer, mut warned) = (0, 0);
    for seed in 0..6_000u64 {
        let mut rng = Rng::new(seed);
        let mut bytes = file.clone();
        for _ in 0..=rng.below(4) {
            // Half of the damage falls on debugging information.
            let place = if rng.below(2) == 0 { debugging.clone() } else { 0..file.len() as u64 };
            let at = (place.start + rng.below(place.end - place.start)) as usize;
            match rng.below(3) {
                0 => bytes[at] ^= 1 << rng.below(8),
                1 => bytes[at] = 0xFF,
                _ => bytes[at] = rng.next_u64() as u8,
            }
        }
        let (lines, warnings) = ask(&bytes);
        fewer += usize::from(lines < whole.0);
        warned += usize::from(warnings > 0);
    }
    assert!(fewer > 50 && warned > 100, "{name} {fewer} {warned}");
}

/// Every bit flipped of the tables that are read, and one of each byte of the longer ones of stabs.
#[test]
fn every_bit() {
    for (name, place) in FILES {
        let file = input(name);
        for at in place.start as usize..place.end as usize {
            for bit in (0..8).filter(|bit| name == "lines.elf" || at % 8 == *bit) {
                let mut bytes = file.clone();
                bytes[at] ^= 1 << bit;
                ask(&bytes);
            }
        }
    }
}

/// Many units that all refer to one long line program, one long abbreviation table or one long list of
/// ranges. Data that is read again for each unit has a limit.
#[test]
fn units_without_end() {
    let unit = |abbreviations: u32| {
        // DWARF 4: length, version, abbreviations, size of addresses; the root: abbreviation 1, line program
        // 0, ranges 0.
        let mut unit = vec![16, 0, 0, 0, 4, 0];
        unit.extend(abbreviations.to_le_bytes());
        unit.extend([4, 1, 0, 0, 0, 0, 0, 0, 0, 0]);
        unit[0] = unit.len() as u8 - 4;
        unit
    };
    // Root without children: line program and ranges, both offsets in sections.
    let abbreviation = [1, 0x11, 0, 0x10, 0x17, 0x55, 0x17, 0, 0];
    // Unused abbreviations of four bytes each.
    let unused = |count: u32| (2..2 + count).flat_map(|_| [0x7F, 0x11, 0, 0, 0]).collect::<Vec<u8>>();
    let mut table = abbreviation.to_vec();
    table.extend(unused(1));
    table.push(0);
    let mut long_table = unused(20_000);
    long_table.splice(0..0, abbreviation);
    long_table.push(0);
    let ranges: Vec<u8> = (0..20_000u32).flat_map(|n| [n * 2 + 2, n * 2 + 4]).flat_map(u32::to_le_bytes).collect();
    let mut head = vec![0u8; 0];
    // Version 2, length of the header, least instruction, default, base, range, first opcode, no folders,
    // many files.
    let files: Vec<u8> = (0..20_000).flat_map(|_| [b'a', 0, 0, 0, 0]).collect();
    let body = [&[1, 1, 0xFB, 14, 1, 0][..], &files, &[0]].concat();
    head.extend((body.len() as u32 + 6).to_le_bytes());
    head.extend([2, 0]);
    head.extend((body.len() as u32).to_le_bytes());
    head.extend(body);
    let same: Vec<u8> = (0..20_000).flat_map(|_| unit(0)).collect();
    for (name, table, ranges, head) in [
        ("ranges", &table, &ranges[..], &[][..]),
        ("heads", &table, &[][..], &head[..]),
        ("abbreviations", &long_table, &[][..], &[][..]),
    ] {
        let file = build(&[
            (".debug_info", 0, &same),
            (".debug_abbrev", 0, table),
            (".debug_ranges", 0, ranges),
            (".debug_line", 0, head),
        ]);
        let (lines, warnings) = ask(&file);
        assert_eq!((lines, warnings), (0, 1), "{name}");
    }
    // Tables that start in the middle of each other.
    let shifted: Vec<u8> = (0..20_000).flat_map(|n| unit(9 + 5 * n)).collect();
    let file = build(&[(".debug_info", 0, &shifted), (".debug_abbrev", 0, &long_table), (".debug_line", 0, &[])]);
    assert_eq!(ask(&file), (0, 1));
}
