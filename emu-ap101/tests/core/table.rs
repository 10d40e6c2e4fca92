//! The table: text to word and back, and words that have no text of their own.

use emu_ap101::chips::AP101;
use emu_ap101::isa::{self, KINDS, ROWS};

/// A word, and its text as it is printed.
const TEXTS: &str = "
0000 LD    I0
0001 LD    I1
01FF LD    I511
0201 LD    E1
0485 LD    R133
0601 LD    M1
072C LD    M300
0801 LD    I1,X
1002 LDC   I2
2201 STO   E1
3A05 STOC  E5,X
4601 STC   M1
4C80 STC   R128,X
5600 RTC   M0
6003 AND   I3
7003 ANDC  I3
8204 OR    E4
9FFF ORC   M511,X
A001 XOR   I1
B000 NOT
C000 CLR
D000 JMP   0x000
D7FF JMP   0x7FF
D812 JMP   0x012,X
E034 JMPC  0x034
E834 JMPC  0x034,X
FFFF NOP
2501 STO   R257
";

/// Words that print as raw words, because their text would give another word.
const RAW: &str = "
B001 .word 0xb001  ; NOT
BFFF .word 0xbfff  ; NOT
C800 .word 0xc800  ; CLR
F000 .word 0xf000  ; NOP   0
F064 .word 0xf064  ; NOP   100
FFFE .word 0xfffe  ; NOP   4094
";

#[test]
fn words_and_their_texts() {
    for line in TEXTS.lines().chain(RAW.lines()).filter(|line| !line.is_empty()) {
        let (word, text) = line.split_once(' ').expect("a word and a text");
        let word = u16::from_str_radix(word, 16).expect("hex");
        assert_eq!(isa::disassemble(&[word], 0).text, text, "{word:04X}");
        assert_eq!(emu_asm::assemble_line(&AP101, text, 0), Ok(vec![word]), "{text}");
    }
}

#[test]
fn every_word_comes_back_from_its_text() {
    for word in 0..=u16::MAX {
        let text = isa::disassemble(&[word], 0).text;
        // STC and RTC of an input, and addresses that no machine has, are valid words, but a source must not
        // contain them.
        let zone = |letter| text.get(6..).and_then(|operand| operand.strip_prefix(letter));
        let number = |text: &str| text.trim_end_matches(",X").parse().unwrap_or(0);
        let nowhere = zone('E').is_some_and(|n| number(n) > 255) || zone('R').is_some_and(|n| number(n) > 383);
        let said = !nowhere && !text.starts_with("STC   I") && !text.starts_with("RTC   I");
        assert_eq!(emu_asm::assemble_line(&AP101, &text, 0).ok(), said.then(|| vec![word]), "{word:04X} {text}");
    }
}

#[test]
fn every_row_is_in_the_table_of_texts() {
    let shown: Vec<_> = TEXTS.lines().filter_map(|line| u16::from_str_radix(line.get(..4)?, 16).ok()).collect();
    let missing: Vec<_> = ROWS
        .iter()
        .zip(KINDS)
        .filter(|(row, kind)| row.name != "NopData" && !shown.iter().any(|&word| isa::find_row(word).kind == **kind))
        .map(|(row, _)| row.name)
        // One of the two addressing modes is enough.
        .filter(|name| !["LdcX", "StoX", "RtcX", "AndX", "AndcX", "OrX", "XorX", "Orc", "Stoc"].contains(name))
        .collect();
    assert!(missing.is_empty(), "{missing:?}");
}

#[test]
fn what_does_not_fit_is_refused() {
    for text in
        ["ld I512", "ld E512", "sto R512", "and M512", "ld Q1", "ld 2048", "jmp 2048", "jmp -1", "nop 5", "not I1"]
    {
        assert!(emu_asm::assemble_line(&AP101, text, 0).is_err(), "{text}");
    }
}
