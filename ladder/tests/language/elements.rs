//! Tests elements, chips and symbols with tables.

use crate::common;
use std::collections::BTreeSet;

use ladder::{ProgramElement, SymbolKind, element_text, parse};

#[test]
fn every_element_reads_into_the_model_and_back() {
    let mut wrong = Vec::new();
    let mut keywords = BTreeSet::new();
    for (number, row) in common::rows(include_str!("tables/elements.txt")) {
        let (line, model) = row.split_once(" => ").expect("a row has an arrow");
        let (line, model) = (line.trim(), model.trim());
        keywords.extend(line.split(' ').next());
        let program = match parse("t", &format!("{}RUNG\n  {line}\nEND\n", common::HEAD)) {
            Ok(parsed) => parsed.program,
            Err(errors) => {
                wrong.push(format!("line {number}: {errors:?}"));
                continue;
            }
        };
        let found: Vec<_> =
            program.elements().map(|ProgramElement { id, element: e, pos }| (id.to_string(), e, pos)).collect();
        let [(id, element, pos)] = found.as_slice() else { panic!("line {number}: {line} reads as {found:?}") };
        assert_eq!((id.as_str(), pos.line, pos.column), ("rung 1, element 1", 6, 3), "line {number}");
        if format!("{element:?}") != model {
            wrong.push(format!("line {number}: expected {model}, found {element:?}"));
        }
        if element_text(element) != line {
            wrong.push(format!("line {number}: expected {line}, found {}", element_text(element)));
        }
        let facts = element.facts();
        let words: Vec<&str> = line.split(' ').collect();
        if words.first() != Some(&facts.keyword) {
            wrong.push(format!("line {number}: its row has the keyword {}", facts.keyword));
        }
        // A shift register and a STEPPER have the stem of their variables instead of the names.
        let is_stem = matches!(facts.keyword, "SHIFT_REGISTER" | "STEPPER");
        let names = facts.symbols.iter().filter(|symbol| !is_stem && !words.contains(&&*symbol.name));
        wrong.extend(names.map(|symbol| format!("line {number}: its row has the symbol {}", symbol.name)));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let missing: Vec<&str> = ladder::element_keywords().filter(|keyword| !keywords.contains(keyword)).collect();
    assert!(missing.is_empty(), "tables/elements.txt has no row for {}", missing.join(", "));
}

/// An element or operation of the model that no line gives would be one that the reader cannot read.
#[test]
fn every_element_of_the_model_has_a_row() {
    let operations = [include_str!("../../src/operations.rs"), include_str!("../../src/operators.rs")].concat();
    let elements = enums(include_str!("../../src/model.rs")).into_iter().find(|(name, _)| *name == "Element");
    let displays = enums(include_str!("../../src/segments.rs"));
    let enums: Vec<_> = enums(&operations).into_iter().chain(displays).chain(elements).collect();
    let models: String = common::rows(include_str!("tables/elements.txt")).map(|(_, row)| format!(" {row}")).collect();
    let words: BTreeSet<&str> = models.split(|c: char| !c.is_alphanumeric()).collect();
    let all: Vec<_> = enums.iter().flat_map(|(name, variants)| variants.iter().map(move |v| (*name, *v))).collect();
    assert!(enums.len() == 9 && all.len() > 80, "{all:?}");
    // Lines of Instruction List are no `.ld` text; `tests/il` has them.
    let is_line = |variant: &str| variant == "Instruction";
    let missing: Vec<_> = all.iter().filter(|(_, v)| !words.contains(v) && !is_line(v)).collect();
    assert!(missing.is_empty(), "tables/elements.txt has no row for {missing:?}");
}

/// Names of the public enums of a source text, with the names of their variants.
fn enums(source: &str) -> Vec<(&str, Vec<&str>)> {
    let word = |text: &str| text.find(|c: char| !c.is_alphanumeric()).unwrap_or(text.len());
    let parts = source.split("\npub enum ").skip(1);
    parts
        .map(|part| {
            let body = part.split_once("\n}").map_or(part, |(body, _)| body);
            let lines = body.lines().skip(1).filter_map(|line| line.strip_prefix("    "));
            let names = lines.filter(|line| line.starts_with(char::is_uppercase)).map(|line| &line[..word(line)]);
            (&part[..word(part)], names.collect())
        })
        .collect()
}

#[test]
fn pins_of_the_packages() {
    for (number, row) in common::rows(include_str!("tables/chips.txt")) {
        let columns: Vec<&str> = row.split('|').map(str::trim).collect();
        let [micro, pin, chip, bit] = columns.as_slice() else { panic!("line {number}: four columns") };
        assert_eq!(ladder::chip_of(micro).unwrap_or("-"), *chip, "line {number}");
        let pin = pin.parse().expect("a pin is a number");
        assert_eq!(ladder::package_pin(micro, pin).unwrap_or("-"), *bit, "line {number}");
    }
}

#[test]
fn targets_without_a_model_name_the_nearest_chip() {
    let targets = [
        ("Microchip PIC16F887 40-PDIP", Some("pic16f877a")),
        ("Atmel AVR ATmega2560 100-TQFP", Some("atmega128")),
        ("Atmel AVR ATmega32U4 44-Pin packages", Some("atmega328p")),
        ("St ARM STM32F40X 144-LQFP", Some("atmega128")),
        ("ANSI C Code", None),
    ];
    for (micro, nearest) in targets {
        let target = ladder::unmodelled_target(micro).unwrap_or_else(|| panic!("{micro} is in LDmicro's list"));
        assert!(!target.what.is_empty() && target.nearest == nearest, "{micro}: {target:?}");
        assert!(nearest.is_none_or(|chip| ladder::chip_of(chip) == Some(chip)), "{micro}: the nearest is modelled");
        assert_eq!(ladder::chip_of(micro), None, "{micro}");
    }
    for micro in ["Atmel AVR ATmega32 40-PDIP", "Microchip PIC16F88 18-PDIP or 18-SOIC", "something else"] {
        assert_eq!(ladder::unmodelled_target(micro), None, "{micro}");
    }
}

#[test]
fn names_of_package_pins() {
    let names = [(4, Some("VCC")), (19, Some("ADC6")), (29, Some("RESET")), (30, Some("PD0")), (33, None), (0, None)];
    for (pin, name) in names {
        assert_eq!(ladder::package_pin_name("Atmel AVR ATmega328 32-Pin packages", pin), name, "pin {pin}");
    }
    assert_eq!(ladder::package_pin_count("Atmel AVR ATmega328 32-Pin packages"), Some(32));
    assert_eq!(ladder::package_pin_name("Atmel AVR ATmega8 28-PDIP", 9), Some("XTAL1 (PB6)"));
}

#[test]
fn symbols_are_collected_by_kind() {
    let text = "LDmicro0.1\nCYCLE=10000\nCRYSTAL=4000000\nIO LIST\nXb at 3\nYunused at 4\nEND\nPROGRAM\n\
        RUNG\nCONTACTS Xb 0\nMOVE Ca Ta\nEND\nRUNG\nTON Ta 20000\nCTC Ca 3\nCOIL Rm 0 0 0\nEND\n\
        RUNG\nSHIFT_REGISTER s 2\nEND\nRUNG\nREAD_ADC Ain\nEND\n";
    let options = ladder::ParseOptions { dialect: Some(ladder::LadderDialect::Ldmicro23) };
    let program = ladder::parse_with("t", text, options).expect("reads").program;
    let found: Vec<String> = program.symbols().iter().map(|s| format!("{} {:?} {}", s.name, s.kind, s.pin)).collect();
    let expected = [
        "Xb Input 3",
        "Yunused Output 4",
        "Rm Relay 0",
        "Ta Timer 0",
        "Ca Counter 0",
        "Ain Adc 0",
        "s0 Variable 0",
        "s1 Variable 0",
    ];
    assert_eq!(found, expected);
    assert!(program.symbols().iter().all(|s| s.bytes == if s.kind.is_bit() { 0 } else { 2 }));
    assert!(SymbolKind::Relay.is_bit() && !SymbolKind::Timer.is_bit());
}

#[test]
fn widths_of_the_newer_dialect() {
    // Rungs, and the widths in bytes of their integers. `VAR LIST` declares 1 for a, 3 for t, 4 for Cd.
    #[rustfmt::skip]
    let cases = [
        ("MOVE a t",             "a=1 t=3"),
        ("MOVE b -2147483648",   "b=2"),
        ("CTU Ca 127",           "Ca=1"),
        ("CTU Ca 128",           "Ca=2"),
        ("CTU Ca -128",          "Ca=1"),
        ("CTU Ca -129",          "Ca=2"),
        ("CTU Ca 32768",         "Ca=3"),
        ("CTU Ca 8388607",       "Ca=3"),
        ("CTU Ca 8388608",       "Ca=4"),
        ("CTU Ca 5 300",         "Ca=2"),
        ("CTU Ca t",             "Ca=2 t=3"),
        ("CTU Ca m",             "Ca=2 m=2"),
        ("CTU Ca Cb\nCTU Cb 1",  "Ca=2 Cb=1"),
        ("CTU Ca 5\nCTD Ca 200", "Ca=2"),
        ("CTD Ca 200\nCTU Ca 5", "Ca=1"),
        ("CTU Cd t",             "Cd=4 t=3"),
        ("CTU Cd 5",             "Cd=1"),
        ("TON Ta 1270000",       "Ta=1"),
        ("TON Ta 1280000",       "Ta=2"),
        ("TON Ta 1280000 -1",    "Ta=2"),
        ("TON Ta 327680000",     "Ta=3"),
        ("TON Ta 1000000000000", "Ta=4"),
        ("TON Ta 20000\nTOF Ta 9000000", "Ta=2"),
        ("TON Ta 9000000\nTOF Ta 20000", "Ta=1"),
        ("SHIFT_REGISTER a 2",   "a0=2 a1=2"),
        ("READ_ADC Ain",         "Ain=2"),
    ];
    for (rungs, wanted) in cases {
        let text = format!(
            "LDmicro0.2\nCYCLE=10000\nCRYSTAL=1\nVAR LIST\n1 bytes a\n3 bytes t\n4 bytes Cd\nEND\nPROGRAM\nRUNG\n{rungs}\nEND\n"
        );
        let program = parse("t", &text).expect("reads").program;
        let found: Vec<String> = program.symbols().iter().map(|s| format!("{}={}", s.name, s.bytes)).collect();
        assert_eq!(found.join(" "), wanted, "{rungs}");
    }
}

#[test]
fn pieces_of_strings() {
    use ladder::format::{StringPiece, split_format_string};
    // Text and its pieces: bytes, `-` for the sign, and the weight of each digit with `<` for the first and
    // `>` for the last.
    #[rustfmt::skip]
    let cases = [
        ("",            true,  ""),
        ("aé",          true,  "97 233"),
        (r"\\x",        true,  "92 120"),
        (r"\x4a\xFf",   true,  "74 255"),
        (r"\1",         true,  "<1>"),
        (r"\5",         true,  "<10000 1000 100 10 1>"),
        (r"1\-23",      true,  "49 - <10 1> 51"),
        ("\u{1}a\u{1f}", false, "88 97 88"),
        (r"\n",         false, "10"),
        ("\t",          true,  "9"),
    ];
    for (text, quoted, wanted) in cases {
        let shown = |piece: &StringPiece| match piece {
            StringPiece::Byte(byte) => byte.to_string(),
            StringPiece::Sign => "-".to_owned(),
            StringPiece::Digit { divisor, first, last } => {
                format!("{}{divisor}{}", if *first { "<" } else { "" }, if *last { ">" } else { "" })
            }
        };
        let found = split_format_string(text, quoted).map(|p| p.iter().map(shown).collect::<Vec<_>>().join(" "));
        assert_eq!(found.as_deref(), Ok(wanted), "{text}");
    }
}
