//! Messages about programs for another chip of the same family, and the list of chips with a compiler.

use std::fs;
use std::path::Path;
use std::process::Command;

fn emu(args: &[&str]) -> String {
    let out = Command::new(env!("CARGO_BIN_EXE_emu")).args(args).output().expect("emu starts");
    String::from_utf8_lossy(&[out.stdout, out.stderr].concat()).into_owned()
}

/// Offset of `e_flags` in the header of an ELF32 file (System V ABI, chapter 4).
const E_FLAGS: usize = 0x24;

#[test]
fn elf_files_for_another_core_are_reported() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let bytes = fs::read(root.join("tests/cli/in/main.elf")).expect("an image");
    // Core in the file, chip, expected message.
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
        let messages = emu(&["disasm", &file.to_string_lossy(), "--mcu", mcu]);
        match wanted {
            Some(wanted) => {
                assert!(messages.contains("CLI004") && messages.contains(wanted), "{core} for {mcu}: {messages}")
            }
            None => assert!(!messages.contains("CLI004"), "{core} for {mcu}: {messages}"),
        }
    }
}

/// Disassembles the ELF file `bytes` for a chip, and compares the message about the chip; `None` means no
/// message.
fn compare(name: &str, bytes: &[u8], mcu: &str, wanted: Option<&str>) {
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::write(&file, bytes).expect("written");
    let messages = emu(&["disasm", &file.to_string_lossy(), "--mcu", mcu]);
    match wanted {
        Some(wanted) => {
            assert!(messages.contains("[CLI004]") && messages.contains(wanted), "{name} for {mcu}: {messages}")
        }
        None => assert!(!messages.contains("CLI004"), "{name} for {mcu}: {messages}"),
    }
}

/// Replaces the only occurrence of `old`.
fn patched(bytes: &[u8], old: &[u8], new: &[u8]) -> Vec<u8> {
    let places: Vec<usize> = (0..bytes.len()).filter(|&at| bytes[at..].starts_with(old)).collect();
    assert_eq!((places.len(), old.len()), (1, new.len()), "{old:?}");
    let mut bytes = bytes.to_vec();
    bytes[places[0]..][..new.len()].copy_from_slice(new);
    bytes
}

/// The name of the chip in the note that compilers write.
#[test]
fn elf_files_for_another_chip_are_reported() {
    let bytes = fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/avr/millis.elf")).expect("an image");
    let hint = |mcu: &str| format!("hint: --mcu atmega328p, or build it with -mmcu={mcu}");
    for mcu in
        ["atmega32", "atmega16", "atmega64", "atmega128", "atmega162", "atmega644", "atmega168", "atmega88", "atmega8"]
    {
        compare("device.elf", &bytes, mcu, Some(&format!("this is a program for atmega328p, not for {mcu}")));
        compare("device.elf", &bytes, mcu, Some(&hint(mcu)));
    }
    // Name in the note, chip, expected message.
    let cases: [(&[u8; 11], &str, Option<&str>); 11] = [
        (b"atmega328p\0", "atmega328p", None),
        (b"atmega328p\0", "atmega328", None),
        (b"atmega328\0\0", "atmega328p", None),
        (b"atmega168pa", "atmega168", None),
        (b"atmega168a\0", "atmega328p", None),
        (b"atmega64a\0\0", "atmega64", None),
        (b"atmega64a\0\0", "atmega328p", Some("hint: --mcu atmega64, or build it with -mmcu=atmega328p")),
        (b"attiny85\0\0\0", "atmega328p", Some("for attiny85, for which emu has no model, not for atmega328p")),
        (b"attiny85\0\0\0", "atmega32", Some("hint: build it with -mmcu=atmega32)")),
        // Without a valid name, the core decides.
        (b"atmega 328p", "atmega32", None),
        (b"\0\0\0\0\0\0\0\0\0\0\0", "atmega128", Some("this is a program for avr5 cores")),
    ];
    for (name, mcu, wanted) in cases {
        compare("named.elf", &patched(&bytes, b"atmega328p\0", name), mcu, wanted);
    }
}

/// A note in which any word has any value is read or ignored, and the program loads.
#[test]
fn damaged_notes_leave_the_core() {
    let bytes = fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/avr/millis.elf")).expect("an image");
    let start = bytes.windows(15).position(|some| some.starts_with(b"AVR\0\0\0\0\0")).expect("a note") - 12;
    let words = [0, 4, 8, 40, 44];
    for value in [0, 1, 7, 0x2C, 0x7FFF_FFFF, u32::MAX] {
        for word in words {
            let mut bytes = bytes.clone();
            bytes[start + word..][..4].copy_from_slice(&u32::to_le_bytes(value));
            let whole = value == 1 && (word == 8 || word == 44);
            // An offset into the name gives the rest of the name.
            let found = emu_core::image::avr_device(&bytes);
            match (word, value) {
                _ if whole => assert_eq!(found.as_deref(), Some("atmega328p")),
                (44, 7) => assert_eq!(found.as_deref(), Some("328p")),
                (4, 0x2C) => assert_eq!(found.as_deref(), Some("atmega328p")),
                _ => assert_eq!(found, None, "{word} {value:x}"),
            }
        }
    }
    for len in 0..bytes.len().min(4096) {
        _ = emu_core::image::avr_device(&bytes[..len]);
        _ = emu_core::image::avr_signature(&bytes[..len]);
    }
}

/// The signature of the program decides if it has no note.
#[test]
fn signatures_are_reported() {
    let bytes = fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/avr/millis.elf")).expect("an image");
    let bytes = patched(&bytes, b"AVR\0\0\0\0\0", b"AVS\0\0\0\0\0");
    let mut bytes = patched(&bytes, b".debug_str", b".signature");
    let word = |bytes: &[u8], at: usize| u32::from_le_bytes(bytes[at..][..4].try_into().expect("a word")) as usize;
    // The header of section 9 (System V ABI, "Section Header"): offset and size.
    let header = word(&bytes, 0x20) + 9 * 40;
    let at = word(&bytes, header + 16);
    bytes[header + 20..][..4].copy_from_slice(&3u32.to_le_bytes());
    // In the order of the file, last byte first.
    let cases: [([u8; 3], &str, Option<&str>); 6] = [
        ([0x0F, 0x95, 0x1E], "atmega328p", None),
        ([0x0F, 0x95, 0x1E], "atmega328", None),
        ([0x06, 0x94, 0x1E], "atmega328p", None),
        ([0x0F, 0x95, 0x1E], "atmega32", Some("for the signature 1E 95 0F of atmega328p; atmega32 has 1E 95 02")),
        ([0x0F, 0x95, 0x1E], "atmega32", Some("hint: --mcu atmega328p, or build it with -mmcu=atmega32")),
        ([0x0B, 0x93, 0x1E], "atmega328p", Some("1E 93 0B, for which emu has no model; atmega328p has 1E 95 0F")),
    ];
    for (signature, mcu, wanted) in cases {
        bytes[at..][..3].copy_from_slice(&signature);
        compare("signed.elf", &bytes, mcu, wanted);
    }
}

/// More chips can run programs than have a compiler for ladder programs.
#[test]
fn the_compiler_names_its_chips() {
    let program = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/welder.ld");
    for mcu in ["atmega168pa", "80c51", "pic16f84a", "atmega48pa"] {
        for command in ["compile", "check"] {
            let messages = emu(&[command, &program.to_string_lossy(), "--mcu", mcu]);
            let refused = messages.contains("LC001") && messages.contains("known are atmega328p, atmega328, atmega168");
            assert!(refused, "{command} for {mcu}: {messages}");
        }
    }
}
