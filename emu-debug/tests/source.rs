//! Program addresses as text, and back.

use emu_8051::chips;
use emu_avr::chips::ATMEGA328P;
use emu_core::chip::Chip;
use emu_core::image::{DemangledName, SourceKind, SourceLine, SourceLines, SymbolAt};
use emu_core::table::NamedOperand;
use emu_debug::{AddressNames, AddressRange, ProgramSource, StopCondition};

fn symbol(name: &str, space: &'static str, addr: u32, size: u32) -> SymbolAt {
    SymbolAt::new(name, space, addr, size)
}

fn line(addr: u32, kind: SourceKind, file: &str, line: u32, len: u32) -> SourceLine {
    SourceLine { addr, kind, file: file.into(), line, len }
}

fn avr() -> (Vec<SymbolAt>, SourceLines) {
    let symbols = vec![
        symbol("__vector_1", "flash", 0x40, 0),
        symbol("__bad", "flash", 0x40, 0),
        symbol("main", "flash", 0x80, 0x10),
        symbol("__bss_start", "data", 0x100, 0),
        symbol("buf", "data", 0x100, 4),
        symbol("flag", "data", 0x104, 0),
    ];
    let c = |addr, file, number, len| line(addr, SourceKind::C, file, number, len);
    let lines = vec![
        c(0x80, "src/main.c", 12, 4),
        c(0x84, "lib/util.h", 3, 2),
        c(0x86, "src/main.c", 12, 2),
        c(0x90, "lib/main.c", 12, 2),
        c(0x7FFFE, "src/main.c", 40, 2),
    ];
    (symbols, SourceLines::new(lines))
}

/// One per line: program word, description.
const PLACES: &str = "
0x1f   0x003e
0x20   0x0040 (__bad)
0x21   0x0042 (__bad+0x2)
0x40   0x0080 (main, src/main.c:12)
0x41   0x0082 (main+0x2, src/main.c:12)
0x42   0x0084 (main+0x4, lib/util.h:3)
0x43   0x0086 (main+0x6, src/main.c:12)
0x44   0x0088 (main+0x8)
0x48   0x0090 (main+0x10, lib/main.c:12)
";

#[test]
fn addresses_as_words() {
    let (symbols, lines) = avr();
    let source = ProgramSource { names: AddressNames { chip: &ATMEGA328P, symbols: &symbols }, lines: &lines };
    for row in PLACES.lines().filter(|row| !row.is_empty()) {
        let (word, wanted_text) = row.split_once("   ").unwrap();
        assert_eq!(source.describe_word(u32::from_str_radix(&word[2..], 16).unwrap()), wanted_text, "{word}");
    }
    let object = |addr| source.names.containing_symbol("data", addr);
    let objects = [0xFF, 0x100, 0x103, 0x104, 0x105].map(|addr| object(addr).unwrap_or_default());
    assert_eq!(objects, ["", "buf", "buf+0x3", "flag", ""]);
    let whole = |start, end| source.names.symbol_of_range(&AddressRange { space: "data", start, end });
    assert_eq!((whole(0x100, 0x104), whole(0x100, 0x103), whole(0x101, 0x104)), (Some("buf"), None, None));
}

#[test]
fn words_as_addresses() {
    let (symbols, lines) = avr();
    let source = ProgramSource { names: AddressNames { chip: &ATMEGA328P, symbols: &symbols }, lines: &lines };
    let words = |text| source.parse_words(text);
    assert_eq!(words("main"), Ok(vec![0x40]));
    assert_eq!(words("main+0x4"), Ok(vec![0x42]));
    assert_eq!(words("src/main.c:12"), Ok(vec![0x40, 0x43]));
    assert_eq!(words("util.h:3"), Ok(vec![0x42]));
    let refused = |text| source.parse_words(text).unwrap_err().to_string();
    assert_eq!(refused("main.c:12"), "`main.c` is one of several source files: lib/main.c, src/main.c");
    assert_eq!(refused("src/main.c:13"), "line 13 of src/main.c has no code; the next line that has is src/main.c:40");
    assert_eq!(refused("src/main.c:40"), "`src/main.c:40` is beyond flash");
    assert!(refused(":3").contains("no symbol `:3`"));
    assert!(refused("main:").contains("no symbol `main:`"));
    let until = |text| source.parse_condition(text);
    let at = |text: &str, words: &[u32]| Ok(StopCondition::Line(text.to_owned(), words.to_vec()));
    assert_eq!(until("pc = util.h:3"), at("util.h:3", &[0x42]));
    assert_eq!(until("pc=src/main.c:12"), at("src/main.c:12", &[0x40, 0x43]));
    assert_eq!(until("pc=0x80"), Ok(StopCondition::Pc(0x40)));
    assert_eq!(until("pc=src/main.c:12").unwrap().describe(&source.names), "pc=src/main.c:12");
    assert!(until("uart \"pc=a:1\"").is_ok());
}

/// If symbol files do not give the extent of a line, it ends with its function.
#[test]
fn lines_without_an_end() {
    let chip: &'static Chip = chips::chip("at89s52").expect("a chip");
    let symbols = [symbol("main", "code", 0x10, 0), symbol("library", "code", 0x20, 0), symbol("count", "idata", 8, 2)];
    let (c, asm) = (SourceKind::C, SourceKind::Asm);
    let lines = SourceLines::new(vec![
        line(0x12, asm, "main.asm", 7, 0),
        line(0x10, c, "main.c", 3, 0),
        line(0x10, c, "main.c", 2, 0),
        line(0x22, asm, "library.asm", 9, 0),
    ]);
    let source = ProgramSource { names: AddressNames { chip, symbols: &symbols }, lines: &lines };
    let wanted_text = [0x0F, 0x10, 0x1F, 0x20, 0x23].map(|word| source.line_text(word).unwrap_or_default());
    assert_eq!(wanted_text, ["", "main.c:3", "main.c:3", "", "library.asm:9"]);
    let meant = source.describe_operands(&[
        NamedOperand { kind: "target", value: 0x12 },
        NamedOperand { kind: "direct address", value: 9 },
        NamedOperand { kind: "direct address", value: 0x90 },
        NamedOperand { kind: "constant", value: 8 },
    ]);
    assert_eq!(meant, ["main+0x2", "count+0x1"]);
}

/// A symbol mangled by a compiler of C++ or Rust: full name, linker name, and the name without parameters.
fn mangled(name: &str, linkage: &str, path: &str, space: &'static str, addr: u32) -> SymbolAt {
    let mangled = DemangledName { linkage: linkage.to_owned(), path: path.to_owned() };
    SymbolAt { mangled: Some(Box::new(mangled)), ..SymbolAt::new(name, space, addr, 4) }
}

fn cpp() -> Vec<SymbolAt> {
    vec![
        mangled("app::area(int)", "_ZN3app4areaEi", "app::area", "flash", 0x80),
        mangled("app::area(int, int)", "_ZN3app4areaEii", "app::area", "flash", 0x84),
        mangled("Sq::Sq(int)", "_ZN2SqC1Ei", "Sq::Sq", "flash", 0x88),
        mangled("Sq::Sq(int)", "_ZN2SqC2Ei", "Sq::Sq", "flash", 0x88),
        mangled("app::twice<int>(int)", "_ZN3app5twiceIiEET_S1_", "app::twice<int>", "flash", 0x8C),
        mangled("log(char const*, ...)", "_Z3logPKcz", "log", "flash", 0x90),
        mangled("other::twice", "_RNvC5other5twice", "other::twice", "flash", 0x94),
        mangled("app::PORTB(int)", "_ZN3app5PORTBEi", "app::PORTB", "flash", 0x98),
        mangled("A::operator+(A)", "_ZN1AplES_", "A::operator+", "flash", 0x9C),
        symbol("area_of", "flash", 0xA0, 4),
        mangled("app::result", "_ZN3app6resultE", "app::result", "data", 0x100),
        mangled("app::PORTB", "_ZN3app5PORTBE", "app::PORTB", "data", 0x104),
    ]
}

/// A text, and its address or its error.
const WRITTEN: &str = "
app::area(int)                 0x80
app::area(int, int)            0x84
app::area(int,int)             0x84
_ZN3app4areaEii                0x84
app::area                      `app::area` is part of several names, write one whole: app::area(int) (0x80), app::area(int, int) (0x84)
area                           `area` is part of several names, write one whole: app::area(int) (0x80), app::area(int, int) (0x84)
area(int)                      0x80
area(int,int)                  0x84
area(byte)                     the image has no symbol `area(byte)` in flash
Sq::Sq                         0x88
Sq                             0x88
Sq+2                           0x8a
app::twice<int>                0x8c
app::twice                     0x8c
twice                          `twice` is part of several names, write one whole: app::twice<int>(int) (0x8c), other::twice (0x94)
log                            0x90
log(char const*, ...)          0x90
operator+                      0x9c
A::operator+(A)                0x9c
area_of                        0xa0
_of                            the image has no symbol `_of` in flash
rea                            the image has no symbol `rea` in flash
::area                         the image has no symbol `::area` in flash
";

#[test]
fn names_of_cpp_and_rust_may_be_shortened() {
    let symbols = cpp();
    let names = AddressNames { chip: &ATMEGA328P, symbols: &symbols };
    for row in WRITTEN.lines().filter(|row| !row.is_empty()) {
        let (text, wanted) = row.split_at(31);
        let found = names
            .parse_program_word(text.trim())
            .map_or_else(|why| why.to_string(), |word| format!("0x{:x}", word * 2));
        assert_eq!(found, wanted, "{text}");
    }
    let range = |text: &str| names.parse_range(text).map(|range| (range.space, range.start, range.end));
    for text in ["app::result", "result", "data:app::result", "data:result", "_ZN3app6resultE"] {
        assert_eq!(range(text), Ok(("data", 0x100, 0x104)), "{text}");
    }
    assert_eq!(range("result+1"), Ok(("data", 0x101, 0x102)));
    assert_eq!(range("app::result..app::result+2"), Ok(("data", 0x100, 0x102)));
    assert_eq!(range("flash:log(char const*, ...)"), Ok(("flash", 0x90, 0x94)));
    // Chip registers are found by their own names.
    assert_eq!(range("PORTB").map(|found| found.1), Ok(0x25));
    // A full name overrides a part of another one.
    assert_eq!(range("app::PORTB"), Ok(("data", 0x104, 0x108)));
    // Breakpoints and conditions resolve names in the same way, and addresses are described as in gdb.
    let lines = SourceLines::default();
    let source = ProgramSource { names, lines: &lines };
    assert_eq!(source.parse_condition("pc=app::area(int, int)"), Ok(StopCondition::Pc(0x42)));
    assert_eq!(source.parse_words("app::twice"), Ok(vec![0x46]));
    assert_eq!(source.describe_word(0x43), "0x0086 (app::area(int, int)+0x2)");
}
