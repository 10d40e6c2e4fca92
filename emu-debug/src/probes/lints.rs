//! Collects suspicious behaviour of programs ([`Lint`]), each once, with its count and first cycle.
//!
//! The cores report most of them. On the 8051 and the PIC16 this module finds reads of RAM that was never
//! written. AVR and AP101 report such reads themselves, and only where the value makes a difference, because
//! they track for each value whether it is defined.

use std::collections::BTreeMap;

use emu_core::chip::{Chip, ChipFamily};
use emu_core::cpu::Probe;
use emu_core::lint::Lint;

use crate::names::address_names::AddressNames;
use crate::probes::access_monitor::{RamCheck, UnwrittenRam};

/// A lint at one instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LintFinding {
    /// The lint.
    pub lint: Lint,
    /// Program word of the instruction; for an interrupt, its vector.
    pub pc: u32,
    /// How often it occurred.
    pub count: u64,
    /// The machine cycle of the first occurrence.
    pub first: u64,
}

/// A probe that collects lints.
#[derive(Debug, Clone)]
pub struct LintProbe {
    chip: &'static Chip,
    unwritten_ram: UnwrittenRam,
    pc: u32,
    findings: Vec<LintFinding>,
    /// Position of each lint in `findings`.
    positions: BTreeMap<(u32, Lint), usize>,
}

impl LintProbe {
    /// Returns a probe for a run of `chip`; `ram` describes its RAM.
    #[must_use]
    pub fn new(chip: &'static Chip, ram: &RamCheck<'_>) -> LintProbe {
        LintProbe {
            chip,
            unwritten_ram: UnwrittenRam::new(chip, ram),
            pc: 0,
            findings: Vec::new(),
            positions: BTreeMap::new(),
        }
    }

    /// Returns the findings in order of their first cycles.
    #[must_use]
    pub fn into_findings(self) -> Vec<LintFinding> {
        let mut findings = self.findings;
        findings.sort_by_key(|finding| finding.first);
        findings
    }
}

impl Probe for LintProbe {
    const INSN: bool = true;
    const DATA: bool = true;
    const LINT: bool = true;

    fn on_instruction(&mut self, _at: u64, pc: u32) -> bool {
        self.pc = pc;
        false
    }

    fn on_data_access(&mut self, at: u64, space: u8, addr: u16, _value: u8, write: bool) -> bool {
        if matches!(self.chip.family, ChipFamily::Avr | ChipFamily::Ap101) {
            return false;
        }
        if let Some(byte) = self.unwritten_ram.note_access(self.chip, space, addr, write) {
            // Every byte is reported once, wherever it is read.
            self.unwritten_ram.mark_written(byte);
            self.on_lint(at, self.pc, Lint::UnwrittenRead { space: self.chip.ram_space, addr: byte as u16 });
        }
        false
    }

    fn on_lint(&mut self, at: u64, pc: u32, lint: Lint) {
        match self.positions.get(&(pc, lint)).and_then(|&place| self.findings.get_mut(place)) {
            Some(finding) => {
                finding.count = finding.count.saturating_add(1);
                finding.first = finding.first.min(at);
            }
            None => {
                self.positions.insert((pc, lint), self.findings.len());
                self.findings.push(LintFinding { lint, pc, count: 1, first: at });
            }
        }
    }
}

/// Describes a lint with the names of registers, pins and symbols.
#[must_use]
pub fn describe_lint(lint: Lint, names: &AddressNames<'_>) -> String {
    match lint {
        Lint::AnalogRead { port, bits } => {
            let (port, pins) = (register_name(names, port), port_pin_names(names, port, bits));
            format!("{port} is read; {pins} are analog inputs and read 0")
        }
        Lint::UnintendedLatchChange { port, bits } => {
            let (port, pins) = (register_name(names, port), port_pin_names(names, port, bits));
            format!("the instruction also changes the latch of {port} at {pins}")
        }
        Lint::PageNotSelected { target } => {
            let byte = u32::from(target) * names.chip.word_bytes;
            let near = names.nearest_symbol(byte).map_or(String::new(), |near| format!(" ({near})"));
            let target = names.chip.code_address(target.into());
            format!("the jump goes to 0x{target:04x}{near}, in another page, and this page did not set PCLATH")
        }
        Lint::UnwrittenRead { space, addr } => {
            format!("{} is read before it was written", cell_name(names, space, addr))
        }
        Lint::UnwrittenUse { space, addr } => {
            format!("{} is used before it was written", cell_name(names, space, addr))
        }
        Lint::StackCollision { limit } => {
            let limit =
                match names.symbols.iter().find(|s| s.space == names.chip.ram_space && s.addr == u32::from(limit)) {
                    _ if limit == names.chip.ram_start => format!("0x{limit:04x}, where RAM begins"),
                    Some(symbol) => format!("0x{limit:04x} ({})", symbol.name),
                    None => format!("0x{limit:04x}, the end of the heap"),
                };
            format!("the stack grows below {limit}")
        }
        Lint::UnimplementedAddress { addr } => {
            format!("{}:0x{addr:02x} is written, but is not implemented", names.chip.reg_space)
        }
        Lint::ReservedBits { addr, bits } => {
            let list = (0..8).filter(|bit| bits >> bit & 1 == 1).map(|bit| bit.to_string()).collect::<Vec<_>>();
            let (what, verb) = if list.len() == 1 { ("bit", "is") } else { ("bits", "are") };
            format!("the reserved {what} {} of {} {verb} written as 1", list.join(", "), register_name(names, addr))
        }
        Lint::TakenWithoutHandler { vector } => {
            format!("the interrupt {} is taken, but has no service routine", interrupt_name(names, vector))
        }
        Lint::EnabledWithoutHandler { vector } => {
            format!("the interrupt {} is enabled, but has no service routine", interrupt_name(names, vector))
        }
        Lint::FloatingRead { port, bits } => {
            let (port, pins) = (register_name(names, port), port_pin_names(names, port, bits));
            format!("{port} is read and used, but nothing drives {pins}")
        }
        Lint::CaptureWritten { addr } => {
            let low = register_name(names, addr);
            let name = low.strip_suffix('L').unwrap_or(&low);
            format!("{name} is written in a mode in which it is not TOP; by the data sheet that has no effect")
        }
        _ => lint.to_string(),
    }
}

/// Returns the name of a chip register, or its address.
fn register_name(names: &AddressNames<'_>, addr: u16) -> String {
    let named = names.chip.regs.iter().find(|reg| reg.addr == addr);
    named.map_or_else(|| format!("{}:0x{addr:02x}", names.chip.reg_space), |reg| reg.name.to_owned())
}

/// Returns a byte of RAM with the variable that contains it, or a core register, if those have addresses.
fn cell_name(names: &AddressNames<'_>, space: &str, addr: u16) -> String {
    let is_register = u32::from(addr) < names.chip.family_traits().registers_in_ram;
    if let Some(name) = names.chip.cpu_regs.get(usize::from(addr)).filter(|_| is_register) {
        return (*name).to_owned();
    }
    let symbol = names.containing_symbol(space, addr.into()).map_or(String::new(), |symbol| format!(" ({symbol})"));
    format!("{space}:0x{addr:02x}{symbol}")
}

/// Returns the name of an interrupt.
fn interrupt_name(names: &AddressNames<'_>, vector: u8) -> String {
    names.chip.vectors.get(usize::from(vector)).map_or_else(|| vector.to_string(), |name| (*name).to_owned())
}

/// Returns the names of pins of a port: RB0 to RB7 for PORTB of a PIC16, PB0 to PB7 for PINB of an AVR.
fn port_pin_names(names: &AddressNames<'_>, port: u16, bits: u8) -> String {
    let port = register_name(names, port);
    let name = |bit: u8| {
        let pin = port.strip_prefix("PORT").map(|letter| format!("R{letter}{bit}"));
        let pin = pin.or_else(|| port.strip_prefix("PIN").map(|letter| format!("P{letter}{bit}")));
        pin.filter(|pin| names.chip.pin(pin).is_some()).unwrap_or_else(|| format!("bit {bit}"))
    };
    (0..8).filter(|bit| bits >> bit & 1 == 1).map(name).collect::<Vec<_>>().join(", ")
}
