//! Loads OMF-51: object files of Intel's tools for MCS-51 and of their successors (Keil, SDCC, ASEM-51).
//! Intel, "External Product Specification for the MCS-51 Object Module Format", V5.0 (1982), chapter 4 and
//! appendix 3, "Absolute Object Module Format".
//!
//! ```text
//!   record:  type, length of the rest (2 bytes, low first), contents, check sum:
//!            all bytes of a record add up to 0 modulo 256
//!   file:    module header (02); scopes (10), names and lines (12), contents (06) in any order;
//!            module end (04)
//! ```
//! A program that can run is absolute: it has no segments that a linker must still place. Such a file is
//! accepted as a whole or rejected with all its faults. Names and lines (`items.rs`) never cause a rejection.

mod codes;
mod items;

use crate::image::omf51::items::OmfSymbolsAndLines;
use diag::{Diagnostic, Pos};

use super::faults::FaultList;
use super::placement::{PlacedBytes, PlacementConflict, SourceSpan, describe_spaces};
use super::{Image, ImageSpace, LoadedImage, SourceLines};
pub use codes::OMF_CODES;
use items::{OmfItems, SizedName};

/// Record types. Keil's linkers write Intel's records with two-byte segment numbers under the next odd
/// number.
mod record_kind {
    /// Begins a module, with its name.
    pub(super) const HEADER: u8 = 0x02;
    /// Ends a module.
    pub(super) const END: u8 = 0x04;
    /// Bytes of a segment.
    pub(super) const CONTENT: u8 = 0x06;
    /// Places that the linker still has to change.
    pub(super) const FIXUP: u8 = 0x08;
    /// Definitions of segments.
    pub(super) const SEGMENTS: u8 = 0x0E;
    /// Begins or ends a module, function or block of the debugging information.
    pub(super) const SCOPE: u8 = 0x10;
    /// Symbols, segments or line numbers of the debugging information.
    pub(super) const ITEMS: u8 = 0x12;
    /// Definitions of public symbols.
    pub(super) const PUBLICS: u8 = 0x16;
    /// Symbols of other modules.
    pub(super) const EXTERNALS: u8 = 0x18;
    /// Names and lines of Keil's linkers.
    pub(super) const KEIL_ITEMS: u8 = 0x22;
    /// The source file of a module, of Keil's linkers.
    pub(super) const KEIL_SOURCE: u8 = 0x24;
    /// The first type that tools can use for records of their own.
    pub(super) const FIRST_OWN: u8 = 0x20;
    /// The header of a library.
    pub(super) const LIBRARY: u8 = 0x2C;
    /// The first record of a file of Keil's LX51, in another format.
    pub(super) const OMF2: u8 = 0x70;
}

/// The kind of a file according to its first record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum OmfGuess {
    /// A module of OMF-51.
    Module,
    /// A library of such modules.
    Library,
    /// A file of LX51 in Keil's own format.
    Omf2,
}

/// Guesses the format of a file that is not text. No text begins with the byte 02. The other two types are
/// letters, so the check sum of their first record must be right.
pub(super) fn guess_format(bytes: &[u8]) -> Option<OmfGuess> {
    let right = || {
        let length = usize::from(u16::from_le_bytes([*bytes.get(1)?, *bytes.get(2)?]));
        (length > 0).then(|| bytes.get(..3 + length)).flatten().filter(|record| checksum(record) == 0)
    };
    match *bytes.first()? {
        record_kind::HEADER => Some(OmfGuess::Module),
        record_kind::LIBRARY => right().map(|_| OmfGuess::Library),
        record_kind::OMF2 => right().map(|_| OmfGuess::Omf2),
        _ => None,
    }
}

fn checksum(record: &[u8]) -> u8 {
    record.iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte))
}

/// A record with a correct check sum.
#[derive(Clone, Copy)]
struct OmfRecord<'b> {
    kind: u8,
    /// The bytes between length and check sum.
    contents: &'b [u8],
    /// Offset of the record in the file.
    offset: usize,
}

/// The kind of a record in Intel's specification.
#[derive(Debug, Clone, Copy)]
struct IntelRecordKind {
    /// The type of the record.
    kind: u8,
    /// The number of bytes of a segment number in it, 1 or 2.
    segment_bytes: usize,
}

impl OmfRecord<'_> {
    /// The type in Intel's specification, and the number of bytes of a segment number.
    fn intel(&self) -> IntelRecordKind {
        let odd = self.kind < record_kind::FIRST_OWN && self.kind % 2 == 1;
        if odd {
            IntelRecordKind { kind: self.kind - 1, segment_bytes: 2 }
        } else {
            IntelRecordKind { kind: self.kind, segment_bytes: 1 }
        }
    }
}

/// Loads an absolute object file. `file` is the name for messages, `spaces` are the memories of the chip, one
/// of which is `code`.
///
/// # Errors
/// All faults of the file (codes in [`OMF_CODES`]): at most [`super::MAX_REPORTED`], and a closing note with
/// the number of further ones.
pub fn load_omf51(file: &str, bytes: &[u8], spaces: &[ImageSpace]) -> Result<LoadedImage, Vec<Diagnostic>> {
    let mut faults = FaultList::new(file, "OMF010");
    match guess_format(bytes) {
        Some(OmfGuess::Module) => {}
        Some(OmfGuess::Library) => {
            let cause = || "the file is a library of object modules, not a program".to_owned();
            faults.error("OMF003", Pos::default(), cause, "link a program with it and load that");
            return faults.finish(Image::default());
        }
        Some(OmfGuess::Omf2) => {
            let cause = || "the file is in the unsupported format of Keil's LX51 (OMF2)".to_owned();
            faults.error(
                "OMF004",
                Pos::default(),
                cause,
                "convert it with OHX51 and load the .hex, with the map as --symbols",
            );
            return faults.finish(Image::default());
        }
        None => {
            let first =
                bytes.first().map_or("the file is empty".to_owned(), |b| format!("the first byte is 0x{b:02X}"));
            faults.error("OMF005", Pos::default(), || format!("{first}, wanted 0x02, a module header"), REBUILD_HINT);
            return faults.finish(Image::default());
        }
    }
    let mut reader = OmfReader {
        placed: PlacedBytes::new(spaces),
        spaces,
        items: OmfItems::default(),
        seen: SeenRecords::default(),
    };
    reader.read(bytes, &mut faults);
    let OmfReader { placed, items, seen, .. } = reader;
    if faults.is_empty() && !seen.content {
        let cause = || "no record has contents of program memory".to_owned();
        faults.error("OMF009", Pos::default(), cause, "link a program; this may be a module of names alone");
    }
    let OmfSymbolsAndLines { symbols, lines } = items.finish(&mut faults);
    let lines = SourceLines::new(lines);
    faults.finish(Image { segments: placed.into_segments(), symbols, lines, entry: None })
}

const REBUILD_HINT: &str = "the file is cut off or damaged: build or get it again";

/// What has been read so far.
#[derive(Default)]
struct SeenRecords {
    content: bool,
    /// The name in the module header.
    name: Option<Vec<u8>>,
    /// Whether relocatable records have been reported.
    relocatable: bool,
}

struct OmfReader<'s> {
    placed: PlacedBytes<'s>,
    spaces: &'s [ImageSpace],
    items: OmfItems,
    seen: SeenRecords,
}

impl OmfReader<'_> {
    fn read(&mut self, bytes: &[u8], faults: &mut FaultList) {
        let mut offset = 0;
        loop {
            if faults.give_up_if_hopeless() {
                return;
            }
            let rest = bytes.get(offset..).unwrap_or_default();
            let Some((&kind, after)) = rest.split_first() else {
                let cause = || "the file ends without a module end record (type 0x04)".to_owned();
                return faults.error("OMF001", Pos::default(), cause, REBUILD_HINT);
            };
            let whole = after.first_chunk().and_then(|length| {
                let length = usize::from(u16::from_le_bytes(*length));
                rest.get(..3 + length).filter(|_| length > 0)
            });
            let Some(whole) = whole else {
                let cause =
                    || format!("the record of type 0x{kind:02X} at 0x{offset:X} extends beyond the end of the file");
                return faults.error("OMF001", Pos::default(), cause, REBUILD_HINT);
            };
            let end = offset + whole.len();
            if checksum(whole) == 0 {
                let contents = whole.get(3..whole.len() - 1).unwrap_or_default();
                if self.record(OmfRecord { kind, contents, offset }, faults) {
                    // CP/M and ISIS fill the last sector of 128 bytes.
                    let behind = bytes.get(end..).unwrap_or_default();
                    let filled = behind.len() < 128 && behind.iter().all(|byte| matches!(byte, 0 | 0x1A));
                    if !filled {
                        let cause = || format!("{} bytes follow the module end record", bytes.len() - end);
                        faults.error("OMF008", Pos::default(), cause, "link the modules, or remove what follows");
                    }
                    return;
                }
            } else {
                let found = whole.last().copied().unwrap_or(0);
                let wanted = found.wrapping_sub(checksum(whole));
                let cause = || {
                    format!(
                        "record 0x{kind:02X} at 0x{offset:X} has the checksum 0x{found:02X}, its bytes require 0x{wanted:02X}"
                    )
                };
                faults.error("OMF002", Pos::default(), cause, REBUILD_HINT);
            }
            offset = end;
        }
    }

    /// Reads one record; returns true for the last one.
    fn record(&mut self, record: OmfRecord<'_>, faults: &mut FaultList) -> bool {
        let IntelRecordKind { kind, segment_bytes: width } = record.intel();
        match kind {
            record_kind::HEADER if self.seen.name.is_some() => {
                damaged(record, "a second module header", faults);
            }
            record_kind::HEADER => match SizedName::split(record.contents) {
                Some(SizedName { name, rest: [_, ..] }) => {
                    self.seen.name = Some(name.to_vec());
                    self.items.header(name);
                }
                _ => damaged(record, "its name extends beyond its end", faults),
            },
            record_kind::END => {
                match SizedName::split(record.contents) {
                    Some(SizedName { name, .. }) if self.seen.name.as_deref().is_some_and(|first| first != name) => {
                        damaged(record, "it names another module than the module header", faults);
                    }
                    Some(_) => {}
                    None => damaged(record, "its name extends beyond its end", faults),
                }
                return true;
            }
            record_kind::CONTENT => self.content(record, width, faults),
            record_kind::FIXUP => self.relocatable(record, "has addresses that a linker fills in", faults),
            record_kind::EXTERNALS if !record.contents.is_empty() => {
                self.relocatable(record, "has names of other modules", faults);
            }
            record_kind::SCOPE => self.items.scope(record.contents),
            record_kind::ITEMS => self.items.items(record.contents, width),
            record_kind::PUBLICS => self.items.publics(record.contents, width),
            record_kind::KEIL_ITEMS => self.items.keil(record.contents),
            record_kind::KEIL_SOURCE => self.items.source(record.contents),
            // Placed segments are in the content records; Keil's type descriptions are not needed.
            record_kind::SEGMENTS | record_kind::EXTERNALS | record_kind::FIRST_OWN.. => {}
            _ => damaged(record, "its type is unknown", faults),
        }
        false
    }

    fn content(&mut self, record: OmfRecord<'_>, width: usize, faults: &mut FaultList) {
        let Some((segment, rest)) = record.contents.split_at_checked(width) else {
            return damaged(record, "it is too short", faults);
        };
        if segment.iter().any(|byte| *byte != 0) {
            return self.relocatable(record, "has contents of a segment that has no address yet", faults);
        }
        let Some((offset, data)) = rest.split_first_chunk() else { return damaged(record, "it is too short", faults) };
        let addr = u16::from_le_bytes(*offset);
        self.seen.content |= !data.is_empty();
        let from = SourceSpan { line: u32::try_from(record.offset).unwrap_or(u32::MAX), column: 0 };
        let spaces = self.spaces;
        self.placed.place_bytes(addr.into(), data, from, |trouble| match trouble {
            PlacementConflict::Outside { start, end } => {
                let cause = || {
                    let (last, at) = (end - 1, record.offset);
                    format!("the contents at 0x{at:X} fill 0x{start:04X} to 0x{last:04X}, outside the memories of the chip: {}", describe_spaces(spaces))
                };
                faults.error("OMF006", Pos::default(), cause, "link for this chip, or choose the chip it was linked for");
            }
            PlacementConflict::Overlap { start, end, with } | PlacementConflict::Replaced { start, end, with } => {
                let cause = || {
                    let (last, at, other) = (end - 1, record.offset, with.line);
                    format!("the contents at 0x{at:X} fill 0x{start:04X} to 0x{last:04X}, which those at 0x{other:X} have filled")
                };
                faults.error("OMF007", Pos::default(), cause, "two segments were put at one address: correct that and link again");
            }
        });
    }

    /// Reports that the module is not absolute, once per file.
    fn relocatable(&mut self, record: OmfRecord<'_>, what: &str, faults: &mut FaultList) {
        if std::mem::replace(&mut self.seen.relocatable, true) {
            return;
        }
        let cause =
            || format!("the module is relocatable: it {what} (record 0x{:02X} at 0x{:X})", record.kind, record.offset);
        faults.error("OMF003", Pos::default(), cause, "link it (BL51 main.obj TO app) and load the absolute file");
    }
}

fn damaged(record: OmfRecord<'_>, what: &str, faults: &mut FaultList) {
    let cause = || format!("record 0x{:02X} at 0x{:X} cannot be read: {what}", record.kind, record.offset);
    faults.error("OMF005", Pos::default(), cause, REBUILD_HINT);
}
