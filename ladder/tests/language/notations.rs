//! Notations that draw networks: faults have places, and damaged files never panic.

use ladder::{ReadOptions, read_program};
use proptest::prelude::*;

#[path = "../../../tests/ladder/plcopen_text.rs"]
mod plcopen_text;

/// Each notation: the name of a file, and a program.
fn samples() -> Vec<(&'static str, String)> {
    vec![("conveyor.xml", include_str!("../../../examples/conveyor.xml").to_owned())]
}

/// Reads a text; returns the codes of its errors with their lines.
fn faults(file: &str, text: &str) -> Vec<(&'static str, u32)> {
    match read_program(file, text.as_bytes(), ReadOptions::default()) {
        Ok(_) => Vec::new(),
        Err(faults) => {
            assert!(faults.iter().any(diag::Diagnostic::is_error), "{text}");
            faults.iter().filter(|fault| fault.is_error()).map(|fault| (fault.code, fault.pos.line)).collect()
        }
    }
}

/// Reads a short text of PLCopen; returns the codes of its errors.
fn plcopen_faults(text: &str) -> Vec<&'static str> {
    faults("t.xml", &plcopen_text::project(text)).into_iter().map(|(code, _)| code).collect()
}

#[test]
fn a_part_of_a_file_is_never_accepted_and_never_panics() {
    for (file, text) in samples() {
        assert_eq!(faults(file, &text), [], "{file}");
        let body_end = text.trim_end().len() - 1;
        for end in (1..body_end).filter(|end| text.is_char_boundary(*end)).step_by(7) {
            assert_ne!(faults(file, &text[..end]), [], "{file} up to {end}");
        }
    }
}

#[test]
fn deep_nesting_and_huge_files_are_refused() {
    let deep = format!("<project xmlns=\"http://www.plcopen.org/xml/tc6_0201\">{}", "<types>".repeat(100_000));
    assert_eq!(faults("deep.xml", &deep), [("LD043", 1)]);
    let wide = format!("<project xmlns=\"http://www.plcopen.org/xml/tc6_0201\">{}</project>", "<a/>".repeat(200_001));
    assert_eq!(faults("wide.xml", &wide), [("LD043", 1)]);
    let huge = format!("<project plcopen=\"1\">{}</project>", " ".repeat(5 << 20));
    assert_eq!(faults("huge.xml", &huge), [("LD043", 1)]);
    let nested: String = (1..200).map(|n| format!("{n} contact a < {} 0\n", n - 1)).collect();
    assert_eq!(plcopen_faults(&format!("in a BOOL\nout q BOOL\n{nested}200 coil q < 199\n")), ["LD042"]);
    let chain: String = (1..300).map(|n| format!("var T{n} TON\n{n} block TON T{n} IN<{}\n", n - 1)).collect();
    assert_eq!(plcopen_faults(&format!("out q BOOL\n{chain}300 coil q < 299.Q\n")), [""; 0]);
    let many: String = (1..6_000).map(|n| format!("{n} contact a < {}\n", n - 1)).collect();
    assert_eq!(plcopen_faults(&format!("in a BOOL\nout q BOOL\n{many}6000 coil q < 5999\n")), ["LD042"]);
    let long: String = (1..4_000).map(|n| format!("{n} contact a < {}\n", n - 1)).collect();
    assert_eq!(plcopen_faults(&format!("in a BOOL\nout q BOOL\n{long}4000 coil q < 3999\n")), [""; 0]);
}

#[test]
fn unsound_diagrams_of_plcopen_are_named() {
    let head = "in a BOOL\nvar n INT\nout q BOOL\nvar T TON\n";
    let cases = [
        ("1 contact a <\n2 coil q < 1", "LD042"),
        ("1 contact a < 2\n2 contact a < 1\n3 coil q < 2", "LD042"),
        ("1 contact a < 9\n2 coil q < 1", "LD044"),
        ("1 contact a < 0\n1 coil q < 1", "LD044"),
        ("1 contact n < 0\n2 coil q < 1", "IL102"),
        ("1 contact a < 0\n2 coil missing < 1", "IL101"),
        ("1 contact a < 0\n2 block TON q IN<1\n3 coil q < 2.Q", "IL037"),
        ("1 contact a < 0\n2 block TON T IN<1\n3 coil q < 2.X", "LD044"),
        ("1 contact a < 0\n2 block PID T IN<1\n3 coil q < 2.X", "LD044"),
        ("1 contact a < 0\n2 block TON - IN<1\n3 coil q < 2.Q", "LD044"),
        ("1 contact not rise a < 0\n2 coil q < 1", "LD044"),
        ("1 coil not set q < 0", "LD044"),
        ("1 jump nowhere < 0", "IL032"),
        ("1 contact a+b < 0\n2 coil q < 1", "IL024"),
        ("var s REAL\n1 coil q < 0", "IL007"),
        ("var s Motor\n1 coil q < 0", "IL006"),
        ("var 9s BOOL\n1 coil q < 0", "LD044"),
        ("var s BOOL = often\n1 coil q < 0", "IL011"),
    ];
    for (text, code) in cases {
        let found = plcopen_faults(&format!("{head}{text}\n"));
        assert_eq!(found.first(), Some(&code), "{text}: {found:?}");
    }
}

#[test]
fn the_interval_of_a_task_is_the_cycle() {
    for (interval, cycle_us) in
        [("T#20ms", 20_000), ("PT0.05S", 50_000), ("00:00:00.100000", 100_000), ("often", 10_000)]
    {
        let text = samples()[0].1.replace("interval=\"T#10ms\"", &format!("interval=\"{interval}\""));
        let read = read_program("t.xml", text.as_bytes(), ReadOptions::default()).expect("a sound program");
        assert_eq!(read.program.settings.cycle_us, cycle_us, "{interval}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn damaged_files_never_panic(
        which in any::<prop::sample::Index>(),
        cuts in prop::collection::vec((any::<prop::sample::Index>(), 0_usize..40, "[ -~]{0,6}"), 1..6),
    ) {
        let samples = samples();
        let (file, text) = &samples[which.index(samples.len())];
        let mut bytes = text.clone().into_bytes();
        for (at, length, new) in cuts {
            let at = at.index(bytes.len());
            let end = (at + length).min(bytes.len());
            bytes.splice(at..end, new.into_bytes());
        }
        let _ = read_program(file, &bytes, ReadOptions::default());
    }
}
