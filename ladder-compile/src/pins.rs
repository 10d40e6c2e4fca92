//! Which symbol stands at which pin: `--pin` first, then `IO LIST` where it is for this chip, then in order.

use std::collections::HashMap;

use diag::{Diagnostic, Pos, Severity};
use emu_core::chip::Chip;
use ladder::{Program, SymbolKind};

use crate::codes;

/// The pins that a program may use, in the order in which they are given out. PC6 is reset, PB6 and PB7 carry the
/// crystal; PD0 and PD1 come last because boards put the serial line there.
pub const ORDER: &[&str] = &[
    "PD2", "PD3", "PD4", "PD5", "PD6", "PD7", "PB0", "PB1", "PB2", "PB3", "PB4", "PB5", "PC0", "PC1", "PC2", "PC3",
    "PC4", "PC5", "PD0", "PD1",
];

/// A symbol at its pin.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pin {
    /// Symbol.
    pub name: String,
    /// Pin, such as `PD2`.
    pub pin: &'static str,
    /// The symbol is an output.
    pub output: bool,
    /// The symbol is read by the converter.
    pub analog: bool,
}

impl Pin {
    /// Letter of the port.
    #[must_use]
    pub fn port(&self) -> char {
        self.pin.chars().nth(1).unwrap_or('?')
    }

    /// Bit in the port, 0 to 7.
    #[must_use]
    pub fn bit(&self) -> u8 {
        self.pin.chars().nth(2).and_then(|c| c.to_digit(8)).unwrap_or(0) as u8
    }
}

/// Finds a pin for every input and output, inputs first, each sorted by name. Adds what is wrong, and a note when pins
/// were given out in order, to `told`.
pub fn assign(program: &Program, given: &[(String, String)], chip: &Chip, told: &mut Vec<Diagnostic>) -> Vec<Pin> {
    let symbols: Vec<_> =
        program.symbols().into_iter().filter(|s| matches!(s.kind, SymbolKind::Input | SymbolKind::Output)).collect();
    let mut tell = |code, pos: Pos, cause: String, hint: String| {
        told.push(Diagnostic::new(Severity::Error, code, &program.file, pos, cause, hint));
    };
    let none = Pos::default();
    let mut wanted: HashMap<&str, (String, Pos)> = HashMap::new();
    // An ATmega328 has the pins of an ATmega328P, so either's list serves the other.
    let named = program.settings.micro.as_deref().and_then(ladder::chip_of).and_then(emu_avr::chips::chip);
    if named.is_some_and(|named| named.pins == chip.pins) {
        let micro = program.settings.micro.as_deref().unwrap_or_default();
        for entry in program.io.iter().filter(|e| e.pin != 0 && symbols.iter().any(|s| s.name == e.name)) {
            match ladder::package_pin(micro, entry.pin) {
                Some(pin) => _ = wanted.insert(&entry.name, (pin.to_owned(), entry.pos)),
                None => tell(
                    codes::UNKNOWN_PIN,
                    entry.pos,
                    format!("`{}` stands at package pin {}, which carries no port", entry.name, entry.pin),
                    format!("see the pins of `{micro}`; 0 means not assigned"),
                ),
            }
        }
    }
    let mut seen: Vec<&str> = Vec::new();
    for (symbol, pin) in given {
        if !symbols.iter().any(|s| s.name == *symbol) {
            let cause = format!("--pin {symbol}={pin}: the program has no input or output `{symbol}`");
            tell(codes::PIN_SYMBOL, none, cause, "name an X or Y symbol as the program spells it".to_owned());
        } else if seen.contains(&symbol.as_str()) {
            let cause = format!("--pin gives `{symbol}` a pin twice, the second time {pin}");
            tell(codes::PIN_GIVEN_TWICE, none, cause, "remove one of them".to_owned());
        } else {
            seen.push(symbol);
            wanted.insert(symbol, (pin.clone(), none));
        }
    }

    let mut taken: HashMap<&'static str, &str> = HashMap::new();
    let mut homes: HashMap<&str, &'static str> = HashMap::new();
    for symbol in &symbols {
        let Some((pin, pos)) = wanted.get(symbol.name.as_str()) else { continue };
        let Some(usable) = ORDER.iter().copied().find(|p| p.eq_ignore_ascii_case(pin)) else {
            let known = chip.pins.iter().find(|p| p.name.eq_ignore_ascii_case(pin));
            let (code, cause) = match known {
                Some(def) => (codes::PIN_TAKEN, format!("`{}` cannot use {}: {}", symbol.name, def.name, def.note)),
                None => (codes::UNKNOWN_PIN, format!("`{}`: {} has no pin `{pin}`", symbol.name, chip.name)),
            };
            tell(code, *pos, cause, format!("usable are {}", ORDER.join(", ")));
            continue;
        };
        if let Some(other) = taken.insert(usable, &symbol.name) {
            let cause = format!("{usable} is given to `{other}` and to `{}`", symbol.name);
            tell(codes::PIN_TWICE, *pos, cause, "give each of them a pin of its own".to_owned());
        }
        homes.insert(&symbol.name, usable);
    }
    let mut free = ORDER.iter().copied().filter(|pin| !taken.contains_key(pin)).collect::<Vec<_>>().into_iter();
    let open: Vec<&str> = symbols.iter().map(|s| s.name.as_str()).filter(|name| !wanted.contains_key(name)).collect();
    if open.len() > free.len() {
        let cause = format!(
            "{} inputs and outputs, {} of them without a pin, but {} has {} usable pins and {} are free",
            symbols.len(),
            open.len(),
            chip.name,
            ORDER.len(),
            free.len()
        );
        tell(codes::TOO_MANY_PINS, none, cause, "use fewer inputs and outputs".to_owned());
        return Vec::new();
    }
    let mut assigned = Vec::new();
    for name in open {
        if let Some(pin) = free.next() {
            homes.insert(name, pin);
            assigned.push(format!("{name}={pin}"));
        }
    }
    if !assigned.is_empty() {
        let cause = format!("pins assigned in order: {}", assigned.join(" "));
        let hint = format!("choose with --pin {}", assigned.first().map_or("", |a| a.as_str()));
        told.push(Diagnostic::new(Severity::Note, codes::PINS_NOTE, &program.file, none, cause, hint));
    }
    symbols
        .iter()
        .filter_map(|s| {
            let pin = homes.get(s.name.as_str())?;
            Some(Pin { name: s.name.clone(), pin, output: s.kind == SymbolKind::Output, analog: false })
        })
        .collect()
}
