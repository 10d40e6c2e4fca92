//! The chip on the bench: what it puts on its pins, and what the bench puts there.
//!
//! The core tells only the level of a pin, which the chip wins where both sides drive. What the chip alone would do is tried on
//! a copy of the machine, which is cheap and disturbs nothing.

use emu_core::cpu::Cpu;
use emu_core::pins::{Level, PinId, Time};

use super::bench::Bench;
use super::net::{HIGH, Member, Wires};
use super::parts::{SUPPLY, Source, conductance};

/// How the voltage of a pin reaches a chip whose inputs know voltages: cpu, when, pin, millivolts.
pub type Analog<'a, C> = &'a mut dyn FnMut(&mut C, Time, PinId, i64);

/// Turns in which parts may answer each other before a ring of gates is taken for one.
const TURNS: usize = 64;

/// What the chip puts on a pin: an output of 150 ohms or a pull-up of 20 kilohms (gpsim's; DS30292, table 15.1: IPURB 50 to
/// 400 uA).
fn output(high: bool) -> Source {
    Source { millivolts: if high { SUPPLY } else { 0 }, conductance: conductance(150.0) }
}

/// The chip's own part in the level of a pin. `outside` is what the bench puts there.
pub fn own<C: Cpu>(cpu: &C, pin: PinId, outside: Level) -> Option<Source> {
    let with = |level: Level| {
        let mut copy = cpu.clone();
        copy.drive(Time::at(copy.cycle()), pin, level);
        copy.level(pin)
    };
    match (outside, cpu.level(pin)) {
        (Level::Float, Level::Float) => return None,
        (Level::Low, Level::High) => return Some(output(true)),
        (Level::High | Level::Float, Level::Low) => return Some(output(false)),
        (_, Level::High) if with(Level::Low) == Level::High => return Some(output(true)),
        (Level::Low, _) if with(Level::High) == Level::Low => return Some(output(false)),
        _ => {}
    }
    let pulled = with(Level::Float) == Level::High;
    pulled.then(|| Source { millivolts: SUPPLY, conductance: conductance(20e3) })
}

impl Bench<'_> {
    /// True for a pin that hangs on a net.
    #[must_use]
    pub fn attached(&self, pin: PinId) -> bool {
        self.nets.iter().any(|net| net.members.contains(&Member::Pin(pin)))
    }

    /// Lets parts and chip see what everybody drives at the clock `t`, until nothing changes any more. `then` are the
    /// levels of the pins at that time, where the chip has gone on since; the chip then gets nothing yet, since that would be
    /// an answer to what has passed: it gets what is left of it in the end. True when the chip gets something else now.
    pub fn settle<C: Cpu>(&mut self, cpu: &mut C, t: u64, then: &[Level], analog: Analog<'_, C>) -> bool {
        let cycle = u64::from(cpu.clocks_per_cycle());
        let mut own_of: Vec<Option<Source>> = Vec::with_capacity(self.outside.len());
        for (pin, (outside, _)) in self.outside.iter().enumerate() {
            let pin = pin as PinId;
            let level = then.get(usize::from(pin)).copied().filter(|level| *level != cpu.level(pin));
            own_of.push(match level {
                _ if !self.attached(pin) => None,
                // A level that the bench explains is not the chip's.
                Some(level) => (level != *outside && level != Level::Float).then(|| output(level == Level::High)),
                None => own(cpu, pin, *outside),
            });
        }
        let own = |pin: PinId| own_of.get(usize::from(pin)).copied().flatten();
        for _ in 0..TURNS {
            let mut lines = Vec::new();
            {
                let drives = |part: usize, pin: usize| self.parts.get(part)?.drives(pin, t, cycle, self.hz);
                let wires = Wires { nets: &self.nets, parts: &self.parts, own: &own, drives: &drives };
                for (at, net) in self.nets.iter().enumerate() {
                    // What nobody drives keeps its charge.
                    let Some(millivolts) = wires.voltage(at, None) else { continue };
                    let high = millivolts >= HIGH;
                    for member in &net.members {
                        if let Member::Part(part, pin) = *member {
                            let seen = self.parts.get(part).and_then(|part| part.seen.get(pin));
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
                    part.line(pin, high, t, self.hz);
                }
            }
        }
        if !then.is_empty() {
            return false;
        }
        let strong = |member: &&Member| match **member {
            Member::Pin(pin) => own(pin).is_some_and(|source| source.conductance >= conductance(1e3)),
            Member::Part(..) => false,
        };
        let shared = self.nets.iter().any(|net| net.members.iter().filter(strong).count() > 1);
        let mut changes = Vec::new();
        {
            let drives = |part: usize, pin: usize| self.parts.get(part)?.drives(pin, t, cycle, self.hz);
            let wires = Wires { nets: &self.nets, parts: &self.parts, own: &own, drives: &drives };
            for (at, net) in self.nets.iter().enumerate() {
                for &member in &net.members {
                    let Member::Pin(pin) = member else { continue };
                    let others = wires.voltage(at, Some(member));
                    // A pull-up of the chip may be stronger than a resistor; a driver of the chip always wins.
                    let weak = own(pin).is_some_and(|source| source.conductance < conductance(1e3));
                    let counts = if weak { wires.voltage(at, None) } else { others };
                    let level = counts.filter(|_| others.is_some()).map_or(Level::Float, |mv| Level::of(mv >= HIGH));
                    changes.push((pin, level, others));
                }
            }
        }
        self.shared = shared;
        // The time at which it happens, if that has not passed.
        let at = Time { cycle: t / cycle, phase: (t % cycle) as u8 };
        let mut changed = false;
        for (pin, level, millivolts) in changes {
            let Some(outside) = self.outside.get_mut(usize::from(pin)) else { continue };
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
