//! Files that keep the contents of a memory between runs: read before a run, written back after it.

use std::io::{ErrorKind, Write as _};
use std::path::Path;

use emu_core::chip::Chip;
use emu_core::cpu::Cpu;
use emu_core::image::{AVR_AREAS, HexSegment, Image, ImageSpace, WordBits, load_hex, write_hex};

use crate::shared::codes::{MEMORY_SIZE, file_error};
use crate::shared::fail::VerbFailure;
use crate::shared::output::PendingFile;
use crate::shared::report::FileTexts;
use crate::shared::{input, output, output_target};

/// The value of an erased cell.
const ERASED: u8 = 0xFF;

/// The memory space whose contents outlive a run.
const EEPROM: &str = "eeprom";

/// A file that holds the contents of a memory. If it is dropped without [`MemoryFile::keep`], the file on
/// disk stays unchanged.
pub struct MemoryFile {
    name: String,
    pending: PendingFile,
    hex: bool,
}

impl MemoryFile {
    /// Opens the file `name` of the flag `flag` for a memory of `size` bytes. Returns its contents, or `None`
    /// if it does not exist.
    ///
    /// Names that end in .hex or .eep are Intel HEX, others plain bytes. Bytes that the file omits are
    /// erased.
    pub fn open(flag: &str, name: &str, size: usize) -> Result<(MemoryFile, Option<Vec<u8>>), VerbFailure> {
        if output_target::output_target(name) != output_target::OutputTarget::File {
            return Err(VerbFailure::Usage(format!(
                "{flag} needs the name of a file, because it is read and written back"
            )));
        }
        let ending = Path::new(name).extension().map(|ending| ending.to_ascii_lowercase());
        let hex = ending.is_some_and(|ending| ending == "hex" || ending == "eep");
        let missing = std::fs::metadata(name).is_err_and(|error| error.kind() == ErrorKind::NotFound);
        let contents = if missing { None } else { Some(content(name, hex, size)?) };
        Ok((MemoryFile { name: name.to_owned(), pending: PendingFile::new(name)?, hex }, contents))
    }

    /// Writes the contents of the memory into the file.
    pub fn keep(self, bytes: &[u8]) -> Result<(), VerbFailure> {
        let mut out = self.pending.writer()?;
        let text = if self.hex { write_hex(&[HexSegment { addr: 0, bytes }]).into_bytes() } else { bytes.to_vec() };
        out.write_all(&text)
            .and_then(|()| out.flush())
            .map_err(|error| VerbFailure::write_failed(&self.name, &error))?;
        drop(out);
        self.pending.complete()
    }
}

/// Reads the contents of a file for a memory of `size` bytes.
fn content(name: &str, hex: bool, size: usize) -> Result<Vec<u8>, VerbFailure> {
    let file = input::read_bytes(name)?;
    let mut cells = vec![ERASED; size];
    if hex {
        let space = ImageSpace { name: EEPROM, start: 0, len: size as u32, word: 1, word_bits: WordBits::All };
        // Without other options, avr-objcopy keeps the EEPROM at its address in the ELF file.
        let carried = ImageSpace { start: AVR_AREAS.start, ..space };
        match load_hex(name, &file, &[space, carried]) {
            Ok(loaded) => loaded.image.fill(EEPROM, &mut cells),
            Err(faults) => return Err(VerbFailure::Refused(faults, FileTexts::one(name, file))),
        };
    } else if file.len() > size {
        let cause = format!("has {} bytes, but the memory has {size}", file.len());
        let hint = "plain bytes from address 0 on; a name in .hex or .eep means Intel HEX";
        return Err(VerbFailure::Refused(vec![file_error(MEMORY_SIZE, name, cause, hint)], FileTexts::default()));
    } else {
        cells.iter_mut().zip(file).for_each(|(cell, byte)| *cell = byte);
    }
    Ok(cells)
}

/// Opens the file of `--eeprom` and reads its contents.
pub fn open_eeprom_file(name: &str, chip: &Chip, image: &Image) -> Result<(MemoryFile, Option<Vec<u8>>), VerbFailure> {
    if chip.eeprom_bytes == 0 {
        return Err(VerbFailure::Usage(format!("--eeprom is for chips with an EEPROM; {} has none", chip.name)));
    }
    let opened = MemoryFile::open("--eeprom", name, chip.eeprom_bytes.into())?;
    if opened.1.is_some() && image.bytes_in(EEPROM).next().is_some() {
        output::print_to_stderr(&format!("note: {name} overrides the EEPROM contents of the image\n"));
    }
    Ok(opened)
}

/// Writes bytes into the EEPROM of a chip. Cells that already hold their value are not written.
pub fn load_eeprom<C: Cpu>(cpu: &mut C, contents: &[u8]) {
    for (addr, &byte) in (0u32..).zip(contents) {
        if cpu.peek(EEPROM, addr) != Some(byte) {
            cpu.poke(EEPROM, addr, byte);
        }
    }
}

/// Returns the contents of the EEPROM of a chip.
pub fn eeprom_bytes<C: Cpu>(cpu: &C) -> Vec<u8> {
    (0..u32::from(cpu.chip().eeprom_bytes)).map(|addr| cpu.peek(EEPROM, addr).unwrap_or(ERASED)).collect()
}
