//! What is told of a program for another chip of the same family, and for which chips there is a compiler.

use std::fs;
use std::path::Path;
use std::process::Command;

fn emu(args: &[&str]) -> String {
    let out = Command::new(env!("CARGO_BIN_EXE_emu")).args(args).output().expect("emu starts");
    String::from_utf8_lossy(&[out.stdout, out.stderr].concat()).into_owned()
}

/// Where `e_flags` begins in the header of an ELF32 file (System V ABI, chapter 4).
const E_FLAGS: usize = 0x24;

#[test]
fn elf_files_for_another_core_are_told() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let bytes = fs::read(root.join("tests/cli/in/main.elf")).expect("an image");
    // Core in the file, chip, what is told.
    let cases = [
        (5, "atmega328p", None),
        (5, "atmega64", None),
        (0, "atmega328p", None),
        (4, "atmega88pa", None),
        (51, "atmega128", None),
        (4, "atmega328p", Some("this is a program for avr4 cores, and atmega328p has an avr5 core")),
        (5, "atmega8", Some("this is a program for avr5 cores, and atmega8 has an avr4 core")),
        (51, "atmega64", Some("this is a program for avr51 cores, and atmega64 has an avr5 core")),
        (25, "atmega328p", Some("build it with -mmcu=atmega328p")),
    ];
    for (core, mcu, wanted) in cases {
        let mut bytes = bytes.clone();
        bytes[E_FLAGS] = bytes[E_FLAGS] & 0x80 | core;
        let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("core-{core}.elf"));
        fs::write(&file, bytes).expect("written");
        let told = emu(&["disasm", &file.to_string_lossy(), "--mcu", mcu]);
        match wanted {
            Some(wanted) => assert!(told.contains("CLI004") && told.contains(wanted), "{core} for {mcu}: {told}"),
            None => assert!(!told.contains("CLI004"), "{core} for {mcu}: {told}"),
        }
    }
}

/// There are more chips to run programs on than to compile ladder programs for.
#[test]
fn the_compiler_names_its_chips() {
    let program = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/welder.ld");
    for mcu in ["atmega168", "atmega8", "atmega128", "atmega48pa"] {
        for command in ["compile", "check"] {
            let told = emu(&[command, &program.to_string_lossy(), "--mcu", mcu]);
            let refused = told.contains("LC001") && told.contains("known are atmega328p, atmega328");
            assert!(refused, "{command} for {mcu}: {told}");
        }
    }
}
