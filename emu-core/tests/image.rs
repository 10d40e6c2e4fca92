//! Tests of the loaders of image files: HEX and ELF, valid and invalid.

#[path = "image/avr_gcc.rs"]
mod avr_gcc;
#[path = "image/elf.rs"]
mod elf;
#[path = "image/hex.rs"]
mod hex;
#[path = "image/random.rs"]
mod random;

use emu_core::image::ElfMachine;

const AVR: ElfMachine = ElfMachine::AVR;
const DIR: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/image");

/// Reads the rows of a table in `tests/image`: `columns` texts separated by bars; lines that begin with `#`
/// are comments.
fn table(name: &str, columns: usize) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(format!("{DIR}/{name}")).unwrap_or_else(|e| panic!("{name}: {e}"));
    let rows: Vec<Vec<String>> = text
        .lines()
        .filter(|line| !line.is_empty() && !line.starts_with('#'))
        .map(|line| line.splitn(columns, '|').map(|cell| cell.trim().to_owned()).collect())
        .collect();
    for row in &rows {
        assert_eq!(row.len(), columns, "{name}: {row:?}");
    }
    rows
}
