//! Tests every diagnostic of the reader with a table.

use crate::common;
use std::collections::BTreeSet;

use diag::Diagnostic;
use diag::text::TextEncoding;
use ladder::ProgramElement;

const TABLE: &str = include_str!("tables/read.txt");

fn diagnostics(text: &str) -> Vec<Diagnostic> {
    match ladder::parse("t.ld", text) {
        Ok(parsed) => parsed.warnings,
        Err(errors) => {
            assert!(errors.iter().any(Diagnostic::is_error), "refused without an error: {text}");
            errors
        }
    }
}

#[test]
fn every_row_reports_what_is_written() {
    let mut wrong = Vec::new();
    for (number, row) in common::rows(TABLE) {
        let (expected, rest) = row.split_once('|').expect("a row has a bar");
        let found = diagnostics(&common::text(rest));
        let is_accepted = !found.iter().any(Diagnostic::is_error);
        if is_accepted != expected.split_whitespace().any(|w| w == "ok") {
            wrong.push(format!("line {number}: accepted: {is_accepted}"));
        }
        let mut found = common::diagnostic_codes(&found);
        let expected: Vec<&str> = expected.split_whitespace().filter(|w| *w != "ok").collect();
        if !expected.iter().any(|e| e.starts_with("LD018")) {
            found.retain(|f| !f.starts_with("LD018"));
        }
        if found != expected {
            wrong.push(format!("line {number}: expected {expected:?}, found {found:?}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_code_of_the_reader_has_a_row() {
    let written: BTreeSet<&str> = common::rows(TABLE)
        .filter_map(|(_, row)| row.split_once('|'))
        .flat_map(|(expected, _)| expected.split_whitespace())
        .filter_map(|w| Some(w.split_once('@')?.0))
        .collect();
    // The tests of the limits below trigger the codes about size, and those of notations the last.
    let elsewhere = ["LD005", "LD019", "LD036", "LD040", "LD042", "LD043", "LD044", "LD045"];
    let missing: Vec<&str> = ladder::CODES
        .iter()
        .map(|c| c.code)
        .filter(|c| c.starts_with("LD0") && !written.contains(c) && !elsewhere.contains(c))
        .collect();
    assert!(missing.is_empty(), "no row for {missing:?}");
}

#[test]
fn codes_are_unique_and_explained() {
    let mut seen = BTreeSet::new();
    for code in ladder::CODES {
        assert!(seen.insert(code.code), "{} twice", code.code);
        assert!(!code.title.is_empty() && code.explain.len() > 40, "{} has no text", code.code);
    }
}

#[test]
fn every_message_has_a_cause_and_a_hint() {
    for (number, row) in common::rows(TABLE) {
        let rest = row.split_once('|').map_or("", |(_, r)| r);
        for d in diagnostics(&common::text(rest)) {
            assert!(!d.cause.is_empty() && !d.hint.is_empty() && d.file == "t.ld", "line {number}: {d:?}");
        }
    }
}

/// A rung with `depth` nested groups.
fn nested(depth: usize) -> String {
    let mut body = String::from("RUNG\n");
    for level in 0..depth {
        body.push_str(if level % 2 == 0 { "PARALLEL\nSHORT\n" } else { "SERIES\nSHORT\n" });
    }
    body.push_str("SHORT\n");
    body.push_str(&"END\n".repeat(depth + 1));
    format!("{}{body}", common::HEAD)
}

#[test]
fn nesting_is_bounded() {
    assert!(ladder::parse("t", &nested(64)).is_ok());
    let errors = ladder::parse("t", &nested(65)).expect_err("65 groups");
    // The 65th group opens two lines after the 64th; line 6 holds the first.
    assert_eq!(common::diagnostic_codes(&errors), ["LD036@134:1+8"]);
    // Neither the reader nor dropping its result may recurse as deeply as the file nests.
    assert!(ladder::parse("t", &nested(200_000)).is_err());
}

#[test]
fn size_is_bounded() {
    let codes_of = |text: &str| common::diagnostic_codes(&ladder::parse("t", text).expect_err("too large"));
    let rung = "RUNG\nSHORT\nEND\n";
    assert!(ladder::parse("t", &format!("{}{}", common::HEAD, rung.repeat(2_000))).is_ok());
    assert_eq!(codes_of(&format!("{}{}", common::HEAD, rung.repeat(2_001))), ["LD005@6005:1+4"]);
    let many = |n: usize| format!("{}RUNG\n{}END\n", common::HEAD, "SHORT\n".repeat(n));
    assert!(ladder::parse("t", &many(20_000)).is_ok());
    assert_eq!(codes_of(&many(20_001)), ["LD005@20006:1+5"]);
    assert_eq!(codes_of(&" ".repeat((4 << 20) + 1)), ["LD005@0:0+0"]);
}

#[test]
fn errors_are_bounded() {
    let errors =
        ladder::parse("t", &format!("{}RUNG\n{}END\n", common::HEAD, "FOO\n".repeat(1000))).expect_err("errors");
    assert_eq!(errors.len(), 101);
    assert_eq!(errors.last().map(|d| d.code), Some("LD019"));
}

#[test]
fn any_number_of_warnings_is_no_error() {
    let names: String = (0..300).map(|n| format!("P{n} at 0\n")).collect();
    let text = format!("LDmicro0.1\nCYCLE=1\nCRYSTAL=1\nIO LIST\n{names}END\nPROGRAM\n");
    assert_eq!(ladder::parse("t", &text).map(|p| p.warnings.len()), Ok(300));
}

/// Comments in any encoding keep their bytes when written back, and are shown as readable text.
#[test]
fn a_program_may_be_in_any_code_page() {
    let files: [(&[u8], TextEncoding, &str); 6] = [
        (b"sem\xE1foro \x80", TextEncoding::Bytes, "sem\u{e1}foro \u{20ac}"),
        ("bot\u{e3}o \u{219}".as_bytes(), TextEncoding::Utf8, "bot\u{e3}o \u{219}"),
        (b"one \xC3\xA9 and another \xE9", TextEncoding::Bytes, "one \u{c3}\u{a9} and another \u{e9}"),
        (b"undefined \x81\x8D\x8F\x90\x9D.", TextEncoding::Bytes, "undefined \u{81}\u{8d}\u{8f}\u{90}\u{9d}."),
        (b"plain", TextEncoding::Utf8, "plain"),
        (b"no\xA0break", TextEncoding::Bytes, "no\u{a0}break"),
    ];
    for (comment, encoding, shown) in files {
        let front = "LDmicro0.1\nCYCLE=10000\nCRYSTAL=4000000\n\nIO LIST\nEND\n\nPROGRAM\nRUNG\n    COMMENT ";
        let file = [front.as_bytes(), comment, b"\nEND\n"].concat();
        let parsed = ladder::parse_bytes("t", &file, ladder::ParseOptions::default()).expect("a program");
        let found = parsed.program.elements().find_map(|ProgramElement { element, .. }| match element {
            ladder::Element::Comment(text) => Some(text.trim_end().to_owned()),
            _ => None,
        });
        assert_eq!((parsed.encoding, found.as_deref()), (encoding, Some(shown)));
        let back = ladder::write_bytes(&parsed.program, parsed.encoding);
        assert_eq!(back.trim_ascii_end(), file.trim_ascii_end(), "{shown}");
    }
}

/// A text in a code page is sent to the chip as its original bytes.
#[test]
fn a_text_in_a_code_page_sends_its_bytes() {
    let file = b"LDmicro0.2\nCYCLE=10000\nCRYSTAL=4000000\nBAUD=9600\nPROGRAM\nRUNG\nFORMATTED_STRING (none) \"\x80\xE9\x81\"\nEND\n";
    let program = ladder::parse_bytes("t", file, ladder::ParseOptions::default()).expect("a program").program;
    let text = program.elements().find_map(|ProgramElement { element, .. }| match element {
        ladder::Element::FormattedString { text, .. } => Some(text.clone()),
        _ => None,
    });
    let wanted = [0x80, 0xE9, 0x81].map(ladder::format::StringPiece::Byte);
    assert_eq!(ladder::format::split_format_string(&text.expect("a text"), true).as_deref(), Ok(&wanted[..]));
}

/// Byte order marks and line ends of other systems are accepted; two bytes per character are refused with a
/// hint.
#[test]
fn a_program_may_come_from_any_system() {
    let text = format!("{}RUNG\nSHORT\nEND\n", common::HEAD);
    let accepted = [
        (text.clone(), None),
        (format!("\u{feff}{text}"), Some("LD003")),
        (text.replace('\n', "\r\n"), None),
        (text.replace('\n', "\r"), None),
        (format!("{text}\x1A"), None),
        (format!("{text}\x1Awhat LDmicro does not see"), Some("LD002")),
    ];
    let mut wanted = ladder::parse("t", &text).expect("a program").program;
    for (text, note) in accepted {
        let parsed = ladder::parse_bytes("t", text.as_bytes(), ladder::ParseOptions::default()).expect("a program");
        wanted.style.crlf = text.contains("\r\n");
        assert_eq!(parsed.program, wanted);
        let code = parsed.warnings.iter().map(|d| d.code).find(|code| *code != ladder::REWRITTEN);
        assert_eq!(code, note, "{text:?}");
    }
    let wide: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    for wide in [wide.clone(), [b"\xFF\xFE".to_vec(), wide].concat()] {
        let errors = ladder::parse_bytes("t", &wide, ladder::ParseOptions::default()).expect_err("UTF-16");
        assert_eq!(common::diagnostic_codes(&errors), ["LD002@0:0+0"]);
    }
}

#[test]
fn hints_guess_what_was_meant() {
    for (line, hint) in [
        ("CONTACTT Xa 0", "did you mean CONTACTS?"),
        ("contacts Xa 0", "did you mean CONTACTS?"),
        ("PARALEL", "did you mean PARALLEL?"),
        ("MOV a 1", "did you mean MOVE?"),
    ] {
        let errors = ladder::parse("t", &format!("{}RUNG\n{line}\nEND\n", common::HEAD)).expect_err("misspelt");
        assert_eq!(errors.first().map(|d| d.hint.as_str()), Some(hint), "{line}");
    }
}

/// The constant that MOVE copies, in a program under a header; `None` if it is refused.
fn constant(header: &str, text: &str) -> Option<i64> {
    let file = format!("{header}\nCYCLE=10000\nCRYSTAL=4000000\nPROGRAM\nRUNG\nMOVE a {text}\nEND\n");
    let program = ladder::parse("t", &file).ok()?.program;
    program.elements().find_map(|ProgramElement { element, .. }| match element {
        ladder::Element::Move { src: ladder::LadderOperand::Const { value, .. }, .. } => Some(*value),
        _ => None,
    })
}

#[test]
fn the_dialect_sets_the_spelling_of_numbers() {
    // Text, value in ldmicro-2.3, value in ldmicro-5.
    let rows = [
        ("12", Some(12), Some(12)),
        ("-3", Some(-3), Some(-3)),
        ("+5", None, Some(5)),
        ("017", Some(17), Some(15)),
        ("-017", Some(-17), Some(-15)),
        ("089", Some(89), Some(0)),
        ("0x1F", Some(31), Some(31)),
        ("-0X10", Some(-16), Some(-16)),
        ("0x", None, Some(0)),
        ("0b101", Some(5), Some(0)),
        ("0o17", Some(15), Some(0)),
        ("5abc", None, Some(5)),
        ("'A'", Some(65), Some(65)),
        ("2147483647", None, Some(2_147_483_647)),
        ("2147483648", None, None),
        ("-", None, None),
    ];
    for (text, old, new) in rows {
        assert_eq!((constant("LDmicro0.1", text), constant("LDmicro", text)), (old, new), "{text}");
    }
}

#[test]
fn lists_keep_every_line_that_has_a_meaning() {
    let vars = "4bytes a\n5 bytes b\nc signed 12 bit\nd signed 4 bit variable\n1 bytes #PORTB\n1 bytes a here\n";
    let io = "Xa at 2 300 -1\nXb at PB0 0 0\nXc at 3 1\nXd 4\nX-e at 5\n";
    let file = format!(
        "LDmicro\nCYCLE=1\nCRYSTAL=1\nVAR LIST\n{vars}END\nIO LIST\n{io}END\nPROGRAM\nRUNG 1\nEND\nRUNG 2\nSHORT\nEND\n"
    );
    let program = ladder::parse("t", &file).expect("a program").program;
    let widths: Vec<_> = program.vars.iter().flatten().map(|var| (var.name.as_str(), var.bytes)).collect();
    assert_eq!(widths, [("a", 4), ("b", 2), ("c", 1), ("d", 2), ("#PORTB", 1), ("a", 1)]);
    let pins: Vec<_> = program.io.iter().map(|io| (io.name.as_str(), io.pin, io.modbus)).collect();
    assert_eq!(pins, [("Xa", 2, Some((44, 65535))), ("Xb", 0, Some((0, 0))), ("Xc", 3, None)]);
    assert_eq!(program.rungs.iter().map(|rung| rung.series.len()).collect::<Vec<_>>(), [0, 1]);
    let written = ladder::write(&program);
    assert!(written.starts_with("LDmicro\n") && written.contains("\nRUNG 2\n"), "{written}");
    assert!(written.contains("    5 bytes b\n    c signed 12 bit\n"), "{written}");
    let widths = ladder::parse("t", &written).expect("a program").program.vars;
    assert_eq!(widths.map(|vars| vars.len()), program.vars.map(|vars| vars.len()));
}

#[test]
fn every_accepted_row_reads_back_as_it_was_written() {
    let mut seen = 0;
    for (number, row) in common::rows(TABLE) {
        let text = common::text(row.split_once('|').map_or("", |(_, rest)| rest));
        let Ok(parsed) = ladder::parse("t", &text) else { continue };
        let written = ladder::write(&parsed.program);
        let again = ladder::parse("t", &written).unwrap_or_else(|e| panic!("line {number}: {e:?}\n{written}"));
        assert_eq!(ladder::write(&again.program), written, "line {number}");
        assert!(again.warnings.iter().all(|note| note.code != ladder::REWRITTEN), "line {number}: {written}");
        assert_eq!(again.program.dialect, parsed.program.dialect, "line {number}");
        seen += 1;
    }
    assert!(seen > 60, "only {seen} rows are accepted");
}
