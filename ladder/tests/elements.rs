//! Elements, chips and symbols, by table.

mod common;

use std::collections::BTreeSet;

use ladder::{SymbolKind, element_text, parse};

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
        let found: Vec<_> = program.elements().map(|(id, e, pos)| (id.to_string(), e, pos)).collect();
        let [(id, element, pos)] = found.as_slice() else { panic!("line {number}: one element") };
        assert_eq!((id.as_str(), pos.line, pos.column), ("rung 1, element 1", 6, 3), "line {number}");
        if format!("{element:?}") != model {
            wrong.push(format!("line {number}: expected {model}, found {element:?}"));
        }
        if element_text(element) != line {
            wrong.push(format!("line {number}: expected {line}, found {}", element_text(element)));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert_eq!(keywords.len(), 36, "the elements of release 2.3");
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
fn symbols_are_collected_by_kind() {
    let text = "LDmicro0.1\nCYCLE=10000\nCRYSTAL=4000000\nIO LIST\nXb at 3\nYunused at 4\nEND\nPROGRAM\n\
        RUNG\nCONTACTS Xb 0\nMOVE Ca Ta\nEND\nRUNG\nTON Ta 20000\nCTC Ca 3\nCOIL Rm 0 0 0\nEND\n\
        RUNG\nSHIFT_REGISTER s 2\nEND\nRUNG\nREAD_ADC Ain\nEND\n";
    let program = parse("t", text).expect("reads").program;
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
    assert!(SymbolKind::Relay.is_bit() && !SymbolKind::Timer.is_bit());
}
