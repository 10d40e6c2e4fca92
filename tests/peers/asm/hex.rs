//! The HEX files of PIC16 have the same text as those of gpasm, and of gplink for relocatable sources.

use std::process::Command;

use crate::corpus::sources;
use crate::judges::{Judge, home, product};
use emu_test_support::test_folder;

#[test]
#[ignore = "needs gputils: .ci/peers installs it"]
fn hex_files_of_pic16_are_those_of_gpasm_and_gplink() {
    let mut wrong = Vec::new();
    let all = sources(Judge::Gpasm);
    for source in &all {
        let out = test_folder!(&format!("asm-hex/{}", source.name));
        Judge::Gpasm.assemble(&home(Judge::Gpasm), &source.name, source.chip, &out);
        let file = home(Judge::Gpasm).join(&source.name);
        let mut emu = Command::new(env!("CARGO_BIN_EXE_emu"));
        let ours = emu.arg("asm").arg(&file).args(["--mcu", source.chip.name, "-o", "-"]).output().expect("emu runs");
        if String::from_utf8_lossy(&ours.stdout) != product(&out) {
            wrong.push(format!("{}: {}", source.name, String::from_utf8_lossy(&ours.stderr)));
        }
    }
    assert!(all.len() > 10, "{} sources", all.len());
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
