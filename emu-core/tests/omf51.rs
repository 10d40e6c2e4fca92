//! Absolute object files for MCS-51: from a writer made from Intel's specification alone, and from other
//! tools.

#[path = "omf51/peers.rs"]
mod peers;
#[path = "omf51/write.rs"]
mod write;

use emu_core::image::{ElfMachine, Image, ImageSpace, LoadedImage, OMF_CODES, SourceKind, WordBits, load};
use emu_core::rng::Rng;
use write::{Item, Module, record};

const CODE: &[ImageSpace] = &[ImageSpace { name: "code", start: 0, len: 0x2000, word: 1, word_bits: WordBits::All }];

fn read(bytes: &[u8]) -> Result<LoadedImage, String> {
    load("app", bytes, CODE, &[], ElfMachine::MCS51).map_err(|faults| {
        let texts: Vec<String> = faults.iter().map(|d| format!("{} {}", d.code, d.cause)).collect();
        texts.join("\n")
    })
}

fn good(bytes: &[u8]) -> Image {
    let loaded = read(bytes).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(loaded.warnings, []);
    loaded.image
}

/// The address of a name, such as `code:0040`, or `-` if it has none or several.
fn place(image: &Image, name: &str) -> String {
    let found: Vec<_> = image.symbols.iter().filter(|s| s.name == name).collect();
    match found.as_slice() {
        [one] => format!("{}:{:04x}", one.space, one.addr),
        _ => "-".to_owned(),
    }
}

/// A program of two modules, with its records in the order of Intel's RL51.
fn program() -> Module {
    let mut module = Module::new("PUMP");
    module.scope(0, "PUMP");
    module.items(
        1,
        &[Item::new(0x00, 0x40, "_setSpeed"), Item::new(0x42, 0x08, "speed"), Item::new(0x41, 0x1234, "log")],
    );
    module.items(1, &[Item::new(0x43, 0x81, "deep"), Item::new(0x44, 0x93, "LAMP"), Item::new(0x05, 0x64, "LIMIT")]);
    module.items(0, &[Item::new(0x00, 0x50, "ramp"), Item::new(0x42, 0x0A, "count")]);
    module.items(2, &[Item::new(0x00, 0x40, "?PR?PUMP")]);
    module.scope(2, "_SETSPEED");
    module.items(0, &[Item::new(0x42, 0x0B, "old"), Item::new(0x42, 0x07, "wanted")]);
    module.content(0x40, &[0x8F, 0x08, 0xE5, 0x08]);
    module.scope(1, "");
    module.items(0, &[Item::new(0x42, 0x21, "step")]);
    module.scope(4, "");
    module.lines(&[(0x40, 12), (0x42, 13)]);
    module.scope(5, "_SETSPEED");
    module.scope(3, "PUMP");
    module.scope(0, "TICK");
    module.items(0, &[Item::new(0x00, 0x80, "AGAIN"), Item::new(0x42, 0x0C, "count")]);
    module.content(0x80, &[0x80, 0xFE]);
    module.content(0, &[0x02, 0x00, 0x40]);
    module.lines(&[(0x80, 8)]);
    module.scope(3, "TICK");
    module
}

#[test]
fn a_program_is_loaded_with_its_names_and_lines() {
    let image = good(&program().finish());
    let bytes: Vec<(u32, u8)> = image.bytes_in("code").map(|one| (one.addr, one.byte)).collect();
    let wanted =
        [(0, 2), (1, 0), (2, 0x40), (0x40, 0x8F), (0x41, 8), (0x42, 0xE5), (0x43, 8), (0x80, 0x80), (0x81, 0xFE)];
    assert_eq!(bytes, wanted);
    let table = [
        ("_setSpeed", "code:0040"),
        ("setSpeed", "code:0040"),
        ("speed", "idata:0008"),
        ("log", "xdata:1234"),
        ("deep", "idata:0081"),
        ("LAMP", "bit:0093"),
        ("LIMIT", "constant:0064"),
        ("PUMP.ramp", "code:0050"),
        ("PUMP.count", "idata:000a"),
        ("TICK.count", "idata:000c"),
        ("count", "-"),
        ("setSpeed.old", "idata:000b"),
        ("PUMP.setSpeed.step$1", "idata:0021"),
        ("wanted", "-"),
        ("?PR?PUMP", "-"),
        ("AGAIN", "code:0080"),
    ];
    for (name, wanted) in table {
        assert_eq!(place(&image, name), wanted, "{name}");
    }
    let lines: Vec<_> = image.lines.all_lines().iter().map(|l| (l.addr, &*l.file, l.line, l.kind)).collect();
    let c = SourceKind::C;
    assert_eq!(lines, [(0x40, "PUMP.c", 12, c), (0x42, "PUMP.c", 13, c), (0x80, "TICK.a51", 8, SourceKind::Asm)]);
}

/// Fewer than 128 filler bytes after the module end record are ignored; other bytes are a fault.
#[test]
fn the_rest_of_the_last_sector_is_passed_over() {
    let whole = &record(0x02, &[1, b'A', 0, 0])[..];
    let text = [whole, &record(0x06, &[0, 0, 0, 0x22]), &record(0x04, &[1, b'A', 0, 0, 1, 0])].concat();
    for behind in [&[0x1A][..], &[0x1A, 0, 0], &[0; 127]] {
        assert!(read(&[&text[..], behind].concat()).is_ok(), "{behind:?}");
    }
    for behind in [&[0; 128][..], &[0x1A, 5]] {
        let refused = read(&[&text[..], behind].concat()).unwrap_err();
        assert!(refused.contains("follow the module end record"), "{refused}");
    }
}

/// Keil's additions: the source file of a module, and debug items under a type of their own, with additional
/// bytes before names.
#[test]
fn records_of_keil_are_read() {
    for more in [0, 1, 2] {
        let mut module = Module::new("PUMP");
        module.scope(0, "PUMP");
        module.push(0x24, &[&[0, 0, 1, 0][..], b"..\\src\\Pump.C\0"].concat());
        module.keil(1, more, &[Item::new(0x00, 0x40, "_setSpeed"), Item::new(0x42, 0x08, "speed")]);
        module.keil(0, more, &[Item::new(0x00, 0, "_ICE_DUMMY_")]);
        module.push(0x22, &[3, 0, 0x40, 0, 12, 0, 0, 0x42, 0, 13, 0]);
        module.push(0x62, b"types of which nobody knows");
        module.content(0x40, &[0x22]);
        module.scope(3, "PUMP");
        let image = good(&module.finish());
        assert_eq!((place(&image, "setSpeed"), place(&image, "speed")), ("code:0040".into(), "idata:0008".into()));
        assert_eq!(place(&image, "_ICE_DUMMY_"), "-");
        assert_eq!(image.lines.addresses_of_line("Pump.C", 13), Ok(vec![0x42]));
        assert_eq!(image.lines.all_lines().first().map(|line| line.kind), Some(SourceKind::C));
    }
    // Segment numbers can have two bytes.
    let mut module = Module::new("A");
    module.push(0x07, &[0, 0, 0x10, 0, 0x22]);
    module.push(0x13, &[1, 0, 0, 0, 0x10, 0, 0, 4, b'm', b'a', b'i', b'n']);
    let image = good(&module.finish());
    assert_eq!((place(&image, "main"), image.end("code")), ("code:0010".to_owned(), 0x11));
}

#[test]
fn what_is_no_program_is_refused() {
    let with = |change: &dyn Fn(&mut Module)| {
        let mut module = program();
        change(&mut module);
        read(&module.finish()).map(|_| "ok".to_owned()).unwrap_or_else(|e| e)
    };
    let whole = program().finish();
    let mut wrong = whole.clone();
    wrong[5] ^= 1;
    let last = whole.len();
    let text = |bytes: &[u8]| read(bytes).map(|_| "ok".to_owned()).unwrap_or_else(|e| e);
    // Offset of the record that is added.
    let at = program().written();
    let first = whole.windows(4).position(|w| w == [6, 8, 0, 0]).unwrap();
    let end = record(4, &[1, b'A', 0, 0, 1, 0]).len() + 3;
    let table = [
        (
            "OMF001",
            text(&whole[..last - 1]),
            format!("the record of type 0x04 at 0x{:X} extends beyond the end of the file", last - end),
        ),
        ("OMF001", text(&whole[..last - end]), "the file ends without a module end record (type 0x04)".to_owned()),
        ("OMF001", text(&[2, 5]), "the record of type 0x02 at 0x0 extends beyond the end of the file".to_owned()),
        ("OMF001", text(&[2, 0, 0]), "the record of type 0x02 at 0x0 extends beyond the end of the file".to_owned()),
        ("OMF002", text(&wrong), "record 0x02 at 0x0 has the checksum 0xB1, its bytes require 0xB2".to_owned()),
        (
            "OMF003",
            with(&|m| m.push(0x06, &[1, 0x90, 0, 0x22])),
            format!(
                "the module is relocatable: it has contents of a segment that has no address yet (record 0x06 at 0x{at:X})"
            ),
        ),
        (
            "OMF003",
            with(&|m| m.push(0x08, &[0, 0, 0, 0, 0, 0, 0])),
            format!("the module is relocatable: it has addresses that a linker fills in (record 0x08 at 0x{at:X})"),
        ),
        (
            "OMF003",
            with(&|m| m.push(0x18, &[2, 0, 0, 0, 1, b'x'])),
            format!("the module is relocatable: it has names of other modules (record 0x18 at 0x{at:X})"),
        ),
        (
            "OMF003",
            text(&record(0x2C, &[1, 0, 0, 0, 10, 0])),
            "the file is a library of object modules, not a program".to_owned(),
        ),
        (
            "OMF004",
            text(&record(0x70, &[1, 2, 3])),
            "the file is in the unsupported format of Keil's LX51 (OMF2)".to_owned(),
        ),
        (
            "OMF005",
            with(&|m| m.push(0x0A, &[])),
            format!("record 0x0A at 0x{at:X} cannot be read: its type is unknown"),
        ),
        (
            "OMF005",
            with(&|m| m.push(0x02, &[1, b'B', 0, 0])),
            format!("record 0x02 at 0x{at:X} cannot be read: a second module header"),
        ),
        (
            "OMF005",
            with(&|m| m.push(0x04, &[1, b'B', 0, 0, 0, 0])),
            format!(
                "record 0x04 at 0x{at:X} cannot be read: it names another module than the module header\nOMF008 13 bytes follow the module end record"
            ),
        ),
        (
            "OMF005",
            with(&|m| m.push(0x06, &[0, 1])),
            format!("record 0x06 at 0x{at:X} cannot be read: it is too short"),
        ),
        (
            "OMF006",
            with(&|m| m.content(0x1FFE, &[1, 2, 3, 4])),
            format!(
                "the contents at 0x{at:X} fill 0x2000 to 0x2001, outside the memories of the chip: code 0x0000 to 0x1FFF, 8192 bytes"
            ),
        ),
        (
            "OMF007",
            with(&|m| m.content(0x42, &[1])),
            format!("the contents at 0x{at:X} fill 0x0042 to 0x0042, which those at 0x{first:X} have filled"),
        ),
        (
            "OMF008",
            text(&[whole.clone(), whole.clone()].concat()),
            format!("{last} bytes follow the module end record"),
        ),
        ("OMF009", text(&Module::new("A").finish()), "no record has contents of program memory".to_owned()),
    ];
    for (code, found, wanted) in &table {
        assert_eq!(*found, format!("{code} {wanted}"));
    }
    // The code that counts further faults needs a hundred others; names never cause a rejection.
    let many = with(&|m| (0..120).for_each(|_| m.push(0x0A, &[])));
    assert!(many.ends_with("OMF010 20 more faults are not shown"), "{many}");
    let mut odd = program();
    odd.push(0x12, &[0, 0, 0x42, 0x08]);
    odd.items(1, &[Item::new(0x44, 0x1234, "bit_nowhere")]);
    let loaded = read(&odd.finish()).unwrap();
    let warnings: Vec<&str> = loaded.warnings.iter().map(|d| d.code).collect();
    assert_eq!((warnings.as_slice(), place(&loaded.image, "speed")), (&["OMF011"][..], "idata:0008".to_owned()));
    let docs = include_str!("../../docs/formats/omf51.md");
    for row in OMF_CODES {
        let tried = table.iter().any(|case| case.0 == row.code) || ["OMF010", "OMF011"].contains(&row.code);
        assert!(tried && docs.contains(row.code) && row.explain.len() > 60, "{}", row.code);
    }
}

/// Files of other families and texts are not object files.
#[test]
fn only_what_begins_so_is_an_object_file() {
    let whole = program().finish();
    let faults = load("app", &whole, CODE, &[], ElfMachine::AVR).unwrap_err();
    assert!(faults.iter().all(|fault| fault.code.starts_with("HEX")));
    for text in ["p", ",", ":00000001FF\n", "posts"] {
        let faults = load("app", text.as_bytes(), CODE, &[], ElfMachine::MCS51);
        let codes = faults.map_or_else(|all| all, |loaded| loaded.warnings);
        assert!(codes.iter().all(|fault| fault.code.starts_with("HEX")), "{text}");
    }
}

/// C1 characters take two bytes in a name; no name can bring a control character to a terminal.
#[test]
fn names_have_no_control_characters() {
    let mut module = Module::new("A");
    module.scope(0, "P\u{9b}P");
    module.items(1, &[Item::new(0, 0x40, "x\u{9b}31my\u{7f}"), Item::new(5, 7, "\u{85}N")]);
    module.items(0, &[Item::new(0, 0x50, "own")]);
    module.content(0, &[0]);
    module.scope(3, "P\u{9b}P");
    let image = good(&module.finish());
    let lines = image.lines.all_lines();
    let lines = lines.iter().map(|line| line.file.to_string());
    let symbols = image.symbols.iter().flat_map(|symbol| [symbol.name.clone(), symbol.linkage_name().to_owned()]);
    let names: Vec<String> = symbols.chain(lines).collect();
    assert!(names.iter().all(|name| !name.contains(|c: char| c.is_control())), "{names:?}");
    for wanted in [r"x\x9b31my\x7f", r"\x85N", r"P\x9bP.own"] {
        assert!(names.iter().any(|name| name == wanted), "{wanted}: {names:?}");
    }
}

/// Reading ends for any input: cut files, changed bits, and records with corrected check sums.
#[test]
fn damaged_files_are_read_to_an_end() {
    let whole = program().finish();
    for end in 0..whole.len() {
        assert!(read(&whole[..end]).is_err());
    }
    let mut rng = Rng::new(51);
    for _ in 0..20_000 {
        let mut bytes = whole.clone();
        for _ in 0..=rng.below(3) {
            let at = rng.below(bytes.len() as u64) as usize;
            bytes[at] = rng.below(256) as u8;
        }
        _ = read(&write::right(&bytes));
        _ = read(&bytes);
    }
}
