//! Sources for Atmel's assembler, assembled by avra.

use std::path::{Path, PathBuf};
use std::process::Command;

use emu_core::image::{ElfMachine, load};
use emu_test_support::test_folder;

use crate::corpus::differences;
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
        let wanted = avra(&path, &home, &test_folder!(&format!("asm-avra/{name}")), chip);
        assert!(!wanted.is_empty(), "{name}: avra fills nothing");
        let found = ours::cells_in(&home, &name, &text, chip).unwrap_or_else(|errors| panic!("{name}:\n{errors}"));
        let differ = differences(chip, &wanted, &found);
        assert!(differ.is_empty(), "{name}: {differ:#?}");
    }
}

/// The folder of Atmel's include files.
const INCLUDES: &str = "/usr/share/avra";

/// Returns the names that an include file defines as numbers, each once.
fn names_of(text: &str) -> Vec<String> {
    let mut names = Vec::new();
    for line in text.lines() {
        let definition = line.trim_start().strip_prefix(".equ").or_else(|| line.trim_start().strip_prefix(".set"));
        let Some((name, _)) = definition.and_then(|rest| rest.split_once('=')) else { continue };
        let name = name.trim().to_owned();
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

/// Every name of every include file for a chip that is here has the value of that file.
#[test]
#[ignore = "needs avra"]
fn names_of_atmels_include_files_have_their_values() {
    let (mut wrong, mut files, mut count) = (Vec::new(), 0, 0);
    let all = std::fs::read_dir(INCLUDES).unwrap_or_else(|e| panic!("{INCLUDES}: {e}"));
    for path in all.map(|entry| entry.expect("a file").path()) {
        let file = path.file_name().expect("a name").to_string_lossy().into_owned();
        let number = file.strip_prefix('m').and_then(|rest| rest.strip_suffix("def.inc"));
        let chip = number.and_then(|number| emu_avr::chips::chip(&format!("atmega{}", number.to_ascii_lowercase())));
        let Some(chip) = chip else { continue };
        let bytes = std::fs::read(&path).unwrap_or_else(|e| panic!("{file}: {e}"));
        let text = String::from_utf8_lossy(&bytes);
        let names = names_of(&text);
        files += 1;
        count += names.len();
        // avra does not know the device of every file that it has.
        let home = test_folder!(&format!("asm-avra-names/{file}"));
        let kept: Vec<&str> = text.lines().filter(|line| !line.starts_with(".device")).collect();
        std::fs::write(home.join(&file), kept.join("\n")).expect("an include file");
        let line = |n: &String| format!(" .dw low({n})|(high({n})<<8), byte3({n})|(byte4({n})<<8)\n");
        let source = format!(".include \"{file}\"\n.cseg\n{}", names.iter().map(line).collect::<String>());
        let main = home.join("main.asm");
        std::fs::write(&main, &source).expect("a source");
        let theirs = avra(&main, &home, &home, chip);
        let ours = match ours::cells_in(&home, "main.asm", &source, chip) {
            Ok(ours) => ours,
            Err(errors) => {
                wrong.push(format!("{file}:\n{errors}"));
                continue;
            }
        };
        for (name, at) in names.iter().zip((0..).step_by(4)) {
            let of =
                |cells: &Cells| (at..at + 4).map(|at| cells.get(&(chip.code_space, at)).copied()).collect::<Vec<_>>();
            if of(&theirs) != of(&ours) || of(&theirs).contains(&None) {
                wrong.push(format!("{file}: {name}: theirs {:02X?}, ours {:02X?}", of(&theirs), of(&ours)));
            }
        }
    }
    println!("{files} files, {count} names");
    assert!(files >= 11, "{files} files");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
