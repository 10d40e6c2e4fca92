//! The programs of `examples`, and the chips for them.

use emu_core::Chip;
use emu_core::image::{self, ElfMachine, Image};

/// Returns the image of a program: a file of the folder, or a source that is assembled.
pub fn load(chip: &'static Chip, file: &str) -> Image {
    let path = format!("{}/../examples/{file}", env!("CARGO_MANIFEST_DIR"));
    let bytes = std::fs::read(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
    if file.ends_with(".asm") {
        let text = String::from_utf8(bytes).expect("text");
        return emu_asm::assemble_text(chip, &text).unwrap_or_else(|e| panic!("{file}: {e}"));
    }
    match image::load(file, &bytes, chip.hex_spaces, chip.elf_spaces, ElfMachine(chip.elf_machine)) {
        Ok(loaded) => loaded.image,
        Err(faults) => panic!("{file}: {faults:?}"),
    }
}

/// Returns a chip of the 8051 family.
pub fn chip_8051(name: &str) -> &'static Chip {
    emu_8051::chips::chips().find(|chip| chip.name == name).expect("a chip")
}

/// Returns a chip of the PIC16 family.
pub fn chip_pic(name: &str) -> &'static Chip {
    emu_pic16::chips::chips().find(|chip| chip.name == name).expect("a chip")
}
