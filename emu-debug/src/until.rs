//! Conditions that end a run.

use emu_core::chip::Family;
use emu_core::pins::{Level, PinId};

use crate::place::{Names, Range};
use crate::stimulus::{example_pin, pin_level};
use crate::text::{escape, unescape};

/// A condition.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Until {
    /// The instruction at this program word is next.
    Pc(u32),
    /// One of these program words is next, with which the code of a source line begins; the line as written, `main.c:12`.
    Line(String, Vec<u32>),
    /// The instruction at this program word has been fetched, and is not executed yet.
    Fetch(u32),
    /// The pin has this level, from the start or by a change; [`Level::Float`] where nothing is to drive it.
    Pin(PinId, Level),
    /// The program reads one of these bytes of data memory, or one of these bits.
    Read(Range),
    /// The program writes one of these bytes of data memory, or one of these bits.
    Write(Range),
    /// The chip has sent these bytes one after the other.
    Uart(Vec<u8>),
}

/// Reads `pc=0x1A2`, `fetch=0x1A2` (AP101), `pin PB5=1`, `read data:0x100`, `write data:0x100..0x110` or `uart "text"`.
///
/// # Errors
/// Not such a text, or an address or pin that the chip does not have.
pub fn until(names: &Names<'_>, text: &str) -> Result<Until, String> {
    let text = text.trim();
    let (word, rest) = text.split_once([' ', '=']).unwrap_or((text, ""));
    let rest = rest.trim();
    match word {
        "pc" => Ok(Until::Pc(names.program_word(rest.trim_start_matches('=').trim())?)),
        "fetch" if names.chip.family == Family::Ap101 => {
            Ok(Until::Fetch(names.program_word(rest.trim_start_matches('=').trim())?))
        }
        "fetch" => Err(format!(
            "`{text}` is for chips that fetch and execute one after the other, as ap101; {} is none",
            names.chip.name
        )),
        "pin" => pin_level(names.chip, &names.with_channel(rest)).map(|(pin, level)| Until::Pin(pin, level)),
        "read" => Ok(Until::Read(data(names, rest)?)),
        "write" => Ok(Until::Write(data(names, rest)?)),
        "uart" => {
            let inner = rest.strip_prefix('"').and_then(|r| r.strip_suffix('"')).unwrap_or(rest);
            if has_bare_quote(inner) {
                return Err(format!(
                    "the quotes of `{rest}` do not pair; write \"text\", and \\\" for one within the text"
                ));
            }
            Ok(Until::Uart(unescape(inner)?))
        }
        _ => {
            let (pin, place) = (example_pin(names.chip, 5), names.example());
            Err(format!(
                "`{text}` is no condition; write pc=0x1a2, `pin {pin}=1`, `write {place}`, `read {place}` or `uart \"text\"`"
            ))
        }
    }
}

impl Until {
    /// What was waited for, for messages; the chip's pins by name.
    #[must_use]
    pub fn describe(&self, names: &Names<'_>) -> String {
        let range = |r: &Range| match (r.end - r.start, names.whole(r)) {
            (1, _) => format!("{}:0x{:x}", r.space, r.start),
            (_, Some(name)) => format!("{}:{name}", r.space),
            _ => format!("{}:0x{:x}..0x{:x}", r.space, r.start, r.end),
        };
        match self {
            Until::Pc(word) => format!("pc=0x{:x}", names.chip.code_address(*word)),
            Until::Fetch(word) => format!("fetch=0x{:x}", names.chip.code_address(*word)),
            Until::Line(line, _) => format!("pc={line}"),
            Until::Pin(pin, level) => {
                let name = names.chip.pins.get(usize::from(*pin)).map_or("?", |p| p.name);
                let level = match level {
                    Level::Low => "0",
                    Level::High => "1",
                    Level::Float | Level::PullUp | Level::PullDown => "z",
                };
                format!("pin {name}={level}")
            }
            Until::Read(r) => format!("read {}", range(r)),
            Until::Write(r) => format!("write {}", range(r)),
            Until::Uart(bytes) => format!("uart {}", escape(bytes)),
        }
    }
}

/// True when a quote stands in `text` without a backslash that makes it a part of the text.
fn has_bare_quote(text: &str) -> bool {
    let mut chars = text.chars();
    while let Some(c) = chars.next() {
        match c {
            '"' => return true,
            '\\' => _ = chars.next(),
            _ => {}
        }
    }
    false
}

fn data(names: &Names<'_>, text: &str) -> Result<Range, String> {
    let range = names.range(text)?;
    names.told(&range)?;
    Ok(range)
}
