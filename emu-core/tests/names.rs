//! Names in files: no reader accepts a control character, or a name that turns a small file into gigabytes.

use emu_core::image::{
    ElfMachine, Image, ImageSpace, SourceLines, SymbolAt, SymbolFile, SymbolSpaces, Symbols, WordBits, load,
    load_messages, load_symbols,
};

/// The control characters ESC and BEL, which replace other characters of a name.
const ESC: u8 = 0x1B;
const BEL: u8 = 7;

/// Reads a test file and replaces a name by another one of the same length.
fn with_name(path: &str, from: &str, to: &[u8]) -> Vec<u8> {
    assert_eq!(from.len(), to.len());
    let mut bytes = std::fs::read(format!("{}/{path}", env!("CARGO_MANIFEST_DIR"))).unwrap();
    let places: Vec<usize> = (0..bytes.len()).filter(|at| bytes[*at..].starts_with(from.as_bytes())).collect();
    assert!(!places.is_empty(), "{path}: {from}");
    places.iter().for_each(|at| bytes[*at..*at + to.len()].copy_from_slice(to));
    bytes
}

/// All names of symbols and of files.
fn all(found: &Symbols) -> Vec<&str> {
    let names = found.symbols.iter().map(|symbol| &*symbol.name);
    names.chain(found.unplaced.iter().map(|(name, _)| &**name)).chain(found.lines.iter().map(|l| &*l.file)).collect()
}

fn all_of(image: &Image) -> Vec<&str> {
    let names = image.symbols.iter().flat_map(|symbol| [&*symbol.name, symbol.linkage_name()]);
    names.chain(image.lines.all_lines().iter().map(|line| &*line.file)).collect()
}

/// Asserts that no name has a control character, and that one contains the escaped text `wanted`.
fn assert_clean(file: &str, names: &[&str], wanted: &str) {
    for name in names {
        assert!(!name.contains(char::is_control), "{file}: {name:?}");
    }
    assert!(names.iter().any(|name| name.contains(wanted)), "{file}: no {wanted} in {names:?}");
}

#[test]
fn symbol_files_have_no_control_characters() {
    let table: &[(&str, SymbolSpaces, &str, &[u8], &str)] = &[
        ("tests/keil/bl51.m51", SymbolSpaces::MCS51, "ramp", &[b'r', ESC, b'm', BEL], r"pump.r\x1bm\x07"),
        ("tests/keil/bl51.m51", SymbolSpaces::MCS51, "Valve", &[b'V', ESC, b'l', b'v', b'e'], r"V\x1blve.c"),
        ("tests/keil/lx51.map", SymbolSpaces::MCS51, "speed", &[b's', ESC, b'e', b'e', BEL], r"s\x1bee\x07"),
        ("tests/symbols/small/main.map", SymbolSpaces::MCS51, "_main", &[b'_', ESC, b'a', b'i', BEL], r"\x1bai\x07"),
        ("tests/symbols/small/main.cdb", SymbolSpaces::MCS51, "main", &[b'm', ESC, b'i', BEL], r"m\x1bi\x07"),
        ("tests/symbols/small/main.rst", SymbolSpaces::MCS51, "main", &[b'm', ESC, b'i', BEL], r"m\x1bi\x07"),
        ("tests/gputils/main.cod", SymbolSpaces::PIC16, "start", &[b's', ESC, b'a', b'r', BEL], r"s\x1bar\x07"),
        ("tests/gputils/main.cod", SymbolSpaces::PIC16, "main.asm", b"ma\x1Bn.asm", r"ma\x1bn.asm"),
        ("tests/gputils/main.map", SymbolSpaces::PIC16, "count", &[b'c', ESC, b'u', b'n', BEL], r"c\x1bun\x07"),
    ];
    for (path, spaces, from, to, wanted) in table {
        let bytes = with_name(path, from, to);
        let found = load_symbols(&[SymbolFile { name: path, bytes: &bytes }], *spaces);
        let found = found.unwrap_or_else(|e| panic!("{path}: {e:?}"));
        assert_clean(path, &all(&found), wanted);
    }
}

#[test]
fn messages_of_a_cod_file_have_none() {
    let bytes = with_name("tests/gputils/main.cod", "PASSED", b"PA\x1BS\x07D");
    let messages = load_messages(&SymbolFile { name: "main.cod", bytes: &bytes }).unwrap();
    let texts: Vec<&str> = messages.iter().map(|message| &*message.text).collect();
    assert_clean("main.cod", &texts, r"PA\x1bS\x07D");
}

#[test]
fn elf_files_have_none() {
    let memories = [("flash", 0, 0x8000), ("data", 0x80_0000, 0x1000)].map(|(name, start, len)| ImageSpace {
        name,
        start,
        len,
        word: 1,
        word_bits: WordBits::All,
    });
    let bytes = with_name("../examples/avr/sort.elf", "\0main\0", b"\0m\x1Bi\x07\0");
    let loaded = load("sort.elf", &bytes, &[], &memories, ElfMachine::AVR).unwrap();
    assert_clean("sort.elf", &all_of(&loaded.image), r"m\x1bi\x07");
    let bytes = with_name("../tests/cli/in/lines.elf", "lines.c\0", b"l\x1Bnes.c\0");
    let lines = SourceLines::from_elf("lines.elf", bytes);
    assert_clean("lines.elf", &lines.all_lines().iter().map(|line| &*line.file).collect::<Vec<_>>(), r"l\x1bnes.c");
}

/// A line feed in a name is escaped.
#[test]
fn other_names_have_none() {
    assert_eq!(SymbolAt::new("a\nb", "flash", 0, 0).name, r"a\x0ab");
}

/// The name of a module is put before each of its names, and the name of a file is kept with each line.
#[test]
fn long_names_refuse_a_file() {
    let head = "BL51 BANKED LINKER/LOCATER V6.22\n\nSYMBOL TABLE OF MODULE:  x (X)\n\n  VALUE  TYPE  NAME\n  -----\n\n";
    let long = "M".repeat(60_000);
    let rows = |row: &str| (0..60_000).map(|n| row.replace('@', &n.to_string())).collect::<String>();
    let table = [
        format!("{head}  -------         MODULE        {long}\n{}", rows("  D:0028H         SYMBOL        v@\n")),
        format!("{head}  -------         MODULE        {long}\n{}", rows("  C:0028H         LINE#         1\n")),
        format!("{head}  -------  MODULE  X\n  -------  PROC  {long}\n{}", rows("  D:0028H  SYMBOL  v@\n")),
        format!("L:L{long}.f$a$1_0$0:10\n"),
        format!("L:A${long}$7:10\n"),
    ];
    for text in table {
        let file = SymbolFile { name: "a", bytes: text.as_bytes() };
        let refused = load_symbols(&[file], SymbolSpaces::MCS51).map(|found| found.symbols.len());
        match refused {
            Err(faults) => assert_eq!(faults.first().map(|fault| fault.code), Some("SYM018"), "{:?}", faults.first()),
            // No record describes this symbol, so it is not listed.
            Ok(symbols) => assert_eq!((symbols, &text[..3]), (0, "L:L")),
        }
    }
    // A name of the maximum length is accepted.
    let text = format!("{head}  -------  MODULE  X\n  C:0028H  PUBLIC  {}\n", "m".repeat(1024));
    let found = load_symbols(&[SymbolFile { name: "a", bytes: text.as_bytes() }], SymbolSpaces::MCS51).unwrap();
    assert_eq!(found.symbols.len(), 1);
}
