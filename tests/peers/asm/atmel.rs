//! Sources for Atmel's assembler, assembled by avra.

use std::path::{Path, PathBuf};
use std::process::Command;

use emu_core::image::{ElfMachine, load};

use crate::corpus::differences;
use crate::folder;
use crate::judges::{Cells, Judge, cells};
use crate::ours;

/// Returns avra's output for a source: program memory and EEPROM.
fn avra(source: &Path, home: &Path, out: &Path, chip: &'static emu_core::Chip) -> Cells {
    let (hex, eeprom) = (out.join("product.hex"), out.join("product.eep"));
    for old in [&hex, &eeprom] {
        let _ = std::fs::remove_file(old);
    }
    let mut command = Command::new("avra");
    command.arg("-o").arg(&hex).arg("-e").arg(&eeprom).arg("-d").arg(out.join("product.obj")).arg(source);
    let output = command.current_dir(home).output();
    let output = output.unwrap_or_else(|e| panic!("avra: {e}"));
    let said = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}: {said}", source.display());
    let read = |path: &PathBuf| {
        let bytes = std::fs::read(path).unwrap_or_default();
        let loaded = load("product.hex", &bytes, chip.hex_spaces, chip.hex_spaces, ElfMachine(chip.elf_machine));
        loaded.map(|loaded| cells(&loaded.image)).unwrap_or_default()
    };
    let in_eeprom = read(&eeprom).into_iter().map(|((_, addr), byte)| (("eeprom", addr), byte));
    read(&hex).into_iter().chain(in_eeprom).collect()
}

#[test]
#[ignore = "needs avra"]
fn sources_for_atmels_assembler_give_the_bytes_of_avra() {
    let home = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/peers/asm/avra");
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(&home).expect("a corpus").map(|entry| entry.expect("a file").path()).collect();
    files.retain(|path| path.extension().is_some_and(|ending| ending == "asm"));
    files.sort();
    assert!(files.len() >= 4, "{files:?}");
    for path in files {
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{name}: {e}"));
        let chip = text.lines().next().and_then(|line| line.strip_prefix("; chip: "));
        let chip = Judge::Avr.chip(chip.unwrap_or_else(|| panic!("{name} names no chip")));
        let wanted = avra(&path, &home, &folder(&format!("asm-avra/{name}")), chip);
        assert!(!wanted.is_empty(), "{name}: avra fills nothing");
        let found = ours::cells_in(&home, &name, &text, chip).unwrap_or_else(|errors| panic!("{name}:\n{errors}"));
        let differ = differences(chip, &wanted, &found);
        assert!(differ.is_empty(), "{name}: {differ:#?}");
    }
}
