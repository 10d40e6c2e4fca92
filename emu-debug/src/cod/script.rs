//! The messages of a program as actions at the start and at addresses.

use std::collections::BTreeMap;

use emu_core::image::SimulatorMessage;

use super::command::{CodAssertion, CodCommand, parse_assertion, parse_command};
use super::error::CodError;
use super::expr::CodExpression;

/// Maximum message length in bytes; a file holds at most 255.
const LONGEST: usize = 1000;

/// An action when the instruction at an address is reached.
#[derive(Debug, Clone, PartialEq)]
pub enum CodAction {
    /// Something must hold before the instruction.
    Assert(CodAssertion),
    /// A command before the instruction.
    Before(CodCommand),
    /// A command after the instruction.
    After(CodCommand),
}

/// A message that cannot be executed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("message {kind} at 0x{addr:04x}, `{text}`: {cause}")]
pub struct CodRefusal {
    /// Its program word address.
    pub addr: u32,
    /// Its kind.
    pub kind: char,
    /// Its text.
    pub text: String,
    /// The reason.
    #[source]
    pub cause: CodError,
}

/// The parsed messages of a program.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CodScript {
    /// Commands for the start, with their messages.
    pub start: Vec<(CodCommand, SimulatorMessage)>,
    /// Actions at program words, with their messages.
    pub by_address: BTreeMap<u32, Vec<(CodAction, SimulatorMessage)>>,
}

impl CodScript {
    /// Parses messages. Kinds other than A, C and E are for other tools and are skipped.
    ///
    /// # Errors
    /// The messages that cannot be executed.
    pub fn read(messages: &[SimulatorMessage]) -> Result<CodScript, Vec<CodRefusal>> {
        let mut script = CodScript::default();
        let mut refusals = Vec::new();
        for message in messages {
            if message.text.len() > LONGEST {
                refusals.push(refusal(message, CodError::MessageTooLong { most: LONGEST }));
                continue;
            }
            for text in lines(&message.text) {
                let action = match message.kind {
                    'E' | 'e' => parse_run_command(text).map(|command| {
                        script.start.push((command, message.clone()));
                        None
                    }),
                    'A' | 'a' => parse_assertion(text).map(|assertion| Some(CodAction::Assert(assertion))),
                    'C' => parse_run_command(text).map(|command| Some(CodAction::Before(command))),
                    'c' => parse_run_command(text).map(|command| Some(CodAction::After(command))),
                    _ => Ok(None),
                };
                match action {
                    Ok(Some(action)) => {
                        script.by_address.entry(message.addr).or_default().push((action, message.clone()))
                    }
                    Ok(None) => {}
                    Err(cause) => refusals.push(refusal(message, cause)),
                }
            }
        }
        if refusals.is_empty() { Ok(script) } else { Err(refusals) }
    }

    /// Returns the oscillator frequency in Hz that the program requests at the start. A chip with times in
    /// seconds must be built for it.
    #[must_use]
    pub fn frequency(&self) -> Option<u64> {
        let frequencies = self.start.iter().filter_map(|(command, _)| frequency(command));
        let mut hz = frequencies.filter_map(|expr| match expr {
            CodExpression::Value(value) => value.to_integer().and_then(|hz| u64::try_from(hz).ok()),
            _ => None,
        });
        hz.rfind(|hz| *hz > 0)
    }

    /// Removes requests for a frequency at the start, because the user has chosen one.
    pub fn ignore_frequency(&mut self) {
        self.start.retain(|(command, _)| frequency(command).is_none());
    }
}

/// Returns the lines of a message: a message may contain a whole stimulus, from its first word to its `end`.
fn lines(text: &str) -> Vec<&str> {
    const WORDS: [&str; 8] = ["initial_state", "start_cycle", "start", "period", "name", "digital", "analog", "end"];
    let text = text.trim();
    if !matches!(text.split_whitespace().next(), Some("stimulus" | "stim")) {
        return vec![text];
    }
    let (mut lines, mut from, mut before) = (Vec::new(), 0, "");
    for word in text.split_whitespace() {
        let at = word.as_ptr() as usize - text.as_ptr() as usize;
        let begins = WORDS.contains(&word) || word.starts_with('{');
        if begins && before != "name" {
            lines.push(text[from..at].trim());
            from = at;
        }
        before = word;
    }
    lines.push(text[from..].trim());
    lines
}

/// Parses a command; refuses a clock of 0 Hz.
fn parse_run_command(text: &str) -> Result<CodCommand, CodError> {
    let command = parse_command(text)?;
    match frequency(&command) {
        Some(CodExpression::Value(value)) if value.to_integer() == Some(0) => Err(CodError::ZeroFrequency),
        _ => Ok(command),
    }
}

/// Returns the frequency that a command requests.
fn frequency(command: &CodCommand) -> Option<&CodExpression> {
    match command {
        CodCommand::Frequency(expr) => Some(expr),
        CodCommand::Assign { name, value } if name.ends_with(".frequency") => Some(value),
        _ => None,
    }
}

/// Returns the refusal of a message.
pub(super) fn refusal(message: &SimulatorMessage, cause: CodError) -> CodRefusal {
    CodRefusal { addr: message.addr, kind: message.kind, text: message.text.clone(), cause }
}
