//! Reads the lines of `IO LIST`, `VAR LIST` and `PULL-UP LIST`, as LDmicro 5 reads them.
//!
//! LDmicro reads a line with C's `scanf`: it accepts any text after the part that it knows, and skips some
//! lines that it does not know. What has no effect is reported as a note or a warning.

use diag::{Pos, Severity};

use crate::codes;
use crate::lexer::{self, LdLine, LdToken};
use crate::model::{IoEntry, LadderDialect, VarEntry};
use crate::packages;
use crate::program_head::ProgramHead;
use crate::reader::{LdReader, message_text};

/// Maximum number of lines of a list.
const MAX_LIST: usize = 4_000;
/// Width in bytes that LDmicro 5 gives to a variable with a width that it does not support.
const FALLBACK_BYTES: u8 = 2;
/// Number of characters of a line of a list that LDmicro 5 reads at once.
const LIST_LINE_CHARS: usize = 63;
/// Parts of the names that LDmicro 5 gives to the pins of its buses.
const BUS_PINS: [&str; 6] = ["_MOSI", "_MISO", "_SCK", "__SS", "_SCL", "_SDA"];

/// Reads one line of the list named `list`.
pub(crate) fn read_list_line(reader: &mut LdReader<'_>, list: &str, line: &LdLine<'_>, out: &mut ProgramHead) {
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
                    let cause = format!("{} is twice in VAR LIST: this line counts", message_text(&entry.name));
                    reader.report(Severity::Note, codes::LIST_LINE, line.pos, cause, "remove one of the lines");
                }
                vars.push(entry);
            }
        }
        _ => {
            check_pull_up(reader, line, out.micro.as_deref());
            out.pull_ups.get_or_insert_default().push(line.text.to_owned());
        }
    }
}

fn read_io_line(reader: &mut LdReader<'_>, line: &LdLine<'_>) -> Option<IoEntry> {
    let (name, pin, rest) = match line.tokens.as_slice() {
        [name, at, pin, rest @ ..] if at.text == "at" => (*name, *pin, rest),
        _ => {
            let cause = format!("`{}` is not a line of IO LIST: it is skipped", message_text(line.text));
            let hint = "write `name at pin`, such as Xbutton at 2";
            reader.report(Severity::Warning, codes::IO_LINE, line.pos, cause, hint);
            return None;
        }
    };
    let pin = read_pin(reader, name, pin);
    let modbus = read_modbus(reader, rest);
    if !lexer::is_name(name.text) {
        let cause = format!("no element can use the name `{}`: the line is skipped", message_text(name.text));
        let hint = "a name has letters A-Z a-z, digits and _, and does not begin with a digit";
        reader.report(Severity::Warning, codes::BAD_NAME, name.pos, cause, hint);
        return None;
    }
    Some(IoEntry { name: name.text.to_owned(), pin: pin?, modbus, pos: line.pos })
}

/// Reads the number of a pin, or the name of a port bit of the chip that MICRO= names above. Any other text
/// assigns no pin.
fn read_pin(reader: &mut LdReader<'_>, name: LdToken<'_>, pin: LdToken<'_>) -> Option<u32> {
    if let Some(number) = reader.micro.as_deref().and_then(|micro| packages::pin_of_port_bit(micro, pin.text)) {
        let (name, shown) = (message_text(name.text), message_text(pin.text));
        let cause = format!("{name} is at {shown}, pin {number} of the package");
        reader.report(Severity::Note, codes::NOT_A_NUMBER, pin.pos, cause, format!("write {number}"));
        return Some(number);
    }
    let (value, rest) = lexer::split_decimal(pin.text).unwrap_or((0, pin.text));
    let found = u32::try_from(value).ok().filter(|pin| *pin <= 255);
    match found {
        None => {
            let cause = format!("the pin is {}, allowed is 0 to 255", message_text(pin.text));
            reader.error(codes::OUT_OF_RANGE, pin.pos, cause, "choose a value from 0 to 255");
        }
        Some(number) if !rest.is_empty() => {
            let (name, shown) = (message_text(name.text), message_text(pin.text));
            let cause = format!("the pin `{shown}` is not a number: {name} is at {number}");
            let hint = "write the number of the package pin, or 0 for not assigned";
            reader.report(Severity::Warning, codes::NOT_A_NUMBER, pin.pos, cause, hint);
        }
        Some(_) => {}
    }
    found
}

/// Reads the Modbus slave and address after the pin. LDmicro 5 keeps 8 and 16 bits of them.
fn read_modbus(reader: &mut LdReader<'_>, rest: &[LdToken<'_>]) -> Option<(u32, u32)> {
    let mut number = |token: Option<&LdToken<'_>>, what: &str, modulus: i64| {
        let token = token?;
        let (value, _) = lexer::split_decimal(token.text).filter(|(_, rest)| rest.is_empty())?;
        let kept = value.rem_euclid(modulus);
        if kept != value {
            let cause = format!("{what} is {}, LDmicro 5 takes {kept}", message_text(token.text));
            let hint = format!("choose a value from 0 to {}", modulus - 1);
            reader.report(Severity::Warning, codes::OUT_OF_RANGE, token.pos, cause, hint);
        }
        u32::try_from(kept).ok()
    };
    let slave = number(rest.first(), "the Modbus slave", 1 << 8);
    let modbus = slave.and_then(|slave| Some((slave, number(rest.get(1), "the Modbus address", 1 << 16)?)));
    if let Some(extra) = rest.get(if modbus.is_some() { 2 } else { 0 }) {
        let cause = format!("`{}` has no effect", message_text(extra.text));
        let hint = "write `name at pin` or `name at pin slave address`";
        reader.report(Severity::Note, codes::IO_LINE, extra.pos, cause, hint);
    }
    modbus
}

fn check_io_line(reader: &mut LdReader<'_>, line: &LdLine<'_>, entry: &IoEntry, before: &[IoEntry]) {
    if let Some(other) = before.iter().find(|e| e.name == entry.name) {
        let cause = format!("{} occurs twice in IO LIST, first at pin {}", entry.name, other.pin);
        reader.error(codes::IO_NAME_TWICE, line.pos, cause, "remove one of the lines");
    } else if let Some(other) = before.iter().find(|e| e.pin == entry.pin && e.pin != 0) {
        let cause = format!("{} and {} are both at pin {}", other.name, entry.name, entry.pin);
        reader.error(codes::PIN_TWICE, line.pos, cause, "choose another pin, or 0 for not assigned");
    }
    if entry.name.starts_with(['X', 'Y', 'R']) {
        reader.use_as_bit(&entry.name);
    }
    let is_ldmicro5 = reader.dialect == LadderDialect::Ldmicro5;
    if entry.name.starts_with(['X', 'Y', 'A']) || (is_ldmicro5 && entry.name.starts_with('P')) {
        return;
    }
    let hint = "the line is kept, but has no effect";
    if is_ldmicro5 && BUS_PINS.iter().any(|p| entry.name.contains(p)) {
        let cause = format!("{} is a pin of a bus, which has its own pins of the chip here", entry.name);
        return reader.report(Severity::Note, codes::IO_KIND, line.pos, cause, hint);
    }
    if is_ldmicro5 && entry.name.starts_with(['I', 'M', 'C', 'H']) {
        let cause = format!("{} belongs to Modbus, which is not supported here", entry.name);
        reader.report(Severity::Note, codes::IO_KIND, line.pos, cause, hint);
    } else {
        let cause = format!("{} is neither an input X.., an output Y.. nor an analog A..", entry.name);
        reader.report(Severity::Warning, codes::IO_KIND, line.pos, cause, hint);
    }
}

fn read_var_line(reader: &mut LdReader<'_>, line: &LdLine<'_>) -> Option<VarEntry> {
    let found = split_bytes_line(line.text).or_else(|| split_bits_line(line.text)).filter(|(size, ..)| *size > 0);
    let Some((size, unit, name)) = found else {
        let cause = format!("`{}` is not a line of VAR LIST", message_text(line.text));
        let hint = "write `2 bytes name` (1 to 4) or `name signed 16 bit variable` (8, 16, 24 or 32)";
        reader.error(codes::LIST_LINE, line.pos, cause, hint);
        return None;
    };
    let bits_of_unit = if unit == "bytes" { 8 } else { 1 };
    let whole = u8::try_from(size.saturating_mul(bits_of_unit) / 8).ok().filter(|bytes| (1..=4).contains(bytes));
    let bytes = whole.unwrap_or(FALLBACK_BYTES);
    let shown = message_text(name);
    let note = if name.starts_with('#') {
        Some((format!("{shown} is a special register of LDmicro 5"), "the line is kept, but has no effect"))
    } else if !lexer::is_name(name) {
        Some((format!("no element can use the name `{shown}`"), "the line is kept, but has no effect"))
    } else if i64::from(bytes) * 8 != size.saturating_mul(bits_of_unit) {
        let hint = "write a width of 1 to 4 bytes: 8, 16, 24 or 32 bit";
        Some((format!("{shown} has {bytes} byte(s), not {size} {unit}, as in LDmicro 5"), hint))
    } else {
        None
    };
    if let Some((cause, hint)) = note {
        reader.report(Severity::Note, codes::LIST_LINE, line.pos, cause, hint);
    }
    Some(VarEntry { name: name.to_owned(), bytes, text: line.text.to_owned(), pos: line.pos })
}

/// Splits `n bytes name ..` as ` %d bytes %s` of `scanf` does: into number, unit and name.
fn split_bytes_line(text: &str) -> Option<(i64, &'static str, &str)> {
    let (size, rest) = lexer::split_decimal(text)?;
    let rest = rest.trim_start();
    let singular = || rest.strip_prefix("byte").filter(|name| name.starts_with(char::is_whitespace));
    let name = rest.strip_prefix("bytes").or_else(singular)?;
    Some((size, "bytes", name.split_whitespace().next()?))
}

/// Splits `name signed n bit variable ..` as ` %s signed %d` of `scanf` does: into number, unit and name.
fn split_bits_line(text: &str) -> Option<(i64, &'static str, &str)> {
    let (name, rest) = text.split_once(char::is_whitespace)?;
    let (size, _) = lexer::split_decimal(rest.trim_start().strip_prefix("signed")?.trim_start())?;
    Some((size, "bit", name))
}

/// Reports a line of PULL-UP LIST that LDmicro 5 refuses or ignores.
fn check_pull_up(reader: &mut LdReader<'_>, line: &LdLine<'_>, micro: Option<&str>) {
    let shown = message_text(line.text);
    let Some(port) = pull_up_port(line.text) else {
        let cause = format!("`{shown}` is not a line of PULL-UP LIST: it has no effect");
        let hint = "write a port and a mask, such as PB: 0x0F";
        return reader.report(Severity::Warning, codes::LIST_LINE, line.pos, cause, hint);
    };
    let Some(micro) = micro else {
        let cause = format!("`{shown}` has no effect, because MICRO= is not before the list");
        let hint = "put MICRO= before PULL-UP LIST";
        return reader.report(Severity::Note, codes::LIST_LINE, line.pos, cause, hint);
    };
    require_port(reader, port, micro, line.pos);
}

fn require_port(reader: &mut LdReader<'_>, port: [char; 2], micro: &str, pos: Pos) {
    let [prefix, letter] = port;
    let wanted = if micro.contains("PIC1") { 'R' } else { 'P' };
    if prefix != wanted || !('A'..='P').contains(&letter.to_ascii_uppercase()) {
        let shown = message_text(&format!("{prefix}{letter}"));
        let cause = format!("`{shown}` in PULL-UP LIST is not a port of {}", message_text(micro));
        reader.error(codes::LIST_LINE, pos, cause, format!("write a port such as {wanted}B"));
    }
}

/// The two characters of the port in a line of PULL-UP LIST; `None` if the line has no port and mask.
fn pull_up_port(text: &str) -> Option<[char; 2]> {
    let mut chars = text.chars();
    let port = [chars.next()?, chars.next()?];
    let mask = chars.as_str().strip_prefix(':')?.trim_start().strip_prefix("0x")?;
    mask.starts_with(|c: char| c.is_ascii_hexdigit()).then_some(port)
}

/// Notes lines of VAR LIST that LDmicro 5 refuses and emu reads: remarks, and lines longer than its buffer.
pub(crate) fn note_refused_var_lines(reader: &mut LdReader<'_>, text: &str) {
    let mut in_list = false;
    for (raw, number) in text.lines().zip(1u32..) {
        let line = raw.trim();
        match line {
            "PROGRAM" => return,
            "END" => in_list = false,
            _ => {}
        }
        let long = raw.chars().count() > LIST_LINE_CHARS;
        let pos = Pos::new(number, 1, raw.chars().count() as u32);
        if in_list && line.starts_with(';') {
            let cause = "LDmicro 5 takes no remark in VAR LIST and refuses the file";
            reader.report(Severity::Note, codes::LIST_LINE, pos, cause, "put the remark before the list");
        } else if in_list && long {
            let cause =
                format!("LDmicro 5 reads {LIST_LINE_CHARS} characters of a line of VAR LIST and refuses the rest");
            reader.report(Severity::Note, codes::LIST_LINE, pos, cause, "shorten the line");
        }
        in_list |= line.split_whitespace().eq(["VAR", "LIST"]);
    }
}
