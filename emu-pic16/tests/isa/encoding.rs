//! All 16,384 program words: to text and back, and which of them are not instructions.

use emu_pic16::chips::PIC16F873;
use emu_pic16::isa::{Pic16Row, ROWS, disassemble, encode, find_row};

/// First and last words without a row (DS33023, table 29-2). Of the words with 0s above bit 6 only NOP,
/// RETURN, RETFIE, OPTION, SLEEP, CLRWDT and TRIS of ports A to C are instructions; 11 1011 is not an
/// instruction.
const RESERVED: &[(u16, u16)] = &[
    (0x0001, 0x0007),
    (0x000A, 0x001F),
    (0x0021, 0x003F),
    (0x0041, 0x005F),
    (0x0061, 0x0061),
    (0x0068, 0x007F),
    (0x3B00, 0x3BFF),
];

/// Mnemonics by the upper bits: pattern with a dot for every bit that does not matter, typed from table 29-2.
const MNEMONICS: &[(&str, &str)] = &[
    ("000111........", "addwf"),
    ("000101........", "andwf"),
    ("0000011.......", "clrf"),
    ("0000010.......", "clrw"),
    ("001001........", "comf"),
    ("000011........", "decf"),
    ("001011........", "decfsz"),
    ("001010........", "incf"),
    ("001111........", "incfsz"),
    ("000100........", "iorwf"),
    ("001000........", "movf"),
    ("0000001.......", "movwf"),
    ("0000000..00000", "nop"),
    ("001101........", "rlf"),
    ("001100........", "rrf"),
    ("000010........", "subwf"),
    ("001110........", "swapf"),
    ("000110........", "xorwf"),
    ("0100..........", "bcf"),
    ("0101..........", "bsf"),
    ("0110..........", "btfsc"),
    ("0111..........", "btfss"),
    ("11111.........", "addlw"),
    ("111001........", "andlw"),
    ("100...........", "call"),
    ("00000001100100", "clrwdt"),
    ("101...........", "goto"),
    ("111000........", "iorlw"),
    ("1100..........", "movlw"),
    ("00000000001001", "retfie"),
    ("1101..........", "retlw"),
    ("00000000001000", "return"),
    ("00000001100011", "sleep"),
    ("11110.........", "sublw"),
    ("111010........", "xorlw"),
    ("00000001100010", "option"),
    ("00000001100101", "tris"),
    ("00000001100110", "tris"),
    ("00000001100111", "tris"),
];

fn matches(pattern: &str, word: u16) -> bool {
    pattern.len() == 14
        && pattern.bytes().rev().enumerate().all(|(n, c)| c == b'.' || c - b'0' == (word >> n & 1) as u8)
}

#[test]
fn every_word_is_what_the_manual_says() {
    let mut patterns = [0; MNEMONICS.len()];
    for word in 0..0x4000 {
        let found = find_row(word).map(|Pic16Row { row, .. }| row.mnemonic);
        let mut wanted = MNEMONICS.iter().enumerate().filter(|(_, row)| matches(row.0, word));
        let first = wanted.next();
        assert_eq!(found, first.map(|(_, row)| row.1), "{word:04x}");
        assert!(wanted.next().is_none(), "{word:04x}: the table of this test is ambiguous");
        if let Some((n, _)) = first {
            patterns[n] += 1;
        }
        let reserved = RESERVED.iter().any(|range| (range.0..=range.1).contains(&word));
        assert_eq!(found.is_none(), reserved, "{word:04x}");
    }
    assert!(patterns.iter().all(|&words| words > 0), "{patterns:?}");
}

/// A word that disassembles to an instruction assembles to itself. A word with nonzero open bits, or without
/// a row, disassembles to a data word.
#[test]
fn text_assembles_to_the_word_it_came_from() {
    let mut instructions = 0;
    for word in 0..0x4000u16 {
        let line = disassemble(&[word], 0x0123);
        assert_eq!(line.len, 1, "{word:04x}");
        let text = line.text.split(';').next().unwrap_or_default().trim();
        match text.strip_prefix(".word ") {
            Some(value) => assert_eq!(value, format!("0x{word:04X}").to_lowercase(), "{word:04x}"),
            None => instructions += 1,
        }
        assert_eq!(
            emu_asm::assemble_line(&PIC16F873.chip, text, 0x0123).map_err(|e| e.to_string()),
            Ok(vec![word]),
            "{word:04x}: {text}"
        );
        assert_eq!(line.row.is_none(), text.starts_with(".word"), "{word:04x}: {text}");
    }
    // 14 rows of 256, CLRF and MOVWF of 128, four of bits of 1,024, CALL and GOTO of 2,048, seven constants
    // of 256; without operands (CLRW, NOP, CLRWDT, RETFIE, RETURN, SLEEP, OPTION) seven, with a port three.
    assert_eq!(instructions, 14 * 256 + 2 * 128 + 4 * 1024 + 2 * 2048 + 7 * 256 + 7 + 3);
}

/// Operands in row order encode to the word that the assembler gives.
#[test]
fn encoding_and_assembly_agree() {
    let table: &[(&str, &[i32], u16)] = &[
        ("addwf 0x25, W", &[0x25], 0x0725),
        ("addwf 0x25, F", &[0x25], 0x07A5),
        ("clrf 0x7F", &[0x7F], 0x01FF),
        ("bcf 0x03, 5", &[3, 5], 0x1283),
        ("bsf 0x0B, 7", &[0x0B, 7], 0x178B),
        ("btfsc 0x20, 0", &[0x20, 0], 0x1820),
        ("btfss 0x20, 7", &[0x20, 7], 0x1FA0),
        ("movlw 0x3F", &[0x3F], 0x303F),
        ("movlw -1", &[-1], 0x30FF),
        ("call 0x7FF", &[0x7FF], 0x27FF),
        ("goto 0x0FFF", &[0xFFF], 0x2FFF),
        ("retlw 0xA5", &[0xA5], 0x34A5),
        ("movwf 0x1A0", &[0x1A0], 0x00A0),
        ("tris 6", &[], 0x0066),
        ("clrwdt", &[], 0x0064),
    ];
    for &(line, operands, word) in table {
        assert_eq!(
            emu_asm::assemble_line(&PIC16F873.chip, line, 0).map_err(|e| e.to_string()),
            Ok(vec![word]),
            "{line}"
        );
        let Pic16Row { kind, .. } = find_row(word).unwrap_or_else(|| panic!("{line}"));
        assert_eq!(encode(kind, operands).map_err(|e| e.to_string()), Ok(word), "{line}");
    }
    // Operands beyond their field: gpasm 1.4.0 keeps the low bits and warns (202, 219, or not at all); the
    // assembler does the same.
    let cut: &[(&str, u16)] = &[
        ("movlw 0x100", 0x3000),
        ("movlw -0x81", 0x307F),
        ("bcf 0x20, 8", 0x1020),
        ("addwf 0x200, W", 0x0700),
        ("addwf 0x25, 2", 0x0725),
        ("goto 0x2000", 0x2800),
    ];
    for &(line, word) in cut {
        assert_eq!(
            emu_asm::assemble_line(&PIC16F873.chip, line, 0).map_err(|e| e.to_string()),
            Ok(vec![word]),
            "{line}"
        );
    }
    // The chip has no port above C: TRIS accepts 5 to 7.
    assert!(emu_asm::assemble_line(&PIC16F873.chip, "tris 8", 0).is_err());
    assert_eq!(ROWS.len(), 14 * 2 + 4 + 4 + 17);
}
