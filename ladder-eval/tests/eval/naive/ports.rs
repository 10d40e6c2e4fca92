//! Registers of ports of the naive interpreter: each bit is looked up where it lives.

use ladder::registers::{RegisterFamily, RegisterKind, register_family, shared_pins};
use ladder::{LadderProgram, SymbolKind};

use super::*;

/// Where a bit of a register lives.
#[derive(Clone)]
pub(super) struct BitHome {
    port: char,
    bit: u32,
    symbol: String,
    kind: SymbolKind,
}

/// `#TRISB` is ('T', 'B').
fn split(name: &str) -> Option<(char, char)> {
    let rest = name.strip_prefix('#')?;
    Some((if rest.starts_with("PORT") { 'O' } else { rest.chars().next()? }, rest.chars().last()?))
}

fn digit(value: i64, bit: u32) -> bool {
    value.div_euclid(1 << bit).rem_euclid(2) == 1
}

impl NaiveInterpreter {
    pub(super) fn set_up_ports(&mut self, program: &LadderProgram) {
        let kind = |output| if output { SymbolKind::Output } else { SymbolKind::Input };
        self.homes = shared_pins(program)
            .into_iter()
            .map(|pin| BitHome { port: pin.port, bit: pin.bit.into(), symbol: pin.name, kind: kind(pin.output) })
            .collect();
        self.avr = program.settings.micro.as_deref().and_then(register_family) == Some(RegisterFamily::Avr);
        for register in ladder::registers::port_registers(program) {
            if register.kind == RegisterKind::Direction {
                let outputs = self.homes.iter().filter(|h| h.port == register.port && h.kind == SymbolKind::Output);
                let ones: i64 = outputs.map(|home| 1 << home.bit).sum();
                self.integers.insert(register.name(), wrap_to_bits(if self.avr { ones } else { 255 - ones }, 8));
            }
        }
    }

    /// The pins as they are at the start of a scan.
    pub(super) fn sample_pins(&mut self) {
        let names: Vec<String> = self.widths.keys().filter(|name| name.starts_with("#PIN")).cloned().collect();
        for name in names {
            let (_, port) = split(&name).expect("a register");
            let mut byte = 0;
            for bit in 0..8 {
                let home = self.homes.iter().find(|home| (home.port, home.bit) == (port, bit));
                let outward = match self.widths.contains_key(&format!("#TRIS{port}")) {
                    true => digit(self.integer(&format!("#TRIS{port}")), bit) == self.avr,
                    false => false,
                };
                let high = match home {
                    Some(home) => self.bit(&home.symbol),
                    None => outward && digit(self.integer(&format!("#PORT{port}")), bit),
                };
                byte += i64::from(high) << bit;
            }
            self.integers.insert(name, wrap_to_bits(byte, 8));
        }
    }

    /// A latch has no bits of its own where outputs are: reading puts them in.
    pub(super) fn with_outputs(&self, name: &str, value: i64) -> i64 {
        let Some(('O', port)) = split(name) else { return value };
        let outputs = self.homes.iter().filter(|home| home.port == port && home.kind == SymbolKind::Output);
        let bits =
            outputs.map(|home| (i64::from(self.bit(&home.symbol)) - i64::from(digit(value, home.bit))) << home.bit);
        wrap_to_bits(value + bits.sum::<i64>(), 8)
    }

    /// What a write of a latch does to the outputs.
    pub(super) fn store_outputs(&mut self, name: &str, value: i64) {
        let Some(('O', port)) = split(name) else { return };
        for home in self.homes.clone().iter().filter(|home| home.port == port && home.kind == SymbolKind::Output) {
            self.bits.insert(home.symbol.clone(), digit(value, home.bit));
        }
    }
}
