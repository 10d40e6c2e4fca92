//! Reads traces line by line, in both formats.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};

use diag::{Diagnostic, Pos, Severity};
use serde_json::Value;

use crate::shared::codes::{NOT_A_TRACE, TRACE_LINE, UNREADABLE, file_error, system_message};
use crate::shared::fail::VerbFailure;
use crate::shared::report::FileTexts;

/// Maximum length of a line, in bytes.
const MAX_LINE_BYTES: u64 = 1 << 16;

/// A line of a trace. Numbers have the same text, whichever format the line was read from.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TraceEntry {
    /// The line as written in the file.
    pub raw: String,
    /// Machine cycle.
    pub cycle: u64,
    /// Address of the instruction, as `0x0080`; empty for other lines.
    pub address: String,
    /// Symbol at or before the address.
    pub symbol: String,
    /// The instruction, the interrupt or the end, as text.
    pub text: String,
    /// Registers that changed, as `NAME=0x1`.
    pub registers: Vec<String>,
    /// Memory reads and writes, as `read SPACE:0x1=0x2`.
    pub memory: Vec<String>,
}

/// A reader of a trace.
pub struct TraceReader {
    file: String,
    input: Box<dyn BufRead>,
    line: u64,
    /// The chip, from the first line of the file.
    pub mcu: String,
    /// The clock in Hz, from the first line of the file.
    pub hz: String,
}

impl TraceReader {
    /// Opens a trace and reads its first line.
    pub fn new(file: &str) -> Result<TraceReader, VerbFailure> {
        let input: Box<dyn BufRead> = match file {
            "-" => Box::new(BufReader::new(io::stdin())),
            _ => Box::new(BufReader::new(File::open(file).map_err(|error| unreadable(file, &error))?)),
        };
        TraceReader::from_input(file, input)
    }

    /// Reads the first line of a trace; `file` is its name in messages.
    pub fn from_input(file: &str, mut input: Box<dyn BufRead>) -> Result<TraceReader, VerbFailure> {
        // A directory can be opened but not read.
        input.fill_buf().map_err(|error| unreadable(file, &error))?;
        let mut reader = TraceReader { file: file.to_owned(), input, line: 0, mcu: String::new(), hz: String::new() };
        let head = match reader.text()? {
            Some(line) => parse_head(&line),
            None => Err("is empty".to_owned()),
        };
        (reader.mcu, reader.hz) = head.map_err(|cause| {
            let hint = "give files that `emu run --trace` has written";
            VerbFailure::Refused(vec![file_error(NOT_A_TRACE, file, cause, hint)], FileTexts::default())
        })?;
        Ok(reader)
    }

    /// Returns the number of lines read so far.
    pub fn lines(&self) -> u64 {
        self.line
    }

    /// Reads the next line. Returns `None` at the end.
    pub fn next(&mut self) -> Result<Option<TraceEntry>, VerbFailure> {
        let Some(raw) = self.text()? else { return Ok(None) };
        let entry = if raw.starts_with('{') { parse_json_line(&raw) } else { parse_text_line(&raw) };
        match entry {
            Some(entry) => Ok(Some(TraceEntry { raw, ..entry })),
            None => Err(self.refuse("is not a line of a trace")),
        }
    }

    fn text(&mut self) -> Result<Option<String>, VerbFailure> {
        let mut bytes = Vec::new();
        let read = self.input.by_ref().take(MAX_LINE_BYTES).read_until(b'\n', &mut bytes);
        self.line += u64::from(!bytes.is_empty());
        if let Err(error) = read {
            return Err(self.refuse(&format!("cannot be read: {}", system_message(&error))));
        }
        if bytes.is_empty() {
            return Ok(None);
        }
        if bytes.len() as u64 == MAX_LINE_BYTES && bytes.last() != Some(&b'\n') {
            return Err(self.refuse("is longer than 64 KB"));
        }
        match String::from_utf8(bytes) {
            Ok(text) => Ok(Some(text.trim_end_matches(['\n', '\r']).to_owned())),
            Err(_) => Err(self.refuse("is not text")),
        }
    }

    fn refuse(&self, cause: &str) -> VerbFailure {
        let line = u32::try_from(self.line).unwrap_or(u32::MAX);
        let pos = Pos { line, column: 1, width: 1 };
        let (cause, hint) = (cause.to_owned(), "record the trace again; docs/trace.md has the shape of its lines");
        let diagnostic = Diagnostic::new(Severity::Error, TRACE_LINE, &self.file, pos, cause, hint);
        VerbFailure::Refused(vec![diagnostic], FileTexts::default())
    }
}

fn unreadable(file: &str, error: &io::Error) -> VerbFailure {
    let cause = format!("cannot be read: {}", system_message(error));
    let fault = file_error(UNREADABLE, file, cause, "check the path; - is standard input");
    VerbFailure::Refused(vec![fault], FileTexts::default())
}

/// Parses the first line of a trace: chip and clock.
fn parse_head(line: &str) -> Result<(String, String), String> {
    let none = || "is not a trace of emu".to_owned();
    let (version, mcu, hz) = if line.starts_with('{') {
        let head: Value = serde_json::from_str(line).map_err(|_| none())?;
        let of = |name: &str| head.get(name).map(|value| value.as_str().map_or(value.to_string(), str::to_owned));
        (of("emu-trace"), of("mcu"), of("hz"))
    } else {
        let mut words = line.strip_prefix("emu-trace ").ok_or_else(none)?.split(' ');
        let version = words.next().map(str::to_owned);
        let mut of = |name: &str| words.next().and_then(|word| word.strip_prefix(name)).map(str::to_owned);
        (version, of("mcu="), of("hz="))
    };
    match (version.as_deref(), mcu, hz) {
        (Some("1"), Some(mcu), Some(hz)) => Ok((mcu, hz)),
        (Some(version), Some(_), Some(_)) => Err(format!("is a trace of version {version}; this emu reads version 1")),
        _ => Err(none()),
    }
}

/// Parses a line in the text format.
fn parse_text_line(raw: &str) -> Option<TraceEntry> {
    let (cycle, rest) = raw.trim_start().split_once("  ")?;
    let cycle = cycle.parse().ok()?;
    let (what, changes) = rest.split_once(';').unwrap_or((rest, ""));
    let what = what.trim();
    let mut entry = TraceEntry { cycle, ..TraceEntry::default() };
    if let Some(why) = what.strip_prefix("end: ") {
        entry.text = format!("end {why}");
        return Some(entry);
    }
    if what.starts_with("interrupt ") {
        entry.text = what.to_owned();
    } else {
        let (address, rest) = what.split_once(' ')?;
        let number = u32::from_str_radix(address.strip_prefix("0x")?, 16).ok()?;
        entry.address = format!("0x{number:04x}");
        let rest = rest.trim_start();
        let (symbol, rest) = match rest.strip_prefix('<') {
            Some(rest) => rest.split_once(">  ")?,
            None => ("", rest),
        };
        (entry.symbol, entry.text) = (symbol.to_owned(), rest.trim().to_owned());
    }
    let mut words = changes.split_whitespace();
    while let Some(word) = words.next() {
        let (name, value) = if matches!(word, "read" | "write") { words.next()? } else { word }.rsplit_once('=')?;
        let value = u32::from_str_radix(value, 16).ok()?;
        if matches!(word, "read" | "write") {
            let place = name.split('(').next().unwrap_or(name);
            let (space, addr) = place.split_once(":0x")?;
            let addr = u32::from_str_radix(addr, 16).ok()?;
            entry.memory.push(format!("{word} {space}:0x{addr:x}=0x{value:x}"));
        } else {
            entry.registers.push(format!("{name}=0x{value:x}"));
        }
    }
    Some(entry)
}

/// Parses a line in the JSON format.
fn parse_json_line(raw: &str) -> Option<TraceEntry> {
    let line: Value = serde_json::from_str(raw).ok()?;
    let string = |value: &Value, name: &str| value.get(name).and_then(Value::as_str).map(str::to_owned);
    let mut entry = TraceEntry { cycle: line.get("cycle")?.as_u64()?, ..TraceEntry::default() };
    if let Some(why) = string(&line, "end") {
        entry.text = format!("end {why}");
        return Some(entry);
    }
    if let Some(vector) = line.get("interrupt") {
        let name = string(&line, "name").unwrap_or_default();
        entry.text = format!("interrupt {} {name}", vector.as_u64()?).trim_end().to_owned();
    } else {
        entry.address = format!("0x{:04x}", line.get("addr")?.as_u64()?);
        entry.symbol = string(&line, "at").unwrap_or_default();
        entry.text = string(&line, "text")?;
    }
    if let Some(registers) = line.get("regs") {
        for (name, value) in registers.as_object()? {
            entry.registers.push(format!("{name}=0x{:x}", value.as_u64()?));
        }
    }
    for access in line.get("data").map_or(Some(&Vec::new()), Value::as_array)? {
        let (how, space) = ["read", "write"].iter().find_map(|how| Some((how, string(access, how)?)))?;
        let (addr, value) = (access.get("addr")?.as_u64()?, access.get("value")?.as_u64()?);
        entry.memory.push(format!("{how} {space}:0x{addr:x}=0x{value:x}"));
    }
    Some(entry)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pairs of one line in the text format and in the JSON format.
    const SHAPES: &[(&str, &str)] = &[
        (
            "        12  0x0080 <main+0x4>  ldi   r16, 0x05          ; r16=05 SREG=80 write data:0x0024(DDRB)=20",
            r#"{"cycle":12,"addr":128,"at":"main+0x4","text":"ldi   r16, 0x05","regs":{"r16":5,"SREG":128},"data":[{"write":"data","addr":36,"name":"DDRB","value":32}]}"#,
        ),
        ("         2  0x0002  sbis  0x09, 2", r#"{"cycle":2,"addr":2,"text":"sbis  0x09, 2"}"#),
        ("         9  interrupt 16 T0 ; SP=0ff", r#"{"cycle":9,"interrupt":16,"name":"T0","regs":{"SP":255}}"#),
        ("        99  end: halted", r#"{"cycle":99,"end":"halted"}"#),
    ];

    #[test]
    fn both_shapes_read_alike() {
        for (line, document) in SHAPES {
            let (a, b) = (parse_text_line(line), parse_json_line(document));
            assert!(a.is_some() && a == b, "{line}: {a:?} {b:?}");
        }
    }

    #[test]
    fn what_is_no_line() {
        for line in [
            "",
            "12",
            "x  0x0080  nop",
            "12  0080  nop",
            "12  0x0080",
            "12  0x00g0  nop",
            "1  0x0  nop ; r16",
            "1  0x0  nop ; read 5=1",
        ] {
            assert_eq!(parse_text_line(line), None, "{line}");
        }
        for line in [
            "{",
            "{}",
            r#"{"cycle":1}"#,
            r#"{"cycle":-1,"end":"x"}"#,
            r#"{"cycle":1,"addr":1,"text":"nop","data":[{}]}"#,
        ] {
            assert_eq!(parse_json_line(line), None, "{line}");
        }
    }

    #[test]
    fn heads() {
        let good = Ok(("8051".to_owned(), "12000000".to_owned()));
        assert_eq!(parse_head("emu-trace 1 mcu=8051 hz=12000000"), good);
        assert_eq!(parse_head(r#"{"emu-trace":1,"mcu":"8051","hz":12000000}"#), good);
        for line in ["", "emu-trace", "emu-trace 2 mcu=8051 hz=1", "emu-trace 1 mcu=8051", "{}", "{", "\u{7f}ELF"] {
            assert!(parse_head(line).is_err(), "{line}");
        }
    }
}
