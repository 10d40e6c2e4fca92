//! Tests which names can be labels in text that assembles back to the same image.

use emu_core::chip::Chip;
use emu_core::image::{Image, Segment, SourceLines, SymbolAt};
use emu_debug::{AddressNames, ProgramSource};

use super::pieces::ProgramMemory;
use super::text::AssemblableText;

/// Chip, bytes of the program, names as `name@byte address`, and the expected text.
const CASES: &[(&str, &[u8], &str, &str)] = &[
    // Names of instructions, registers, bits, directives and functions cannot be labels, in any letter case.
    // Nor can names that the assembler cannot parse or that are already defined.
    (
        "atmega328p",
        &[0x00, 0x00, 0x0C, 0x94, 0x00, 0x00, 0x00, 0x00],
        "LDI@0 main@0 PORTB@0 portb5@0 r16@0 XL@0 org@0 lo8@0 a.b@0 Main@2 start@2 half@4 end_of_it@6",
        "\
; LDI:
main:
; PORTB:
; portb5:
; r16:
; XL:
; org:
; lo8:
; a.b:
    nop                         ; 0000  0000
; Main:
start:
; half = 0002 + 2
    jmp   0x0000                ; 0002  940C 0000  a.b
end_of_it:
    nop                         ; 0006  0000
; 0008 to 7FFF erased, 32760 bytes
",
    ),
    (
        "8052",
        &[0x00, 0x22],
        "A@0 acc@0 P1@0 EA@0 RXD@0 _main@0 C@1 DPTR@1 ret@1 loop@1",
        "\
; A:
; acc:
; P1:
; EA:
; RXD:
_main:
    nop                         ; 0000  00
; C:
; DPTR:
; ret:
loop:
    ret                         ; 0001  22
; 0002 to FFFF erased, 65534 bytes
",
    ),
    (
        "pic16f84",
        &[0x08, 0x00],
        "W@0 F@0 PORTB@0 RP0@0 _WDT_OFF@0 Org@0 delay@0",
        "\
; W:
; F:
; PORTB:
; RP0:
; _WDT_OFF:
; Org:
delay:
    return                      ; 0000  0008
; 0001 to 03FF erased, 1023 words
",
    ),
];

/// A source cannot set an input, although a program may contain the word.
#[test]
fn words_that_no_source_may_say_are_words() {
    let chip = emu_ap101::chips::chips().next().expect("a chip");
    let stc = chip.isa.rows.iter().find(|row| row.mnemonic == "stc").expect("an instruction");
    let words = [stc.pattern.value as u16, 0];
    let image = Image {
        segments: vec![Segment {
            space: chip.code_space,
            addr: 0,
            bytes: words.iter().flat_map(|word| word.to_le_bytes()).collect(),
        }],
        ..Image::default()
    };
    let lines = SourceLines::default();
    let source = ProgramSource { names: AddressNames { chip, symbols: &[] }, lines: &lines };
    let mut text = AssemblableText::new(&source);
    text.program(&ProgramMemory::new(chip, &image).pieces(0, 2), None);
    let text = text.finish();
    assert!(text.starts_with("    .word 0x") && text.contains("STC   I0"), "{text}");
    assert_eq!(emu_asm::assemble_text(chip, &text).expect("a program").segments, image.segments);
}

fn chip(name: &str) -> &'static Chip {
    let avr = emu_avr::chips::chip(name).or_else(|| emu_8051::chips::chip(name));
    avr.or_else(|| emu_pic16::chips::chip(name)).expect("a chip")
}

#[test]
fn only_names_that_mean_nothing_else_are_labels() {
    for &(name, bytes, names, wanted) in CASES {
        let chip = chip(name);
        let symbols = names.split(' ').filter_map(|name| name.split_once('@'));
        let symbols =
            symbols.map(|(name, addr)| SymbolAt::new(name, chip.code_space, addr.parse().expect("an address"), 0));
        let symbols: Vec<SymbolAt> = symbols.collect();
        let segments = vec![Segment { space: chip.code_space, addr: 0, bytes: bytes.to_vec() }];
        let image = Image { segments, ..Image::default() };
        let lines = SourceLines::default();
        let source = ProgramSource { names: AddressNames { chip, symbols: &symbols }, lines: &lines };
        let mut text = AssemblableText::new(&source);
        text.program(&ProgramMemory::new(chip, &image).pieces(0, chip.flash_bytes / chip.word_bytes), None);
        let text = text.finish();
        assert_eq!(text, wanted, "{name}");
        assert_eq!(emu_asm::assemble_text(chip, &text).expect("a program").segments, image.segments, "{name}");
    }
}
