//! The pins of ports whose registers the program names: those that no symbol and no peripheral of it uses.

use emu_core::chip::{Chip, ChipFamily};
use emu_core::pins::{PinId, PinLevel};
use ladder::LadderProgram;
use ladder::registers::{self, PortRegister, RegisterKind};
use ladder_eval::Evaluator;

use crate::chip::deviation::Deviation;
use crate::chip::families::{self, HighDrive};

/// A port with its registers, by symbol index, and its free pins, by bit.
#[derive(Debug, Clone)]
pub(crate) struct PortPins {
    latch: Option<usize>,
    direction: Option<usize>,
    /// Value of a direction bit that makes an output.
    output_bit: i32,
    /// Bit, pin, name, and whether the pin is never driven high.
    pub pins: Vec<(u8, PinId, &'static str, bool)>,
}

/// The ports of a program on a chip; `named` are the pins that it uses otherwise.
pub(crate) fn port_pins(
    program: &LadderProgram,
    chip: &'static Chip,
    eval: &Evaluator,
    named: &[PinId],
) -> Vec<PortPins> {
    let registers = registers::port_registers(program);
    let mut letters: Vec<char> = registers.iter().map(|register| register.port).collect();
    letters.dedup();
    let port = |port: char| {
        let symbol = |kind| eval.index(&PortRegister { port, kind }.name());
        // Pins of the clock and of reset are no pins of a port.
        let pins = families::unnamed_pins(chip, named).drivable.into_iter().filter_map(|pin| {
            let name = chip.pins.get(usize::from(pin))?.name;
            let mut chars = name.chars().skip(1);
            let bit = chars.next().filter(|letter| *letter == port).and(chars.next())?.to_digit(8)?;
            let is_open_drain = families::pin_behaviour(chip, pin)?.high == HighDrive::Open;
            (name.len() == 3).then_some((bit as u8, pin, name, is_open_drain))
        });
        PortPins {
            latch: symbol(RegisterKind::Latch),
            direction: symbol(RegisterKind::Direction),
            output_bit: i32::from(chip.family == ChipFamily::Avr),
            pins: pins.collect(),
        }
    };
    letters.into_iter().map(port).collect()
}

impl PortPins {
    /// Compares the pins with the registers, and returns their number or the first deviation. `level` gives
    /// the level of a pin.
    pub(crate) fn compare(&self, eval: &Evaluator, level: impl Fn(PinId) -> PinLevel) -> Result<u64, Deviation> {
        for &(bit, pin, name, is_open_drain) in &self.pins {
            let of = |register: usize| eval.get(register) >> bit & 1;
            let is_output = self.direction.is_some_and(|register| of(register) == self.output_bit);
            let high = self.latch.is_some_and(|register| of(register) == 1);
            let found = level(pin);
            let (wanted, fits) = match (is_output, high) {
                (true, false) => ("low", found == PinLevel::Low),
                (true, true) if is_open_drain => ("not driven", found != PinLevel::Low),
                (true, true) => ("high", found == PinLevel::High),
                // A latch of 1 may switch on a pull-up.
                (false, _) => ("an input, not driven", found != PinLevel::Low),
            };
            if !fits {
                return Err(Deviation::new(
                    format!("{name} {wanted}, by the registers of its port"),
                    format!("{found:?}").to_lowercase(),
                ));
            }
        }
        Ok(self.pins.len() as u64)
    }
}

/// Returns true if a port register shares the value of this symbol with another symbol. A tool that writes
/// one of them in memory must write the other too.
pub(crate) fn is_shared(program: &LadderProgram, name: &str) -> bool {
    let latch = PortRegister::from_name(name).filter(|register| register.kind == RegisterKind::Latch);
    let shared = registers::shared_pins(program);
    shared
        .iter()
        .filter(|pin| pin.output)
        .any(|pin| pin.name == name || latch.is_some_and(|latch| latch.port == pin.port))
}
