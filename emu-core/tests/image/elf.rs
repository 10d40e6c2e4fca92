//! Hand-made ELF files, valid and invalid, compared with `elf.txt`.

use std::collections::BTreeSet;

use diag::Severity;
use emu_core::image::{
    ImageSpace, Segment, SimavrSection, SimavrTrace, SymbolAt, WordBits, load, load_elf, read_simavr_section,
};

use crate::{AVR, table};

/// The address windows that avr-gcc gives to the memories of an AVR, with the sizes of an ATmega328P.
pub const MEMORIES: &[ImageSpace] = &[
    ImageSpace { name: "flash", start: 0, len: 0x8000, word: 2, word_bits: WordBits::All },
    ImageSpace { name: "data", start: 0x80_0000, len: 0x900, word: 1, word_bits: WordBits::All },
    ImageSpace { name: "eeprom", start: 0x81_0000, len: 0x400, word: 1, word_bits: WordBits::All },
];

const ALLOC: u32 = 2;
const CODE: u32 = 4;
const EXEC: u16 = 2;
const PROGBITS: u32 = 1;
const NOBITS: u32 = 8;
const FUNC: u8 = 2;
const OBJECT: u8 = 1;
const ABS: u16 = 0xFFF1;

/// A section. If it is loaded it gets its own program header.
#[derive(Clone)]
struct Section {
    name: &'static str,
    kind: u32,
    flags: u32,
    addr: u32,
    load: u32,
    bytes: Vec<u8>,
}

#[derive(Clone)]
pub struct Elf {
    class: u8,
    order: u8,
    kind: u16,
    machine: u16,
    sections: Vec<Section>,
    /// Name, value, size, type, section.
    symbols: Vec<(&'static str, u32, u32, u8, u16)>,
    headers: bool,
}

fn section(name: &'static str, flags: u32, addr: u32, load: u32, bytes: &[u8]) -> Section {
    Section { name, kind: PROGBITS, flags: flags | ALLOC, addr, load, bytes: bytes.to_vec() }
}

/// A valid program: code, initialized data that is loaded after it, zeroed data, EEPROM, a comment.
pub fn program() -> Elf {
    let mut bss = section(".bss", 0, 0x80_0102, 0x80_0102, &[0; 0x1000]);
    bss.kind = NOBITS;
    let mut comment = section(".comment", 0, 0, 0, b"GCC");
    comment.flags = 0;
    Elf {
        class: 1,
        order: 1,
        kind: EXEC,
        machine: 83,
        sections: vec![
            section(".text", CODE, 0, 0, &[0x0C, 0x94, 0x34, 0x00]),
            section(".data", 0, 0x80_0100, 4, &[0xAB, 0xCD]),
            bss,
            section(".eeprom", 0, 0x81_0000, 0x81_0000, &[1, 2, 3]),
            comment,
        ],
        symbols: vec![
            ("main", 2, 2, FUNC, 1),
            ("start", 0, 0, 0, 1),
            ("value", 0x80_0100, 2, OBJECT, 2),
            ("cells", 0x81_0000, 3, OBJECT, 4),
            ("SREG", 0x3F, 0, 0, ABS),
            ("missing", 0, 0, 0, 0),
            ("main.c", 0, 0, 4, 1),
            (".Lloop", 2, 0, 0, 1),
            ("$d", 2, 0, 0, 1),
            ("far", 0x90_0000, 1, OBJECT, 2),
        ],
        headers: true,
    }
}

impl Elf {
    /// Builds the file: header, program headers, bytes, symbols, names, section headers. Every part starts at
    /// a multiple of 4.
    pub fn build(&self) -> Vec<u8> {
        let loaded: Vec<bool> = self.sections.iter().map(|s| s.flags & ALLOC != 0).collect();
        let segments = loaded.iter().filter(|&&yes| yes).count();
        let mut file = vec![0; 52 + 32 * segments];
        let mut program_headers: Vec<u32> = Vec::new();
        let mut names = vec![0];
        let mut headers: Vec<[u32; 10]> = vec![[0; 10]];
        for (s, loaded) in self.sections.iter().zip(loaded) {
            pad(&mut file);
            let (offset, size) = (file.len() as u32, s.bytes.len() as u32);
            let filled = if s.kind == NOBITS { 0 } else { size };
            if filled > 0 {
                file.extend(&s.bytes);
            }
            if loaded {
                let flags = if s.flags & CODE == 0 { 6 } else { 5 };
                program_headers.extend([1, offset, s.addr, s.load, filled, size, flags, 1]);
            }
            headers.push([name(&mut names, s.name), s.kind, s.flags, s.addr, offset, size, 0, 0, 1, 0]);
        }
        let mut strings = vec![0];
        let mut symbols = vec![0; 16];
        for &(text, value, size, kind, section) in &self.symbols {
            symbols.extend(words(&[name(&mut strings, text), value, size]));
            symbols.extend([kind, 0]);
            symbols.extend(section.to_le_bytes());
        }
        let count = headers.len() as u32;
        for (text, kind, link, entry, bytes) in
            [(".symtab", 2, count + 1, 16, symbols), (".strtab", 3, 0, 0, strings), (".shstrtab", 3, 0, 0, Vec::new())]
        {
            pad(&mut file);
            let at = name(&mut names, text);
            let bytes = if text == ".shstrtab" { names.clone() } else { bytes };
            headers.push([at, kind, 0, 0, file.len() as u32, bytes.len() as u32, link, 0, 1, entry]);
            file.extend(bytes);
        }
        pad(&mut file);
        let (at, count) = if self.headers { (file.len() as u32, headers.len() as u16) } else { (0, 0) };
        if self.headers {
            headers.iter().for_each(|header| file.extend(words(header)));
        }
        let mut start = vec![0x7F, b'E', b'L', b'F', self.class, self.order, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0];
        let half = |v: u16| if self.order == 2 { v.to_be_bytes() } else { v.to_le_bytes() };
        start.extend(half(self.kind));
        start.extend(half(self.machine));
        start.extend(words(&[1, 0x0002, if segments == 0 { 0 } else { 52 }, at, 0]));
        [52, 32, segments as u16, 40, count, count.saturating_sub(1)]
            .iter()
            .for_each(|v| start.extend(v.to_le_bytes()));
        file[..52].copy_from_slice(&start);
        file[52..52 + 32 * segments].copy_from_slice(&words(&program_headers));
        file
    }
}

fn words(all: &[u32]) -> Vec<u8> {
    all.iter().flat_map(|word| word.to_le_bytes()).collect()
}

fn pad(file: &mut Vec<u8>) {
    file.resize(file.len().next_multiple_of(4), 0);
}

fn name(names: &mut Vec<u8>, text: &str) -> u32 {
    let at = names.len() as u32;
    names.extend(text.as_bytes());
    names.push(0);
    at
}

/// Builds the file of one case of `elf.txt`.
fn case(case: &str) -> Vec<u8> {
    let mut elf = program();
    match case {
        "text" => return b"hello".to_vec(),
        "no-bytes" => return Vec::new(),
        "elf64" => elf.class = 2,
        "big-endian" => elf.order = 2,
        "other-machine" => elf.machine = 62,
        "object" => elf.kind = 1,
        "shared" => elf.kind = 3,
        "host" => elf = Elf { class: 2, order: 2, kind: 3, machine: 62, ..elf },
        "short-header" => return elf.build()[..19].to_vec(),
        "half-header" => return elf.build()[..40].to_vec(),
        "cut-table" => {
            let file = elf.build();
            return file[..file.len() - 1].to_vec();
        }
        "cut-section" => return grown(&elf),
        "cut-segment" => {
            elf.headers = false;
            return grown(&elf);
        }
        "many-headers" => {
            let mut file = elf.build();
            file.resize(file.len() + 1025 * 32, 0);
            file[44..46].copy_from_slice(&1025u16.to_le_bytes());
            return file;
        }
        "huge-names" => {
            let long: &'static str = "n".repeat(100_000).leak();
            elf.symbols = vec![(long, 0, 0, 0, 1)];
            elf.symbols.extend(vec![("", 0, 0, 0, 1); 2000]);
            return same_name(elf.build());
        }
        "outside" => {
            elf.sections[0].addr = 0x8000;
            elf.sections[0].load = 0x8000;
            elf.sections[1].bytes.clear();
            elf.sections.push(section(".far", CODE, 0x91_0000, 0x91_0000, &[1]));
        }
        "overlap" => elf.sections.push(section(".boot", CODE, 2, 2, &[0x34, 0x00])),
        "no-code" => elf.sections = vec![section(".data", 0, 0x80_0100, 0, &[1, 2])],
        "nothing" => elf.sections.clear(),
        _ => panic!("elf.txt names the case {case}, which is not built here"),
    }
    elf.build()
}

/// The program with a first section that is larger than the file; without section headers, with such a first
/// segment.
fn grown(elf: &Elf) -> Vec<u8> {
    let mut file = elf.build();
    let at = if elf.headers { section_headers(&file) + 40 + 5 * 4 } else { 52 + 4 * 4 };
    file[at..at + 4].copy_from_slice(&0x10_0000u32.to_le_bytes());
    file
}

fn section_headers(file: &[u8]) -> usize {
    u32::from_le_bytes(file[32..36].try_into().unwrap()) as usize
}

/// Gives all symbols the name of the first one.
fn same_name(mut file: Vec<u8>) -> Vec<u8> {
    let headers = section_headers(&file);
    let count = usize::from(u16::from_le_bytes(file[48..50].try_into().unwrap()));
    let table = headers + (count - 3) * 40;
    let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
    let (start, size) = (word(table + 16), word(table + 20));
    for symbol in (start + 16..start + size).step_by(16) {
        file[symbol..symbol + 4].copy_from_slice(&1u32.to_le_bytes());
    }
    file
}

#[test]
fn faults_are_all_reported() {
    let rows = table("elf.txt", 3);
    let names: BTreeSet<&str> = rows.iter().map(|row| row[0].as_str()).collect();
    for name in names {
        let wanted: Vec<String> = rows.iter().filter(|row| row[0] == name).map(|row| row[1..].join(" | ")).collect();
        let found = load_elf("a.elf", &case(name), MEMORIES, AVR.0).expect_err(name);
        let found: Vec<String> = found.iter().map(|d| format!("{} | {}", d.code, d.cause)).collect();
        assert_eq!(found, wanted, "{name}");
    }
}

/// A section with an odd length and sections for other tools are accepted: what is left out is noted, and the
/// rest is loaded.
#[test]
fn sections_that_others_make_are_accepted() {
    let mut elf = program();
    elf.sections[1].bytes.pop();
    elf.sections.extend([
        section(".boot", CODE, 0x11, 0x11, &[0x95]),
        section(".user_signatures", 0, 0x85_0000, 0x85_0000, &[1, 2]),
        section(".for_a_tool", 0, 0x91_0000, 0x91_0000, &[1]),
        section(".mmcu", 0, 0x91_0010, 0x91_0010, &[1, 2]),
    ]);
    let loaded = load_elf("a.elf", &elf.build(), MEMORIES, AVR.0).unwrap();
    let seg = |space, addr, bytes: &[u8]| Segment { space, addr, bytes: bytes.to_vec() };
    let flash = [seg("flash", 0, &[0x0C, 0x94, 0x34, 0, 0xAB, 0xFF]), seg("flash", 0x10, &[0xFF, 0x95])];
    assert_eq!(loaded.image.segments[..2], flash);
    assert_eq!(loaded.image.end("eeprom"), 3);
    assert!(loaded.warnings.iter().all(|d| d.severity == Severity::Note));
    let reported: Vec<(&str, &str)> =
        loaded.warnings.iter().map(|d| (d.code, d.cause.split(" lies").next().unwrap_or_default())).collect();
    let wanted = [
        ("ELF015", ".user_signatures: 0x850000 to 0x850001 (2 bytes)"),
        ("ELF015", ".for_a_tool: 0x910000 to 0x910000 (1 bytes)"),
        ("ELF009", ".data defines half a word: flash byte 0x0004 without 0x0005, which stays erased (0xFF)"),
        ("ELF009", ".boot defines half a word: flash byte 0x0011 without 0x0010, which stays erased (0xFF)"),
    ];
    assert_eq!(reported, wanted);
}

/// Entries with the layout of simavr's avr_mcu_section.h, with zeros between them. A section that is cut off
/// keeps the entries before the cut.
#[test]
fn what_a_program_says_to_simavr() {
    let string = |tag: u8, text: &str| [vec![tag, 64], text.as_bytes().to_vec(), vec![0; 64 - text.len()]].concat();
    let trace = |tag: u8, mask: u8, what: u16| {
        [vec![tag, 35, mask], what.to_le_bytes().to_vec(), b"name".to_vec(), vec![0; 28]].concat()
    };
    let section_of = |bytes: &[u8]| {
        let mut elf = program();
        elf.sections.push(section(".mmcu", 0, 0x91_0000, 0x91_0000, bytes));
        elf.build()
    };
    let entries = [
        string(1, "ATmega88"),
        vec![2, 4, 0, 0x12, 0x7A, 0],
        vec![0, 0],
        vec![3, 4, 0x88, 0x13, 0, 0],
        string(12, "trace.vcd"),
        trace(14, 0, 0x25),
        trace(14, 0x20, 0xC0),
        trace(15, b'B', 5),
        trace(16, 9, 1),
        trace(17, 0, 0x0104),
        trace(18, 0, 0x0105),
        // In simavr 1.6 this is a pull-up at a port.
        vec![17, 4, 0xFF, 0x0F, b'B', 0],
        vec![11, 2, 0x3E, 0],
        vec![10, 2, 0x4A, 0],
    ];
    let wanted = SimavrSection {
        mcu: Some("atmega88".to_owned()),
        hz: Some(8_000_000),
        vcd: Some("trace.vcd".to_owned()),
        traces: vec![
            SimavrTrace::Register(0x25, 0),
            SimavrTrace::Register(0xC0, 0x20),
            SimavrTrace::Pin('B', 5),
            SimavrTrace::Interrupt,
            SimavrTrace::Ram(0x0104, 1),
            SimavrTrace::Ram(0x0105, 2),
        ],
        console: Some(0x3E),
        command: Some(0x4A),
        truncated_bytes: None,
    };
    assert_eq!(read_simavr_section(&section_of(&entries.concat())), Some(wanted));
    assert_eq!(read_simavr_section(&section_of(&[0, 0, 0])), Some(SimavrSection::default()));
    let cut =
        |tag: u8, hz: Option<u32>| Some(SimavrSection { truncated_bytes: Some(tag), hz, ..SimavrSection::default() });
    assert_eq!(read_simavr_section(&section_of(&[1, 64, b'a'])), cut(1, None));
    assert_eq!(read_simavr_section(&section_of(&[2, 4, 1, 0, 0, 0, 12])), cut(12, Some(1)));
    assert_eq!(read_simavr_section(&program().build()), None);
    assert_eq!(read_simavr_section(b"\x7fELF"), None);
}

#[test]
fn a_program_goes_to_its_load_addresses() {
    let seg = |space, addr, bytes: &[u8]| Segment { space, addr, bytes: bytes.to_vec() };
    let sym = |name: &str, space, addr, size| SymbolAt::new(name, space, addr, size);
    let segments = [seg("flash", 0, &[0x0C, 0x94, 0x34, 0x00, 0xAB, 0xCD]), seg("eeprom", 0, &[1, 2, 3])];
    let symbols = [
        sym("start", "flash", 0, 0),
        sym("main", "flash", 2, 2),
        sym("value", "data", 0x100, 2),
        sym("cells", "eeprom", 0, 3),
    ];
    let loaded = load("a.elf", &program().build(), &[], MEMORIES, AVR).unwrap();
    assert_eq!(loaded.image.segments, segments);
    assert_eq!(loaded.image.symbols, symbols);
    assert_eq!((loaded.image.entry, loaded.warnings.len()), (Some(2), 0));

    // Without section headers the program headers give the same bytes, and there are no symbols.
    let stripped = Elf { headers: false, ..program() };
    let loaded = load("a.elf", &stripped.build(), &[], MEMORIES, AVR).unwrap();
    assert_eq!((loaded.image.segments.as_slice(), loaded.image.symbols.len()), (&segments[..], 0));

    // If the address of a section differs from that of the program header around its bytes, its own address
    // is its load address.
    let mut file = program().build();
    let at = section_headers(&file) + 2 * 40 + 3 * 4;
    file[at..at + 4].copy_from_slice(&0x81_0200u32.to_le_bytes());
    let moved = load_elf("a.elf", &file, MEMORIES, 83).unwrap().image.segments;
    assert_eq!(moved.last(), Some(&seg("eeprom", 0x200, &[0xAB, 0xCD])));

    // A file inside a larger buffer can start at any address.
    for shift in 1..8 {
        let file = [vec![0; shift], program().build()].concat();
        assert_eq!(load_elf("a.elf", &file[shift..], MEMORIES, 83).unwrap().image.segments, segments);
    }
}

#[test]
fn the_list_of_faults_has_an_end() {
    let mut elf = program();
    let far = (0..105).map(|n| section(".far", 0, 0x70_0000 + n, 0x70_0000 + n, &[0]));
    elf.sections.extend(far);
    let found = load_elf("a.elf", &elf.build(), MEMORIES, 83).unwrap_err();
    assert_eq!(found.len(), 101);
    assert_eq!(found.last().map(|d| (d.code, d.cause.as_str())), Some(("ELF011", "1 more faults are not shown")));
}

/// Local symbols of two modules with the same name get the names of their modules. A global symbol keeps its
/// name, and other symbols have only their own. Of several names of one address the weak ones come first.
#[test]
fn names_of_modules() {
    const FILE: u8 = 4;
    const GLOBAL: u8 = 0x10;
    const WEAK: u8 = 0x20;
    let mut elf = program();
    elf.symbols = vec![
        ("src/main.c", 0, 0, FILE, 0xFFF1),
        ("init", 0, 2, FUNC, 1),
        ("count", 0x80_0100, 1, OBJECT, 2),
        ("alone", 0x80_0101, 1, OBJECT, 2),
        ("util.c", 0, 0, FILE, 0xFFF1),
        ("init", 2, 2, FUNC, 1),
        ("count", 0x80_0102, 1, OBJECT, 2),
        ("count", 0x81_0000, 1, OBJECT, 4),
        ("zero", 0, 2, GLOBAL | FUNC, 1),
        ("_weak", 0, 2, WEAK | FUNC, 1),
        ("zz_weak", 0, 2, WEAK | FUNC, 1),
        ("count", 0x80_0103, 1, GLOBAL | OBJECT, 2),
    ];
    let loaded = load("a.elf", &elf.build(), &[], MEMORIES, AVR).unwrap();
    let found: Vec<String> =
        loaded.image.symbols.iter().map(|s| format!("{}:{:x} {}", s.space, s.addr, s.name)).collect();
    let wanted = [
        "flash:0 _weak",
        "flash:0 zz_weak",
        "flash:0 main.init",
        "flash:0 zero",
        "flash:2 util.init",
        "data:100 main.count",
        "data:101 alone",
        "data:102 util.count",
        "data:103 count",
        "eeprom:0 count",
    ];
    assert_eq!(found, wanted);
}
