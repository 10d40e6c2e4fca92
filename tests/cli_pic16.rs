//! The guess of another chip (CLI004) never appears for an image of the chip that was named.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn emu(args: &[&str]) -> String {
    let out = Command::new(env!("CARGO_BIN_EXE_emu")).args(args).output().expect("emu starts");
    String::from_utf8_lossy(&[out.stdout, out.stderr].concat()).into_owned()
}

fn hex_files(folder: &str) -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let entries = fs::read_dir(root.join(folder)).expect("a folder of images");
    let files = entries.map(|entry| entry.expect("an entry").path());
    files.filter(|file| file.extension().is_some_and(|ending| ending == "hex")).collect()
}

/// Folder, part of the file name, chips that the images are for.
const IMAGES: &[(&str, &str, &[&str])] = &[
    ("examples/8051", "", &["8051", "8052", "at89s52"]),
    ("examples/pic16", "blink", &["pic16f873", "pic16f84a", "pic16f628a", "pic16f877a"]),
    ("examples/pic16", "hello", &["pic16f877a", "pic16f628a", "pic16f88"]),
    ("tests/cli/in", "51.hex", &["8051", "at89s52", "at89c2051"]),
    (
        "tests/cli/in",
        "16.hex",
        &["pic16c71", "pic16f84a", "pic16f628a", "pic16f819", "pic16f88", "pic16f873", "pic16f877a"],
    ),
    ("emu-core/tests/image", "", &["atmega328p", "8051"]),
];

#[test]
fn no_false_alarms() {
    let mut tried = 0;
    let mut look = |file: &Path, mcu: &str| {
        // A comment that names the chip is no guess.
        if fs::read(file).is_ok_and(|text| text.split(|c| *c == b'\n').any(|line| line.starts_with(b";"))) {
            return;
        }
        let messages = emu(&["disasm", &file.to_string_lossy(), "--mcu", mcu]);
        assert!(!messages.contains("CLI004"), "{} for {mcu}: {messages}", file.display());
        tried += 1;
    };
    for (folder, part, chips) in IMAGES {
        for file in hex_files(folder).iter().filter(|file| file.to_string_lossy().contains(part)) {
            chips.iter().for_each(|mcu| look(file, mcu));
        }
    }
    for file in hex_files("tests/cli/in") {
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if !["51.hex", "16.hex", "101.hex"].iter().any(|end| name.ends_with(end)) {
            look(&file, "atmega328p");
        }
    }
    assert!(tried > 100, "only {tried} were tried");
}

/// Programs of the ladder compiler are AVR programs of some size that begin without a jump: no warning for an
/// AVR, a warning for a PIC16.
#[test]
fn compiled_programs() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    for name in ["blinker", "garage", "modulo5", "press", "traffic", "welder"] {
        let program = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("examples/{name}.ld"));
        let image = folder.join(format!("guess-{name}.hex")).to_string_lossy().into_owned();
        emu(&["compile", &program.to_string_lossy(), "--mcu", "atmega328p", "-o", &image]);
        assert!(!emu(&["disasm", &image, "--mcu", "atmega328p"]).contains("CLI004"), "{name}");
        let messages = emu(&["disasm", &image, "--mcu", "pic16f877a"]);
        assert!(
            messages.contains("looks like a program for an AVR or an 8051, not for pic16f877a"),
            "{name}: {messages}"
        );
    }
}

/// Names of gputils are addresses, in the unit of each memory.
#[test]
fn symbols_of_gputils() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let image = root.join("examples/pic16/blink.hex").to_string_lossy().into_owned();
    for ending in ["cod", "lst"] {
        let names = root.join(format!("emu-core/tests/gputils/absolute.{ending}")).to_string_lossy().into_owned();
        let flags = ["run", &image, "--mcu", "pic16f873", "--symbols", &names, "--no-start-up"];
        let ends =
            ["--until", "pc=start", "--peek", "flash:start", "--peek", "flash:loop..5", "--peek", "eeprom:cells"];
        let messages = emu(&[&flags[..], &ends[..]].concat());
        // The image has GOTO 10h at 0, nothing at 1 to 3 and MOVWF 20h at 4; its EEPROM is erased.
        for line in [
            "until: pc=0x0\n",
            "0x0000 (start",
            "flash:start 2810\n",
            "flash:loop..5 3fff 3fff 00a0\n",
            "eeprom:cells ff\n",
        ] {
            assert!(messages.contains(line), "{ending}, {line}: {messages}");
        }
        let messages =
            emu(&["disasm", &image, "--mcu", "pic16f873", "--symbols", &names, "--from", "deep", "--to", "0x802"]);
        assert!(messages.contains("; 0800 to 0801 erased, 2 words\n"), "{ending}: {messages}");
    }
}
