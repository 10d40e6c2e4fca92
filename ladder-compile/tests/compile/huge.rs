//! Tests programs far too large for any chip, or large in one way: every back end compiles or refuses them
//! with numbers.
//!
//! No program may give an internal error or a panic.

use crate::common::program;
use ladder_compile::{CompileOptions, compile};

/// Codes with which such a program may be refused: missing parts of the chip, a scan that is too long, code,
/// RAM.
const EXPECTED: [&str; 4] = ["LC007", "LC022", "LC030", "LC031"];

/// One chip of each kind: only relative jumps, long jumps, one page, several pages, bytes as words, modules.
const CHIPS: [&str; 6] = ["atmega8", "atmega162", "pic16f628", "pic16f877", "8051", "ap101"];

/// Name, number of copies of the rung, and the rung: `|` ends a line, `#` is the number of the copy, `<n
/// text>` repeats a text.
#[rustfmt::skip]
const PROGRAMS: &[(&str, u32, &str)] = &[
    ("short rungs",            2_000, "CONTACTS Xa 0|COIL Yb 0 0 0"),
    ("latches",                  900, "CONTACTS Xa 0|OSR|COIL Rc# 0 1 0"),
    ("long rungs",               500, "<3 CONTACTS Rc 0|PARALLEL|CONTACTS Xa 1|SERIES|CONTACTS Rd 0|CONTACTS Re 1|END|END|>COIL Yb 0 0 0"),
    ("edges",                    900, "CONTACTS Xa 0|OSR|OSF|COIL Yb 0 0 1"),
    ("arithmetic",               300, "CONTACTS Xa 0|PARALLEL|MUL a b c|DIV b a 7|SUB c # a|END"),
    ("comparisons",              500, "GRT a b|LES b #|NEQ a c|COIL Yb 0 0 0"),
    ("timers",                 1_000, "CONTACTS Xa 0|TON T# 500000|COIL Yb 0 0 0"),
    ("one timer often",          400, "CONTACTS Xa 0|TON Ta 500000|COIL Yb 0 0 0"),
    ("counters",                 300, "CONTACTS Xa 0|CTU C# 30|COIL Yb 0 0 0"),
    ("tables",                   300, "LOOK_UP_TABLE d i 16 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 #"),
    ("curves",                   200, "PIECEWISE_LINEAR d i 4 0 0 10 # 20 7 100 300"),
    ("a long series",              1, "<5000 CONTACTS Xa 0|>COIL Yb 0 0 0"),
    ("a wide group",               1, "PARALLEL|<5000 CONTACTS Xa 0|>END|COIL Yb 0 0 0"),
    ("a wide rung of quotients",   1, "CONTACTS Xa 0|PARALLEL|<900 DIV a b a|>END"),
    ("deep groups",                1, "<30 PARALLEL|CONTACTS Xa 0|SERIES|CONTACTS Xb 1|><30 END|END|>COIL Yb 0 0 0"),
    ("many deep groups",          60, "<30 PARALLEL|CONTACTS Xa 0|SERIES|CONTACTS Xb 1|><30 END|END|>COIL Yb 0 0 0"),
    ("deep timers",                1, "<30 PARALLEL|CONTACTS Xa 0|SERIES|TON Ta 500000|><30 END|END|>COIL Yb 0 0 0"),
];

#[test]
fn nothing_is_a_fault_of_the_compiler() {
    for &(name, times, rung) in PROGRAMS {
        let rung = unfold(rung).replace('|', "\n");
        let rungs: String = (0..times).map(|n| format!("RUNG\n{}\nEND\n", rung.replace('#', &n.to_string()))).collect();
        let text = format!("LDmicro0.1\nCYCLE=100000\nCRYSTAL=8000000\nBAUD=2400\nIO LIST\nEND\nPROGRAM\n{rungs}");
        let program = program(&text);
        for mcu in CHIPS {
            for optimise in [true, false] {
                let outcome =
                    compile(&program, &CompileOptions { mcu: mcu.to_owned(), optimise, ..CompileOptions::default() });
                let Err(reported) = outcome else { continue };
                for one in &reported {
                    assert!(EXPECTED.contains(&one.code), "{name} on {mcu}, optimised {optimise}: {one}");
                }
                // A refusal for size names the largest rungs.
                let full = reported.iter().find(|one| one.code == "LC030");
                assert!(
                    full.is_none_or(|one| one.to_string().contains("; most in rung ")),
                    "{name} on {mcu}: {full:?}"
                );
            }
        }
    }
}

/// Replaces `<n text>` by n copies of the text.
fn unfold(text: &str) -> String {
    let mut out = String::new();
    for (n, piece) in text.split('<').enumerate() {
        match piece.split_once('>').filter(|_| n > 0) {
            Some((repeated, rest)) => {
                let (times, what) = repeated.split_once(' ').expect("a number and a text");
                out += &what.repeat(times.parse().expect("a number"));
                out += rest;
            }
            None => out += piece,
        }
    }
    out
}
