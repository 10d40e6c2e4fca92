//! Reads `.cod` files: blocks of 512 bytes, the first of which is a directory.
//!
//! ```text
//!   offset in a directory   contents (first and last block, words low byte first; 0 if there is none)
//!   430, 432                names of source files, 64 bytes each: length, text
//!   434, 436                lines, 84 per block, 6 bytes each: file, flags, line, program address (words)
//!   350                     the tool that wrote the file: length, text
//!   439                     upper half of this directory's program addresses
//!   441                     block of the next directory
//!   453                     processor: length, text
//!   462, 464                symbols: length, name, kind (word), value (4 bytes, high byte first)
//!   466, 468                messages: see message.rs
//! ```
//! Sources: gputils documentation, "The .cod file format"; files that gpasm and gplink 1.4.0 write.

use crate::image::symbols::names::RankedName;
use diag::Pos;

use super::super::names;
use super::super::{CollectedSymbols, FaultList, SourceKind, shortened};

/// Bytes per block.
pub(super) const BLOCK_BYTES: usize = 512;

/// Offsets of the pairs of block numbers in a directory.
const FILES: usize = 430;
const LINES: usize = 434;
const SYMBOLS: usize = 462;
/// Offset of the entry of the table of messages in the directory.
pub(super) const MESSAGES: usize = 466;
const HIGH: usize = 439;
const NEXT: usize = 441;
const PROCESSOR: usize = 453;
const MAKER: usize = 350;

/// Kinds of symbols.
const DATA: u16 = 2;
const LABEL: u16 = 46;

/// Flags of a line from which the code at its address was made; other lines at the address made no code.
const MADE_CODE: u8 = 0x80;

/// Returns true if a file can only be a `.cod`: it names a tool and a processor at their offsets, and its
/// first block is not text.
pub(in super::super) fn is_cod_file(bytes: &[u8]) -> bool {
    let texts = [MAKER, PROCESSOR].map(|at| text(bytes, at));
    let binary = bytes.iter().take(BLOCK_BYTES).any(|&byte| byte == 0);
    bytes.len() >= BLOCK_BYTES && binary && texts.iter().all(|text| text.as_ref().is_some_and(|t| printable(t)))
}

fn printable(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|b| b.is_ascii_graphic() || b == b' ')
}

/// A text preceded by its length.
pub(super) fn text(bytes: &[u8], at: usize) -> Option<String> {
    let length = usize::from(*bytes.get(at)?);
    Some(String::from_utf8_lossy(bytes.get(at + 1..at + 1 + length)?).into_owned())
}

/// The 16 bits at an offset, low byte first.
pub(super) fn word(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_le_bytes([*bytes.get(at)?, *bytes.get(at + 1)?]))
}

/// The 32 bits at an offset, high byte first.
pub(super) fn long(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_be_bytes(bytes.get(at..at + 4)?.try_into().ok()?))
}

/// The chip that a file names.
pub(in super::super) fn processor_name(bytes: &[u8]) -> Option<String> {
    text(bytes, PROCESSOR)
}

/// A file whose directories have been checked.
pub(super) struct CodFile<'b> {
    bytes: &'b [u8],
    /// Block numbers of the directories; the first one is 0.
    directories: Vec<usize>,
}

/// A block of a COD file with its number.
#[derive(Debug, Clone, Copy)]
pub(super) struct CodBlock<'b> {
    /// The position in the file, in blocks.
    pub(super) number: usize,
    /// The content.
    pub(super) bytes: &'b [u8],
}

impl<'b> CodFile<'b> {
    /// Checks the directories. Returns `None`, after reporting it, if they are damaged or the file is for a
    /// chip of another family.
    pub(super) fn new(bytes: &'b [u8], faults: &mut FaultList) -> Option<Self> {
        if !bytes.len().is_multiple_of(BLOCK_BYTES) || bytes.is_empty() {
            let cause = || {
                format!("the file has {} bytes, which is not a whole number of blocks of {BLOCK_BYTES}", bytes.len())
            };
            faults.error("SYM013", Pos::default(), cause, "the file is cut off: assemble or link again");
            return None;
        }
        let mut cod = CodFile { bytes, directories: vec![0] };
        let mut at = 0;
        while let Some(next) = cod.block(at).and_then(|block| word(block, NEXT)).map(usize::from).filter(|n| *n != 0) {
            if cod.block(next).is_none() || cod.directories.contains(&next) {
                let cause = || format!("the next directory would be block {next} of {}", bytes.len() / BLOCK_BYTES);
                faults.error("SYM013", Pos::default(), cause, "the file is damaged: assemble or link again");
                return None;
            }
            cod.directories.push(next);
            at = next;
        }
        let processor = processor_name(bytes).unwrap_or_default();
        let family = processor.trim_start_matches(['p', 'P', 'i', 'I', 'c', 'C']).get(..2);
        if !matches!(family, Some("16" | "12" | "10" | "14")) {
            let cause = || format!("the program is for {:?}, which is not a mid-range PIC", shortened(&processor));
            faults.error("SYM015", Pos::default(), cause, "give the .cod of a program for a 16F or 16C chip");
            return None;
        }
        Some(cod)
    }

    fn block(&self, number: usize) -> Option<&'b [u8]> {
        let start = number.checked_mul(BLOCK_BYTES)?;
        self.bytes.get(start..start.checked_add(BLOCK_BYTES)?)
    }

    /// The blocks of a table of one directory, with their numbers; empty if there is no such table. Blocks
    /// beyond the end of the file are a fault.
    pub(super) fn table(&self, directory: usize, at: usize, what: &str, faults: &mut FaultList) -> Vec<CodBlock<'b>> {
        let entry = |at| self.block(directory).and_then(|block| word(block, at)).map_or(0, usize::from);
        let (first, last) = (entry(at), entry(at + 2));
        if first == 0 {
            return Vec::new();
        }
        let blocks = self.bytes.len() / BLOCK_BYTES;
        if last < first || last >= blocks {
            let cause = || format!("the table of {what} would be blocks {first} to {last} of {blocks}");
            faults.error("SYM013", Pos::default(), cause, "the file is damaged: assemble or link again");
            return Vec::new();
        }
        (first..=last).filter_map(|number| Some(CodBlock { number, bytes: self.block(number)? })).collect()
    }

    /// The blocks of a table that only the first directory has.
    pub(super) fn main_table(&self, at: usize, what: &str, faults: &mut FaultList) -> Vec<CodBlock<'b>> {
        self.table(0, at, what, faults)
    }
}

/// Reports a record that is not complete.
pub(super) fn report_damaged(block: usize, offset: usize, what: &str, faults: &mut FaultList) {
    let cause = || format!("{what} in block {block} at offset 0x{offset:X} is not whole");
    faults.error("SYM014", Pos::default(), cause, "the file is damaged: assemble or link again");
}

/// Reads symbols and lines.
pub(in super::super) fn read_cod(bytes: &[u8], found: &mut CollectedSymbols, faults: &mut FaultList) {
    let Some(cod) = CodFile::new(bytes, faults) else { return };
    for CodBlock { number, bytes: block } in cod.main_table(SYMBOLS, "symbols", faults) {
        read_symbols(number, block, found, faults);
        if faults.is_full() {
            return;
        }
    }
    let mut files = Vec::new();
    for CodBlock { number, bytes: block } in cod.main_table(FILES, "source files", faults) {
        for at in (0..BLOCK_BYTES).step_by(64) {
            let name = text(block, at).filter(|name| name.len() < 64);
            if name.is_none() {
                report_damaged(number, at, "the name of a source file", faults);
            }
            files.push(name.unwrap_or_default());
        }
    }
    for &directory in &cod.directories {
        // A mid-range program has one directory; the addresses of further ones start at multiples of 32 K
        // words.
        let high = cod.block(directory).and_then(|block| word(block, HIGH)).map_or(0, |high| u32::from(high) << 15);
        for CodBlock { number, bytes: block } in cod.table(directory, LINES, "lines", faults) {
            read_lines(number, block, high, &files, found, faults);
            if faults.is_full() {
                return;
            }
        }
    }
}

fn read_symbols(number: usize, block: &[u8], found: &mut CollectedSymbols, faults: &mut FaultList) {
    let mut at = 0;
    while let Some(length) = block.get(at).copied().filter(|length| *length != 0) {
        let end = at + 1 + usize::from(length);
        let (Some(name), Some(kind), Some(value)) = (text(block, at), word(block, end), long(block, end + 2)) else {
            return report_damaged(number, at, "the symbol", faults);
        };
        let pos = Pos::default();
        match kind {
            DATA => super::add_data_symbol(value, names::linker_names(&name), pos, found, faults),
            LABEL => super::add_label(value, names::linker_names(&name), pos, found, faults),
            // Constants, which are mostly the registers and bits of the chip's include file.
            _ => found.unplaced.push((name, value)),
        }
        at = end + 6;
    }
}

fn read_lines(
    number: usize,
    block: &[u8],
    high: u32,
    files: &[String],
    found: &mut CollectedSymbols,
    faults: &mut FaultList,
) {
    for (row, record) in block.chunks_exact(6).take(84).enumerate() {
        let (Some(&[file, flags]), Some(line), Some(addr)) =
            (record.get(..2).and_then(|r| <&[u8; 2]>::try_from(r).ok()), word(record, 2), word(record, 4))
        else {
            continue;
        };
        if flags != MADE_CODE {
            continue;
        }
        match files.get(usize::from(file)).filter(|name| !name.is_empty()) {
            Some(name) => super::add_line(high + u32::from(addr), SourceKind::Asm, name, line.into(), found),
            None => {
                let cause = || {
                    format!(
                        "a line in block {number} at offset 0x{:X} names source file {file}, which does not exist",
                        6 * row
                    )
                };
                faults.error("SYM014", Pos::default(), cause, "the file is damaged: assemble or link again");
            }
        }
    }
}

/// The ranked names of a static of one file.
pub(super) fn names_in_file(file: &str, name: &str) -> Vec<RankedName> {
    names::local_names(super::module_name(file), name)
}
