//! Program addresses as words, and back.

use emu_8051::chips;
use emu_avr::chips::ATMEGA328P;
use emu_core::chip::Chip;
use emu_core::image::{LineAt, LineKind, Lines, SymbolAt};
use emu_debug::{Names, Range, Source, Until};

fn symbol(name: &str, space: &'static str, addr: u32, size: u32) -> SymbolAt {
    SymbolAt::new(name, space, addr, size)
}

fn line(addr: u32, kind: LineKind, file: &str, line: u32, len: u32) -> LineAt {
    LineAt { addr, kind, file: file.into(), line, len }
}

fn avr() -> (Vec<SymbolAt>, Lines) {
    let symbols = vec![
        symbol("__vector_1", "flash", 0x40, 0),
        symbol("__bad", "flash", 0x40, 0),
        symbol("main", "flash", 0x80, 0x10),
        symbol("__bss_start", "data", 0x100, 0),
        symbol("buf", "data", 0x100, 4),
        symbol("flag", "data", 0x104, 0),
    ];
    let c = |addr, file, number, len| line(addr, LineKind::C, file, number, len);
    let lines = vec![
        c(0x80, "src/main.c", 12, 4),
        c(0x84, "lib/util.h", 3, 2),
        c(0x86, "src/main.c", 12, 2),
        c(0x90, "lib/main.c", 12, 2),
        c(0x7FFFE, "src/main.c", 40, 2),
    ];
    (symbols, Lines::new(lines))
}

/// One a line: program word, what is told of it.
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
    let source = Source { names: Names { chip: &ATMEGA328P, symbols: &symbols }, lines: &lines };
    for row in PLACES.lines().filter(|row| !row.is_empty()) {
        let (word, told) = row.split_once("   ").unwrap();
        assert_eq!(source.place(u32::from_str_radix(&word[2..], 16).unwrap()), told, "{word}");
    }
    let object = |addr| source.names.object("data", addr);
    let objects = [0xFF, 0x100, 0x103, 0x104, 0x105].map(|addr| object(addr).unwrap_or_default());
    assert_eq!(objects, ["", "buf", "buf+0x3", "flag", ""]);
    let whole = |start, end| source.names.whole(&Range { space: "data", start, end });
    assert_eq!((whole(0x100, 0x104), whole(0x100, 0x103), whole(0x101, 0x104)), (Some("buf"), None, None));
}

#[test]
fn words_as_addresses() {
    let (symbols, lines) = avr();
    let source = Source { names: Names { chip: &ATMEGA328P, symbols: &symbols }, lines: &lines };
    let words = |text| source.words(text);
    assert_eq!(words("main"), Ok(vec![0x40]));
    assert_eq!(words("main+0x4"), Ok(vec![0x42]));
    assert_eq!(words("src/main.c:12"), Ok(vec![0x40, 0x43]));
    assert_eq!(words("util.h:3"), Ok(vec![0x42]));
    let refused = |text| source.words(text).unwrap_err();
    assert_eq!(refused("main.c:12"), "`main.c` is one of several source files: lib/main.c, src/main.c");
    assert_eq!(refused("src/main.c:13"), "line 13 of src/main.c has no code; the next line that has is src/main.c:40");
    assert_eq!(refused("src/main.c:40"), "`src/main.c:40` lies beyond flash");
    assert!(refused(":3").contains("no symbol `:3`"));
    assert!(refused("main:").contains("no symbol `main:`"));
    let until = |text| source.until(text);
    let at = |text: &str, words: &[u32]| Ok(Until::Line(text.to_owned(), words.to_vec()));
    assert_eq!(until("pc = util.h:3"), at("util.h:3", &[0x42]));
    assert_eq!(until("pc=src/main.c:12"), at("src/main.c:12", &[0x40, 0x43]));
    assert_eq!(until("pc=0x80"), Ok(Until::Pc(0x40)));
    assert_eq!(until("pc=src/main.c:12").unwrap().describe(&source.names), "pc=src/main.c:12");
    assert!(until("uart \"pc=a:1\"").is_ok());
}

/// Where files of symbols do not tell how far a line goes, it ends with its function.
#[test]
fn lines_without_an_end() {
    let chip: &'static Chip = chips::chip("at89s52").expect("a chip");
    let symbols = [symbol("main", "code", 0x10, 0), symbol("library", "code", 0x20, 0), symbol("count", "idata", 8, 2)];
    let (c, asm) = (LineKind::C, LineKind::Asm);
    let lines = Lines::new(vec![
        line(0x12, asm, "main.asm", 7, 0),
        line(0x10, c, "main.c", 3, 0),
        line(0x10, c, "main.c", 2, 0),
        line(0x22, asm, "library.asm", 9, 0),
    ]);
    let source = Source { names: Names { chip, symbols: &symbols }, lines: &lines };
    let told = [0x0F, 0x10, 0x1F, 0x20, 0x23].map(|word| source.line(word).unwrap_or_default());
    assert_eq!(told, ["", "main.c:3", "main.c:3", "", "library.asm:9"]);
    let meant = source.operands(&[("target", 0x12), ("direct address", 9), ("direct address", 0x90), ("constant", 8)]);
    assert_eq!(meant, ["main+0x2", "count+0x1"]);
}
