//! Our assembler on the sources of the corpora.

use std::io;
use std::path::Path;

use emu_asm::{AssembleOptions, IncludeFiles, assemble};
use emu_core::Chip;

use crate::corpus::Source;
use crate::judges::{Cells, cells as cells_of, home};

/// The files of a folder.
struct Folder<'p>(&'p Path);

impl IncludeFiles for Folder<'_> {
    fn open(&mut self, name: &str, _: &str) -> io::Result<(String, Vec<u8>)> {
        Ok((name.to_owned(), std::fs::read(self.0.join(name))?))
    }
}

/// Returns the cells that our assembler fills, or all its errors.
pub fn cells(source: &Source) -> Result<Cells, String> {
    cells_in(&home(source.judge), &source.name, &source.text, source.chip)
}

/// Returns the cells for a text whose includes are in `home`, or all errors.
pub fn cells_in(home: &Path, name: &str, text: &str, chip: &'static Chip) -> Result<Cells, String> {
    let text = emu_asm::SourceText { name, bytes: text.as_bytes() };
    match assemble(&text, chip, &AssembleOptions::default(), &mut Folder(home)) {
        Ok(assembled) => Ok(cells_of(&assembled.image)),
        Err(refused) => {
            let shown = refused.diagnostics.iter().filter(|f| f.is_error()).take(30);
            let lines = shown.map(|f| format!("  {}:{}:{}: {}: {}", f.file, f.pos.line, f.pos.column, f.code, f.cause));
            Err(lines.collect::<Vec<_>>().join("\n"))
        }
    }
}
