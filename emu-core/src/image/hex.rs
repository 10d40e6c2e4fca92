//! Loads Intel HEX: lines to records to addresses. "Hexadecimal Object File Format Specification", Intel,
//! revision A, 1988.

use diag::{Diagnostic, Pos, text};
use ihex::Record;

use super::faults::FaultList;
use super::hex_record::{self, HexRecord};
use super::placement::{PlacedBytes, PlacementConflict, STAYS_ERASED, SourceSpan, describe_spaces};
use super::{AVR_AREAS, Image, ImageSpace, LoadedImage, SourceLines, WordBits, is_avr_elf_area};

/// Size of a segment in bytes: an offset has 16 bits.
const SEGMENT_BYTES: usize = 0x1_0000;

/// First character of a comment line. CCS C writes the chip and the date after the records as comments.
const COMMENT_MARK: u8 = b';';

/// Loads an Intel HEX file. `file` is the name for messages, `spaces` are the memories of the chip.
///
/// # Errors
/// All faults of the file in the order of their positions (codes HEX001 to HEX028, `docs/formats/hex.md`): at
/// most [`super::MAX_REPORTED`], and a closing note with the number of further ones.
pub fn load_hex(file: &str, bytes: &[u8], spaces: &[ImageSpace]) -> Result<LoadedImage, Vec<Diagnostic>> {
    let mut reader = HexReader {
        faults: FaultList::new(file, "HEX020"),
        placed: PlacedBytes::new(spaces),
        spaces,
        base: Some(0),
        end: None,
        end_reported: false,
        start: None,
        outside: None,
    };
    let bytes = text_of_cpm(bytes, &mut reader.faults);
    let text = text::readable(bytes);
    if is_text(bytes, text.as_bytes(), &mut reader.faults) {
        let mut last = 0;
        for (text, number) in text.split('\n').zip(1..) {
            let text = text.as_bytes().trim_ascii_end();
            match text.trim_ascii_start() {
                [] => {}
                [COMMENT_MARK, behind @ ..] => hex_record::check_comment(behind, number, &mut reader.faults),
                _ => {
                    reader.read_line(text, number);
                    last = number;
                }
            }
            if reader.faults.give_up_if_hopeless() {
                break;
            }
        }
        if !reader.faults.give_up_if_hopeless() {
            reader.finish(last);
        }
    }
    let HexReader { faults, placed, start, .. } = reader;
    let image = Image {
        segments: placed.into_segments(),
        symbols: Vec::new(),
        lines: SourceLines::default(),
        entry: start.map(|(entry, _)| entry),
    };
    faults.finish(image)
}

/// Returns the bytes before the ^Z that ends a text in CP/M. The rest of the last sector can contain
/// anything.
fn text_of_cpm<'b>(bytes: &'b [u8], faults: &mut FaultList) -> &'b [u8] {
    let Some(end) = bytes.iter().position(|&byte| byte == 0x1A) else { return bytes };
    let (text, rest) = bytes.split_at(end);
    // A binary file contains zeros and is reported as such later.
    if text.contains(&0) || text.trim_ascii().is_empty() {
        return bytes;
    }
    let kept = rest.iter().filter(|&&byte| !matches!(byte, 0 | 0x1A) && !byte.is_ascii_whitespace()).count();
    if kept > 0 {
        let line = text.iter().filter(|&&byte| byte == b'\n').count() as u32 + 1;
        let cause = || format!("{} bytes after the ^Z (0x1A) that ends the text are ignored", rest.len() - 1);
        faults.note("HEX009", Pos::new(line, 1, 1), cause, "they are the rest of an old sector, as CP/M leaves it");
    }
    text
}

/// Returns true if the file is a text that is not empty. `plain` is the decoded text without decorations.
fn is_text(bytes: &[u8], plain: &[u8], faults: &mut FaultList) -> bool {
    if let Some(name) = text::wide_encoding(bytes) {
        let cause = || format!("the file is written in {name}");
        faults.error("HEX014", Pos::new(1, 1, 1), cause, "save it as plain ASCII");
        return false;
    }
    if bytes.starts_with(text::BYTE_ORDER_MARK) {
        let cause = || "the byte order mark of UTF-8 at the start of the file is ignored".to_owned();
        faults.note("HEX014", Pos::new(1, 1, 1), cause, "save it as plain ASCII: programmers do not read the mark");
    }
    if plain.contains(&0) {
        let at = bytes.iter().position(|&byte| byte == 0).unwrap_or_default();
        let cause = || format!("the file is binary: byte 0x00 at offset {at}");
        faults.error("HEX013", Pos::default(), cause, "convert it to Intel HEX (objcopy -I binary -O ihex)");
        return false;
    }
    if plain.trim_ascii().is_empty() {
        let cause = || format!("the file is empty ({} bytes)", bytes.len());
        faults.error("HEX012", Pos::default(), cause, "the program that wrote it has most likely failed: run it again");
        return false;
    }
    true
}

struct HexReader<'f> {
    faults: FaultList<'f>,
    placed: PlacedBytes<'f>,
    spaces: &'f [ImageSpace],
    /// The base address of the offsets; `None` after a type 02 or 04 record that cannot be read.
    base: Option<u32>,
    /// Line of the last end record.
    end: Option<u32>,
    end_reported: bool,
    /// Start address and its line.
    start: Option<(u32, u32)>,
    outside: Option<OutsideRange>,
}

/// Bytes outside of all memories, over consecutive lines without a gap. An image for a larger chip is
/// therefore one fault.
struct OutsideRange {
    addr: std::ops::Range<u64>,
    first: Pos,
    last_line: u32,
}

impl HexReader<'_> {
    fn read_line(&mut self, text: &[u8], number: u32) {
        let line = hex_record::parse_line(text, number, &mut self.faults);
        if line.kind != Some(1) {
            self.warn_after_end(number);
        }
        match line.record {
            Some(Record::Data { offset, ref value }) => self.read_data_record(&line, number, offset, value),
            Some(Record::ExtendedSegmentAddress(segment)) => self.base = Some(u32::from(segment) << 4),
            Some(Record::ExtendedLinearAddress(upper)) => self.base = Some(u32::from(upper) << 16),
            Some(Record::StartSegmentAddress { cs, ip }) => {
                self.read_start_record(&line, number, (u32::from(cs) << 4) + u32::from(ip))
            }
            Some(Record::StartLinearAddress(start)) => self.read_start_record(&line, number, start),
            Some(Record::EndOfFile) => self.read_end_record(number),
            None => match line.kind {
                Some(1) => self.read_end_record(number),
                Some(2 | 4) => self.base = None,
                _ => {}
            },
        }
    }

    fn warn_after_end(&mut self, number: u32) {
        let Some(end) = self.end.filter(|_| !self.end_reported) else { return };
        self.end_reported = true;
        let cause = || format!("the file continues after the end record of line {end}");
        let hint = "the end record is the last line; two joined files must be merged (srec_cat, mergehex)";
        self.faults.error("HEX009", Pos::new(number, 1, 1), cause, hint);
    }

    fn read_end_record(&mut self, number: u32) {
        if let Some(first) = self.end {
            let cause = || format!("a second end record, the first is on line {first}");
            self.faults.error("HEX011", Pos::new(number, 1, 1), cause, "leave only one end record, as the last line");
        }
        self.end = Some(number);
        self.end_reported = false;
        self.base = Some(0);
    }

    fn read_start_record(&mut self, line: &HexRecord, number: u32, start: u32) {
        match self.start {
            None => self.start = Some((start, number)),
            Some((first, _)) if first == start => {}
            Some((first, first_line)) => self.faults.warning(
                "HEX023",
                Pos::new(number, line.column, 8),
                || format!("the start address is 0x{start:04X} here and 0x{first:04X} on line {first_line}"),
                "the first one is kept; leave only one start record",
            ),
        }
    }

    fn read_data_record(&mut self, line: &HexRecord, number: u32, offset: u16, value: &[u8]) {
        let room = SEGMENT_BYTES - usize::from(offset);
        if value.len() > room {
            let over = value.len() - room;
            let pos = Pos::new(number, line.column + 2 * room as u32, 2 * over as u32);
            let cause = || {
                let count = value.len();
                format!("{count} data bytes at offset 0x{offset:04X} run over the end of the 64 KB segment by {over}")
            };
            self.faults.error("HEX017", pos, cause, "split the record at the end of the segment");
            return;
        }
        let Some(base) = self.base else { return };
        let addr = u64::from(base) + u64::from(offset);
        let mut troubles = Vec::new();
        self.placed.place_bytes(addr, value, SourceSpan { line: number, column: line.column }, |trouble| {
            troubles.push(trouble)
        });
        for trouble in troubles {
            let pos =
                |from: u64, to: u64| Pos::new(number, line.column + 2 * (from - addr) as u32, 2 * (to - from) as u32);
            match trouble {
                PlacementConflict::Outside { start, end } => self.note_outside(start..end, pos(start, end)),
                PlacementConflict::Replaced { start, end, with } => self.faults.note(
                    "HEX028",
                    pos(start, end),
                    || {
                        format!(
                            "{} erased on line {}; this value counts",
                            range_text(start, end, " was", " were"),
                            with.line
                        )
                    },
                    "dumps of a whole memory give erased cells and then single words of it",
                ),
                PlacementConflict::Overlap { start, end, with } => self.faults.error(
                    "HEX015",
                    pos(start, end),
                    || format!("{} already given on line {}", range_text(start, end, " was", " were"), with.line),
                    "give every byte once, even where both lines say the same",
                ),
            }
        }
    }

    fn note_outside(&mut self, addr: std::ops::Range<u64>, pos: Pos) {
        match &mut self.outside {
            Some(outside) if outside.addr.end == addr.start => {
                outside.addr.end = addr.end;
                outside.last_line = pos.line;
            }
            _ => {
                self.report_outside();
                self.outside = Some(OutsideRange { addr, first: pos, last_line: pos.line });
            }
        }
    }

    fn report_outside(&mut self) {
        let Some(OutsideRange { addr, first, last_line }) = self.outside.take() else { return };
        let bytes = range_text(addr.start, addr.end, " lies", " lie");
        let lines = if last_line > first.line { format!(" (to line {last_line})") } else { String::new() };
        // No AVR has such a memory, whatever its size: a linker keeps data for other tools there.
        if self.spaces.iter().any(|space| is_avr_elf_area(space.start)) && addr.start >= AVR_AREAS.end.into() {
            let cause = || format!("{bytes} where no AVR has a memory{lines}: ignored");
            let hint = "from here on an ELF file for an AVR has what other tools read; objcopy -R leaves it out";
            return self.faults.note("HEX026", first, cause, hint);
        }
        let cause = || format!("{bytes} outside the memories of the chip{lines}: {}", describe_spaces(self.spaces));
        self.faults.error(
            "HEX016",
            first,
            cause,
            "build the program for this chip, or choose the chip it was built for",
        );
    }

    /// Reports what is known only at the end of the file; `last` is its last line with text.
    fn finish(&mut self, last: u32) {
        self.report_outside();
        if self.end.is_none() {
            let cause = || "the end record is missing".to_owned();
            self.faults.error(
                "HEX010",
                Pos::new(last, 0, 0),
                cause,
                "the file is cut off: get it again (last line :00000001FF)",
            );
        }
        for half in self.placed.half_words() {
            let pos = Pos::new(half.from.line, half.from.column + 2 * half.offset, 2);
            let cause =
                format!("the word at {} 0x{:04X} is half defined: {}", half.space.name, half.addr & !1, half.bytes());
            match half.space.word_bits {
                WordBits::All => {
                    self.faults.note("HEX018", pos, || cause + STAYS_ERASED, "pad the image to whole words")
                }
                _ => self.faults.error(
                    "HEX018",
                    pos,
                    || cause,
                    "pad the image so that both bytes of every word are given",
                ),
            }
        }
        self.placed.fill_half_words();
        for wide in self.placed.wide_words() {
            let pos = Pos::new(wide.from.line, wide.from.column + 2 * wide.offset, 2);
            let byte = wide.space.start + wide.addr;
            let others = match wide.others {
                0 => String::new(),
                1 => " (another too)".to_owned(),
                count => format!(" ({count} others too)"),
            };
            let cause = |bits: u32| {
                format!(
                    "the {} word 0x{:04X} at byte 0x{byte:04X} has more than {bits} bits{others}",
                    wide.space.name, wide.word
                )
            };
            match wide.space.word_bits {
                WordBits::All => {}
                WordBits::Only(bits) => self.faults.error("HEX024", pos, || cause(bits), &too_wide(bits)),
                WordBits::Low(bits) => {
                    self.faults.warning("HEX025", pos, || cause(bits), "the upper bits are dropped; write zeros there");
                }
            }
        }
        if self.faults.is_empty() && self.placed.is_empty() {
            let cause = || "the file contains no data".to_owned();
            self.faults.warning("HEX021", Pos::default(), cause, "check that the program was built");
        }
    }
}

fn too_wide(bits: u32) -> String {
    let most = (1u64 << bits.min(63)) - 1;
    format!("is the program for this chip? Its words go to 0x{most:04X}: mask what fills or pads them (& 0x{most:04X})")
}

/// Formats a range: `byte 0x0010 was` or `bytes 0x0010 to 0x001F (16) were`.
fn range_text(start: u64, end: u64, one: &str, many: &str) -> String {
    match end - start {
        1 => format!("byte 0x{start:04X}{one}"),
        count => format!("bytes 0x{start:04X} to 0x{:04X} ({count}){many}", end - 1),
    }
}
