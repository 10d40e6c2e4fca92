//! Programs built by avr-gcc: the line of every instruction agrees with avr-addr2line.

use std::path::Path;

use emu_core::image::{ElfMachine, ImageSpace, SourceLines, load};
use emu_test_support::{test_folder, tool_text};

use crate::{DIR, line_of};

/// Several files, functions that the linker drops, inline functions of headers, AVR-LibC.
const SOURCE: &str = r#"
#include <avr/io.h>
#include <avr/interrupt.h>
#include <util/delay.h>
#include <stdio.h>
#include "scale.h"
volatile int counter[10];
int dropped(int x) { return x * 3; }
ISR(TIMER0_OVF_vect) { counter[0]++; }
static int put(char c, FILE *f)
{
    while (!(UCSR0A & _BV(UDRE0)))
        ;
    UDR0 = c;
    return 0;
}
static FILE out = FDEV_SETUP_STREAM(put, NULL, _FDEV_SETUP_WRITE);
int main(void)
{
    stdout = &out;
    for (int i = 0; i < 4; i++)
        counter[i] = scale(i);
    _delay_ms(2);
    printf("%d %d\n", counter[1], far(counter[2]));
    for (;;) {
    }
}
"#;
/// The lines of `dropped` and `unused`.
const DROPPED: &[&str] = &["/app.c:8", "/far.c:2"];
const SCALE: &str = "int far(int);
static inline int scale(int a)
{
    if (a & 1)
        return far(a);
    return a << 3;
}
";
const FAR: &str = "#include \"scale.h\"
int unused(int a) { return scale(a); }
int far(int a)
{
    while (a > 100)
        a -= 7;
    return a;
}
";

/// Addresses of all instructions in the listing of avr-objdump.
fn instructions(folder: &Path, elf: &str) -> Vec<String> {
    let listing = tool_text("avr-objdump", &["-d", elf], folder);
    let rows = listing.lines().filter_map(|line| line.strip_prefix(' '));
    let addresses = rows.filter_map(|row| row.split_once(":\t")).map(|(addr, _)| format!("0x{}", addr.trim()));
    addresses.collect()
}

/// Compares the line of every instruction with avr-addr2line; returns how many instructions have a line.
fn compare(folder: &Path, elf: &str, dropped: &[&str]) -> usize {
    let addresses = instructions(folder, elf);
    assert!(!addresses.is_empty());
    let mut args = vec!["-e", elf];
    args.extend(addresses.iter().map(String::as_str));
    let theirs = tool_text("avr-addr2line", &args, folder);
    let lines = SourceLines::from_elf(elf, std::fs::read(folder.join(elf)).unwrap());
    let mut known = 0;
    assert_eq!(theirs.lines().count(), addresses.len());
    for (addr, theirs) in addresses.iter().zip(theirs.lines()) {
        let byte = u32::from_str_radix(&addr[2..], 16).unwrap();
        let line = lines.line_at(byte, 0).map(|line| (line, lines.folder(&line.file).unwrap_or_default()));
        let ours = line.map_or("??:0".to_owned(), |(line, home)| match line.file.starts_with('/') {
            true => format!("{}:{}", line.file, line.line),
            false => format!("{home}/{}:{}", line.file, line.line),
        });
        // Binutils append the discriminator. If no line is known, they print the name of a file that is in
        // the symbol table.
        let theirs = theirs.split(" (").next().unwrap_or_default().replace("/./", "/");
        let theirs = if theirs.ends_with(":?") || theirs.ends_with(":0") { "??:0".to_owned() } else { theirs };
        // Lines of dropped functions have no code, but binutils 2.26 give them the code of other functions.
        if dropped.iter().any(|line| theirs.ends_with(line)) && !ours.ends_with(":0") {
            assert!(!dropped.iter().any(|line| ours.ends_with(line)), "{elf} {addr}: {ours}");
            continue;
        }
        assert_eq!(ours, theirs, "{elf} {addr}");
        known += usize::from(line.is_some());
    }
    assert_eq!(lines.warnings(), []);
    println!("{elf}: {} instructions, {known} of them with a line", addresses.len());
    known
}

#[test]
#[ignore = "needs avr-gcc"]
fn lines_are_those_of_addr2line() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("lines-avr-gcc");
    std::fs::create_dir_all(folder.join("sub")).unwrap();
    for (name, text) in [("app.c", SOURCE), ("scale.h", SCALE), ("sub/far.c", FAR)] {
        std::fs::write(folder.join(name), text).unwrap();
    }
    let mut known = 0;
    for (at, version) in ["-gdwarf-2", "-gdwarf-3", "-gdwarf-4", "-gdwarf-5"].into_iter().enumerate() {
        for (level, optimise) in ["-O0", "-O1", "-Os", "-O2"].into_iter().enumerate() {
            for sections in ["-ffunction-sections", "-fno-function-sections"] {
                let elf = format!("app{at}{level}{}.elf", sections.len());
                let flags = ["-mmcu=atmega328p", "-DF_CPU=16000000UL", "-w", "-I.", "-Wl,--gc-sections"];
                let all = [&flags[..], &[version, optimise, sections, "app.c", "sub/far.c", "-o", &elf]].concat();
                tool_text("avr-gcc", &all, &folder);
                let dropped = if sections == "-ffunction-sections" { DROPPED } else { &[] };
                known += compare(&folder, &elf, dropped);
            }
        }
    }
    assert!(known > 2_000, "{known}");
}

/// The file in `tests/cli/in` agrees with its sources for any compiler version: it has the same symbols, and
/// code for the same lines.
#[test]
#[ignore = "needs avr-gcc"]
fn the_program_of_the_tests_is_what_its_sources_say() {
    let folder = test_folder!("lines-fixture");
    for name in ["lines.c", "lines.h", "twice.S"] {
        std::fs::copy(format!("{DIR}/{name}"), folder.join(name)).unwrap();
    }
    let map = format!("-fdebug-prefix-map={}=/src", folder.display());
    let flags =
        ["-mmcu=atmega328p", "-Os", "-gdwarf-4", "-nostartfiles", "-nostdlib", "lines.c", "twice.S", "-o", "lines.elf"];
    tool_text("avr-gcc", &[&[map.as_str()][..], &flags].concat(), &folder);
    let flash =
        [ImageSpace { name: "flash", start: 0, len: 0x8000, word: 2, word_bits: emu_core::image::WordBits::All }];
    let read = |file: &str| {
        let bytes = std::fs::read(file).unwrap();
        let image = load(file, &bytes, &[], &flash, ElfMachine::AVR).unwrap().image;
        let mut names: Vec<String> =
            image.symbols.iter().map(|s| s.name.clone()).filter(|n| !n.starts_with('_')).collect();
        names.sort();
        let lines = SourceLines::from_elf(file, bytes);
        let starts = ["start", "put", "twice", "main"].map(|name| {
            let symbol = image.symbols.iter().find(|s| s.name == name).unwrap_or_else(|| panic!("{name}"));
            line_of(&lines, symbol.addr).rsplit_once(':').map(|(file, _)| file.to_owned())
        });
        let mut places: Vec<String> = lines.all_lines().iter().map(|l| format!("{}:{}", l.file, l.line)).collect();
        places.sort();
        places.dedup();
        (names, starts, places)
    };
    let (ours, built) = (read(&format!("{DIR}/lines.elf")), read(&folder.join("lines.elf").to_string_lossy()));
    assert_eq!((&ours.0, &ours.1), (&built.0, &built.1));
    // The compiler chooses which lines get code of their own; these lines do with any compiler.
    for line in ["lines.c:14", "lines.c:20", "lines.c:27", "twice.S:4", "twice.S:5"] {
        for (who, places) in [("ours", &ours.2), ("built", &built.2)] {
            assert!(places.iter().any(|place| place == line), "{who}: {line} {places:?}");
        }
    }
    compare(&folder, "lines.elf", &[]);
}
