//! Every version of DWARF, written by `gimli`, gives the same lines; other formats are not read.

use emu_core::image::{LINE_CODES, SourceLines};
use gimli::write::{
    Address, AttributeValue, DwarfUnit, EndianVec, LineProgram, LineString, Range, RangeList, Sections,
};
use gimli::{Encoding, Format, LineEncoding, LittleEndian};

use crate::elf::build;
use crate::line_of;

/// A program compiled in /src, from main.c, a file in a folder below, a system header, and a file whose
/// absolute path is below /src. Its code is from 0x10 to 0x18 and from 0x40 to 0x44. The linker has dropped a
/// function of 6 bytes and left its lines at 0.
fn file(version: u16, format: Format) -> Vec<u8> {
    let encoding = Encoding { format, version, address_size: 4 };
    let mut dwarf = DwarfUnit::new(encoding);
    let text = |dwarf: &mut DwarfUnit, text: &str| LineString::new(text, encoding, &mut dwarf.line_strings);
    let names = ["/src", "main.c", "lib", "/usr/include", "/src/deep", "sub.c", "delay.h", "far.c"];
    let [folder, main, lib, system, deep, sub, delay, far] = names.map(|name| text(&mut dwarf, name));
    let mut program = LineProgram::new(encoding, LineEncoding::default(), folder.clone(), None, main.clone(), None);
    let here = program.default_directory();
    let main = program.add_file(main, here, None);
    let lib = program.add_directory(lib);
    let sub = program.add_file(sub, lib, None);
    let system = program.add_directory(system);
    let delay = program.add_file(delay, system, None);
    let deep = program.add_directory(deep);
    let far = program.add_file(far, deep, None);
    let sequences: [(u64, &[_], u64); 3] = [
        (0x10, &[(0, main, 3), (2, sub, 7), (2, main, 4), (4, delay, 100), (6, main, 0)], 8),
        (0x40, &[(0, far, 9)], 4),
        (0, &[(0, main, 90), (4, main, 91)], 6),
    ];
    for (start, rows, end) in sequences {
        program.begin_sequence(Some(Address::Constant(start)));
        for &(offset, file, line) in rows {
            let row = program.row();
            (row.address_offset, row.file, row.line) = (offset, file, line);
            program.generate_row();
        }
        program.end_sequence(end);
    }
    dwarf.unit.line_program = program;
    let ranges = [(0x10, 0x18), (0x40, 0x44)]
        .map(|(begin, end)| Range::StartEnd { begin: Address::Constant(begin), end: Address::Constant(end) });
    let ranges = dwarf.unit.ranges.add(RangeList(ranges.to_vec()));
    let root = dwarf.unit.root();
    let root = dwarf.unit.get_mut(root);
    root.set(gimli::DW_AT_ranges, AttributeValue::RangeListRef(ranges));
    root.set(gimli::DW_AT_comp_dir, AttributeValue::String(b"/src".to_vec()));
    root.set(gimli::DW_AT_low_pc, AttributeValue::Address(Address::Constant(0)));
    let mut sections = Sections::new(EndianVec::new(LittleEndian));
    dwarf.write(&mut sections).expect("DWARF is written");
    let mut all = Vec::new();
    let each = sections.for_each(|id, data| {
        all.push((id.name(), 0, data.slice().to_vec()));
        Ok::<(), ()>(())
    });
    each.expect("nothing fails");
    let used: Vec<_> = all.iter().filter(|s| !s.2.is_empty()).map(|(n, f, b)| (*n, *f, b.as_slice())).collect();
    build(&used)
}

const LINES: &str = "
0x00 -
0x04 -
0x0f -
0x10 main.c:3
0x11 main.c:3
0x12 main.c:4
0x14 /usr/include/delay.h:100
0x16 -
0x18 -
0x3f -
0x40 deep/far.c:9
0x43 deep/far.c:9
0x44 -
";

#[test]
fn every_version_is_read() {
    for (version, format) in [
        (2, Format::Dwarf32),
        (3, Format::Dwarf32),
        (4, Format::Dwarf32),
        (5, Format::Dwarf32),
        (4, Format::Dwarf64),
        (5, Format::Dwarf64),
    ] {
        let lines = SourceLines::from_elf("a.elf", file(version, format));
        for row in LINES.lines().filter(|row| !row.is_empty()) {
            let (addr, line) = row.split_once(' ').unwrap();
            let addr = u32::from_str_radix(&addr[2..], 16).unwrap();
            assert_eq!(line_of(&lines, addr), line, "DWARF {version}, 0x{addr:x}, {:?}", lines.all_lines());
        }
        assert_eq!(lines.warnings(), [], "DWARF {version}");
        assert_eq!(lines.folder("main.c"), Some("/src"));
        // The line of sub.c made no code: the next row starts at the same address.
        assert_eq!(
            lines.addresses_of_line("sub.c", 7).unwrap_err().to_string(),
            format!("the program has no source file `sub.c`; it has {ALL}")
        );
        assert_eq!(lines.addresses_of_line("far.c", 9), Ok(vec![0x40]));
        // Paths as editors and debuggers give them, and paths of a program that was compiled elsewhere.
        let paths =
            "main.c ./main.c /src/main.c /src/lib/../main.c //src/./main.c /home/me/main.c src/main.c".split(' ');
        for path in paths {
            assert_eq!(lines.addresses_of_line(path, 3), Ok(vec![0x10]), "{path}");
        }
        let paths =
            "far.c deep/far.c ./deep/far.c /src/deep/far.c /home/me/deep/far.c /home/me/lib/../deep/far.c".split(' ');
        for path in paths {
            assert_eq!(lines.addresses_of_line(path, 9), Ok(vec![0x40]), "{path}");
        }
        for path in ["/src/lib/far.c", "other/main.c", "/usr/main.h", "/", ".", "..", "./", "../far.c", "/far.c"] {
            let why = format!("the program has no source file `{path}`; it has {ALL}");
            assert_eq!(lines.addresses_of_line(path, 3).unwrap_err().to_string(), why);
        }
        assert_eq!(lines.addresses_of_line("main.c", 90).unwrap_err().to_string(), "line 90 of main.c has no code");
    }
}

const ALL: &str = "/usr/include/delay.h, deep/far.c, main.c";

#[test]
fn invalid_dwarf_is_reported() {
    let codes = |file: &[u8]| {
        let lines = SourceLines::from_elf("a.elf", file);
        assert_eq!(lines.all_lines(), []);
        lines.warnings().iter().map(|warning| warning.code).collect::<Vec<_>>()
    };
    const COMPRESSED: u32 = 1 << 11;
    assert_eq!(codes(&build(&[(".debug_line", COMPRESSED, &[1, 0, 0, 0])])), ["ELF013"]);
    assert_eq!(codes(&build(&[(".zdebug_line", 0, b"ZLIB")])), ["ELF013"]);
    // Stabs: the head of a unit, and what is cut off or outside.
    assert_eq!(codes(&build(&[(".stab", 0, &[0; 12]), (".stabstr", 0, &[0])])), [""; 0]);
    assert_eq!(codes(&build(&[(".stab", 0, &[0; 13]), (".stabstr", 0, &[0])])), ["ELF014"]);
    assert_eq!(codes(&build(&[(".stab", 0, &[9; 12]), (".stabstr", 0, &[0])])), ["ELF014"]);
    // As GCC 5.4 links it: a head of lines without rows, and no unit that names it.
    let stabs = [(".stab", 0, &[0; 11][..]), (".debug_info", 0, &[]), (".debug_line", 0, &[0; 4])];
    assert_eq!(codes(&build(&stabs)), ["ELF014"]);
    assert_eq!(codes(&build(&[(".stab", 0, &[]), (".text", 0, &[0; 4])])), [""; 0]);
    assert_eq!(codes(&build(&[(".text", 0, &[0; 4])])), [""; 0]);
    assert_eq!(codes(&build(&[(".debug_info", 0, &[0xFF; 40])])), ["ELF012"]);
    assert_eq!(codes(b"\x7fELF"), ["ELF012"]);
    assert_eq!(codes(b""), ["ELF012"]);
    assert_eq!(codes(b":00000001FF\n"), ["ELF012"]);
    let all: Vec<&str> = LINE_CODES.iter().map(|row| row.code).collect();
    assert_eq!(all, ["ELF012", "ELF013", "ELF014"]);
    let page = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/formats/elf.md")).unwrap();
    for row in LINE_CODES {
        assert!(page.contains(&format!("| {} |", row.code)) && row.explain.len() > 60, "{}", row.code);
    }
}
