//! Files that keep what a memory holds from run to run: read before, written back after.

use std::io::{ErrorKind, Write as _};
use std::path::Path;

use emu_core::chip::Chip;
use emu_core::cpu::Cpu;
use emu_core::image::{AVR_AREAS, Bits, Image, Space, load_hex, write_hex};

use crate::codes::{SIZE, about_file};
use crate::fail::Failure;
use crate::output::{self, Pending};
use crate::report::Texts;
use crate::{input, sink};

/// What an erased cell reads as.
const ERASED: u8 = 0xFF;

/// The memory of chips whose content outlives a run.
const EEPROM: &str = "eeprom";

/// A file beside a memory. Dropped without being kept, the file is as it was.
pub struct Store {
    name: String,
    pending: Pending,
    hex: bool,
}

impl Store {
    /// The file `name` of the flag `flag`, for a memory of `size` bytes, and what it holds: nothing where it does not exist yet.
    /// Intel HEX where its name ends in .hex or .eep, else plain bytes; what it leaves out is erased.
    pub fn open(flag: &str, name: &str, size: usize) -> Result<(Store, Option<Vec<u8>>), Failure> {
        if sink::sink(name) != sink::Sink::File {
            return Err(Failure::Usage(format!("{flag} wants the name of a file, since it is read and written back")));
        }
        let ending = Path::new(name).extension().map(|ending| ending.to_ascii_lowercase());
        let hex = ending.is_some_and(|ending| ending == "hex" || ending == "eep");
        let missing = std::fs::metadata(name).is_err_and(|error| error.kind() == ErrorKind::NotFound);
        let held = if missing { None } else { Some(content(name, hex, size)?) };
        Ok((Store { name: name.to_owned(), pending: Pending::new(name)?, hex }, held))
    }

    /// Writes what the memory holds now into the file.
    pub fn keep(self, bytes: &[u8]) -> Result<(), Failure> {
        let mut out = self.pending.writer()?;
        let text = if self.hex { write_hex(&[(0, bytes)]).into_bytes() } else { bytes.to_vec() };
        out.write_all(&text).and_then(|()| out.flush()).map_err(|error| Failure::writing(&self.name, &error))?;
        drop(out);
        self.pending.complete()
    }
}

/// What a file holds, for a memory of `size` bytes.
fn content(name: &str, hex: bool, size: usize) -> Result<Vec<u8>, Failure> {
    let file = input::bytes(name)?;
    let mut cells = vec![ERASED; size];
    if hex {
        let space = Space { name: EEPROM, start: 0, len: size as u32, word: 1, bits: Bits::All };
        // avr-objcopy leaves it where the ELF file has it, unless told otherwise.
        let carried = Space { start: AVR_AREAS.start, ..space };
        match load_hex(name, &file, &[space, carried]) {
            Ok(loaded) => loaded.image.fill(EEPROM, &mut cells),
            Err(faults) => return Err(Failure::Refused(faults, Texts::one(name, file))),
        };
    } else if file.len() > size {
        let cause = format!("holds {} bytes, and the memory has {size}", file.len());
        let hint = "plain bytes from address 0 on; a name in .hex or .eep stands for Intel HEX";
        return Err(Failure::Refused(vec![about_file(SIZE, name, cause, hint)], Texts::default()));
    } else {
        cells.iter_mut().zip(file).for_each(|(cell, byte)| *cell = byte);
    }
    Ok(cells)
}

/// The file of `--eeprom`, and what it holds.
pub fn eeprom(name: &str, chip: &Chip, image: &Image) -> Result<(Store, Option<Vec<u8>>), Failure> {
    if chip.eeprom == 0 {
        return Err(Failure::Usage(format!("--eeprom is for chips with an EEPROM; {} has none", chip.name)));
    }
    let opened = Store::open("--eeprom", name, chip.eeprom.into())?;
    if opened.1.is_some() && image.bytes_in(EEPROM).next().is_some() {
        output::tell(&format!("note: {name} goes before what the image has for the EEPROM\n"));
    }
    Ok(opened)
}

/// Puts bytes into the EEPROM of a chip.
pub fn fill<C: Cpu>(cpu: &mut C, held: &[u8]) {
    for (addr, &byte) in (0u32..).zip(held) {
        if cpu.peek(EEPROM, addr) != Some(byte) {
            cpu.poke(EEPROM, addr, byte);
        }
    }
}

/// What the EEPROM of a chip holds.
pub fn cells<C: Cpu>(cpu: &C) -> Vec<u8> {
    (0..u32::from(cpu.chip().eeprom)).map(|addr| cpu.peek(EEPROM, addr).unwrap_or(ERASED)).collect()
}
