//! Registers of ports as operands (`#PORTB`, `#PINB`, `#TRISB`), and the pins of `IO LIST` that they share.

use std::collections::BTreeSet;

use crate::model::{LadderProgram, ProgramElement, SymbolKind};
use crate::packages;

/// Which of the registers of a port.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum RegisterKind {
    /// `#PORTx`: the output latch.
    Latch,
    /// `#PINx`: the levels of the pins.
    Level,
    /// `#TRISx`: the directions, DDRx on AVR and TRISx on PIC16.
    Direction,
}

/// A register of a port that a program names as an integer of one byte (LDmicro 5).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PortRegister {
    /// Letter of the port, A to P.
    pub port: char,
    /// Which register of the port.
    pub kind: RegisterKind,
}

/// Families of chips, which differ in the meaning of a direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RegisterFamily {
    /// A direction of 1 is an output.
    Avr,
    /// A direction of 0 is an output.
    Pic16,
}

/// An input or output that `IO LIST` puts on a port of which the program names a register.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SharedPin {
    /// Letter of the port.
    pub port: char,
    /// Number of the bit, 0 to 7.
    pub bit: u8,
    /// Name of the symbol.
    pub name: String,
    /// True for an output.
    pub output: bool,
}

impl PortRegister {
    /// The register with a name such as `#PORTB`; `None` for any other name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<PortRegister> {
        let name = name.strip_prefix('#')?;
        let rows = [("PORT", RegisterKind::Latch), ("PIN", RegisterKind::Level), ("TRIS", RegisterKind::Direction)];
        rows.into_iter().find_map(|(stem, kind)| {
            let mut letters = name.strip_prefix(stem)?.chars();
            let port = letters.next().filter(|letter| ('A'..='P').contains(letter))?;
            letters.next().is_none().then_some(PortRegister { port, kind })
        })
    }

    /// Name in a program, such as `#PORTB`.
    #[must_use]
    pub fn name(self) -> String {
        let stem = match self.kind {
            RegisterKind::Latch => "PORT",
            RegisterKind::Level => "PIN",
            RegisterKind::Direction => "TRIS",
        };
        format!("#{stem}{}", self.port)
    }
}

/// The port register at an address in the data memory of the chip that `MICRO=` names, as LDmicro's `#number`
/// means it.
#[must_use]
pub fn register_at(micro: &str, address: u32) -> Option<PortRegister> {
    use RegisterKind::{Direction, Latch, Level};
    let of = |port: char, kind| Some(PortRegister { port, kind });
    let chip = packages::chip_of(micro)?;
    let letter = |n: u32, first: u8| char::from(first + n as u8);
    let found = match (register_family(micro)?, address) {
        // PORTx is read at the pins too, so its address has one name.
        (RegisterFamily::Pic16, 5..=9) => of(letter(address - 5, b'A'), Latch),
        (RegisterFamily::Pic16, 0x85..=0x89) => of(letter(address - 0x85, b'A'), Direction),
        (RegisterFamily::Pic16, _) => None,
        (RegisterFamily::Avr, _) => {
            // First address of PINx, DDRx, PORTx, which follow each other.
            let rows: &[(u32, char)] = match chip {
                "atmega48" | "atmega88" | "atmega168" | "atmega328p" => &[(0x23, 'B'), (0x26, 'C'), (0x29, 'D')],
                "atmega64" | "atmega128" => match address {
                    0x20 => return of('F', Level),
                    0x61 => return of('F', Direction),
                    0x62 => return of('F', Latch),
                    _ => &[(0x21, 'E'), (0x63, 'G'), (0x30, 'D'), (0x33, 'C'), (0x36, 'B'), (0x39, 'A')],
                },
                "atmega162" => &[(0x25, 'E'), (0x30, 'D'), (0x33, 'C'), (0x36, 'B'), (0x39, 'A')],
                "atmega8" => &[(0x30, 'D'), (0x33, 'C'), (0x36, 'B')],
                _ => &[(0x30, 'D'), (0x33, 'C'), (0x36, 'B'), (0x39, 'A')],
            };
            let row = rows.iter().find(|(first, _)| (*first..first + 3).contains(&address))?;
            let kind = [Level, Direction, Latch].into_iter().nth((address - row.0) as usize)?;
            return of(row.1, kind);
        }
    };
    found.filter(|register| has_port(micro, register.port))
}

/// Family of the chip that `MICRO=` names; `None` for an unknown chip.
#[must_use]
pub fn register_family(micro: &str) -> Option<RegisterFamily> {
    let chip = packages::chip_of(micro)?;
    Some(if chip.starts_with("pic") { RegisterFamily::Pic16 } else { RegisterFamily::Avr })
}

/// False if the chip is known and has no such port.
pub(crate) fn has_port(micro: &str, port: char) -> bool {
    packages::package_pin_count(micro).is_none()
        || (1..=100).any(|pin| packages::package_pin(micro, pin).is_some_and(|name| name.chars().nth(1) == Some(port)))
}

/// All port registers that the rungs of a program name.
#[must_use]
pub fn port_registers(program: &LadderProgram) -> BTreeSet<PortRegister> {
    let mut found = BTreeSet::new();
    for ProgramElement { element, .. } in program.elements() {
        found.extend(element.facts().symbols.iter().filter_map(|symbol| PortRegister::from_name(&symbol.name)));
    }
    found
}

/// The inputs and outputs on ports of which the program names a register, by port and bit.
///
/// Of several symbols at one pin the first by kind and name counts. Empty if `MICRO=` names no chip whose
/// pins are known.
#[must_use]
pub fn shared_pins(program: &LadderProgram) -> Vec<SharedPin> {
    let ports: BTreeSet<char> = port_registers(program).into_iter().map(|register| register.port).collect();
    let Some(micro) = program.settings.micro.as_deref().filter(|_| !ports.is_empty()) else { return Vec::new() };
    let mut shared: Vec<SharedPin> = Vec::new();
    for symbol in program.symbols() {
        if !matches!(symbol.kind, SymbolKind::Input | SymbolKind::Output) {
            continue;
        }
        let Some(pin) = packages::package_pin(micro, symbol.pin) else { continue };
        let (Some(port), Some(bit)) = (pin.chars().nth(1), pin.chars().nth(2).and_then(|digit| digit.to_digit(8)))
        else {
            continue;
        };
        let bit = bit as u8;
        if ports.contains(&port) && !shared.iter().any(|other| (other.port, other.bit) == (port, bit)) {
            shared.push(SharedPin { port, bit, name: symbol.name, output: symbol.kind == SymbolKind::Output });
        }
    }
    shared.sort_by_key(|pin| (pin.port, pin.bit));
    shared
}

/// Value of `#TRISx` at power-up: the outputs of `IO LIST` on the port are outputs, all other pins inputs.
#[must_use]
pub fn initial_directions(program: &LadderProgram, port: char) -> u8 {
    let shared = shared_pins(program);
    let outputs = shared.iter().filter(|pin| pin.port == port && pin.output).fold(0, |mask, pin| mask | 1 << pin.bit);
    match program.settings.micro.as_deref().and_then(register_family) {
        Some(RegisterFamily::Avr) => outputs,
        Some(RegisterFamily::Pic16) | None => !outputs,
    }
}
