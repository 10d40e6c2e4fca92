//! Reads the head of a `.ld` file: settings, `IO LIST`, `VAR LIST` and `PULL-UP LIST`.

use diag::{Pos, Severity, nearest};

use crate::codes;
use crate::lexer::{self, LdLine};
use crate::model::{IoEntry, LadderDialect, LadderProgram, LdFormat, ProgramSettings, Rung, VarEntry};
use crate::reader::{LdReader, message_text};

/// Maximum value of CYCLE (microseconds), CRYSTAL (Hz) and BAUD (bits per second).
const MAX_SETTING: u64 = 1_000_000_000_000;
/// Maximum number of lines of a list.
const MAX_LIST: usize = 4_000;
const SETTINGS: [&str; 10] = [
    "MICRO=",
    "CYCLE=",
    "CRYSTAL=",
    "BAUD=",
    "COMPILER=",
    "COMPILED=",
    "IO LIST",
    "VAR LIST",
    "PULL-UP LIST",
    "PROGRAM",
];

/// The settings and lists before the rungs, as far as they have been read.
#[derive(Default)]
pub(crate) struct ProgramHead {
    micro: Option<String>,
    cycle: Option<(u64, String)>,
    crystal: Option<(u64, String)>,
    baud: Option<(u64, String)>,
    compiler: Option<String>,
    compiled: Option<String>,
    /// Names of the settings and lists read so far, to find repeated ones.
    seen: Vec<&'static str>,
    io: Vec<IoEntry>,
    vars: Option<Vec<VarEntry>>,
    pull_ups: Option<Vec<String>>,
}

impl ProgramHead {
    /// Builds the program with this head. A missing setting, which was reported as an error, becomes zero.
    pub(crate) fn into_program(
        self,
        file: &str,
        format: LdFormat,
        dialect: LadderDialect,
        rungs: Vec<Rung>,
    ) -> LadderProgram {
        let (cycle_us, cycle_rest) = self.cycle.unwrap_or_default();
        let (crystal_hz, crystal_rest) = self.crystal.unwrap_or_default();
        let (baud, baud_rest) = self.baud.map_or((None, String::new()), |(value, rest)| (Some(value), rest));
        let settings = ProgramSettings {
            micro: self.micro,
            cycle_us,
            cycle_rest,
            crystal_hz,
            crystal_rest,
            baud,
            baud_rest,
            compiler: self.compiler,
            compiled: self.compiled,
        };
        let ProgramHead { io, vars, pull_ups, .. } = self;
        LadderProgram { file: file.to_owned(), format, dialect, settings, io, vars, pull_ups, rungs }
    }
}

/// Reads up to and including the line `PROGRAM`; returns true if that line was found.
pub(crate) fn read_head<'a>(
    reader: &mut LdReader<'_>,
    lines: &mut impl Iterator<Item = LdLine<'a>>,
    out: &mut ProgramHead,
) -> bool {
    let mut found = false;
    let mut last = Pos::default();
    let mut list: Option<(&'static str, Pos)> = None;
    for line in lines.by_ref() {
        last = line.pos;
        let section = section_keyword(&line);
        if let Some((name, opened)) = list {
            match section {
                Some("END") => list = None,
                None => read_list_line(reader, name, &line, out),
                Some(_) => {
                    reader.error(
                        codes::LIST_OPEN,
                        opened,
                        format!("{name} is not closed"),
                        "put END after its last line",
                    );
                    list = None;
                }
            }
            if list.is_some() || section == Some("END") {
                continue;
            }
        }
        match section {
            Some("PROGRAM") => {
                found = true;
                break;
            }
            Some("END") => {
                reader.error(codes::STRAY_END, line.pos, "END closes no list", "remove it");
            }
            Some(name) => {
                refuse_repeated(reader, out, name, line.pos);
                list = Some((name, line.pos));
                match name {
                    "VAR LIST" => drop(out.vars.get_or_insert_default()),
                    "PULL-UP LIST" => drop(out.pull_ups.get_or_insert_default()),
                    _ => {}
                }
            }
            None => read_setting(reader, &line, out),
        }
        if reader.has_too_many_errors() {
            break;
        }
    }
    if let Some((name, opened)) = list {
        reader.error(codes::LIST_OPEN, opened, format!("{name} is not closed"), "put END after its last line");
    }
    if !found && !reader.has_too_many_errors() {
        let cause = "the file ends before the line PROGRAM";
        reader.error(codes::NO_PROGRAM, last, cause, "put PROGRAM before the first RUNG");
    }
    for (name, given) in [("CYCLE=", out.cycle.is_some()), ("CRYSTAL=", out.crystal.is_some())] {
        if !given && !out.seen.contains(&name) {
            let hint =
                if name == "CYCLE=" { "such as CYCLE=10000 (microseconds)" } else { "such as CRYSTAL=4000000 (Hz)" };
            reader.error(codes::SETTING_MISSING, Pos::default(), format!("the line {name} is missing"), hint);
        }
    }
    found
}

/// Returns the keyword of a section line; any white space may separate its words.
fn section_keyword(line: &LdLine<'_>) -> Option<&'static str> {
    let words: Vec<&str> = line.tokens.iter().map(|t| t.text).take(3).collect();
    match words.as_slice() {
        ["IO", "LIST"] => Some("IO LIST"),
        ["VAR", "LIST"] => Some("VAR LIST"),
        ["PULL-UP", "LIST"] => Some("PULL-UP LIST"),
        ["END"] => Some("END"),
        ["PROGRAM"] => Some("PROGRAM"),
        _ => None,
    }
}

fn refuse_repeated(reader: &mut LdReader<'_>, out: &mut ProgramHead, name: &'static str, pos: Pos) {
    if out.seen.contains(&name) {
        reader.error(codes::SETTING_TWICE, pos, format!("{name} stands twice"), "remove one of them");
    }
    out.seen.push(name);
}

fn read_setting(reader: &mut LdReader<'_>, line: &LdLine<'_>, out: &mut ProgramHead) {
    let known =
        SETTINGS.iter().filter(|s| s.ends_with('=')).find_map(|s| Some((*s, line.text.strip_prefix(s)?.trim())));
    let Some((name, value)) = known else {
        let word = line.text.split_inclusive('=').next().unwrap_or("");
        let hint = match (line.keyword(), nearest(word, SETTINGS.into_iter())) {
            ("RUNG", _) => "rungs come after the line PROGRAM".to_owned(),
            (_, Some(near)) => format!("did you mean {near}?"),
            (_, None) => format!("known are {}", SETTINGS.join(", ")),
        };
        reader.error(
            codes::UNKNOWN_SETTING,
            line.pos,
            format!("`{}` is no line of the head", message_text(line.text)),
            hint,
        );
        return;
    };
    refuse_repeated(reader, out, name, line.pos);
    match name {
        "MICRO=" => out.micro = Some(value.to_owned()).filter(|v| !v.is_empty()),
        "CYCLE=" => out.cycle = read_quantity(reader, line, name, value, "us", 0),
        "CRYSTAL=" => out.crystal = read_quantity(reader, line, name, value, "hz", 1),
        "BAUD=" => out.baud = read_quantity(reader, line, name, value, "hz", 0),
        "COMPILER=" => out.compiler = Some(value.to_owned()),
        _ => out.compiled = Some(value.to_owned()),
    }
}

/// Reads a decimal number and the text after it, which must be empty or begin with the unit.
fn read_quantity(
    reader: &mut LdReader<'_>,
    line: &LdLine<'_>,
    name: &str,
    value: &str,
    unit: &str,
    low: u64,
) -> Option<(u64, String)> {
    let digits = value.len() - value.trim_start_matches(|c: char| c.is_ascii_digit()).len();
    let (digits, rest) = value.split_at_checked(digits)?;
    let rest = rest.trim();
    let number = digits.parse::<u64>().ok().filter(|n| (low..=MAX_SETTING).contains(n));
    let unit_ok = rest.is_empty() || rest.get(..unit.len()).is_some_and(|u| u.eq_ignore_ascii_case(unit));
    if let (Some(number), true) = (number, unit_ok) {
        return Some((number, rest.to_owned()));
    }
    // Mark only the text after the equals sign, or the whole line if there is none.
    let width = value.chars().count() as u32;
    let before = line.pos.width.saturating_sub(width);
    let pos = if width == 0 { line.pos } else { Pos::new(line.pos.line, line.pos.column + before, width) };
    let cause = format!("{name} needs a whole number from {low} to {MAX_SETTING}, found `{}`", message_text(value));
    let hint = match unit {
        "us" => "write microseconds, such as CYCLE=10000".to_owned(),
        _ => format!("write Hz, such as {name}{}", if name == "BAUD=" { 2400 } else { 4_000_000 }),
    };
    reader.error(codes::SETTING_NUMBER, pos, cause, hint);
    None
}

fn read_list_line(reader: &mut LdReader<'_>, list: &str, line: &LdLine<'_>, out: &mut ProgramHead) {
    let length = out.io.len().max(out.vars.as_ref().map_or(0, Vec::len)).max(out.pull_ups.as_ref().map_or(0, Vec::len));
    if length >= MAX_LIST {
        let cause = format!("more than {MAX_LIST} lines in {list}");
        return reader.error(codes::TOO_LARGE, line.pos, cause, "remove the names that are not used");
    }
    match list {
        "IO LIST" => {
            if let Some(entry) = read_io_line(reader, line) {
                check_io_line(reader, line, &entry, &out.io);
                out.io.push(entry);
            }
        }
        "VAR LIST" => {
            let vars = out.vars.get_or_insert_default();
            if let Some(entry) = read_var_line(reader, line) {
                if vars.iter().any(|v| v.name == entry.name) {
                    let cause = format!("{} stands twice in VAR LIST", entry.name);
                    reader.error(codes::LIST_LINE, line.pos, cause, "remove one of the lines");
                }
                vars.push(entry);
            }
        }
        _ => {
            if pull_up_is_valid(line.text) {
                out.pull_ups.get_or_insert_default().push(line.text.to_owned());
            } else {
                let cause = format!("`{}` is no line of PULL-UP LIST", message_text(line.text));
                reader.error(codes::LIST_LINE, line.pos, cause, "write a port and a mask, such as Pb: 0x0F");
            }
        }
    }
}

fn read_io_line(reader: &mut LdReader<'_>, line: &LdLine<'_>) -> Option<IoEntry> {
    let (name, pin, modbus) = match line.tokens.as_slice() {
        [name, at, pin] if at.text == "at" => (*name, *pin, None),
        [name, at, pin, slave, address] if at.text == "at" => (*name, *pin, Some((*slave, *address))),
        _ => {
            let cause = format!("`{}` is no line of IO LIST", message_text(line.text));
            reader.error(codes::IO_LINE, line.pos, cause, "write `name at pin`, such as Xbutton at 2");
            return None;
        }
    };
    let pin_value = reader.read_u32(pin, "the pin", 0, 255);
    let modbus = match modbus {
        None => Some(None),
        Some((slave, address)) => {
            let slave = reader.read_u32(slave, "the Modbus slave", 0, 255);
            let address = reader.read_u32(address, "the Modbus address", 0, 65535);
            slave.zip(address).map(Some)
        }
    };
    let name_value = reader.read_name(name);
    Some(IoEntry { name: name_value?, pin: pin_value?, modbus: modbus?, pos: line.pos })
}

fn check_io_line(reader: &mut LdReader<'_>, line: &LdLine<'_>, entry: &IoEntry, before: &[IoEntry]) {
    if let Some(other) = before.iter().find(|e| e.name == entry.name) {
        let cause = format!("{} stands twice in IO LIST, first at pin {}", entry.name, other.pin);
        reader.error(codes::IO_NAME_TWICE, line.pos, cause, "remove one of the lines");
    } else if let Some(other) = before.iter().find(|e| e.pin == entry.pin && e.pin != 0) {
        let cause = format!("{} and {} are both at pin {}", other.name, entry.name, entry.pin);
        reader.error(codes::PIN_TWICE, line.pos, cause, "choose another pin, or 0 for not assigned");
    }
    if entry.name.starts_with(['X', 'Y', 'R']) {
        reader.use_as_bit(&entry.name);
    }
    let pwm = reader.dialect == LadderDialect::Ldmicro5 && entry.name.starts_with('P');
    if !entry.name.starts_with(['X', 'Y', 'A']) && !pwm {
        let cause = format!("{} is neither an input X.., an output Y.. nor an analog A..", entry.name);
        let hint = "the line is kept, but has no effect";
        reader.report(Severity::Warning, codes::IO_KIND, line.pos, cause, hint);
    }
}

fn read_var_line(reader: &mut LdReader<'_>, line: &LdLine<'_>) -> Option<VarEntry> {
    let words: Vec<&str> = line.tokens.iter().map(|t| t.text).collect();
    let found = match words.as_slice() {
        [n, "bytes" | "byte", name] => Some((n.parse().ok(), *name)),
        [name, "signed", n, "bit", "variable"] => {
            let bits: Option<u8> = n.parse().ok();
            Some((bits.filter(|b| b % 8 == 0).map(|b| b / 8), *name))
        }
        _ => None,
    };
    match found {
        Some((Some(bytes @ 1..=4), name)) if lexer::is_name(name) => {
            Some(VarEntry { name: name.to_owned(), bytes, text: line.text.to_owned(), pos: line.pos })
        }
        _ => {
            let cause = format!("`{}` is no line of VAR LIST", message_text(line.text));
            let hint = "write `2 bytes name` (1 to 4) or `name signed 16 bit variable` (8, 16, 24 or 32)";
            reader.error(codes::LIST_LINE, line.pos, cause, hint);
            None
        }
    }
}

fn pull_up_is_valid(text: &str) -> bool {
    text.split_once(':').is_some_and(|(port, mask)| {
        let port = port.trim();
        let mut letters = port.chars();
        letters.next() == Some('P')
            && letters.next().is_some_and(|c| c.is_ascii_alphabetic())
            && letters.next().is_none()
            && mask.trim().starts_with("0x")
            && lexer::parse_number(mask.trim()).is_some_and(|m| m <= i64::from(u32::MAX))
    })
}
