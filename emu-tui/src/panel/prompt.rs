//! The command line of the panel: `Xa=1`, `Aname=512`, `Cparts=5`, `send hello\n`, `scan 100`, `speed 0.5`.

use super::{LadderPanel, SPEEDS};
use crate::TuiError;

/// Maximum number of scans per command.
const MAX_SCANS: u64 = 1_000_000;

/// Executes a command line; returns its message.
pub(super) fn run_command(panel: &mut LadderPanel, line: &str) -> Result<String, TuiError> {
    let line = line.trim();
    if let Some((name, value)) = line.split_once('=') {
        return set(panel, name.trim(), value.trim());
    }
    let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
    match word {
        "" => Ok(String::new()),
        "send" => {
            let bytes = unescape_bytes(rest)?;
            panel.machine.send(&bytes);
            Ok(format!("{} byte(s) on their way", panel.machine.incoming_bytes()))
        }
        "scan" => {
            let scans = rest.trim().parse().ok().filter(|scans| (1..=MAX_SCANS).contains(scans));
            panel.machine.run(scans.ok_or(TuiError::BadScanCount { most: MAX_SCANS })?);
            Ok(String::new())
        }
        "back" => {
            let scans = rest.trim().parse().map_err(|_| TuiError::BadBackCount)?;
            Ok(format!("{} scan(s) back", panel.machine.go_back(scans)))
        }
        "speed" => {
            let speed = rest.trim().parse().ok().filter(|speed| SPEEDS.contains(speed));
            panel.speed = speed.ok_or(TuiError::BadSpeed { low: *SPEEDS.start(), high: *SPEEDS.end() })?;
            Ok(String::new())
        }
        _ => Err(TuiError::UnknownCommand { line: line.to_owned() }),
    }
}

fn set(panel: &mut LadderPanel, name: &str, value: &str) -> Result<String, TuiError> {
    let machine = &mut panel.machine;
    let index = machine.index(name).ok_or_else(|| TuiError::UnknownSymbol { name: name.to_owned() })?;
    let range = machine.symbols().get(index).map_or((0, 1), |symbol| symbol.range().into_inner());
    let analog = machine.levels().any(|(symbol, _)| symbol == index);
    let (low, high) = if analog { (0, 1023) } else { range };
    let number = value.parse::<i64>().ok().filter(|number| (low..=high).contains(number));
    let number = number.ok_or_else(|| TuiError::ValueOutOfRange { name: name.to_owned(), low, high })?;
    match u16::try_from(number) {
        Ok(level) if analog => machine.set_level(index, level),
        _ => machine.set(index, number as i32),
    }
    Ok(format!("{name} = {number}"))
}

/// The bytes of a text with the escapes `\n`, `\r`, `\t`, `\0`, `\\` and `\xNN`.
fn unescape_bytes(text: &str) -> Result<Vec<u8>, TuiError> {
    let mut out = Vec::new();
    let mut rest = text.chars();
    while let Some(c) = rest.next() {
        if c != '\\' {
            out.extend(c.to_string().bytes());
            continue;
        }
        out.push(match rest.next() {
            Some('n') => b'\n',
            Some('r') => b'\r',
            Some('t') => b'\t',
            Some('0') => 0,
            Some('\\') => b'\\',
            Some('x') => {
                let digits: String = rest.by_ref().take(2).collect();
                let byte = u8::from_str_radix(&digits, 16).ok().filter(|_| digits.len() == 2);
                byte.ok_or(TuiError::BadHexEscape)?
            }
            _ => return Err(TuiError::UnknownEscape),
        });
    }
    Ok(out)
}
