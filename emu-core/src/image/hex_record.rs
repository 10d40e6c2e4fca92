//! Reads one line of a HEX file. `ihex` parses it; for a line that `ihex` rejects, this module reports every
//! fault with its column.
//!
//! ```text
//!   :10010000214601360121470136007EFE09D2190140    count 10, address 0100, type 00, 16 data bytes,
//!    ^^      ^^                              ^^    checksum 40; all bytes add up to 0 modulo 256
//!    count   type                            checksum
//! ```

use diag::Pos;
use ihex::{Record, checksum};

use super::faults::FaultList;

/// Digits of the longest record: count, address, type, 255 data bytes, checksum.
const MAX_DIGITS: usize = 2 * (1 + 2 + 1 + 255 + 1);
/// Digits of the shortest record: count, address, type, checksum.
const MIN_DIGITS: usize = 2 * (1 + 2 + 1 + 1);
/// Bytes before the data bytes: count, address, type.
const HEADER: usize = 4;

/// The contents of one line.
pub(super) struct HexRecord {
    /// The record. It is also present if only the checksum is wrong, because the other fields are then most
    /// likely right.
    pub record: Option<Record>,
    /// The type field. It is also present if the record is broken but this field can be read.
    pub kind: Option<u8>,
    /// Column of the first data byte.
    pub column: u32,
}

/// Reads line `number` and reports its faults. `text` is the line without line end and trailing spaces;
/// leading spaces are skipped.
pub(super) fn parse_line(text: &[u8], number: u32, faults: &mut FaultList) -> HexRecord {
    let indent = text.len() - text.trim_ascii_start().len();
    let Some(LineDigits { column, digits }) = digits(text.trim_ascii_start(), indent as u32, number, faults) else {
        return HexRecord { record: None, kind: None, column: 0 };
    };
    let chars: Vec<char> = quoted(digits).chars().collect();
    let digits =
        RecordDigits { line: number, column, nibbles: chars.iter().map(|c| c.to_digit(16).map(|d| d as u8)).collect() };
    let record = match digits.parse() {
        Some(record) => Some(record),
        None => digits.explain(&chars, faults),
    };
    digits.warn_of_address(faults);
    HexRecord { record, kind: digits.byte(3), column: digits.column_of(HEADER) }
}

/// Checks a comment, given without its semicolon, and warns if it is a valid record: it was probably meant to
/// be loaded.
pub(super) fn check_comment(text: &[u8], number: u32, faults: &mut FaultList) {
    let record = str::from_utf8(text).ok().and_then(|text| Record::from_record_string(&format!(":{text}")).ok());
    if record.is_some() {
        let cause = || "a record after a semicolon is ignored".to_owned();
        let hint = "write a colon in its place if it belongs to the program";
        faults.warning("HEX027", Pos::new(number, 1, text.len() as u32 + 1), cause, hint);
    }
}

/// The digits of a line of Intel HEX.
#[derive(Debug, Clone, Copy)]
struct LineDigits<'t> {
    /// The column of the first digit, from 1.
    column: u32,
    /// The characters after the colon.
    digits: &'t [u8],
}

/// Finds the digits of a line and the column where they start. Characters before the colon are reported and
/// skipped. A line that consists only of digits is read as a line without its colon.
fn digits<'t>(text: &'t [u8], indent: u32, line: u32, faults: &mut FaultList) -> Option<LineDigits<'t>> {
    let colon = text.iter().take(MAX_DIGITS).position(|&byte| byte == b':');
    let (column, digits) = match colon {
        Some(0) => (indent + 2, text.get(1..)?),
        Some(at) => {
            let junk = quoted(text.get(..at)?);
            let width = junk.chars().count() as u32;
            faults.error(
                "HEX001",
                Pos::new(line, indent + 1, width),
                || starts_with(&junk),
                "remove what precedes the colon",
            );
            (indent + width + 2, text.get(at + 1..)?)
        }
        None => {
            let head = quoted(text.get(..text.len().min(8))?);
            let hint = match text {
                [b'S', b'0'..=b'9', ..] => "this looks like Motorola S-records: convert the file to Intel HEX",
                _ => "every line of Intel HEX begins with a colon, and a comment with a semicolon",
            };
            faults.error("HEX001", Pos::new(line, indent + 1, 1), || starts_with(&head), hint);
            let lost = (MIN_DIGITS..=MAX_DIGITS).contains(&text.len()) && text.iter().all(u8::is_ascii_hexdigit);
            (indent + 1, lost.then_some(text)?)
        }
    };
    if digits.len() > MAX_DIGITS {
        faults.error(
            "HEX019",
            Pos::new(line, column, MAX_DIGITS as u32),
            || format!("the record has {} characters, the longest has {MAX_DIGITS} digits", digits.len()),
            "break the lines with LF or CR LF, one record a line",
        );
        return None;
    }
    Some(LineDigits { column, digits })
}

/// The characters of a piece of a line.
fn quoted(text: &[u8]) -> String {
    String::from_utf8_lossy(text).into_owned()
}

fn starts_with(text: &str) -> String {
    format!("the line begins with {:?}, wanted ':'", text.chars().next().unwrap_or(' '))
}

/// The digits of one line and their position. A character that is not a digit is `None`.
struct RecordDigits {
    line: u32,
    column: u32,
    nibbles: Vec<Option<u8>>,
}

impl RecordDigits {
    fn len(&self) -> usize {
        self.nibbles.len()
    }

    /// Column of the byte `at`, counted from the count field.
    fn column_of(&self, at: usize) -> u32 {
        self.column + 2 * at as u32
    }

    fn pos(&self, at: usize) -> Pos {
        Pos::new(self.line, self.column_of(at), 2)
    }

    fn byte(&self, at: usize) -> Option<u8> {
        match self.nibbles.get(2 * at..2 * at + 2)? {
            &[Some(high), Some(low)] => Some(high << 4 | low),
            _ => None,
        }
    }

    fn bytes(&self) -> Option<Vec<u8>> {
        (0..self.len() / 2).map(|at| self.byte(at)).collect()
    }

    /// The record as `ihex` reads it, or `None` if it has any fault.
    fn parse(&self) -> Option<Record> {
        let digits: Option<String> = self.nibbles.iter().map(|n| char::from_digit(u32::from((*n)?), 16)).collect();
        Record::from_record_string(&format!(":{}", digits?)).ok()
    }

    /// Reports every fault of a line that `ihex` rejected. Returns the record if only the checksum was wrong.
    fn explain(&self, chars: &[char], faults: &mut FaultList) -> Option<Record> {
        self.bad_digits(chars, faults);
        if self.len() < MIN_DIGITS {
            let pos = Pos::new(self.line, self.column - 1, self.len() as u32 + 1);
            let cause = || format!("the record has {} digits, wanted at least {MIN_DIGITS}", self.len());
            faults.error("HEX004", pos, cause, "the line is cut off: get the file again");
            return None;
        }
        let even = self.len().is_multiple_of(2);
        if !even {
            let pos = Pos::new(self.line, self.column + self.len() as u32 - 1, 1);
            let cause = || format!("the record has {} digits, wanted an even number", self.len());
            faults.error("HEX003", pos, cause, "a digit is missing or one too many: get the file again");
        }
        let counted = even && self.wrong_count(faults);
        self.wrong_type(faults);
        if !counted {
            return None;
        }
        // The position of the checksum is known only if count and digits agree, so it is checked last.
        let mut bytes = self.bytes()?;
        let found = bytes.pop()?;
        let wanted = checksum(&bytes);
        if found != wanted {
            let cause = || format!("the checksum is 0x{found:02X}, wanted 0x{wanted:02X}");
            faults.error(
                "HEX006",
                self.pos(bytes.len()),
                cause,
                "a byte of the line or its checksum was changed: get the file again",
            );
        }
        bytes.push(wanted);
        let repaired: String = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
        Record::from_record_string(&format!(":{repaired}")).ok()
    }

    fn bad_digits(&self, chars: &[char], faults: &mut FaultList) {
        let mut at = 0;
        for run in chars.chunk_by(|a, b| a.is_ascii_hexdigit() == b.is_ascii_hexdigit()) {
            if let Some(bad) = run.first().filter(|c| !c.is_ascii_hexdigit()) {
                let hint = match bad {
                    ':' => "one record a line: the line break before this colon is lost",
                    _ => "only 0 to 9 and A to F may follow the colon",
                };
                let pos = Pos::new(self.line, self.column + at, run.len() as u32);
                faults.error("HEX002", pos, || format!("{bad:?} is not a hexadecimal digit"), hint);
            }
            at += run.len() as u32;
        }
    }

    /// Checks the byte count. Returns true if it can be read and agrees with the number of digits, which must
    /// be even.
    fn wrong_count(&self, faults: &mut FaultList) -> bool {
        let Some(count) = self.byte(0) else { return false };
        let found = (self.len() - MIN_DIGITS) / 2;
        if found != usize::from(count) {
            let cause = || format!("the count says {count} data bytes (0x{count:02X}), the line has {found}");
            let hint = match self.counts_words() {
                true => "this looks like INHX16, which counts in words: write INHX8M or INHX32 (gpasm -a inhx32)",
                false => "the line was cut or joined, or its count changed: get the file again",
            };
            faults.error("HEX005", self.pos(0), cause, hint);
        }
        found == usize::from(count)
    }

    /// Returns true if the line is complete but counts words of two bytes, as in INHX16 (MPASM user's guide,
    /// "Hex file formats").
    fn counts_words(&self) -> bool {
        let Some(bytes) = self.bytes() else { return false };
        let found = (self.len() - MIN_DIGITS) / 2;
        let whole = bytes.iter().fold(0u8, |sum, &byte| sum.wrapping_add(byte)) == 0;
        whole && bytes.first().is_some_and(|&count| found == 2 * usize::from(count))
    }

    fn wrong_type(&self, faults: &mut FaultList) {
        let Some(kind) = self.byte(3) else { return };
        let wanted = match kind {
            0 => return,
            1 => 0,
            2 | 4 => 2,
            3 | 5 => 4,
            _ => {
                let cause = || format!("record type 0x{kind:02X} is unknown, wanted 0x00 to 0x05");
                faults.error("HEX007", self.pos(3), cause, "write the file as Intel HEX (objcopy -O ihex)");
                return;
            }
        };
        if let Some(count) = self.byte(0).filter(|&count| count != wanted) {
            let cause = || format!("a record of type 0x{kind:02X} has {wanted} data bytes, this one has {count}");
            faults.error("HEX008", self.pos(0), cause, "write the file as Intel HEX (objcopy -O ihex)");
        }
    }

    /// Warns if a record of types 02 to 05 has a nonzero address field. An end record can have a start
    /// address in old files.
    fn warn_of_address(&self, faults: &mut FaultList) {
        let (Some(high), Some(low), Some(2..=5)) = (self.byte(1), self.byte(2), self.byte(3)) else { return };
        if (high, low) != (0, 0) {
            let pos = Pos::new(self.line, self.column_of(1), 4);
            let cause = || format!("the address field is {high:02X}{low:02X}, wanted 0000 in a record of this type");
            faults.warning("HEX022", pos, cause, "the field is not used; write 0000");
        }
    }
}
