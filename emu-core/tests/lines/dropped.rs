//! Functions that the linker dropped, which DWARF 5 places at address 0, and functions that are really there.
//!
//! The units have the form that GNU ld leaves for an object with a section per function: for each function a
//! sequence of rows and a range with its real length, from 0 for functions without a section. clang and rustc
//! for AVR give the same form (rustc itself is not one of the peers).

use emu_core::image::{SourceKind, SourceLines};
use emu_test_support::{test_folder, tool_text};
use gimli::write::{
    Address, AttributeValue, DwarfUnit, EndianVec, LineProgram, LineString, Range, RangeList, Sections,
};
use gimli::{Encoding, Format, LineEncoding, LittleEndian};

use crate::elf::build_with;
use crate::line_of;

/// Flags of a section with code.
const CODE: u32 = 6;

/// A function of the unit: name, linker name, address, size, line.
type Function = (&'static str, Option<&'static str>, u64, u64, u64);

/// Makes a unit main.rs with some functions; `symbols` are the symbols of the file. With `entries` the
/// functions also have entries in the unit.
fn file(version: u16, functions: &[Function], symbols: &[(&str, u32)], entries: bool) -> SourceLines {
    // clang writes the real size of addresses.
    let encoding = Encoding { format: Format::Dwarf32, version, address_size: if version == 5 { 2 } else { 4 } };
    let mut dwarf = DwarfUnit::new(encoding);
    let text = |dwarf: &mut DwarfUnit, text: &str| LineString::new(text, encoding, &mut dwarf.line_strings);
    let [folder, main] = ["/src", "main.rs"].map(|name| text(&mut dwarf, name));
    let mut program = LineProgram::new(encoding, LineEncoding::default(), folder, None, main.clone(), None);
    let main = program.add_file(main, program.default_directory(), None);
    let mut ranges = Vec::new();
    for &(_, _, start, size, line) in functions {
        program.begin_sequence(Some(Address::Constant(start)));
        for (offset, line) in [(0, line), (size / 2, line + 1)] {
            let row = program.row();
            (row.address_offset, row.file, row.line) = (offset, main, line);
            program.generate_row();
        }
        program.end_sequence(size);
        // No range extends beyond the last address.
        let length = size.min((1 << (8 * encoding.address_size)) - 1 - start);
        ranges.extend((length > 0).then_some(Range::StartLength { begin: Address::Constant(start), length }));
    }
    dwarf.unit.line_program = program;
    let ranges = dwarf.unit.ranges.add(RangeList(ranges));
    let root = dwarf.unit.root();
    dwarf.unit.get_mut(root).set(gimli::DW_AT_ranges, AttributeValue::RangeListRef(ranges));
    dwarf.unit.get_mut(root).set(gimli::DW_AT_low_pc, AttributeValue::Address(Address::Constant(0)));
    for &(name, linked, start, size, _) in functions.iter().filter(|_| entries) {
        // The linker name is in the declaration, to which the definition refers.
        let declaration = dwarf.unit.add(root, gimli::DW_TAG_subprogram);
        let string = |text: &str| AttributeValue::String(text.as_bytes().to_vec());
        dwarf.unit.get_mut(declaration).set(gimli::DW_AT_name, string(name));
        if let Some(linked) = linked {
            dwarf.unit.get_mut(declaration).set(gimli::DW_AT_linkage_name, string(linked));
        }
        let definition = dwarf.unit.add(root, gimli::DW_TAG_subprogram);
        let entry = dwarf.unit.get_mut(definition);
        entry.set(gimli::DW_AT_specification, AttributeValue::UnitRef(declaration));
        entry.set(gimli::DW_AT_low_pc, AttributeValue::Address(Address::Constant(start)));
        entry.set(gimli::DW_AT_high_pc, AttributeValue::Udata(size));
    }
    let mut sections = Sections::new(EndianVec::new(LittleEndian));
    dwarf.write(&mut sections).expect("DWARF is written");
    let mut all = vec![(".text", CODE, vec![0; 0x100])];
    let each = sections.for_each(|id, data| {
        all.push((id.name(), 0, data.slice().to_vec()));
        Ok::<(), ()>(())
    });
    each.expect("nothing fails");
    let used: Vec<_> = all.iter().filter(|s| !s.2.is_empty()).map(|(n, f, b)| (*n, *f, b.as_slice())).collect();
    SourceLines::from_elf("a.elf", build_with(&used, symbols))
}

/// The lines at some addresses; asserts that there are no warnings.
fn at(lines: &SourceLines, addresses: &[u32]) -> String {
    let found: Vec<String> = addresses.iter().map(|addr| line_of(lines, *addr).replace("main.rs:", "")).collect();
    assert_eq!(lines.warnings(), []);
    found.join(" ")
}

const LIVE: Function = ("main", Some("_RNvC3app4main"), 0x68, 0x10, 10);
const DROPPED: [Function; 2] =
    [("unused", Some("_RNvC3app6unused"), 0, 0xDA, 50), ("small", Some("_RNvC3app5small"), 0, 0x20, 70)];

#[test]
fn dropped_functions_have_no_code() {
    let functions = [DROPPED[0], LIVE, DROPPED[1]];
    for version in [4, 5] {
        let lines = file(version, &functions, &[("__vectors", 0), ("_RNvC3app4main", 0x68)], true);
        assert_eq!(at(&lines, &[0, 0x10, 0x60, 0x68, 0x70, 0x78, 0xC0]), "- - - 10 11 - -", "DWARF {version}");
        assert_eq!(lines.addresses_of_line("main.rs", 50).unwrap_err().to_string(), "line 50 of main.rs has no code");
    }
}

#[test]
fn a_function_at_0_differs_from_dropped_ones() {
    // A program without a vector table: its own function starts at 0, where dropped functions seem to be too.
    let here: Function = ("start", None, 0, 0x20, 1);
    for functions in [[DROPPED[0], here, LIVE], [here, DROPPED[0], LIVE], [LIVE, DROPPED[0], here]] {
        let lines = file(5, &functions, &[("start", 0), ("_RNvC3app4main", 0x68)], true);
        assert_eq!(at(&lines, &[0, 0x0F, 0x10, 0x1F, 0x20, 0x68, 0x70]), "1 1 2 2 - 10 11");
    }
    // The name of a clone that the compiler made.
    let lines = file(5, &[here, DROPPED[0]], &[("start.constprop.0", 0)], true);
    assert_eq!(at(&lines, &[0, 0x10, 0x20]), "1 2 -");
}

#[test]
fn what_has_no_names_gives_way() {
    // Vectors in assembler have rows and no entries; the symbols of a file can have been stripped.
    for (symbols, entries) in [(&[("__vectors", 0)][..], false), (&[], true), (&[], false)] {
        let lines = file(5, &[("vectors", None, 0, 0x80, 1), LIVE], symbols, entries);
        assert_eq!(at(&lines, &[0, 0x3F, 0x40, 0x67, 0x68, 0x70, 0x78]), "1 1 2 2 10 11 -");
    }
}

#[test]
fn the_highest_addresses_mean_none() {
    for (version, highest) in [(4, 0xFFFF_FFFF), (5, 0xFFFF)] {
        for start in [highest, highest - 1] {
            let functions = [("unused", None, start, 0x40, 50), LIVE];
            let lines = file(version, &functions, &[("_RNvC3app4main", 0x68)], true);
            assert_eq!(at(&lines, &[0, 0x10, 0x3E, 0x68]), "- - - 10");
            assert!(lines.all_lines().iter().all(|line| line.line < 50 && line.kind == SourceKind::C));
        }
    }
}

/// Functions that are used, dropped, and dropped and inlined, with clang and gcc.
const SOURCE: &str = "
typedef unsigned char byte;
volatile byte a, b;
static void used(void) { a++; b += 3; }
void dropped(void)
{
    a = 1; b = 2; a = 3; b = 4; a = 5; b = 6; a = 7; b = 8;
    a = 1; b = 2; a = 3; b = 4; a = 5; b = 6; a = 7; b = 8;
    a = 1; b = 2; a = 3; b = 4; a = 5; b = 6; a = 7; b = 8;
    a = 1; b = 2; a = 3; b = 4; a = 5; b = 6; a = 7; b = 8;
}
int main(void)
{
    for (;;) {
        a = b;
        used();
    }
}
";

#[test]
#[ignore = "needs clang and avr-gcc"]
fn programs_of_compilers_have_the_lines_of_what_is_there() {
    let folder = test_folder!("lines-dropped");
    let run = |program: &str, args: &[&str]| tool_text(program, args, &folder);
    std::fs::write(folder.join("gc.c"), SOURCE).unwrap();
    let clang: &[&str] = &["--target=avr", "-mmcu=atmega328p"];
    let gcc: &[&str] = &["-mmcu=atmega328p"];
    let mut seen = 0;
    for (compiler, target) in [("clang", clang), ("avr-gcc", gcc)] {
        for version in ["-gdwarf-2", "-gdwarf-3", "-gdwarf-4", "-gdwarf-5"] {
            for start in [&["-Wl,--gc-sections"][..], &["-Wl,--gc-sections", "-nostdlib", "-Wl,-emain"]] {
                let flags = [target, &["-Os", version, "-ffunction-sections", "-c", "gc.c", "-o", "gc.o"]].concat();
                run(compiler, &flags);
                run("avr-gcc", &[gcc, start, &["gc.o", "-o", "gc.elf"]].concat());
                let symbols = run("avr-nm", &["gc.elf"]);
                let main = symbols.lines().find_map(|line| line.strip_suffix(" T main")).unwrap();
                let main = u32::from_str_radix(main, 16).unwrap();
                assert_eq!(main == 0, start.len() > 1, "a main at 0 is one that was linked there");
                assert!(!symbols.contains(" dropped"));
                let lines = SourceLines::from_elf("gc.elf", std::fs::read(folder.join("gc.elf")).unwrap());
                let what = format!("{compiler} {version} {start:?}: {:?}", lines.all_lines());
                let of = |byte| lines.line_at(byte, 0).map(|line| line.line);
                assert_eq!(of(main), Some(15), "{what}");
                assert!(lines.all_lines().iter().all(|line| !(5..=11).contains(&line.line)), "{what}");
                assert!((0..main).all(|byte| of(byte).is_none()), "{what}");
                assert!(lines.all_lines().iter().all(|line| line.addr >= main), "{what}");
                seen += lines.all_lines().len();
            }
        }
    }
    assert!(seen > 40, "{seen}");
}
