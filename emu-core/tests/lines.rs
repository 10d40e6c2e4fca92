//! Source lines of ELF files: of a program built by avr-gcc (`tests/cli/in/lines.c`), of files made in every
//! version of DWARF, and of damaged files.

#[path = "lines/avr_gcc.rs"]
mod avr_gcc;
#[path = "lines/damage.rs"]
mod damage;
#[path = "lines/dropped.rs"]
mod dropped;
#[path = "lines/elf.rs"]
mod elf;
#[path = "lines/stabs.rs"]
mod stabs;
#[path = "lines/versions.rs"]
mod versions;

use emu_core::image::{SourceKind, SourceLines};

const DIR: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/cli/in");

fn input(name: &str) -> Vec<u8> {
    std::fs::read(format!("{DIR}/{name}")).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// The line of the code at a byte address, such as `lines.c:12`, or `-` if none is known.
fn line_of(lines: &SourceLines, byte: u32) -> String {
    lines.line_at(byte, 0).map_or("-".to_owned(), |line| format!("{}:{}", line.file, line.line))
}

/// Lines of addresses according to avr-objdump -dl of binutils 2.26.
const LISTED: &str = "
0x00 lines.c:14
0x02 lines.c:14
0x04 lines.c:19
0x08 lines.c:19
0x0a lines.h:4
0x0c lines.h:4
0x0e lines.c:19
0x12 lines.c:19
0x14 lines.c:20
0x22 lines.c:20
0x24 twice.S:4
0x26 twice.S:5
0x28 lines.c:26
0x3e lines.c:26
0x40 lines.c:27
0x46 lines.c:27
0x48 lines.c:28
0x4e lines.c:28
0x4f lines.c:28
0x50 -
0x7ffe -
0xffffffff -
";

#[test]
fn every_address_has_its_line() {
    let lines = SourceLines::from_elf("lines.elf", input("lines.elf"));
    assert!(lines.warnings().is_empty(), "nothing is read yet");
    for row in LISTED.lines().filter(|row| !row.is_empty()) {
        let (addr, line) = row.split_once(' ').unwrap();
        assert_eq!(line_of(&lines, u32::from_str_radix(&addr[2..], 16).unwrap()), line, "{addr}");
    }
    assert_eq!(lines.warnings(), []);
    let kind = |byte| lines.line_at(byte, 0).map(|line| line.kind);
    assert_eq!((kind(0x12), kind(0x24)), (Some(SourceKind::C), Some(SourceKind::Asm)));
    // The length of each line is known, so the start of the function makes no difference.
    assert_eq!(lines.line_at(0x46, 0x46).map(|line| line.line), Some(27));
    assert_eq!((lines.folder("lines.c"), lines.folder("other.c")), (Some("/src"), None));
    assert_eq!(lines.all_lines().iter().filter(|line| line.len == 0).count(), 0);
}

#[test]
fn every_line_has_its_addresses() {
    let lines = SourceLines::from_elf("lines.elf", input("lines.elf"));
    let of = |file, line| lines.addresses_of_line(file, line);
    assert_eq!(of("lines.c", 20), Ok(vec![0x14]));
    assert_eq!(of("lines.c", 19), Ok(vec![0x04, 0x0e]), "with the line of the header in between");
    assert_eq!(of("lines.h", 4), Ok(vec![0x0a]));
    assert_eq!(of("twice.S", 5), Ok(vec![0x26]));
    let error = |file, line| of(file, line).unwrap_err().to_string();
    assert_eq!(error("lines.c", 21), "line 21 of lines.c has no code; the next line that has is lines.c:26");
    assert_eq!(error("lines.c", 29), "line 29 of lines.c has no code");
    assert_eq!(error("ines.c", 20), "the program has no source file `ines.c`; it has lines.c, lines.h, twice.S");
    let none = SourceLines::from_elf("nolines.elf", input("nolines.elf"));
    assert_eq!(none.addresses_of_line("lines.c", 20).unwrap_err().to_string(), "the program has no source lines");
    assert_eq!((line_of(&none, 4).as_str(), none.warnings()), ("-", &[][..]));
}

#[test]
fn whether_lines_were_read_makes_no_difference() {
    let (read, unread) =
        (SourceLines::from_elf("a", input("lines.elf")), SourceLines::from_elf("a", input("lines.elf")));
    assert_eq!(read.all_lines().len(), 10);
    assert_eq!(read, unread);
    assert_ne!(read, SourceLines::from_elf("a", input("nolines.elf")));
    assert_eq!(SourceLines::default(), SourceLines::new(Vec::new()));
}
