//! Compares words as the crate prints them with the fields of the reference.

use emu_ap101::chips::AP101;

use super::asm::assemble;
use super::decode::{OPS, Op, decode};

fn text(word: u16) -> String {
    (AP101.isa.disassemble)(&[word], 0).text.trim().to_string()
}

#[test]
fn a_word_has_one_name_and_a_name_one_code() {
    let mut seen = [[0_u32; 2]; 16];
    for word in 0..=0xFFFF_u16 {
        let (fields, text) = (decode(word), text(word));
        let name = text.split_whitespace().next().unwrap_or("");
        let data = matches!(fields.op, Op::Not | Op::Clr | Op::Nop);
        let wanted = OPS[usize::from(word >> 12)].0;
        // Words with fields that have no meaning are printed as numbers.
        if name == ".word" {
            assert!(data || matches!(fields.op, Op::Stc | Op::Rtc), "{word:04x}: {text}");
            continue;
        }
        assert_eq!(name, wanted, "{word:04x}: {text}");
        assert_eq!(text.ends_with(",X"), fields.indexed && !data, "{word:04x}: {text}");
        seen[usize::from(word >> 12)][usize::from(fields.indexed)] += 1;
    }
    for ((name, op), seen) in OPS.iter().zip(seen) {
        let plain = matches!(op, Op::Not | Op::Clr | Op::Nop);
        assert!(if plain { seen[0] + seen[1] > 0 } else { seen[0] > 0 && seen[1] > 0 }, "{name}: {seen:?}");
    }
    let names: std::collections::BTreeSet<_> = OPS.iter().map(|op| op.0).collect();
    assert_eq!(names.len(), 16, "two instructions of one name");
}

#[test]
fn programs_read_back_as_they_were_written() {
    let source = [
        "LD I1",
        "LDC I511",
        "STO E0",
        "STOC E255",
        "STC M0",
        "RTC M255",
        "AND R0",
        "ANDC R127",
        "OR R133",
        "ORC M300",
        "XOR E7",
        "LD I1,X",
        "STO M5,X",
        "AND R2,X",
        "NOT",
        "CLR",
        "NOP",
    ];
    let bytes = assemble(&source.join("\n"));
    for (at, line) in source.iter().enumerate() {
        let word = u16::from_le_bytes([bytes[2 * at], bytes[2 * at + 1]].map(|byte| byte.expect("a word")));
        let printed: Vec<String> = text(word).split_whitespace().map(str::to_string).collect();
        assert_eq!(printed.join(" "), *line, "{word:04x}");
    }
    // One line that becomes two words.
    let bytes = assemble("TIM R1,#50");
    let words: Vec<_> = bytes.iter().take(4).map(|byte| byte.expect("a byte")).collect();
    assert_eq!(words, [0x01, 0x25, 0x32, 0xF0]);
    assert_eq!(bytes[4], None);
}
