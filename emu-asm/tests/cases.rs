//! Small sources of all families with their results, as text. A case begins with `--- chip name`. After its
//! source come the bytes of its memories (`= code 0000: ..`), its warnings and its errors (`! line:column
//! code: cause (hint)`). EMU_BLESS=1 writes the actual results.

mod common;

use std::fmt::Write;

use common::chip;
use emu_asm::{AssembleOptions, IncludeFiles, NamedText, SourceText, assemble};

/// Files for includes.
struct Memory;

impl IncludeFiles for Memory {
    fn open(&mut self, name: &str, _: &str) -> std::io::Result<(String, Vec<u8>)> {
        let text = match name {
            "seven.inc" => "seven equ 7\n",
            "seven.h" => "#define SEVEN 7\n.set eight, SEVEN+1\n",
            "latin.inc" => return Ok((name.to_owned(), b"m macro x\n db \"\xE9\", x\n endm\n".to_vec())),
            "wide.inc" => return Ok((name.to_owned(), vec![0xFF, 0xFE, b' ', 0])),
            "wrong.inc" => " nothing here\n",
            "self.inc" => " include \"self.inc\"\n",
            _ => return Err(std::io::Error::new(std::io::ErrorKind::NotFound, "No such file")),
        };
        Ok((name.to_owned(), text.into()))
    }
}

/// Returns the result of a source.
fn found(chip_name: &str, text: &str) -> String {
    assembled(chip_name, text.as_bytes())
}

fn assembled(chip_name: &str, bytes: &[u8]) -> String {
    let source = SourceText { name: "main.asm", bytes };
    let options = AssembleOptions {
        defines: vec![NamedText { name: "GIVEN".into(), text: "3".into() }],
        ..AssembleOptions::default()
    };
    let mut out = String::new();
    let chip = chip(chip_name).unwrap_or_else(|| panic!("no chip {chip_name}"));
    let faults = match assemble(&source, chip, &options, &mut Memory) {
        Ok(assembled) => {
            for segment in &assembled.image.segments {
                let bytes: Vec<String> = segment.bytes.iter().map(|byte| format!("{byte:02X}")).collect();
                let _ = writeln!(out, "= {} {:04X}: {}", segment.space, segment.addr, bytes.join(" "));
            }
            assembled.warnings
        }
        Err(refused) => refused.diagnostics,
    };
    for fault in faults {
        let file = if fault.file == "main.asm" { String::new() } else { format!("{}:", fault.file) };
        let _ = writeln!(
            out,
            "! {file}{}:{} {}: {} ({})",
            fault.pos.line, fault.pos.column, fault.code, fault.cause, fault.hint
        );
    }
    out
}

fn check(path: &str) {
    let path = format!("{}/tests/cases/{path}", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).expect("cases");
    let (mut now, mut wrong) = (String::new(), Vec::new());
    let mut parts = text.split("\n--- ");
    now.push_str(parts.next().unwrap_or_default());
    let mut cases = 0;
    for part in parts {
        cases += 1;
        let (head, body) = part.split_once('\n').expect("a case has a source");
        let is_result = |line: &&str| line.starts_with("= ") || line.starts_with("! ");
        let source: Vec<&str> = body.lines().take_while(|line| !is_result(line)).collect();
        let wanted: Vec<&str> = body.lines().filter(is_result).collect();
        let chip = head.split(' ').next().unwrap_or_default();
        let found = found(chip, &source.join("\n"));
        if found.lines().collect::<Vec<_>>() != wanted {
            wrong.push(format!("--- {head}\nwanted\n{}\nfound\n{found}", wanted.join("\n")));
        }
        let _ = write!(now, "\n--- {head}\n{}\n{found}", source.join("\n"));
    }
    assert!(cases > 0, "{path} has no cases");
    if std::env::var_os("EMU_BLESS").is_some() {
        std::fs::write(&path, now).expect("writing the cases");
    } else {
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    }
}

#[test]
fn instructions_and_names() {
    check("names.txt");
}

#[test]
fn data_and_places() {
    check("data.txt");
}

#[test]
fn sources_after_asm51_and_its_like() {
    check("asm51.txt");
}

#[test]
fn areas_of_a_module() {
    check("areas.txt");
}

#[test]
fn macros_repetitions_and_conditions() {
    check("macros.txt");
}

#[test]
fn controllers() {
    check("ap101.txt");
}

#[test]
fn what_is_wrong() {
    check("wrong.txt");
}

#[test]
fn many_warnings_hide_no_error() {
    let reported = found("8051", &(" warning \"w\"\n".repeat(150) + " mov a,#300\n"));
    let codes: Vec<&str> =
        reported.lines().filter_map(|line| line.split([' ', ':']).find(|w| w.starts_with("ASM"))).collect();
    assert_eq!(codes, [vec!["ASM025"; 100], vec!["ASM003", "ASM029"]].concat(), "{reported}");
}

#[test]
fn ends_of_lines_and_files() {
    #[rustfmt::skip]
    let cases: &[(&[u8], &str)] = &[
        (b" db 1\r db 2\r\n db 3\n", "= code 0000: 01 02 03\n"),
        (b" db 1\n db 2\n\x1A", "= code 0000: 01 02\n"),
        (b" db 1\r\n\x1A\r\n\0\0", "= code 0000: 01\n"),
        (b" db 1\n\x1A\n db 2\n", "! 2:1 ASM005: `\\x1a` is not an instruction, directive or label (a line is `label: word operands ; comment`)\n"),
        (b"\xEF\xBB\xBF db 1\n", "= code 0000: 01\n"),
        (b" db 1\r\r\n mvo a\r", "! 2:2 ASM001: `mvo` is not an instruction, directive or macro (did you mean `mov`?)\n"),
        (b" db 1\r\r mvo a\r", "! 3:2 ASM001: `mvo` is not an instruction, directive or macro (did you mean `mov`?)\n"),
        (b"\xFE\xFF\0 \0n", "! 0:0 ASM035: `main.asm` is written in UTF-16 (high byte first) (save it as UTF-8)\n"),
        (b" include \"wide.inc\"\n", "! 1:10 ASM035: `wide.inc` is written in UTF-16 (low byte first) (save it as UTF-8)\n"),
    ];
    for (bytes, wanted) in cases {
        assert_eq!(assembled("8051", bytes), *wanted, "{bytes:?}");
    }
}

/// Bytes of strings and characters are those of the file, in any encoding; names and messages are readable,
/// and positions count characters.
#[test]
fn texts_in_any_encoding() {
    #[rustfmt::skip]
    let cases: &[(&str, &[u8], &str)] = &[
        ("pic16f84a", b" org 0\n dt \"\xBFA\"\n", "= flash 0000: BF 34 41 34\n"),
        ("pic16f84a", " org 0\n dt \"\u{bf}A\"\n".as_bytes(), "= flash 0000: C2 34 BF 34 41 34\n"),
        ("8051", b" db \"\xE9\", '\xE9', \"\\\xE9\" ; \xE9\n", "= code 0000: E9 E9 5C E9\n"),
        ("8051", b" .ascii /\x80\xFF/\n", "= code 0000: 80 FF\n"),
        ("atmega328p", b".ascii \"\xC3\xA9\xE9\"\n .byte 0\n", "= flash 0000: C3 A9 E9 00\n"),
        ("8051", "; \u{e9}\n include \"latin.inc\"\n m \"\u{e9}\"\n".as_bytes(), "= code 0000: E9 C3 A9\n"),
        ("8051", "; UTF-8 with a character for private use\n db \"\u{ef80}\"\n".as_bytes(), "= code 0000: EE BE 80\n"),
        ("8051", b"ma\xF1ana equ 7\n db ma\xF1ana\n", "= code 0000: 07\n"),
        ("8051", b" db \"\xE9\xE9\", ma\xF1ana\n", "! 1:11 ASM006: `ma\u{f1}ana` is not defined (give it with equ, or as a label; names of registers and bits are those of the chip)\n"),
        ("8051", b" db 0 ; \xE9\n .error \"\x80\"\n", "! 2:9 ASM024: \u{20ac} (the program itself says so)\n"),
    ];
    for (chip, bytes, wanted) in cases {
        assert_eq!(assembled(chip, bytes), *wanted, "{}", String::from_utf8_lossy(bytes));
    }
}
