//! Registers of ports (5.12): their bits that are inputs and outputs of the program, and the levels of the
//! pins.

use ladder::registers::{self, PortRegister, RegisterFamily, RegisterKind};
use ladder::{LadderProgram, SymbolKind};

/// A port of which the program names a register. All indices are of symbols.
#[derive(Debug, Default)]
pub(crate) struct FlatPort {
    /// `#PORTx`.
    latch: Option<u32>,
    /// `#PINx`.
    levels: Option<u32>,
    /// `#TRISx`.
    directions: Option<u32>,
    /// True if a 1 in the directions is an output.
    one_is_output: bool,
    /// Inputs of `IO LIST`: bit and symbol.
    inputs: Vec<(u8, u32)>,
    /// Outputs of `IO LIST`: bit and symbol.
    outputs: Vec<(u8, u32)>,
}

/// The ports of a program; `find` gives the index of a symbol.
pub(crate) fn flatten_ports(program: &LadderProgram, find: impl Fn(&str) -> Option<u32>) -> Vec<FlatPort> {
    let mut ports: Vec<(char, FlatPort)> = Vec::new();
    for register in registers::port_registers(program) {
        let PortRegister { port, kind } = register;
        if ports.last().is_none_or(|(last, _)| *last != port) {
            ports.push((port, FlatPort::default()));
        }
        let (Some((_, flat)), Some(symbol)) = (ports.last_mut(), find(&register.name())) else { continue };
        match kind {
            RegisterKind::Latch => flat.latch = Some(symbol),
            RegisterKind::Level => flat.levels = Some(symbol),
            RegisterKind::Direction => flat.directions = Some(symbol),
        }
    }
    let family = program.settings.micro.as_deref().and_then(registers::register_family);
    for pin in registers::shared_pins(program) {
        let (Some((_, flat)), Some(symbol)) = (ports.iter_mut().find(|(port, _)| *port == pin.port), find(&pin.name))
        else {
            continue;
        };
        if pin.output { flat.outputs.push((pin.bit, symbol)) } else { flat.inputs.push((pin.bit, symbol)) }
    }
    ports.iter_mut().for_each(|(_, flat)| flat.one_is_output = family == Some(RegisterFamily::Avr));
    ports.into_iter().map(|(_, flat)| flat).collect()
}

/// The value of a register of directions at power-up; `None` for any other symbol.
pub(crate) fn power_up_directions(program: &LadderProgram, name: &str, kind: SymbolKind) -> Option<i32> {
    let register = PortRegister::from_name(name).filter(|_| !kind.is_bit())?;
    let is_direction = register.kind == RegisterKind::Direction;
    is_direction.then(|| i32::from(registers::initial_directions(program, register.port) as i8))
}

impl FlatPort {
    /// Takes the levels of the pins: inputs and outputs of the program, and what its latch puts at pins that
    /// it directs outwards; all others are 0.
    pub(crate) fn sample(&self, values: &mut [i32]) {
        let Some(levels) = self.levels else { return };
        let get = |symbol: Option<u32>| symbol.map_or(0, |symbol| values[symbol as usize]);
        let directed = match (self.directions, self.one_is_output) {
            (None, _) => 0,
            (directions, true) => get(directions),
            (directions, false) => !get(directions),
        };
        let mut byte = directed & get(self.latch);
        for &(bit, symbol) in self.inputs.iter().chain(&self.outputs) {
            byte = byte & !(1 << bit) | get(Some(symbol)) << bit;
        }
        values[levels as usize] = i32::from(byte as i8);
    }

    /// Makes the bits of the latch and the outputs equal again, after one of both was written. `held` is what
    /// they held before.
    pub(crate) fn share_outputs(&self, values: &mut [i32], held: &mut u8) {
        let Some(latch) = self.latch else { return };
        for &(bit, output) in &self.outputs {
            let before = i32::from(*held >> bit & 1);
            let (in_latch, at_output) = (values[latch as usize] >> bit & 1, values[output as usize]);
            let now = if in_latch != before { in_latch } else { at_output };
            values[output as usize] = now;
            values[latch as usize] = values[latch as usize] & !(1 << bit) | now << bit;
        }
        values[latch as usize] = i32::from(values[latch as usize] as i8);
        *held = values[latch as usize] as u8;
    }
}
