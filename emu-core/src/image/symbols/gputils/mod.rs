//! Reads symbols and source lines of programs for mid-range PICs from the files that gputils writes beside
//! the image.
//!
//! ```text
//!   main.cod   globals, lines of the sources, messages for a simulator    cod.rs, message.rs
//!   main.map   the linker's map: all names of all files                   map.rs
//!   main.lst   the linker's listing, or that of an absolute program       listing.rs
//! ```

pub(super) mod cod;
pub(super) mod listing;
pub(super) mod map;
pub(super) mod message;

use diag::Pos;
use diag::text::printable;

use super::names::RankedName;
use super::{CollectedSymbols, FaultList, MemorySpace, SourceKind};

/// Word address of the IDs and configuration words (DS33023, section 27.2).
const CONFIG: u32 = 0x2000;
/// Word address of the EEPROM in image files (DS30262 and related programming specifications).
const EEPROM: u32 = 0x2100;

/// An address in a memory of the PIC16.
#[derive(Debug, Clone, Copy)]
struct ProgrammerAddress {
    /// The memory.
    space: MemorySpace,
    /// The byte address in it.
    addr: u32,
}

/// Converts a word of the programmer's address space to memory and byte address; `None` beyond its end.
fn program_space(word: u32) -> Option<ProgrammerAddress> {
    match word {
        0..CONFIG => Some(ProgrammerAddress { space: MemorySpace::Flash, addr: 2 * word }),
        CONFIG..EEPROM => Some(ProgrammerAddress { space: MemorySpace::Config, addr: 2 * (word - CONFIG) }),
        EEPROM..0x2200 => Some(ProgrammerAddress { space: MemorySpace::Eeprom, addr: word - EEPROM }),
        _ => None,
    }
}

/// Adds the names of a program address.
fn add_label(word: u32, names: Vec<RankedName>, pos: Pos, found: &mut CollectedSymbols, faults: &mut FaultList) {
    match program_space(word) {
        Some(ProgrammerAddress { space: mem, addr }) => found.add_symbol(mem, addr, 0, names, pos, faults),
        None => report_beyond_end("program memory", word, 0x21FF, pos, faults),
    }
}

/// Adds the names of a data address.
fn add_data_symbol(addr: u32, names: Vec<RankedName>, pos: Pos, found: &mut CollectedSymbols, faults: &mut FaultList) {
    if addr > MemorySpace::Data.last_address() {
        return report_beyond_end("data memory", addr, MemorySpace::Data.last_address(), pos, faults);
    }
    found.add_symbol(MemorySpace::Data, addr, 0, names, pos, faults);
}

/// Adds the line of a word of program memory; IDs, configuration and EEPROM have no lines.
fn add_line(word: u32, kind: SourceKind, file: &str, number: u32, found: &mut CollectedSymbols) {
    if let Some(ProgrammerAddress { space: MemorySpace::Flash, addr }) = program_space(word) {
        found.lines.push(super::SourceLine { addr, kind, file: printable(file).into(), line: number, len: 0 });
    }
}

fn report_beyond_end(memory: &str, addr: u32, last: u32, pos: Pos, faults: &mut FaultList) {
    let cause = || format!("the address 0x{addr:X} is beyond the last of {memory}, 0x{last:X}");
    faults.error("SYM004", pos, cause, "the program is for another family, or the file is damaged: build again");
}

/// The name of a source file without folder and extension, used as a prefix of its statics.
fn module_name(file: &str) -> &str {
    let name = file.rsplit(['/', '\\']).next().unwrap_or(file);
    name.rsplit_once('.').map_or(name, |(stem, _)| stem)
}
