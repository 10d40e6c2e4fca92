//! Collects what programs do that is seldom meant ([`Lint`]), each once with how often and when first.
//!
//! What a core has diagnostics of it tells itself; of the RAM of every chip this looks for reads of what was never written.

use std::collections::BTreeMap;

use emu_core::chip::Chip;
use emu_core::cpu::Probe;
use emu_core::lint::Lint;

use crate::close::{Fresh, RamTrap};
use crate::place::Names;

/// A lint at one instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Found {
    /// What.
    pub lint: Lint,
    /// Program word of the instruction; of an interrupt its vector.
    pub pc: u32,
    /// How often.
    pub count: u64,
    /// The machine cycle of the first time.
    pub first: u64,
}

/// A probe that collects lints.
#[derive(Debug, Clone)]
pub struct Lints {
    chip: &'static Chip,
    fresh: Fresh,
    pc: u32,
    found: Vec<Found>,
    /// Where each lies in that list.
    places: BTreeMap<(u32, Lint), usize>,
}

impl Lints {
    /// For a run of `chip` whose RAM is as `ram` says.
    #[must_use]
    pub fn new(chip: &'static Chip, ram: &RamTrap<'_>) -> Lints {
        Lints { chip, fresh: Fresh::new(chip, ram), pc: 0, found: Vec::new(), places: BTreeMap::new() }
    }

    /// What was found, in the order of first cycles.
    #[must_use]
    pub fn found(self) -> Vec<Found> {
        let mut found = self.found;
        found.sort_by_key(|found| found.first);
        found
    }
}

impl Probe for Lints {
    const INSN: bool = true;
    const DATA: bool = true;
    const LINT: bool = true;

    fn insn(&mut self, _at: u64, pc: u32) -> bool {
        self.pc = pc;
        false
    }

    fn data(&mut self, at: u64, space: u8, addr: u16, _value: u8, write: bool) -> bool {
        if let Some(byte) = self.fresh.reads_unwritten(self.chip, space, addr, write) {
            // Every byte is told of once, wherever it is read.
            self.fresh.fill(byte);
            self.lint(at, self.pc, Lint::UnknownRead { space: self.chip.ram, addr: byte as u16 });
        }
        false
    }

    fn lint(&mut self, at: u64, pc: u32, lint: Lint) {
        match self.places.get(&(pc, lint)).and_then(|&place| self.found.get_mut(place)) {
            Some(found) => {
                found.count = found.count.saturating_add(1);
                found.first = found.first.min(at);
            }
            None => {
                self.places.insert((pc, lint), self.found.len());
                self.found.push(Found { lint, pc, count: 1, first: at });
            }
        }
    }
}

/// What it is, with the names of registers, pins and symbols.
#[must_use]
pub fn describe(lint: Lint, names: &Names<'_>) -> String {
    match lint {
        Lint::AnalogRead { port, bits } => {
            let (port, pins) = (register(names, port), pins(names, port, bits));
            format!("{port} is read, where {pins} read 0 as analog inputs")
        }
        Lint::ForeignLatch { port, bits } => {
            let (port, pins) = (register(names, port), pins(names, port, bits));
            format!("the latch of {port} is changed at {pins} along with the bits that are meant")
        }
        Lint::Page { target } => {
            let byte = u32::from(target) * names.chip.word_bytes;
            let near = names.near(byte).map_or(String::new(), |near| format!(" ({near})"));
            let target = names.chip.code_address(target.into());
            format!("goes to 0x{target:04x}{near}, in a page that PCLATH was not set for here")
        }
        Lint::UnknownRead { space, addr } => {
            let symbol = names.object(space, addr.into()).map_or(String::new(), |symbol| format!(" ({symbol})"));
            format!("{space}:0x{addr:02x}{symbol} is read before it was written")
        }
        Lint::StackOverflow | Lint::StackUnderflow | Lint::NotSaved { .. } | Lint::NoSleep => lint.to_string(),
    }
}

/// The name of a register of the chip, or where it lies.
fn register(names: &Names<'_>, addr: u16) -> String {
    let named = names.chip.regs.iter().find(|reg| reg.addr == addr);
    named.map_or_else(|| format!("{}:0x{addr:02x}", names.chip.reg_space), |reg| reg.name.to_owned())
}

/// The names of pins of a port: those of PORTB are RB0 to RB7.
fn pins(names: &Names<'_>, port: u16, bits: u8) -> String {
    let port = register(names, port);
    let name = |bit: u8| {
        let pin = port.strip_prefix("PORT").map(|letter| format!("R{letter}{bit}"));
        pin.filter(|pin| names.chip.pin(pin).is_some()).unwrap_or_else(|| format!("bit {bit}"))
    };
    (0..8).filter(|bit| bits >> bit & 1 == 1).map(name).collect::<Vec<_>>().join(", ")
}
