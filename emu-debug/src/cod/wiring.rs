//! The chip on the bench: what it drives on its pins, and what the bench drives there.
//!
//! The core only reports the level of a pin, and the chip wins if both sides drive. What the chip alone would
//! drive is measured on a copy of the machine, which is cheap and has no side effects.

use emu_core::cpu::Cpu;
use emu_core::pins::{CycleTime, PinId, PinLevel};

use super::circuit::CodCircuit;
use super::nets::{HIGH_MILLIVOLTS, NetMember, NetSolver};
use super::parts::{SUPPLY_MILLIVOLTS, VoltageSource, conductance};

/// Passes the voltage of a pin to a chip with analog inputs: cpu, time, pin, millivolts.
pub type SetAnalogInput<'a, C> = &'a mut dyn FnMut(&mut C, CycleTime, PinId, i64);

/// Passes in which parts may react to each other before they count as a ring of gates.
const MAX_SETTLE_PASSES: usize = 64;

/// Returns what the chip drives on a pin: an output of 150 ohms or a pull-up of 20 kilohms (gpsim's values;
/// DS30292, table 15.1: IPURB 50 to 400 uA).
fn output(high: bool) -> VoltageSource {
    VoltageSource { millivolts: if high { SUPPLY_MILLIVOLTS } else { 0 }, conductance: conductance(150.0) }
}

/// Returns the chip's own share in the level of a pin. `outside` is the level that the bench drives.
pub fn chip_pin_source<C: Cpu>(cpu: &C, pin: PinId, outside: PinLevel) -> Option<VoltageSource> {
    let with = |level: PinLevel| {
        let mut copy = cpu.clone();
        copy.drive(CycleTime::at(copy.cycle()), pin, level);
        copy.pin_level(pin)
    };
    match (outside, cpu.pin_level(pin)) {
        (PinLevel::Float, PinLevel::Float) => return None,
        (PinLevel::Low, PinLevel::High) => return Some(output(true)),
        (PinLevel::High | PinLevel::Float, PinLevel::Low) => return Some(output(false)),
        (_, PinLevel::High) if with(PinLevel::Low) == PinLevel::High => return Some(output(true)),
        (PinLevel::Low, _) if with(PinLevel::High) == PinLevel::Low => return Some(output(false)),
        _ => {}
    }
    let pulled = with(PinLevel::Float) == PinLevel::High;
    pulled.then(|| VoltageSource { millivolts: SUPPLY_MILLIVOLTS, conductance: conductance(20e3) })
}

impl CodCircuit<'_> {
    /// Returns true if a pin is on a net.
    #[must_use]
    pub fn is_attached(&self, pin: PinId) -> bool {
        self.nets.iter().any(|net| net.members.contains(&NetMember::Pin(pin)))
    }

    /// Passes all drives at the clock `t` to parts and chip until nothing changes; returns true if an input
    /// of the chip changes now. `then` are the levels of the pins at that time, if the chip has advanced
    /// since. In that case its inputs are not changed yet, because that would be an answer to the past; the
    /// chip gets the final levels later.
    pub fn settle<C: Cpu>(&mut self, cpu: &mut C, t: u64, then: &[PinLevel], analog: SetAnalogInput<'_, C>) -> bool {
        let cycle = u64::from(cpu.clocks_per_cycle());
        let mut own_of: Vec<Option<VoltageSource>> = Vec::with_capacity(self.external_levels.len());
        for (pin, (outside, _)) in self.external_levels.iter().enumerate() {
            let pin = pin as PinId;
            let level = then.get(usize::from(pin)).copied().filter(|level| *level != cpu.pin_level(pin));
            own_of.push(match level {
                _ if !self.is_attached(pin) => None,
                // A level that the bench explains is not the chip's.
                Some(level) => (level != *outside && level != PinLevel::Float).then(|| output(level == PinLevel::High)),
                None => chip_pin_source(cpu, pin, *outside),
            });
        }
        let own = |pin: PinId| own_of.get(usize::from(pin)).copied().flatten();
        for _ in 0..MAX_SETTLE_PASSES {
            let mut lines = Vec::new();
            {
                let drives = |part: usize, pin: usize| self.parts.get(part)?.source_of_pin(pin, t, cycle, self.hz);
                let wires = NetSolver { nets: &self.nets, parts: &self.parts, chip_source: &own, part_source: &drives };
                for (at, net) in self.nets.iter().enumerate() {
                    // A net without a driver keeps its charge.
                    let Some(millivolts) = wires.voltage(at, None) else { continue };
                    let high = millivolts >= HIGH_MILLIVOLTS;
                    for member in &net.members {
                        if let NetMember::Part(part, pin) = *member {
                            let seen = self.parts.get(part).and_then(|part| part.pin_levels.get(pin));
                            if seen.is_some_and(|seen| *seen != high) {
                                lines.push((part, pin, high));
                            }
                        }
                    }
                }
            }
            if lines.is_empty() {
                break;
            }
            for (part, pin, high) in lines {
                if let Some(part) = self.parts.get_mut(part) {
                    part.on_pin_change(pin, high, t, self.hz);
                }
            }
        }
        if !then.is_empty() {
            return false;
        }
        let strong = |member: &&NetMember| match **member {
            NetMember::Pin(pin) => own(pin).is_some_and(|source| source.conductance >= conductance(1e3)),
            NetMember::Part(..) => false,
        };
        let shared = self.nets.iter().any(|net| net.members.iter().filter(strong).count() > 1);
        let mut changes = Vec::new();
        {
            let drives = |part: usize, pin: usize| self.parts.get(part)?.source_of_pin(pin, t, cycle, self.hz);
            let wires = NetSolver { nets: &self.nets, parts: &self.parts, chip_source: &own, part_source: &drives };
            for (at, net) in self.nets.iter().enumerate() {
                for &member in &net.members {
                    let NetMember::Pin(pin) = member else { continue };
                    let others = wires.voltage(at, Some(member));
                    // A pull-up of the chip may be stronger than a resistor; an output of the chip always
                    // wins.
                    let weak = own(pin).is_some_and(|source| source.conductance < conductance(1e3));
                    let counts = if weak { wires.voltage(at, None) } else { others };
                    let level = counts
                        .filter(|_| others.is_some())
                        .map_or(PinLevel::Float, |mv| PinLevel::from_bit(mv >= HIGH_MILLIVOLTS));
                    changes.push((pin, level, others));
                }
            }
        }
        self.shared = shared;
        // The time of the change, if it has not passed.
        let at = CycleTime { cycle: t / cycle, phase: (t % cycle) as u8 };
        let mut changed = false;
        for (pin, level, millivolts) in changes {
            let Some(outside) = self.external_levels.get_mut(usize::from(pin)) else { continue };
            let before = std::mem::replace(outside, (level, millivolts));
            changed |= before != (level, millivolts);
            if before.0 != level {
                cpu.drive(at, pin, level);
            }
            if let Some(millivolts) = millivolts.filter(|_| before.1 != millivolts) {
                analog(cpu, at, pin, millivolts);
            }
        }
        changed
    }
}
