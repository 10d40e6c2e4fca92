//! Parses messages: assertions and commands.

use super::error::CodError;
use super::expr::{CodExpression, CodTextReader};

/// An assertion.
#[derive(Debug, Clone, PartialEq)]
pub struct CodAssertion {
    /// The condition that must hold; without one, the run always halts.
    pub condition: Option<CodExpression>,
    /// The text to print when the run halts.
    pub text: String,
}

/// Parses `count == 3, 'text'`, `'text'` or an empty text.
///
/// # Errors
/// No expression, or text after it.
pub fn parse_assertion(text: &str) -> Result<CodAssertion, CodError> {
    let mut reader = CodTextReader::new(text);
    if reader.rest().is_empty() {
        return Ok(CodAssertion { condition: None, text: String::new() });
    }
    let mut whole = reader;
    if let Some(text) = whole.quoted().filter(|_| whole.rest().is_empty()) {
        return Ok(CodAssertion { condition: None, text: text.to_owned() });
    }
    // Macros may leave the comma without an expression.
    let holds = if reader.rest().starts_with(',') { None } else { Some(reader.expr()?) };
    let said = if reader.take(",") { reader.quoted().unwrap_or("").to_owned() } else { String::new() };
    if !reader.rest().is_empty() {
        return Err(CodError::TrailingText { rest: reader.rest().to_owned() });
    }
    let said = if said.is_empty() && holds.is_some() { format!("does not hold: {}", text.trim()) } else { said };
    Ok(CodAssertion { condition: holds, text: said })
}

/// A command.
#[derive(Debug, Clone, PartialEq)]
#[rustfmt::skip]
pub enum CodCommand {
    /// Nothing that affects a run.
    None,
    /// `module load TYPE NAME`.
    Module { kind: String, name: String },
    /// `node NAME ..`.
    Nodes(Vec<String>),
    /// `attach NODE PIN ..`.
    Attach { node: String, pins: Vec<String> },
    /// `break c N`: the run ends at this machine cycle.
    Limit(CodExpression),
    /// `frequency HZ`.
    Frequency(CodExpression),
    /// `symbol NAME=VALUE`.
    Symbol { name: String, value: CodExpression },
    /// `NAME = VALUE`, for registers, symbols and attributes.
    Assign { name: String, value: CodExpression },
    /// A line of a stimulus: `stimulus asynchronous_stimulus`, `period N`, `{ cycle, value }` and so on, up
    /// to `end`.
    Stimulus(CodStimulusLine),
    /// `dump e MODULE FILE`: saves the contents of an EEPROM under a name.
    SaveEeprom { module: String, file: String },
    /// `load e MODULE FILE`: fills an EEPROM with the saved contents.
    LoadEeprom { module: String, file: String },
}

/// A line of a stimulus.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs)]
pub enum CodStimulusLine {
    Begin,
    Initial(CodExpression),
    Start(CodExpression),
    Period(CodExpression),
    Name(String),
    Analog(bool),
    Data(Vec<CodExpression>),
    End,
}

/// Parses a command.
///
/// # Errors
/// It is malformed or not supported.
pub fn parse_command(text: &str) -> Result<CodCommand, CodError> {
    let text = text.trim();
    if text.is_empty() || text.starts_with('#') || text == "echo" || text.starts_with("echo ") {
        return Ok(CodCommand::None);
    }
    let mut reader = CodTextReader::new(text);
    if let Some(data) = data(&mut reader)? {
        return Ok(CodCommand::Stimulus(data));
    }
    if let Some(RegisterAssignment { register: name, value }) = register(text) {
        return Ok(CodCommand::Assign { name: name.to_owned(), value: whole(CodTextReader::new(value))? });
    }
    let first = reader.name().ok_or_else(|| CodError::UnknownCommand { text: text.to_owned() })?;
    let words: Vec<&str> = reader.rest().split_whitespace().collect();
    let owned = |words: &[&str]| words.iter().map(|word| (*word).to_owned()).collect::<Vec<_>>();
    if reader.rest().starts_with('=') && !reader.rest().starts_with("==") {
        reader.take("=");
        return match bare_word(reader.rest()) {
            Some(value) => Ok(CodCommand::Assign { name: first.to_owned(), value }),
            None => Ok(CodCommand::Assign { name: first.to_owned(), value: whole(reader)? }),
        };
    }
    match (first, words.as_slice()) {
        ("module", ["library" | "lib", _]) => Ok(CodCommand::None),
        ("module", ["load", kind, name]) => {
            Ok(CodCommand::Module { kind: (*kind).to_owned(), name: (*name).to_owned() })
        }
        ("module", ["load", kind]) => Ok(CodCommand::Module { kind: (*kind).to_owned(), name: (*kind).to_owned() }),
        ("node", [_, ..]) => Ok(CodCommand::Nodes(owned(&words))),
        ("attach", [node, pins @ ..]) => Ok(CodCommand::Attach { node: (*node).to_owned(), pins: owned(pins) }),
        ("break", ["c", _]) => {
            reader.take("c");
            Ok(CodCommand::Limit(whole(reader)?))
        }
        ("frequency", [_, ..]) => Ok(CodCommand::Frequency(whole(reader)?)),
        ("symbol", [_, ..]) => {
            let name = reader.name().unwrap_or("");
            if name.is_empty() || !reader.take("=") {
                return Err(CodError::MalformedSymbol { text: text.to_owned() });
            }
            Ok(CodCommand::Symbol { name: name.to_owned(), value: whole(reader)? })
        }
        ("stimulus" | "stim", ["asynchronous_stimulus" | "asy"]) => Ok(CodCommand::Stimulus(CodStimulusLine::Begin)),
        ("initial_state", [_, ..]) => Ok(CodCommand::Stimulus(CodStimulusLine::Initial(whole(reader)?))),
        ("start_cycle" | "start", [_, ..]) => Ok(CodCommand::Stimulus(CodStimulusLine::Start(whole(reader)?))),
        ("period", [_, ..]) => Ok(CodCommand::Stimulus(CodStimulusLine::Period(whole(reader)?))),
        ("name", [name]) => Ok(CodCommand::Stimulus(CodStimulusLine::Name((*name).to_owned()))),
        ("digital", []) => Ok(CodCommand::Stimulus(CodStimulusLine::Analog(false))),
        ("analog", []) => Ok(CodCommand::Stimulus(CodStimulusLine::Analog(true))),
        ("end", []) => Ok(CodCommand::Stimulus(CodStimulusLine::End)),
        ("dump", ["e", module, file]) => {
            Ok(CodCommand::SaveEeprom { module: (*module).to_owned(), file: (*file).to_owned() })
        }
        ("load", ["e", module, file]) => {
            Ok(CodCommand::LoadEeprom { module: (*module).to_owned(), file: (*file).to_owned() })
        }
        (
            "attach" | "break" | "frequency" | "load" | "module" | "node" | "run" | "step" | "stimulus" | "stim"
            | "symbol" | "x" | "clear" | "reset" | "trace" | "log" | "set" | "macro" | "processor" | "initial_state"
            | "start_cycle" | "period" | "name" | "icd" | "list" | "dump" | "quit",
            _,
        ) => Err(CodError::UnsupportedCommand { text: text.to_owned() }),
        // A bare expression only prints its value.
        _ => {
            let mut again = CodTextReader::new(text);
            again.expr()?;
            if again.rest().is_empty() {
                Ok(CodCommand::None)
            } else {
                Err(CodError::UnknownCommand { text: text.to_owned() })
            }
        }
    }
}

/// The parts of `reg(ADDRESS) = VALUE`.
#[derive(Debug, Clone, Copy)]
struct RegisterAssignment<'a> {
    /// The register, with its parentheses.
    register: &'a str,
    /// The text after the equals sign.
    value: &'a str,
}

/// Splits `reg(ADDRESS) = VALUE` into the register and the value.
fn register(text: &str) -> Option<RegisterAssignment<'_>> {
    let (name, value) = text.split_once('=').filter(|(_, value)| !value.starts_with('='))?;
    let name = name.trim_end();
    (address(name).is_some()).then_some(RegisterAssignment { register: name, value })
}

/// Returns the address of `reg(ADDRESS)`.
pub(super) fn address(name: &str) -> Option<u32> {
    let text = name.strip_prefix("reg")?.trim_start().strip_prefix('(')?.strip_suffix(')')?;
    match CodTextReader::new(text).expr() {
        Ok(CodExpression::Value(value)) => value.to_integer().and_then(|addr| u32::try_from(addr).ok()),
        _ => None,
    }
}

fn whole(mut reader: CodTextReader<'_>) -> Result<CodExpression, CodError> {
    let expr = reader.expr()?;
    if reader.rest().is_empty() { Ok(expr) } else { Err(CodError::TrailingText { rest: reader.rest().to_owned() }) }
}

/// Parses `open` and `closed`, the named states of a switch.
fn bare_word(text: &str) -> Option<CodExpression> {
    use super::value::CodValue;
    match text {
        "open" => Some(CodExpression::Value(CodValue::Bool(false))),
        "closed" => Some(CodExpression::Value(CodValue::Bool(true))),
        _ => None,
    }
}

/// Parses `{ cycle, value, .. }` or a part of it: a list with its braces may extend over several messages.
fn data(reader: &mut CodTextReader<'_>) -> Result<Option<CodStimulusLine>, CodError> {
    let opened = reader.take("{");
    if reader.rest() == "}" {
        return Ok(Some(CodStimulusLine::Data(Vec::new())));
    }
    let number = reader.rest().starts_with(|c: char| c.is_ascii_digit());
    if !opened && !number {
        return Ok(None);
    }
    let mut values = Vec::new();
    while !reader.rest().is_empty() && !reader.take("}") {
        values.push(reader.expr()?);
        if !reader.take(",") && !reader.rest().is_empty() && !reader.rest().starts_with('}') {
            return Err(CodError::MissingComma { rest: reader.rest().to_owned() });
        }
    }
    Ok(Some(CodStimulusLine::Data(values)))
}
