//! Chip names on the command line: names of the rows, and suggestions for other names.

use std::ffi::OsStr;

use clap::builder::{PossibleValue, TypedValueParser};
use clap::{Arg, Command, Error};
use emu_core::chip::Chip;

use crate::shared::family::chips;
use diag::{distance, nearest};

use crate::shared::usage_error::UsageError;

/// Common names of chips and boards, the nearest row, and what the two have in common.
const ALIASES: &[(&str, &str, &str)] = &[
    ("mcs51", "8051", "the first of the family"),
    ("mcs-51", "8051", "the first of the family"),
    ("8051ah", "8051", "the same chip"),
    ("8052ah", "8052", "the same chip"),
    ("80c31", "8031", "the same registers"),
    ("80c32", "8032", "the same registers"),
    ("80c52", "8052", "the same registers"),
    ("87c51", "8751", "the same registers"),
    ("87c52", "8752", "the same registers"),
    ("stc89c51", "at89c51", "its registers at 12 clocks, without those that STC added"),
    ("stc89c51rc", "at89c51", "its registers at 12 clocks, without those that STC added"),
    ("stc89c52", "at89c52", "its registers at 12 clocks, without those that STC added"),
    ("stc89c52rc", "at89c52", "its registers at 12 clocks, without those that STC added"),
    ("avr", "atmega328p", "one of the family"),
    ("arduino", "atmega328p", "the chip of most boards"),
    ("uno", "atmega328p", "the chip of the board"),
    ("nano", "atmega328p", "the chip of the board"),
    ("promini", "atmega328p", "the chip of the board"),
    ("pro-mini", "atmega328p", "the chip of the board"),
    ("pic", "pic16f877a", "one of the family"),
    ("pic16", "pic16f877a", "one of the family"),
];

/// Variants that differ from a row in electrical values only, and that row: the newer process (A) and the
/// low-voltage versions (L, V).
///
/// Data sheets: Microchip DS40001974 (ATmega8A), Atmel 8154 (16A), 8155 (32A), 8160 (64A), 8151 (128A). The
/// data sheets of the rows cover L and V.
const CHIP_VERSIONS: &[(&str, &str)] = &[
    ("atmega8a", "atmega8"),
    ("atmega8l", "atmega8"),
    ("atmega16a", "atmega16"),
    ("atmega16l", "atmega16"),
    ("atmega32a", "atmega32"),
    ("atmega32l", "atmega32"),
    ("atmega64a", "atmega64"),
    ("atmega64l", "atmega64"),
    ("atmega128a", "atmega128"),
    ("atmega128l", "atmega128"),
    ("atmega162v", "atmega162"),
    ("atmega48v", "atmega48"),
    ("atmega88v", "atmega88"),
    ("atmega168v", "atmega168"),
    ("atmega164", "atmega164p"),
    ("atmega324", "atmega324p"),
    ("atmega164v", "atmega164p"),
    ("atmega324v", "atmega324p"),
    ("atmega644v", "atmega644"),
    ("atmega164pv", "atmega164p"),
    ("atmega324pv", "atmega324p"),
    ("atmega644pv", "atmega644p"),
];

/// Prefixes that tools of the manufacturers omit or abbreviate: 89s52, 16f877a, m328p, mega328p.
const PREFIXES: &[(&str, &str)] =
    &[("", ""), ("", "at"), ("", "pic"), ("p", "pic"), ("m", "atmega"), ("mega", "atmega")];

/// Finds the row of the chip `name`, ignoring case. A variant in `CHIP_VERSIONS` gives the row of its chip.
pub fn find_chip(name: &str) -> Option<&'static Chip> {
    let name = name.to_ascii_lowercase();
    let name = CHIP_VERSIONS.iter().find(|(version, _)| *version == name).map_or(name.as_str(), |(_, row)| row);
    chips().find(|chip| chip.name == name)
}

/// Parses the name of a chip, ignoring case.
///
/// # Errors
/// No chip has this name. The message suggests a chip or lists all of them.
pub fn parse_chip(name: &str) -> Result<&'static Chip, UsageError> {
    let name = name.trim().to_ascii_lowercase();
    if let Some(chip) = find_chip(&name) {
        return Ok(chip);
    }
    // Names with additions around them: PIC16F877-20/P, Arduino Uno.
    let plain = name.split(['-', '/']).next().unwrap_or_default();
    let last = name.split_whitespace().next_back().unwrap_or_default();
    if let Some((_, chip, why)) = ALIASES.iter().find(|(alias, ..)| *alias == name || *alias == last) {
        return Err(UsageError::OtherChip { chip, why });
    }
    let whole = |&(short, long): &(&str, &str)| find_chip(&format!("{long}{}", plain.strip_prefix(short)?));
    let whole = PREFIXES.iter().find_map(whole).map(|chip| chip.name);
    // A name that differs by more than one letter is another chip, so it gives no suggestion.
    let near = || nearest(&name, chips().map(|chip| chip.name)).filter(|near| distance(&name, near) <= 1);
    match whole.or_else(near) {
        Some(near) => Err(UsageError::MisspeltChip { near }),
        None => Err(UsageError::UnknownChip { known: chips().map(|chip| chip.name).collect() }),
    }
}

/// Value parser for the name of a chip. Shell completions offer all names.
#[derive(Debug, Clone, Copy)]
pub struct ChipParser;

impl TypedValueParser for ChipParser {
    type Value = &'static Chip;

    fn parse_ref(&self, cmd: &Command, arg: Option<&Arg>, value: &OsStr) -> Result<Self::Value, Error> {
        TypedValueParser::parse_ref(&(parse_chip as fn(&str) -> _), cmd, arg, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(chips().map(|chip| PossibleValue::new(chip.name))))
    }
}

/// A value of `--mcu`: one chip or all.
#[derive(Debug, Clone, Copy)]
pub enum ChipChoice {
    /// The value `all`. Each verb defines what it includes.
    All,
    /// One chip.
    One(&'static Chip),
}

/// Value parser for the name of a chip or `all`. Shell completions offer all names.
#[derive(Debug, Clone, Copy)]
pub struct ChipChoiceParser {
    /// Refuse chips without a compiler.
    pub compiled: bool,
}

impl TypedValueParser for ChipChoiceParser {
    type Value = ChipChoice;

    fn parse_ref(&self, cmd: &Command, arg: Option<&Arg>, value: &OsStr) -> Result<Self::Value, Error> {
        let compiled = self.compiled;
        let parse = move |name: &str| match parse_chip(name) {
            _ if name.eq_ignore_ascii_case("all") => Ok(ChipChoice::All),
            Ok(chip) if compiled && ladder_compile::find_chip(chip.name).is_none() => {
                Err(UsageError::malformed(format!("there is no compiler for {}", chip.name)))
            }
            found => found.map(ChipChoice::One),
        };
        TypedValueParser::parse_ref(&parse, cmd, arg, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        let usable = |chip: &&Chip| !self.compiled || ladder_compile::find_chip(chip.name).is_some();
        let names = chips().filter(usable).map(|chip| chip.name).collect::<Vec<_>>();
        Some(Box::new(["all"].into_iter().chain(names).map(PossibleValue::new)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_alias_leads_to_a_chip_and_is_none() {
        for (alias, name, _) in ALIASES {
            assert!(chips().any(|chip| chip.name == *name), "{alias}: {name}");
            assert!(chips().all(|chip| chip.name != *alias), "{alias}");
        }
    }

    #[test]
    fn versions_have_the_row_of_their_chip() {
        for (version, name) in CHIP_VERSIONS {
            assert!(chips().all(|chip| chip.name != *version), "{version}");
            assert_eq!(parse_chip(&version.to_ascii_uppercase()).map(|chip| chip.name), Ok(*name), "{version}");
        }
        assert!(find_chip("atmega328pb").is_none(), "another chip");
    }

    #[test]
    fn the_chip_that_is_meant_is_named() {
        for (name, meant) in [
            ("89c51", "at89c51"),
            ("89S52", "at89s52"),
            ("16f877a", "pic16f877a"),
            ("p16f84a", "pic16f84a"),
            ("m328p", "atmega328p"),
            ("mega8", "atmega8"),
            ("mega8a", "atmega8"),
            ("80c52", "8052"),
            ("stc89c52rc", "at89c52"),
            ("mcs51", "8051"),
            ("uno", "atmega328p"),
            ("atmega382p", "atmega328p"),
        ] {
            let message = parse_chip(name).expect_err(name).to_string();
            assert!(message.contains(&format!("`{meant}`")), "{name}: {message}");
        }
        assert_eq!(parse_chip("ATmega328P").map(|chip| chip.name), Ok("atmega328p"));
        assert!(parse_chip("z80").expect_err("unknown").to_string().contains("chips are atmega"));
    }
}
