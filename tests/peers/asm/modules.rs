//! Modules of SDCC compared with sdas8051 and sdld: the output of `sdcc -S` for its own library, and random
//! areas.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use emu_asm::{AssembleOptions, assemble};
use emu_core::rng::Rng;
use emu_test_support::{random_seed, test_folder};

use crate::corpus::differences;
use crate::judges::{Cells, Judge, cells};

/// Sources of SDCC's library, as Debian's `sdcc-libraries` installs them.
const LIBRARY: &str = "/usr/share/sdcc/lib/src";

fn run(program: &str, args: &[&str], home: &Path) -> bool {
    let output = Command::new(program).args(args).current_dir(home).output();
    output.unwrap_or_else(|e| panic!("{program}: {e}")).status.success()
}

/// Returns the output of sdas8051 and sdld for a module, with names of other modules as 0, or `None` if
/// sdas8051 refuses it.
fn theirs(home: &Path, source: &str) -> Option<Cells> {
    let chip = Judge::Sdas.chip("at89s52");
    for old in ["module.rel", "module.ihx"] {
        let _ = std::fs::remove_file(home.join(old));
    }
    run("sdas8051", &["-g", "-o", "module.rel", source], home).then_some(())?;
    run("sdld", &["-i", "module.ihx", "module.rel"], home);
    let bytes = std::fs::read(home.join("module.ihx")).ok()?;
    if bytes.is_empty() {
        return Some(Cells::new());
    }
    let image =
        emu_core::image::load_hex(source, &bytes, chip.hex_spaces).unwrap_or_else(|e| panic!("{source}: {e:?}"));
    Some(cells(&image.image))
}

fn ours(text: &str) -> Result<Cells, String> {
    let source = emu_asm::SourceText { name: "module.asm", bytes: text.as_bytes() };
    match assemble(&source, Judge::Sdas.chip("at89s52"), &AssembleOptions::default(), &mut ()) {
        Ok(assembled) => Ok(cells(&assembled.image)),
        Err(refused) => {
            let first = refused.diagnostics.iter().find(|fault| fault.is_error());
            Err(first.map_or(String::new(), |f| format!("{}:{}: {}: {}", f.pos.line, f.pos.column, f.code, f.cause)))
        }
    }
}

/// Returns the differences of our output for the module in this file.
fn compare(home: &Path, source: &str) -> Option<String> {
    let text = std::fs::read_to_string(home.join(source)).expect("a module");
    let theirs = theirs(home, source)?;
    match ours(&text) {
        Ok(ours) => {
            let differ = differences(Judge::Sdas.chip("at89s52"), &theirs, &ours);
            (!differ.is_empty()).then(|| format!("{source}: {} bytes differ: {}", differ.len(), differ[0]))
        }
        Err(fault) => Some(format!("{source}: refused: {fault}")),
    }
}

#[test]
#[ignore = "needs sdcc with the sources of its library: .ci/peers installs them"]
fn modules_of_sdccs_library_are_those_of_sdas8051_and_sdld() {
    let home = test_folder!("asm-modules");
    let mut sources: Vec<PathBuf> = std::fs::read_dir(LIBRARY)
        .expect("sources of the library")
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.extension().is_some_and(|ending| ending == "c"))
        .collect();
    sources.sort();
    for (model, least) in [("small", 150), ("large", 150)] {
        let (mut modules, mut wrong) = (0, Vec::new());
        for source in &sources {
            let name = format!("{}-{model}.asm", source.file_stem().expect("a name").to_string_lossy());
            let path = source.to_string_lossy();
            let model = format!("--model-{model}");
            // Some sources are for other processors.
            if !run("sdcc", &["-mmcs51", &model, "--std-c99", "-S", "-o", &name, &path], &home) {
                continue;
            }
            modules += 1;
            wrong.extend(compare(&home, &name));
        }
        println!("{model}: {} of {modules} modules give the bytes of sdas8051 and sdld", modules - wrong.len());
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
        assert!(modules >= least, "{model}: only {modules} modules");
    }
}

/// Areas with their attributes. sdas8051 gives the second part of an ABS area the attributes of another area,
/// so ABS areas appear once.
const AREAS: &[&str] = &[
    "REG_BANK_0 (REL,OVR,DATA)",
    "REG_BANK_1 (REL,OVR,DATA)",
    "BSEG (BIT)",
    "BIT_BANK (REL,OVR,DATA)",
    "DSEG (DATA)",
    "OSEG (OVR,DATA)",
    "ISEG (DATA)",
    "SSEG",
    "XSEG (XDATA)",
    "PSEG (PAG,XDATA)",
    "HOME (CODE)",
    "GSINIT0 (CODE)",
    "GSINIT (CODE)",
    "GSFINAL (CODE)",
    "CSEG (CODE)",
    "MINE (CON,CODE)",
    "MYD (DATA)",
    "B2 (BIT)",
    "IABS (ABS,DATA)",
    "XABS (ABS,XDATA)",
    "CABS (ABS,CODE)",
];

fn random_module(rng: &mut Rng) -> String {
    let mut areas = AREAS.to_vec();
    let (mut text, mut labels, mut free) = (String::new(), 0, 0x100);
    let mut label = |text: &mut String| {
        labels += 1;
        let _ = writeln!(text, "s{labels}:");
        labels
    };
    let mut last = 0;
    for _ in 0..3 + rng.below(12) {
        let number = rng.below(areas.len() as u64) as usize;
        let area = areas[number];
        let _ = writeln!(text, "        .area {area}");
        if area.contains("ABS,") {
            areas.remove(number);
            let at = match area {
                "CABS (ABS,CODE)" => {
                    free += 64;
                    free - 64 - 0x100 * rng.below(2)
                }
                "IABS (ABS,DATA)" => 8 + rng.below(0x60),
                _ => rng.below(400),
            };
            let _ = writeln!(text, "        .org {at}");
        }
        last = label(&mut text);
        match area {
            _ if area.contains("CODE") => {
                for _ in 0..rng.below(6) {
                    let line = ["nop", "mov a,#1", "ljmp s1", "mov dptr,#s1", ".db #s1", ".dw s1+1", ".ds 5", "ret"];
                    let _ = writeln!(text, "        {}", line[rng.below(8) as usize]);
                }
            }
            _ if area.starts_with("REG_BANK") => text.push_str("        .ds 8\n"),
            "SSEG" | "BIT_BANK (REL,OVR,DATA)" => text.push_str("        .ds 1\n"),
            _ => {
                let _ = writeln!(text, "        .ds {}", rng.below(10));
            }
        }
    }
    text.push_str("        .area CSEG (CODE)\n");
    for label in 1..=last {
        let _ = writeln!(text, "        .dw s{label}");
    }
    text
}

#[test]
#[ignore = "needs sdas8051 and sdld"]
fn random_areas_lie_where_sdld_puts_them() {
    let home = test_folder!("asm-areas");
    let seed = random_seed();
    println!("EMU_SEED={seed}");
    let mut rng = Rng::new(seed);
    for _ in 0..300 {
        let text = random_module(&mut rng);
        std::fs::write(home.join("areas.asm"), &text).expect("a file");
        let wrong = compare(&home, "areas.asm");
        assert!(wrong.is_none(), "EMU_SEED={seed}: {}\n{text}", wrong.unwrap_or_default());
    }
}
