//! Conditions that end a run.

use emu_core::pins::{PinId, PinLevel};

use crate::names::address_names::{AddressNames, AddressRange};
use crate::stimulus::{PinAndLevel, example_pin, parse_pin_level};
use crate::text::input_error::{InputError, malformed};
use crate::text::text_escapes::{escape, unescape};

/// A condition.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StopCondition {
    /// The instruction at this program word is next.
    Pc(u32),
    /// One of these program words, at which the code of a source line begins, is next; with the line as
    /// written, `main.c:12`.
    Line(String, Vec<u32>),
    /// The instruction at this program word has been fetched but not executed.
    Fetch(u32),
    /// The pin has this level, from the start or by a change; [`PinLevel::Float`] if nothing drives it.
    Pin(PinId, PinLevel),
    /// The program reads one of these bytes of data memory, or one of these bits.
    Read(AddressRange),
    /// The program writes one of these bytes of data memory, or one of these bits.
    Write(AddressRange),
    /// The chip has sent these bytes in sequence.
    Uart(Vec<u8>),
}

/// Parses `pc=0x1A2`, `fetch=0x1A2` (AP101), `pin PB5=1`, `read data:0x100`, `write data:0x100..0x110` or
/// `uart "text"`.
///
/// # Errors
/// The text is not a condition, or it names an address or a pin that the chip does not have.
pub fn parse_condition(names: &AddressNames<'_>, text: &str) -> Result<StopCondition, InputError> {
    let text = text.trim();
    let (word, rest) = text.split_once([' ', '=']).unwrap_or((text, ""));
    let rest = rest.trim();
    match word {
        "pc" => Ok(StopCondition::Pc(names.parse_program_word(rest.trim_start_matches('=').trim())?)),
        "fetch" if names.chip.is_bit_controller() => {
            Ok(StopCondition::Fetch(names.parse_program_word(rest.trim_start_matches('=').trim())?))
        }
        "fetch" => Err(InputError::NoFetchCycles { text: text.to_owned(), chip: names.chip.name }),
        "pin" => parse_pin_level(names.chip, &names.replace_channel_name(rest))
            .map(|PinAndLevel { pin, level }| StopCondition::Pin(pin, level)),
        "read" => Ok(StopCondition::Read(parse_data_range(names, rest)?)),
        "write" => Ok(StopCondition::Write(parse_data_range(names, rest)?)),
        "uart" => {
            let inner = rest.strip_prefix('"').and_then(|r| r.strip_suffix('"')).unwrap_or(rest);
            if has_unescaped_quote(inner) {
                return Err(InputError::UnpairedQuotes { text: rest.to_owned() });
            }
            Ok(StopCondition::Uart(unescape(inner)?))
        }
        _ => {
            let (pin, place) = (example_pin(names.chip, 5), names.example_address());
            let examples = format!("pc=0x1a2, `pin {pin}=1`, `write {place}`, `read {place}` or `uart \"text\"`");
            Err(malformed(text, "condition", examples))
        }
    }
}

impl StopCondition {
    /// Describes the condition for messages, with the chip's pin names.
    #[must_use]
    pub fn describe(&self, names: &AddressNames<'_>) -> String {
        let range = |r: &AddressRange| match (r.end - r.start, names.symbol_of_range(r)) {
            (1, _) => format!("{}:0x{:x}", r.space, r.start),
            (_, Some(name)) => format!("{}:{name}", r.space),
            _ => format!("{}:0x{:x}..0x{:x}", r.space, r.start, r.end),
        };
        match self {
            StopCondition::Pc(word) => format!("pc=0x{:x}", names.chip.code_address(*word)),
            StopCondition::Fetch(word) => format!("fetch=0x{:x}", names.chip.code_address(*word)),
            StopCondition::Line(line, _) => format!("pc={line}"),
            StopCondition::Pin(pin, level) => {
                let name = names.chip.pins.get(usize::from(*pin)).map_or("?", |p| p.name);
                let level = match level {
                    PinLevel::Low => "0",
                    PinLevel::High => "1",
                    PinLevel::Float | PinLevel::PullUp | PinLevel::PullDown => "z",
                };
                format!("pin {name}={level}")
            }
            StopCondition::Read(r) => format!("read {}", range(r)),
            StopCondition::Write(r) => format!("write {}", range(r)),
            StopCondition::Uart(bytes) => format!("uart {}", escape(bytes)),
        }
    }
}

/// Returns true if `text` contains a quote without a backslash before it.
fn has_unescaped_quote(text: &str) -> bool {
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

fn parse_data_range(names: &AddressNames<'_>, text: &str) -> Result<AddressRange, InputError> {
    let range = names.parse_range(text)?;
    names.check_observable(&range)?;
    Ok(range)
}
