//! Assigns symbols to pins: `--pin` first, then `IO LIST` if it applies to this chip, then automatically in
//! order.

use std::collections::HashMap;

use diag::{Diagnostic, Pos, Severity};
use emu_core::chip::{Chip, ChipFamily};
use ladder::registers::{self, SharedPin};
use ladder::{ChipPart, Element, LadderProgram, ProgramElement, PwmOutput, SymbolKind};

use crate::codes;
use crate::target::{CompileTarget, PwmPin};

/// A pin that the user gives to a symbol, such as `--pin Xstart=PD2`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PinAssignment {
    /// Name of the input, output or analog input.
    pub symbol: String,
    /// Name of the pin, such as `PD2`.
    pub pin: String,
}

impl PinAssignment {
    /// Creates an assignment; the compiler checks both names.
    #[must_use]
    pub fn new(symbol: &str, pin: &str) -> PinAssignment {
        PinAssignment { symbol: symbol.to_owned(), pin: pin.to_owned() }
    }

    /// Returns the assignment with the name as the program spells it ([`ladder::find_symbol`]).
    #[must_use]
    pub fn spelled_in(&self, program: &LadderProgram) -> PinAssignment {
        let symbols = program.symbols();
        let found = ladder::find_symbol(&symbols, &self.symbol).and_then(|index| symbols.get(index));
        PinAssignment::new(found.map_or(self.symbol.as_str(), |symbol| symbol.name.as_str()), &self.pin)
    }
}

/// A symbol with its pin.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AssignedPin {
    /// Name of the symbol.
    pub name: String,
    /// Name of the pin, such as `PD2`.
    pub pin: &'static str,
    /// True if the symbol is an output.
    pub output: bool,
    /// True if the converter reads the symbol.
    pub analog: bool,
}

impl AssignedPin {
    /// Letter or digit of the port.
    #[must_use]
    pub fn port_letter(&self) -> char {
        self.pin.chars().nth(1).unwrap_or('?')
    }

    /// Bit number in the port, 0 to 7.
    #[must_use]
    pub fn bit_number(&self) -> u8 {
        self.pin.chars().next_back().and_then(|c| c.to_digit(8)).unwrap_or(0) as u8
    }
}

/// A symbol that needs a pin.
struct PinRequest {
    name: String,
    kind: SymbolKind,
}

/// Number of symbols that a hint names.
const MOST_NAMED: usize = 12;

/// The pins of a program.
#[derive(Debug, Clone, Default)]
pub struct PinPlan {
    /// Inputs, outputs and analog inputs.
    pub pins: Vec<AssignedPin>,
    /// PWM outputs, in the order in which the program names them first.
    pub pwm_pins: Vec<PwmPin>,
}

/// Assigns a pin to every input, output and analog input, in this order, each group sorted by name.
///
/// Adds errors, and a note if pins were assigned automatically, to `notes`.
pub fn assign_pins(
    program: &LadderProgram,
    requested: &[PinAssignment],
    target: &'static CompileTarget,
    notes: &mut Vec<Diagnostic>,
) -> PinPlan {
    let chip = target.chip;
    let requested: Vec<PinAssignment> = requested.iter().map(|given| given.spelled_in(program)).collect();
    let used = program.elements().filter_map(|ProgramElement { element, .. }| match element {
        Element::ReadAdc { name, .. } => Some(name.clone()),
        _ => None,
    });
    let used: Vec<String> = used.collect();
    let wanted_pins: Vec<PinRequest> = program
        .symbols()
        .into_iter()
        .filter(|s| match s.kind {
            SymbolKind::Input | SymbolKind::Output => true,
            // An unread analog input needs no pin; another check refuses a read if the chip has no converter.
            SymbolKind::Adc => used.contains(&s.name) && !target.adc.is_empty(),
            _ => false,
        })
        .map(|s| PinRequest { name: s.name, kind: s.kind })
        .collect();
    let mut push_diagnostic = |code, pos: Pos, cause: String, hint: String| {
        notes.push(Diagnostic::new(Severity::Error, code, &program.file, pos, cause, hint));
    };
    let none = Pos::default();
    let mut wanted: HashMap<&str, (String, Pos)> = HashMap::new();
    let micro = program.settings.micro.as_deref().unwrap_or_default();
    let named = ladder::chip_of(micro).and_then(find_chip_row);
    let io_list_applies = named.is_some_and(|named| has_same_pins(named, target));
    let outputs = program.pwm_outputs();
    let is_pwm = |name: &str| outputs.iter().any(|output| output.name.as_deref() == Some(name));
    if io_list_applies {
        let overridden = |name: &str| requested.iter().any(|given| given.symbol == name);
        let is_wanted = |name: &str| wanted_pins.iter().any(|s| s.name == name) || is_pwm(name);
        for entry in program.io.iter().filter(|e| e.pin != 0 && is_wanted(&e.name) && !overridden(&e.name)) {
            match ladder::package_pin(micro, entry.pin) {
                Some(pin) => _ = wanted.insert(&entry.name, (pin.to_owned(), entry.pos)),
                None => push_diagnostic(
                    codes::UNKNOWN_PIN,
                    entry.pos,
                    package_pin_error(micro, &entry.name, entry.pin),
                    "choose a port pin; 0 means not assigned, --pin overrides".to_owned(),
                ),
            }
        }
    }
    let mut requested_symbols: Vec<&str> = Vec::new();
    for PinAssignment { symbol, pin } in &requested {
        if !wanted_pins.iter().any(|s| s.name == *symbol) && !is_pwm(symbol) {
            let cause = format!("--pin {symbol}={pin}: the program has no input or output `{symbol}`");
            let named = wanted_pins.iter().map(|symbol| symbol.name.as_str());
            let hint = match diag::nearest(symbol, named.clone()) {
                Some(near) => format!("did you mean {near}?"),
                None => format!("name one of {}", named.take(MOST_NAMED).collect::<Vec<_>>().join(", ")),
            };
            push_diagnostic(codes::PIN_SYMBOL, none, cause, hint);
        } else if requested_symbols.contains(&symbol.as_str()) {
            let cause = format!("--pin gives `{symbol}` a pin twice, the second time {pin}");
            push_diagnostic(codes::PIN_GIVEN_TWICE, none, cause, "remove one of them".to_owned());
        } else {
            requested_symbols.push(symbol);
            wanted.insert(symbol, (pin.clone(), none));
        }
    }
    let taken: Vec<&'static str> = peripheral_pins(program, target, &[]).into_iter().map(|(pin, _)| pin).collect();
    let pwm_pins = assign_pwm_pins(&outputs, target, &wanted, &taken, &mut push_diagnostic);

    // Pins of peripherals that the program uses are reserved, and all of a port whose registers it names.
    let shared = registers::shared_pins(program);
    let ports: Vec<char> = registers::port_registers(program).iter().map(|register| register.port).collect();
    let of_register = |pin: &str| pin.chars().nth(1).is_some_and(|letter| ports.contains(&letter));
    let mut used_by: HashMap<&'static str, &str> = HashMap::new();
    used_by.extend(target.pins.iter().filter(|pin| of_register(pin)).map(|pin| (*pin, OF_REGISTER)));
    for (pin, part) in peripheral_pins(program, target, &pwm_pins) {
        if let Some(other) = used_by.insert(pin, part).filter(|other| *other != part && *other != OF_REGISTER) {
            let cause = format!("{pin} of {} belongs to {part} and to {other}, and the program uses both", chip.name);
            push_diagnostic(codes::PIN_TAKEN, none, cause, "use one of the two, or a chip with more pins".to_owned());
        }
    }
    let port_and_bit = |pin: &SharedPin| format!("{}{}", pin.port, pin.bit);
    let mut assigned_pins: HashMap<&str, &'static str> = HashMap::new();
    let usable = |kind: SymbolKind| usable_pins(target, kind);
    for symbol in &wanted_pins {
        let Some((pin, pos)) = wanted.get(symbol.name.as_str()) else { continue };
        let all = usable(symbol.kind);
        let Some(pin_found) = all.iter().copied().find(|p| p.eq_ignore_ascii_case(pin)) else {
            let chip_pin = chip.pins.iter().find(|p| p.name.eq_ignore_ascii_case(pin));
            let why = |note: &str| match symbol.kind {
                SymbolKind::Adc => "the converter does not reach it".to_owned(),
                _ if note.is_empty() => "it cannot be this".to_owned(),
                _ => note.to_owned(),
            };
            let (code, cause) = match chip_pin {
                Some(def) => {
                    (codes::PIN_TAKEN, format!("`{}` cannot use {}: {}", symbol.name, def.name, why(def.note)))
                }
                None => (codes::UNKNOWN_PIN, format!("`{}`: {} has no pin `{pin}`", symbol.name, chip.name)),
            };
            push_diagnostic(code, *pos, cause, format!("usable are {}", pin_ranges(&all)));
            continue;
        };
        let shared_pin = shared.iter().find(|pin| pin.name == symbol.name);
        if shared_pin.is_some_and(|pin| !pin_found.ends_with(&port_and_bit(pin))) {
            continue;
        }
        if shared_pin.is_some()
            || symbol.kind == SymbolKind::Adc && used_by.get(pin_found) == Some(&"a register of its port")
        {
            used_by.remove(pin_found);
        }
        if let Some(other) = used_by.insert(pin_found, &symbol.name) {
            let cause = format!("{pin_found} is given to `{other}` and to `{}`", symbol.name);
            push_diagnostic(codes::PIN_TWICE, *pos, cause, "give each of them a pin of its own".to_owned());
        }
        assigned_pins.insert(&symbol.name, pin_found);
    }
    // The checks of elements refuse registers on other families.
    let has_registers = matches!(chip.family, ChipFamily::Avr | ChipFamily::Pic16);
    for pin in shared.iter().filter(|pin| has_registers && !assigned_pins.contains_key(pin.name.as_str())) {
        let cause =
            format!("IO LIST puts `{}` at bit {} of port {}, whose register it shares", pin.name, pin.bit, pin.port);
        let hint = "leave it there, and compile for the chip that MICRO= names".to_owned();
        push_diagnostic(codes::PIN_TAKEN, none, cause, hint);
    }
    // Analog inputs have the fewest possible pins, so they are assigned first.
    let mut unassigned: Vec<&PinRequest> =
        wanted_pins.iter().filter(|s| !wanted.contains_key(s.name.as_str())).collect();
    unassigned.sort_by_key(|s| s.kind != SymbolKind::Adc);
    let (mut assigned, mut names_without_pin) = (Vec::new(), Vec::new());
    let free_before = target.pins.iter().filter(|pin| !used_by.contains_key(*pin)).count();
    for symbol in &unassigned {
        let Some(pin) = usable(symbol.kind).into_iter().find(|pin| !used_by.contains_key(pin)) else {
            names_without_pin.push(symbol.name.as_str());
            continue;
        };
        used_by.insert(pin, &symbol.name);
        assigned_pins.insert(&symbol.name, pin);
        assigned.push(format!("{}={pin}", symbol.name));
    }
    if let Some(name) = names_without_pin.first() {
        let cause = format!(
            "{} inputs and outputs, {} of them without a pin, but {} has {} usable pins and {free_before} are free: none is left \
             for `{name}`",
            wanted_pins.len(),
            unassigned.len(),
            chip.name,
            target.pins.len(),
        );
        push_diagnostic(codes::TOO_MANY_PINS, none, cause, "use fewer inputs and outputs".to_owned());
        return PinPlan::default();
    }
    if !assigned.is_empty() {
        let why = match named.filter(|_| !io_list_applies) {
            Some(named) => format!("MICRO= names {}, which has other pins, so its IO LIST is left out; ", named.name),
            None => String::new(),
        };
        let cause = format!("{why}pins assigned in order: {}", assigned.join(" "));
        let hint = format!("choose with --pin {}", assigned.first().map_or("", |a| a.as_str()));
        notes.push(Diagnostic::new(Severity::Note, codes::PINS_NOTE, &program.file, none, cause, hint));
    }
    let pins = wanted_pins.iter().filter_map(|s| {
        let pin = assigned_pins.get(s.name.as_str())?;
        let (output, analog) = (s.kind == SymbolKind::Output, s.kind == SymbolKind::Adc);
        Some(AssignedPin { name: s.name.clone(), pin, output, analog })
    });
    PinPlan { pins: pins.collect(), pwm_pins }
}

/// The pins of the PWM outputs: those that the program wants, and for the others the first that nothing
/// wants.
fn assign_pwm_pins(
    outputs: &[PwmOutput],
    target: &'static CompileTarget,
    wanted: &HashMap<&str, (String, Pos)>,
    taken: &[&'static str],
    push_diagnostic: &mut dyn FnMut(&'static str, Pos, String, String),
) -> Vec<PwmPin> {
    let of = |output: &PwmOutput| output.name.as_deref().and_then(|name| wanted.get(name));
    let pins: Vec<&str> = target.pwm.iter().map(|at| at.pin).collect();
    let mut assigned: Vec<PwmPin> = Vec::new();
    for output in outputs.iter().filter(|_| !pins.is_empty()) {
        let chosen = match of(output) {
            Some((pin, pos)) => {
                let found = target.pwm.iter().find(|at| at.pin.eq_ignore_ascii_case(pin));
                if found.is_none() {
                    let which = if pins.len() == 1 { "PWM output of" } else { "PWM outputs of" };
                    let are = if pins.len() == 1 { "is" } else { "are" };
                    let cause = format!(
                        "`{}` is at {pin}, but the {which} {} {are} {}",
                        output.label(),
                        target.chip.name,
                        pins.join(", ")
                    );
                    let why = if target.chip.family == ChipFamily::Avr { "; timer 1 paces the scans" } else { "" };
                    push_diagnostic(codes::PIN_TAKEN, *pos, cause, format!("put it at {}{why}", pins.join(" or ")));
                }
                found
            }
            None => {
                let is_wanted = |pin: &str| wanted.values().any(|(other, _)| other.eq_ignore_ascii_case(pin));
                let is_free = |at: &&PwmPin| assigned.iter().all(|other| other.pin != at.pin);
                let free = || target.pwm.iter().filter(is_free);
                free().find(|at| !is_wanted(at.pin) && !taken.contains(&at.pin)).or_else(|| free().next())
            }
        };
        let Some(at) = chosen.copied().filter(|at| assigned.iter().all(|other| other.pin != at.pin)) else {
            let pos = of(output).map_or(Pos::default(), |(_, pos)| *pos);
            if chosen.is_some() || of(output).is_none() {
                let cause = format!(
                    "no PWM output of {} is left for `{}`: they are {}",
                    target.chip.name,
                    output.label(),
                    pins.join(", ")
                );
                push_diagnostic(
                    codes::PIN_TWICE,
                    pos,
                    cause,
                    "give each output a pin of its own, or choose a chip with more".to_owned(),
                );
            }
            continue;
        };
        assigned.push(at);
    }
    assigned
}

/// Says why a symbol cannot be at a pin of the package that MICRO= names.
fn package_pin_error(micro: &str, symbol: &str, pin: u32) -> String {
    let start = format!("`{symbol}` is at package pin {pin}");
    match (ladder::package_pin_name(micro, pin), ladder::package_pin_count(micro)) {
        (Some(name), _) => format!("{start}, which is {name} on {micro}"),
        (None, Some(count)) => format!("{start}, but {micro} has {count} pins"),
        (None, None) => format!("{start}, and the pins of the package in `{micro}` are not known"),
    }
}

/// Pins that a symbol of this kind can have, in order of assignment.
fn usable_pins(target: &'static CompileTarget, kind: SymbolKind) -> Vec<&'static str> {
    match kind {
        SymbolKind::Adc => target.adc.iter().map(|&(pin, _)| pin).collect(),
        kind => {
            let output = kind == SymbolKind::Output;
            target.pins.iter().copied().filter(|pin| target.can_use_pin(pin, output)).collect()
        }
    }
}

/// What uses a pin of a port whose register the program names.
const OF_REGISTER: &str = "a register of its port";

/// Pins that peripherals use, with the name of the peripheral.
fn peripheral_pins(
    program: &LadderProgram,
    target: &'static CompileTarget,
    pwm_pins: &[PwmPin],
) -> Vec<(&'static str, &'static str)> {
    let (sends, receives) = (program.uses_part(ChipPart::Transmitter), program.uses_part(ChipPart::Receiver));
    let mut out = Vec::new();
    out.extend(target.uart.filter(|_| sends).map(|(transmit, _)| (transmit, "the serial line")));
    out.extend(target.uart.filter(|_| receives).map(|(_, receive)| (receive, "the serial line")));
    out.extend(pwm_pins.iter().map(|at| (at.pin, "the PWM output")));
    let (i2c, spi) = (program.uses_part(ChipPart::I2c), program.uses_part(ChipPart::Spi));
    let i2c = target.i2c.filter(|_| i2c).into_iter().flat_map(|(data, clock)| [data, clock]);
    out.extend(i2c.map(|pin| (pin, "the I2C bus")));
    out.extend(target.spi.filter(|_| spi).into_iter().flatten().map(|pin| (pin, "the SPI bus")));
    out
}

/// Finds a chip by its name, in any family.
fn find_chip_row(name: &str) -> Option<&'static Chip> {
    emu_avr::chips::chip(name).or_else(|| emu_pic16::chips::chip(name)).or_else(|| emu_8051::chips::chip(name))
}

/// True if the package of `named` has all pins at the same positions as the target's, so that its `IO LIST`
/// applies.
fn has_same_pins(named: &Chip, target: &CompileTarget) -> bool {
    let package_position = |chip: &Chip, name: &str| chip.pins.iter().find(|pin| pin.name == name).map(|pin| pin.dip);
    named.family == target.chip.family
        && target.pins.iter().all(|pin| {
            package_position(named, pin).is_some() && package_position(named, pin) == package_position(target.chip, pin)
        })
}

/// Formats names of pins, with consecutive ones as a range: `PB0..PB5, PD2`.
fn pin_ranges(names: &[&str]) -> String {
    let split = |name: &str| {
        let digits = name.trim_end_matches(|c: char| c.is_ascii_digit()).len();
        (name[..digits].to_owned(), name[digits..].parse::<u32>().unwrap_or(0))
    };
    let mut rows: Vec<(&str, &str, (String, u32))> = Vec::new();
    for name in names {
        let (stem, number) = split(name);
        match rows.last_mut() {
            Some((_, last, end)) if end.0 == stem && end.1 + 1 == number => (*last, end.1) = (name, number),
            _ => rows.push((name, name, (stem, number))),
        }
    }
    let text = |(first, last, _): &(&str, &str, _)| match first == last {
        true => (*first).to_owned(),
        false => format!("{first}..{last}"),
    };
    rows.iter().map(text).collect::<Vec<_>>().join(", ")
}
