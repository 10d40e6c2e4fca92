//! The HEX files in this folder, compared with the tables `refused.txt` and `accepted.txt`.

use std::collections::BTreeSet;
use std::fmt::Write;

use diag::{Diagnostic, Severity};
use emu_core::image::{
    HexSegment, IMAGE_CODES, ImageSpace, LoadedImage, MAX_REPORTED, WordBits, load, load_hex, write_hex,
    write_hex_aligned,
};

use crate::{AVR, DIR, table};

const MEMORIES: &[ImageSpace] = &[
    ImageSpace { name: "flash", start: 0, len: 0x2_0000, word: 2, word_bits: WordBits::All },
    ImageSpace { name: "user", start: 0x30_0000, len: 8, word: 1, word_bits: WordBits::All },
];

/// Memories of 14-bit words, and of byte cells that take two bytes in the file, as on PIC16.
const NARROW: &[ImageSpace] = &[
    ImageSpace { name: "flash", start: 0, len: 0x800, word: 2, word_bits: WordBits::Only(14) },
    ImageSpace { name: "eeprom", start: 0x4200, len: 0x80, word: 2, word_bits: WordBits::Low(8) },
];

/// The memories of an AVR chip row, in the address windows of an ELF file.
const ATMEGA328P: &[ImageSpace] = &[
    ImageSpace { name: "flash", start: 0, len: 0x8000, word: 2, word_bits: WordBits::All },
    ImageSpace { name: "data", start: 0x80_0000, len: 0x900, word: 1, word_bits: WordBits::All },
    ImageSpace { name: "eeprom", start: 0x81_0000, len: 0x400, word: 1, word_bits: WordBits::All },
    ImageSpace { name: "fuse", start: 0x82_0000, len: 3, word: 1, word_bits: WordBits::All },
    ImageSpace { name: "lock", start: 0x83_0000, len: 1, word: 1, word_bits: WordBits::All },
    ImageSpace { name: "signature", start: 0x84_0000, len: 3, word: 1, word_bits: WordBits::All },
];

/// Codes that are notes; all other codes are warnings if the file is accepted.
const NOTES: &[&str] = &["HEX014", "HEX018", "HEX026", "HEX028"];

fn file(name: &str) -> Vec<u8> {
    std::fs::read(format!("{DIR}/{name}.hex")).unwrap_or_else(|e| panic!("{name}.hex: {e}"))
}

fn load_file(name: &str) -> Result<LoadedImage, Vec<Diagnostic>> {
    let (memories, others) = match name {
        "hex018" | "hex024" | "hex025" => (NARROW, &[][..]),
        "hex026" | "avr-eeprom-too-large" => (&ATMEGA328P[..1], ATMEGA328P),
        _ => (MEMORIES, &[][..]),
    };
    load(&format!("{name}.hex"), &file(name), memories, others, AVR)
}

/// Formats each diagnostic as `line:column+width code cause`.
fn lines(all: &[Diagnostic], separator: &str) -> Vec<String> {
    let one = |d: &Diagnostic| {
        let place = format!("{}:{}+{}", d.pos.line, d.pos.column, d.pos.width);
        [place.as_str(), d.code, d.cause.as_str()].join(separator)
    };
    all.iter().map(one).collect()
}

fn image(loaded: &LoadedImage) -> String {
    let mut text = String::new();
    for segment in &loaded.image.segments {
        write!(text, "{} {:04X} ", segment.space, segment.addr).unwrap();
        segment.bytes.iter().for_each(|byte| write!(text, "{byte:02X}").unwrap());
        text.push_str(", ");
    }
    let entry = loaded.image.entry.map_or("-".to_owned(), |entry| format!("{entry:04X}"));
    text + "entry " + &entry
}

#[test]
fn faults_are_all_reported() {
    let rows = table("refused.txt", 4);
    let names: BTreeSet<&str> = rows.iter().map(|row| row[0].as_str()).collect();
    for name in names {
        let wanted: Vec<String> = rows.iter().filter(|row| row[0] == name).map(|row| row[1..].join(" | ")).collect();
        let found = load_file(name).expect_err(name);
        assert_eq!(lines(&found, " | "), wanted, "{name}.hex");
        for d in &found {
            let severity = if d.cause.ends_with("ignored") || d.cause.ends_with("(0xFF)") {
                Severity::Note
            } else {
                Severity::Error
            };
            assert_eq!((d.severity, d.file.as_str()), (severity, format!("{name}.hex").as_str()));
            assert!(!d.hint.is_empty(), "{name}.hex: {d} has no hint");
        }
    }
}

#[test]
fn variants_are_accepted() {
    for row in table("accepted.txt", 3) {
        let loaded = load_file(&row[0]).unwrap_or_else(|e| panic!("{}: {:?}", row[0], lines(&e, " ")));
        assert_eq!(image(&loaded), row[1], "{}.hex", row[0]);
        assert_eq!(lines(&loaded.warnings, " ").join("; "), row[2], "{}.hex", row[0]);
        let severity = |code| if NOTES.contains(&code) { Severity::Note } else { Severity::Warning };
        assert!(loaded.warnings.iter().all(|d| d.severity == severity(d.code)), "{}.hex", row[0]);
    }
}

#[test]
fn the_list_of_faults_has_an_end() {
    let found = load_file("hex020").expect_err("hex020");
    assert_eq!(found.len(), MAX_REPORTED + 1);
    assert!(found[..MAX_REPORTED].iter().zip(1..).all(|(d, line)| d.code == "HEX001" && d.pos.line == line));
    let last = &found[MAX_REPORTED];
    assert_eq!((last.code, last.cause.as_str()), ("HEX020", "3 more faults are not shown"));

    let garbage = [b"ZZZZ\n:GG\n".repeat(200_000), vec![b'Q'; 1_000_000]].concat();
    let found = load_hex("garbage", &garbage, MEMORIES).expect_err("garbage");
    // The first line of each pair has one fault (HEX001) and the second has two (HEX002, HEX004). The first
    // line of pair 334 has the thousandth fault, and nothing after it is read.
    assert_eq!(found.len(), MAX_REPORTED + 1);
    assert_eq!(found[MAX_REPORTED].cause, "900 more faults are not shown, and the rest is not read");
}

/// Every row of `IMAGE_CODES` has a test file of its own, a text for `emu explain` and an entry in the docs.
#[test]
fn every_code_has_a_case() {
    let mut tried: BTreeSet<String> = table("refused.txt", 4).into_iter().map(|row| row[2].clone()).collect();
    tried.extend(table("elf.txt", 3).into_iter().map(|row| row[1].clone()));
    for row in table("accepted.txt", 3) {
        let codes = row[2].split("; ").filter_map(|warning| warning.split(' ').nth(1));
        tried.extend(codes.filter(|word| word.starts_with("HEX")).map(str::to_owned));
    }
    tried.extend(["HEX020", "ELF009", "ELF011", "ELF015"].map(str::to_owned));
    let known: BTreeSet<String> = IMAGE_CODES.iter().map(|code| code.code.to_owned()).collect();
    assert_eq!(tried, known);
    assert_eq!(known.len(), IMAGE_CODES.len(), "a code occurs twice");
    let docs = page("hex.md") + &page("elf.md");
    for code in IMAGE_CODES {
        assert!(!code.title.is_empty() && code.explain.len() > 60, "{}", code.code);
        assert!(docs.contains(code.code), "docs/formats say nothing of {}", code.code);
        if code.code.starts_with("HEX") {
            file(&code.code.to_lowercase());
        }
    }
}

#[test]
fn an_image_answers() {
    let loaded = load_file("ok-two-memories").unwrap();
    let image = loaded.image;
    assert_eq!((image.end("flash"), image.end("user"), image.end("eeprom")), (0x2_0000, 8, 0));
    assert_eq!(image.bytes_in("user").map(|one| (one.addr, one.byte)).collect::<Vec<_>>(), [(6, 0xAB), (7, 0x55)]);
    let mut user = [0xFF; 7];
    image.fill("user", &mut user);
    assert_eq!(user, [0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xAB]);
}

#[test]
fn written_text() {
    let bytes: Vec<u8> = (0..20).collect();
    let text = write_hex(&[
        HexSegment { addr: 0xFFFE, bytes: &[1, 2, 3] },
        HexSegment { addr: 0x10, bytes: &bytes },
        HexSegment { addr: 0x2_0000, bytes: &[] },
        HexSegment { addr: 0x1000_0000, bytes: &[0xFF] },
    ]);
    let wanted = "\
:10001000000102030405060708090A0B0C0D0E0F68
:040020001011121396
:02FFFE000102FE
:020000040001F9
:0100000003FC
:020000041000EA
:01000000FF00
:00000001FF
";
    assert_eq!(text, wanted);
}

#[test]
fn aligned_text() {
    let bytes: Vec<u8> = (0..14).collect();
    let segments = &[HexSegment { addr: 0x400E, bytes: &[0xF1, 0x3F] }, HexSegment { addr: 6, bytes: &bytes }];
    let wanted = "\
:0A00060000010203040506070809C3
:040010000A0B0C0DBE
:02400E00F13F80
:00000001FF
";
    assert_eq!(write_hex_aligned(segments, false), wanted);
    assert_eq!(write_hex_aligned(segments, true), format!(":020000040000FA\n{wanted}"));
}

/// A record can start before a memory, cross a gap and end after a memory; only bytes outside of all memories
/// are faults.
#[test]
fn a_record_across_memories() {
    let memory = |name, start, len| ImageSpace { name, start, len, word: 1, word_bits: WordBits::All };
    let memories = [memory("late", 0x16, 2), memory("early", 0x10, 4), memory("none", 0x12, 0)];
    let found = load_hex("a.hex", b":10000E00000102030405060708090A0B0C0D0E0F6A\n:00000001FF", &memories).unwrap_err();
    let known = "outside the memories of the chip: late 0x0016 to 0x0017, 2 bytes; early 0x0010 to 0x0013, 4 bytes";
    let wanted =
        [("1:10+4", "0x000E to 0x000F (2)"), ("1:22+4", "0x0014 to 0x0015 (2)"), ("1:30+12", "0x0018 to 0x001D (6)")];
    let wanted = wanted.map(|(place, bytes)| format!("{place} HEX016 bytes {bytes} lie {known}"));
    assert_eq!(lines(&found, " "), wanted);
}

/// The examples in `docs/formats/hex.md` have the faults that they illustrate.
#[test]
fn examples_in_the_docs() {
    const FLASH: &[ImageSpace] =
        &[ImageSpace { name: "flash", start: 0, len: 0x8000, word: 2, word_bits: WordBits::All }];
    let mut tried = 0;
    for row in page("hex.md").lines().filter(|line| line.starts_with("| HEX")) {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let (code, example) = (cells[1], cells[3]);
        let Some(example) = example.strip_prefix('`').and_then(|text| text.strip_suffix('`')) else { continue };
        let found = load_hex(code, example.replace(" ⏎ ", "\n").as_bytes(), FLASH);
        let found = found.map_or_else(|errors| errors, |loaded| loaded.warnings);
        assert!(found.iter().any(|d| d.code == code), "{row}: {:?}", lines(&found, " "));
        assert!(found.iter().filter(|d| d.is_error()).count() <= 1, "{row}: {:?}", lines(&found, " "));
        tried += 1;
    }
    assert_eq!(tried, 20);
}

fn page(name: &str) -> String {
    std::fs::read_to_string(format!("{}/../docs/formats/{name}", env!("CARGO_MANIFEST_DIR"))).unwrap()
}

#[test]
fn what_follows_the_end_of_a_text_of_cpm_is_left_out() {
    let spaces = [ImageSpace { name: "code", start: 0, len: 0x1000, word: 1, word_bits: WordBits::All }];
    let load = |behind: &str| {
        let text = format!(":0100000022DD\n:00000001FF\n{behind}");
        let loaded = load_hex("a.hex", text.as_bytes(), &spaces).expect("taken");
        loaded.warnings.iter().map(|d| format!("{} {} {}", d.pos.line, d.code, d.cause)).collect::<Vec<_>>().join("; ")
    };
    let note = "3 HEX009 9 bytes after the ^Z (0x1A) that ends the text are ignored";
    assert_eq!(load("\u{1A}:01000000"), note);
    assert_eq!(load("\u{1A}\u{1A}\0\r\n\0"), "");
    // A record that the ^Z cuts off is still a fault.
    assert!(load_hex("a.hex", b":0100000022DD\n:0000\x1A0001FF\n", &spaces).is_err());
}
