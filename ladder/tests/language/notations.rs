//! Notations that draw networks: faults have places, and damaged files never panic.

use ladder::{ReadOptions, read_program};
use proptest::prelude::*;

#[path = "../../../tests/ladder/plcopen_text.rs"]
mod plcopen_text;

/// Each notation: the name of a file, and a program.
fn samples() -> Vec<(&'static str, String)> {
    let rungs =
        "XIC(a)[XIC(b)OTE(c),ONS(s)]TON(T,20,0)CTU(K,2)MOV(K.ACC,n)GRT(n,1)RES(T);\nBST XIC a NXB XIO b BND OTL d;";
    vec![
        ("conveyor.xml", include_str!("../../../examples/conveyor.xml").to_owned()),
        ("stamper.L5X", include_str!("../../../examples/stamper.L5X").to_owned()),
        ("latch.ld", include_str!("notations_in/latch.openplc.ld").to_owned()),
        ("rungs.txt", rungs.to_owned()),
    ]
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
        if file == "rungs.txt" {
            // A part can be a program.
            (1..text.len()).for_each(|end| drop(faults(file, &text[..end])));
            continue;
        }
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
fn neutral_text_is_refused_by_name_and_place() {
    let cases = [
        ("XIC(a)PID(b);", "LD044", 7),
        ("XIC(a)OTE(b", "LD045", 12),
        ("XIC(a)[XIC(b)OTE(c);", "LD045", 20),
        ("XIC(a)OTE();", "LD045", 7),
        ("XIC(a,b)OTE(c);", "LD045", 1),
        ("XIC(a)@OTE(c);", "LD045", 7),
        ("XIC(a[3])OTE(c);", "LD044", 5),
        ("XIC(I:1/0)OTE(c);", "LD044", 5),
        ("XIC(T.DN)OTE(c);", "LD044", 5),
        ("TON(T,20,0)XIC(T.OV)OTE(c);", "LD044", 16),
        ("XIC(a)TON(T,20,0);XIC(a)TOF(T,20,0);", "LD044", 29),
        ("XIC(a)TON(T,?,?);", "LD044", 7),
        ("XIC(a)TON(T,n,0);", "LD044", 13),
        ("XIC(a)TOF(T,9,0);XIC(b)RES(T);", "LD044", 28),
        ("XIC(n)MOV(n,m);", "LD044", 11),
        ("XIC(a)RES(b);", "LD044", 11),
    ];
    for (text, code, column) in cases {
        let options = ReadOptions { notation: Some(ladder::Notation::Rockwell), ..ReadOptions::default() };
        let found = read_program("t.txt", text.as_bytes(), options).expect_err(text);
        assert_eq!((found[0].code, found[0].pos.column), (code, column), "{text}: {found:?}");
    }
    let deep = format!("{}XIC(a)", "[".repeat(100_000));
    assert_eq!(faults("t.l5x", &format!("XIC(a){deep}")), [("LD045", 1)]);
}

#[test]
fn rungs_of_openplc_are_the_networks_of_their_wires() {
    let text = include_str!("notations_in/latch.openplc.ld");
    let read = read_program("latch.ld", text.as_bytes(), ReadOptions::default()).expect("a sound program");
    let wanted = "(* Seal-in *)\n    LDN Stop\n    AND( Start\n      OR On\n    )\n    ST On\n\n    LD On\n    ST TON0.IN\n    \
                  CAL TON0(PT := T#20ms)\n\n    LD TON0.Q\n    S Lamp\n";
    assert!(ladder::il::program_text(&read.program).ends_with(wanted), "{}", ladder::il::program_text(&read.program));
    for (from, to, code) in [
        ("\"coil\"", "\"lamp\"", "LD044"),
        ("\"negated\"", "\"odd\"", "LD044"),
        ("\"TON\"", "\"PID\"", "LD044"),
        ("\"source\": \"left-1\"", "\"source\": \"left-9\"", "LD044"),
        ("\"rungs\": [", "\"rungs\": [[", "LD043"),
        (": bool AT %IX0.0", ": string AT %IX0.0", "IL007"),
    ] {
        let found = faults("latch.ld", &text.replace(from, to));
        assert!(found.iter().any(|(found, line)| *found == code && *line > 1), "{to}: {found:?}");
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
