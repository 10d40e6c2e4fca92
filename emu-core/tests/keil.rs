//! Maps of Keil's linkers. They were written for these tests in the form of published maps.

use emu_core::image::{SymbolFile, SymbolSpaces, Symbols, load_symbols};

fn read(name: &str, text: &str) -> Result<Symbols, String> {
    let file = SymbolFile { name, bytes: text.as_bytes() };
    load_symbols(&[file], SymbolSpaces::MCS51).map_err(|faults| {
        let texts: Vec<String> =
            faults.iter().map(|d| format!("{}:{} {} {}", d.pos.line, d.pos.column, d.code, d.cause)).collect();
        texts.join("\n")
    })
}

/// The addresses of a name, such as `code:0040 idata:0008`, or `-` for none.
fn places(symbols: &Symbols, name: &str) -> String {
    let found = symbols.symbols.iter().filter(|s| s.name == name);
    let found: Vec<String> = found.map(|s| format!("{}:{:04x}", s.space, s.addr)).collect();
    if found.is_empty() { "-".to_owned() } else { found.join(" ") }
}

fn lines(symbols: &Symbols) -> String {
    let all = symbols.lines.iter().map(|l| format!("{:x} {}:{} {:?}", l.addr, l.file, l.line, l.kind));
    all.collect::<Vec<_>>().join("\n")
}

const BL51: &str = include_str!("keil/bl51.m51");
const LX51: &str = include_str!("keil/lx51.map");

#[test]
fn names_of_a_map_are_found() {
    let symbols = read("app.m51", BL51).unwrap();
    let table = [
        ("main", "code:0060"),
        ("_setSpeed", "code:0040"),
        ("setSpeed", "code:0040"),
        ("ramp", "code:0050"),
        ("pump.ramp", "code:0050"),
        ("speed", "idata:0008"),
        ("deep", "idata:0081"),
        ("log", "xdata:1234"),
        ("running", "bit:0001"),
        ("P1", "sfr:0090"),
        // Two modules use this name for two pins.
        ("LAMP", "-"),
        ("pump.LAMP", "bit:0093"),
        ("Valve.LAMP", "bit:00b7"),
        // Statics of two modules.
        ("count", "-"),
        ("pump.count", "idata:000a"),
        ("Valve.count", "idata:000c"),
        // Variables of functions and of blocks in functions. The function has the spelling of its name.
        ("old", "idata:000b"),
        ("setSpeed.old", "idata:000b"),
        ("pump.setSpeed.old", "idata:000b"),
        ("setSpeed.step", "idata:0021"),
        ("pump.ramp.step$1", "idata:0022"),
        ("pump.ramp.step$2", "idata:0023"),
        ("ramp.step", "-"),
        // A register of a bank holds a variable only for a while.
        ("wanted", "-"),
        ("_ICE_DUMMY_", "-"),
        ("AGAIN", "code:0080"),
        ("?C?UIDIV", "code:0090"),
        ("a_name_that_goes_beyond_the_end_of_the_line_as_it_is_very_long_indeed", "code:0070"),
    ];
    for (name, wanted) in table {
        assert_eq!(places(&symbols, name), wanted, "{name}");
    }
    assert_eq!(symbols.unplaced, [("LIMIT".to_owned(), 0x64)]);
    assert_eq!(symbols.warnings, []);
}

#[test]
fn lines_belong_to_the_file_of_their_module() {
    let wanted = "40 pump.c:12 C\n44 pump.c:13 C\n50 pump.c:20 C\n60 pump.c:30 C\n60 pump.c:31 C\n63 pump.c:33 C\n\
                  70 Valve.c:5 C\n80 tick.a51:8 Asm\n82 tick.a51:9 Asm";
    assert_eq!(lines(&read("app.m51", BL51).unwrap()), wanted);
    // Line ends and the form feeds of pages make no difference.
    let other = BL51.replace("BL51 BANKED LINKER/LOCATER V6.22     ", "\u{c}BL51 BANKED LINKER/LOCATER V6.22     ");
    assert_eq!(lines(&read("app.m51", &other.replace('\n', "\r\n")).unwrap()), wanted);
}

#[test]
fn maps_of_lx51_say_the_same() {
    let symbols = read("app.map", LX51).unwrap();
    let table = [
        ("setSpeed", "code:0040"),
        ("P1", "sfr:0090"),
        ("LAMP", "bit:0093"),
        ("running", "bit:0001"),
        ("speed", "idata:0008"),
        ("deep", "idata:0081"),
        ("log", "xdata:1234"),
        ("pump.setSpeed.old", "idata:000b"),
        ("pump.setSpeed.step$1", "idata:0021"),
        ("wanted", "-"),
        // Parameters of functions that the linker removed, in registers and outside of any block; and such a
        // function itself.
        ("en", "-"),
        ("pump.en", "-"),
        ("value", "-"),
        ("gone", "-"),
    ];
    for (name, wanted) in table {
        assert_eq!(places(&symbols, name), wanted, "{name}");
    }
    assert_eq!(symbols.warnings, []);
    assert_eq!(lines(&symbols), "40 pump.c:12 C\n44 pump.c:13 C");
}

#[test]
fn a_map_that_is_cut_off_is_taken_with_a_warning() {
    let warnings = |text: &str| {
        let all = read("a.m51", text).unwrap().warnings;
        all.iter().map(|d| format!("{}: {} {}", d.pos.line, d.code, d.cause)).collect::<Vec<_>>().join("; ")
    };
    let before = |text: &'static str, mark: &str| &text[..text.find(mark).unwrap()];
    let last = |text: &str| text.lines().count();
    for (cut, module) in [
        (before(BL51, "  C:0044H         LINE#         13"), ": module pump has no ENDMOD"),
        (before(LX51, "      01000044H   LINE"), ""),
        (before(LX51, "Program Size"), ""),
    ] {
        let wanted = format!("{}: SYM009 the map ends within its table of symbols{module}", last(cut));
        assert_eq!(warnings(cut), wanted);
    }
    // An ENDMOD is missing in the middle of a file that is otherwise complete.
    let ended =
        format!("{}Program Size: data=9.0 xdata=0 code=2\n", before(BL51, "  C:0044H         LINE#         13"));
    assert!(warnings(&ended).contains("module pump has no ENDMOD"), "{}", warnings(&ended));
}

#[test]
fn messages_of_the_linker_do_not_end_the_table() {
    let row = "  C:0044H         LINE#         13";
    let message = "*** WARNING L16: UNCALLED SEGMENT, IGNORED FOR OVERLAY PROCESS\n    SEGMENT: ?PR?RAMP?PUMP\n";
    let noted = read("a.m51", &BL51.replacen(row, &format!("{message}{row}"), 1)).unwrap();
    let plain = read("a.m51", BL51).unwrap();
    assert_eq!((lines(&noted), noted.warnings), (lines(&plain), Vec::new()));
}

#[test]
fn what_is_damaged_has_its_place() {
    let row = |from: &str, to: &str| {
        let line = BL51.lines().position(|line| line.contains(from)).unwrap() + 1;
        let found = read("a.m51", &BL51.replacen(from, to, 1)).map(|_| "ok".to_owned()).unwrap_or_else(|e| e);
        found.strip_prefix(&format!("{line}:")).map_or(found.clone(), str::to_owned)
    };
    let table = [
        ("C:0044H ", "C:0044  ", "3 SYM009 the value is not a hexadecimal number with an H: \"C:0044\""),
        ("C:0044H ", "Q:0044H ", "3 SYM009 the memory is unknown; wanted C, D, I, X, B or N: \"Q:0044H\""),
        ("C:0044H ", "B1:0044H", "3 SYM009 the name is in a bank of code, and banks are not emulated: \"B1:0044H\""),
        ("LINE#         13", "LINE#         x", "33 SYM009 the number of a line is invalid: \"x\""),
        ("B:0020H.1 ", "B:0030H.1 ", "3 SYM009 no bit of the chip has this address: \"B:0030H.1\""),
        ("D:0008H ", "D:0108H ", "3 SYM009 the address is beyond internal RAM: \"D:0108H\""),
        (
            "  C:0044H         LINE#         13",
            "  C:00",
            "3 SYM009 the line does not belong to a table of symbols: \"C:00\"",
        ),
        ("SYMBOL TABLE OF", "TABLE OF", "0:0 SYM016 the map has no table of symbols"),
    ];
    for (from, to, wanted) in table {
        assert_eq!(row(from, to), wanted);
    }
    let docs = include_str!("../../docs/formats/keil.md");
    assert!(["SYM004", "SYM009", "SYM016"].iter().all(|code| docs.contains(code)));
}

/// Reading ends for every prefix of a map, and for every changed character.
#[test]
fn damaged_maps_are_read_to_an_end() {
    for text in [BL51, LX51] {
        for end in (0..text.len()).step_by(7) {
            _ = read("a.m51", &text[..end]);
        }
        let mut bytes = text.as_bytes().to_vec();
        for at in (0..bytes.len()).step_by(3) {
            let old = std::mem::replace(&mut bytes[at], [b'9', b' ', b'\n', b'.', b'>', 0xE9][at % 6]);
            _ = load_symbols(&[SymbolFile { name: "a.m51", bytes: &bytes }], SymbolSpaces::MCS51);
            bytes[at] = old;
        }
    }
}
