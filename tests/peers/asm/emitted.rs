//! Assembly sources of compiled programs: gpasm, as31, sdas8051 and avr-as produce the same bytes as our HEX
//! files.

use std::path::{Path, PathBuf};

use emu_core::chip::ChipFamily;
use emu_test_support::test_folder;
use ladder_compile::{CompileOptions, assembly, compile, targets};

use crate::judges::{Judge, cells};

#[test]
#[ignore = "needs gpasm, as31, sdas8051, avr-as"]
fn sources_assemble_elsewhere_too() {
    let out = test_folder!("emit");
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let mut programs: Vec<PathBuf> = std::fs::read_dir(examples)
        .expect("examples")
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.extension().is_some_and(|ending| ending == "ld"))
        .collect();
    programs.sort();
    let mut seen = [0; 4];
    for path in &programs {
        let text = std::fs::read_to_string(path).expect("a program");
        let program = ladder::parse("program.ld", &text).expect("reads").program;
        for target in targets().filter(|target| target.chip.family != ChipFamily::Ap101) {
            for optimise in [true, false] {
                let options =
                    CompileOptions { mcu: target.chip.name.to_owned(), optimise, ..CompileOptions::default() };
                let Ok(compiled) = compile(&program, &options) else { continue };
                let source = assembly(&program, target.chip, &compiled.built, &compiled.map);
                let wanted =
                    emu_core::image::load_hex("image", compiled.hex.as_bytes(), target.chip.hex_spaces).expect("sound");
                for (n, judge) in Judge::ALL.into_iter().enumerate() {
                    let fits = match judge {
                        Judge::As31 | Judge::Sdas => target.chip.family == ChipFamily::Mcs51,
                        Judge::Gpasm => target.chip.family == ChipFamily::Pic16,
                        Judge::Avr => target.chip.family == ChipFamily::Avr,
                    };
                    if !fits {
                        continue;
                    }
                    // sdas8051 places an area without a start address anywhere.
                    let area = if judge == Judge::Sdas { "    .area CSEG (ABS,CODE)\n    .org 0\n" } else { "" };
                    std::fs::write(out.join("source.asm"), format!("{area}{source}")).expect("a file");
                    let verdict = judge.assemble(&out, "source.asm", target.chip, &out);
                    let name = path.file_name().unwrap_or_default().display();
                    let place = format!("{name} for {} by {}", target.chip.name, judge.name());
                    assert_eq!(verdict.cells, Some(cells(&wanted.image)), "{place}: {:?}\n{source}", verdict.said);
                    seen[n] += 1;
                }
            }
        }
    }
    assert!(seen.iter().all(|&n| n >= 8), "sources by assembler: {seen:?}");
}
