//! Compares the evaluator with the hand-written traces of `tests/ladder`.

use ladder::ProgramElement;

use crate::common;
use crate::table::{self, BusField, Column};
use ladder_eval::{BusEvent, Evaluator};
use std::collections::BTreeSet;

/// Sets a column before a scan.
fn set_column(eval: &mut Evaluator, column: &Column, value: i32) {
    match column {
        Column::Symbol(name) => eval.set(common::index(eval, name), value),
        Column::Level(name) => eval.set_adc(common::index(eval, name), value.try_into().expect("a level")),
        Column::Received => assert!(eval.receive(value.try_into().expect("a byte")), "a byte waits already"),
        Column::Cell(cell) => eval.set_eeprom(*cell, value.try_into().expect("a byte")),
        Column::Answer => eval.set_bus_answer(value.try_into().expect("a byte")),
        Column::Sent | Column::Duty | Column::DutyOf(_) | Column::Bus(_) => panic!("{column:?} is not given"),
    }
}

/// Reads a column after a scan.
fn column_value(eval: &Evaluator, column: &Column) -> Option<i32> {
    match column {
        Column::Symbol(name) => Some(eval.get(common::index(eval, name))),
        Column::Sent => eval.sent().map(i32::from),
        Column::Duty => eval.pwm_percent().map(i32::from),
        Column::Cell(cell) => eval.eeprom().get(*cell).copied().map(i32::from),
        Column::DutyOf(output) => eval.pwm_duties().get(*output).copied().flatten().map(i32::from),
        Column::Bus(field) => eval.bus_events().last().and_then(|event| of_event(event, *field)),
        Column::Level(_) | Column::Received | Column::Answer => panic!("{column:?} is not wanted"),
    }
}

/// A part of a transfer; `None` if it has none.
fn of_event(event: &BusEvent, field: BusField) -> Option<i32> {
    let (device, register, byte) = match *event {
        BusEvent::I2cWrite { device, register, byte } => (Some(device), Some(register), Some(byte)),
        BusEvent::I2cRead { device, register } => (Some(device), Some(register), None),
        BusEvent::Spi { byte } => (None, None, Some(byte)),
    };
    let part = match field {
        BusField::Byte => byte,
        BusField::Register => register,
        BusField::Device => device,
    };
    part.map(i32::from)
}

#[test]
fn every_line_of_every_trace() {
    let mut faults = Vec::new();
    for case in table::cases() {
        let mut eval = common::evaluator(&common::parse("test.ld", &case.program));
        for row in &case.rows {
            for _ in 0..row.times {
                for (column, value) in case.given.iter().zip(&row.given) {
                    value.iter().for_each(|&value| set_column(&mut eval, column, value));
                }
                eval.scan();
            }
            let found: Vec<Option<i32>> = case.wanted.iter().map(|column| column_value(&eval, column)).collect();
            if found != row.wanted {
                faults.push(format!("{}: {}: found {found:?}, wanted {:?}", case.name, row.text, row.wanted));
            }
        }
    }
    assert!(faults.is_empty(), "{faults:#?}");
}

#[test]
fn every_element_has_a_trace() {
    let mut found = BTreeSet::new();
    for case in table::cases() {
        let program = common::parse("test.ld", &case.program);
        found.extend(program.elements().map(|ProgramElement { element, .. }| element.facts().keyword));
    }
    let missing: Vec<&str> = ladder::element_keywords().filter(|keyword| !found.contains(keyword)).collect();
    assert_eq!(missing, ["PLACEHOLDER"], "tests/ladder has no trace of these; PLACEHOLDER has no meaning");
}
