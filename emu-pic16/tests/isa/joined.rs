//! A test and the GOTO after it execute as one op, which must not be visible.

use emu_core::{Cpu, StopReason};
use emu_pic16::Pic16;

use super::rig::{machine_with, put_word, word};

/// Tests that are one op with a GOTO; each with a byte at 20h for which it skips, and one for which it does
/// not.
const TESTS: [(&str, u8, u8); 6] = [
    ("btfsc 0x20, 3", 0xF7, 0x08),
    ("btfss 0x20, 3", 0x08, 0xF7),
    ("decfsz 0x20, F", 0x01, 0x00),
    ("incfsz 0x20, F", 0xFF, 0xFE),
    ("btfsc 0x03, 0", 0x00, 0xFF),
    ("btfss 0x03, 0", 0xFF, 0x00),
];

/// Returns a chip with `lines` at address 0, erased words after them, and `byte` at 20h and its lowest bit in
/// C.
fn machine(lines: &[&str], byte: u8) -> Pic16 {
    let words: Vec<u16> = lines.iter().map(|line| word(line)).collect();
    let mut pic = machine_with("pic16f873", 1, &words);
    assert!(pic.poke("data", 0x20, byte) && pic.set_reg("STATUS", (0x18 | byte & 1).into()));
    pic
}

/// Returns program counter, cycle and instruction count.
fn place(pic: &Pic16) -> (u32, u64, u64) {
    (pic.pc(), pic.cycle(), pic.instructions())
}

#[test]
fn they_stop_wherever_a_run_ends() {
    for (test, skips, goes) in TESTS {
        let program = [test, "goto 0x005", "nop", "nop", "nop", "nop", "nop"];
        for (limit, wanted) in [(1, (2, 2, 1)), (2, (2, 2, 1)), (3, (3, 3, 2)), (4, (4, 4, 3))] {
            let mut pic = machine(&program, skips);
            assert_eq!((pic.run(limit, &mut ()), place(&pic)), (StopReason::Limit, wanted), "{test} skips, to {limit}");
        }
        for (limit, wanted) in [(1, (1, 1, 1)), (2, (5, 3, 2)), (3, (5, 3, 2)), (4, (6, 4, 3))] {
            let mut pic = machine(&program, goes);
            assert_eq!((pic.run(limit, &mut ()), place(&pic)), (StopReason::Limit, wanted), "{test} goes, to {limit}");
        }
    }
}

#[test]
fn a_trap_on_the_goto_stops_before_it() {
    for (test, _, goes) in TESTS {
        let mut pic = machine(&[test, "goto 0x005"], goes);
        pic.set_breakpoint(1, true);
        let trapped = pic.clone();
        assert_eq!((pic.run(9, &mut ()), place(&pic)), (StopReason::Breakpoint { pc: 1 }, (1, 1, 1)), "{test}");
        let mut cleared = trapped;
        cleared.set_breakpoint(1, false);
        assert_eq!((cleared.run(2, &mut ()), place(&cleared)), (StopReason::Limit, (5, 3, 2)), "{test}, cleared");
    }
}

#[test]
fn a_word_written_over_either_of_them_counts() {
    for (test, _, goes) in TESTS {
        for (at, word, wanted) in [(0, "nop", (5, 3, 2)), (1, "nop", (3, 3, 3)), (1, "goto 0x007", (7, 3, 2))] {
            let mut pic = machine(&[test, "goto 0x005", "nop", "nop"], goes);
            put_word(&mut pic, at, self::word(word));
            let until = if at == 1 && wanted.2 == 3 { 3 } else { 2 };
            assert_eq!((pic.run(until, &mut ()), place(&pic)), (StopReason::Limit, wanted), "{test}, {word} at {at}");
        }
    }
}
