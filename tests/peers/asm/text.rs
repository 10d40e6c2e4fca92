//! Texts in any encoding: each byte of a string, a character or a comment gives the same code bytes as in
//! each assembler.

use emu_asm::{AssembleOptions, assemble};
use emu_test_support::test_folder;

use crate::corpus::differences;
use crate::judges::{Judge, cells};

/// Bytes that are not ASCII: from code pages, from UTF-8, from both.
const TEXTS: &[&[u8]] = &[
    b"\xBF",
    b"\xE9",
    b"\x80",
    b"\xFF",
    b"\xA0",
    b"\x85",
    b"\xE9\xBF",
    "\u{e9}".as_bytes(),
    "\u{20ac}".as_bytes(),
    "\u{ef80}".as_bytes(),
    b"\xC3\xA9\xE9",
];

/// Lines of each dialect; `@` is replaced by a text.
const LINES: &[(Judge, &str, &str, &[&str])] = &[
    (
        Judge::Gpasm,
        "pic16f84a",
        " list p=16f84a\n org 0\n@\n end\n",
        &[
            " dt \"@\"",
            " dt \"a@b\", \"@\"",
            " dw \"@\"",
            " db \"@\"",
            " data \"@\"",
            " de \"@\"",
            " movlw '@'",
            " retlw '@'",
            " nop ; @",
            " dt \"\\@\"",
            "m macro x\n dt x\n endm\n m \"@\"",
            "#define t \"@\"\n dt t",
            "v equ '@'\n movlw v",
        ],
    ),
    (Judge::As31, "at89s52", " .org 0\n@\n", &[" .db \"@\"", " .db \"a@b\", 1", " mov a,#'@'", " nop ; @"]),
    (
        Judge::Sdas,
        "at89s52",
        " .area CODE (ABS)\n .org 0\n@\n",
        &[" .ascii \"@\"", " .asciz \"a@b\"", " .ascii /@/", " mov a,#'@", " nop ; @"],
    ),
    (
        Judge::Avr,
        "atmega328p",
        "@\n",
        &[
            ".ascii \"@\"",
            ".asciz \"a@b\"",
            ".string \"@\"",
            ".byte '@'",
            "ldi r16, '@'",
            ".byte '@",
            "nop ; @",
            "/* @ */ nop",
            ".macro m x\n.ascii \"\\x\"\n.endm\nm @",
        ],
    ),
];

/// If the assembler accepts a line, ours gives the same bytes.
#[test]
#[ignore = "needs as31, sdcc, gputils, binutils-avr and avr-libc: .ci/peers installs them"]
fn texts_of_any_encoding() {
    let mut wrong = Vec::new();
    for (judge, chip, frame, lines) in LINES {
        let (home, chip, mut same) = (test_folder!(&format!("asm-text-{}", judge.name())), judge.chip(chip), 0);
        for line in *lines {
            for text in TEXTS {
                let whole = frame.replacen('@', line, 1);
                let pieces: Vec<&[u8]> = whole.as_bytes().split(|byte| *byte == b'@').collect();
                let source = pieces.join(*text);
                std::fs::write(home.join("text.s"), &source).expect("a source");
                let theirs = judge.assemble(&home, "text.s", chip, &home);
                let Some(theirs) = theirs.cells.filter(|_| !theirs.said.iter().any(|said| said.contains("rror")))
                else {
                    continue;
                };
                let ours = emu_asm::SourceText { name: "text.s", bytes: &source };
                match assemble(&ours, chip, &AssembleOptions::default(), &mut ()) {
                    Ok(ours) if differences(chip, &theirs, &cells(&ours.image)).is_empty() => same += 1,
                    ours => wrong.push(format!("{} {line} {text:02X?}: {ours:?}", judge.name())),
                }
            }
        }
        println!("{}: {same} lines", judge.name());
        assert!(same > 30, "{}", judge.name());
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
