//! Tests every refusal and every way to assign pins: program, options, and expected messages.

use crate::common::{cases, program};
use ladder_compile::{CompileOptions, compile};

#[test]
fn every_refusal_says_what_the_table_says() {
    for (name, sections) in cases(include_str!("data/refusals.txt")) {
        let [text, given, wanted] = sections.as_slice() else { panic!("{name}: program, options, refusals") };
        let mut options = CompileOptions { mcu: "atmega328p".to_owned(), ..CompileOptions::default() };
        for word in given.split_whitespace() {
            match word.split_once('=') {
                Some(("mcu", mcu)) => options.mcu = mcu.to_owned(),
                Some(("clock", hz)) => options.clock_hz = Some(hz.parse().expect("a clock")),
                Some((symbol, pin)) => options.pins.push(ladder_compile::PinAssignment::new(symbol, pin)),
                None => panic!("{name}: `{word}`"),
            }
        }
        let reported = match compile(&program(&unfold(text)), &options) {
            Ok(compiled) => compiled.notes,
            Err(errors) => errors,
        };
        let reported: Vec<String> = reported.iter().map(ToString::to_string).collect();
        let wanted: Vec<&str> = wanted.lines().collect();
        assert_eq!(reported.len(), wanted.len(), "{name}: {}", reported.join("\n"));
        for (reported, wanted) in reported.iter().zip(wanted) {
            assert!(reported.contains(wanted), "{name}: wanted `{wanted}`, reported `{reported}`");
        }
    }
}

/// Expands a line `3 x text #` to three lines, with `#` counting from 0.
fn unfold(text: &str) -> String {
    let mut out = String::new();
    for line in text.lines() {
        match line.split_once(" x ").and_then(|(n, rest)| Some((n.trim().parse::<u32>().ok()?, rest))) {
            Some((times, rest)) => {
                (0..times).for_each(|n| out += &(rest.replace('#', &n.to_string()).replace('|', "\n") + "\n"))
            }
            None => out += &format!("{line}\n"),
        }
    }
    out
}

/// Every code is in the table of refusals, or is listed here because no program can cause it.
#[test]
fn every_code_is_shown() {
    let table = include_str!("data/refusals.txt");
    // The reader and the checks of the language refuse these first; the codes guard programs built by other
    // means.
    let guards = ["LC002", "LC003", "LC004", "LC005", "LC006", "LC020", "LC099"];
    for code in ladder_compile::CODES {
        let shown = table.contains(code.code);
        assert_ne!(shown, guards.contains(&code.code), "{}", code.code);
    }
}
