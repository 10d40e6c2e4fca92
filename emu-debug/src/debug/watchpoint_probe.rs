//! The probe of the debugger: it observes accesses, pins and expressions for the watchpoints, and keeps the
//! log of chip events. Breakpoints on code need no probe: the machine itself stops there.

use std::collections::BTreeSet;

use emu_core::chip::Chip;
use emu_core::cpu::{Probe, StopReason};
use emu_core::pins::{ChipEvent, PinId, PinLevel};

use super::dyn_machine::{DynMachine, ObserveLevel};
use super::event_log::SessionEvents;
use super::expression::DebugExpression;
use super::points::{AccessKind, DebugPoints, PointTrigger};
use super::session_stop::PointHit;
use crate::access_monitor::{AccessWatch, MatchedAccess};
use crate::address_names::AddressRange;
use crate::bit_space::{self, BIT_SPACE};

/// An observation for a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Observation {
    /// Number of the point.
    pub id: u32,
    /// Program word of the instruction; for a pin, of the next instruction.
    pub pc: u32,
    /// Byte read or written.
    pub value: Option<u8>,
    pub write: bool,
}

/// The watchpoints of a session, and what was observed for them since the last check.
pub(super) struct WatchpointProbe {
    chip: &'static Chip,
    accesses: Vec<(u32, AddressRange, AccessKind)>,
    /// Pins with the awaited level and the current one.
    pins: Vec<(u32, PinId, Option<PinLevel>, PinLevel)>,
    /// Expressions with their previous values.
    changes: Vec<(u32, DebugExpression, Option<i64>)>,
    /// Whether all expressions depend only on RAM, so that only writes can change them.
    ram_only: bool,
    /// Canonical addresses of the bytes of RAM that the watched expressions read.
    watched_ram: BTreeSet<u32>,
    /// Observations of this instruction.
    pub observations: Vec<Observation>,
    /// The event log, if one is kept.
    pub chip_events: Option<SessionEvents>,
    pc: u32,
    /// The cycle of the last stop before an instruction: the run does not stop again there.
    stopped_before: Option<u64>,
    /// Number of interrupts entered.
    pub interrupts_entered: u32,
}

impl WatchpointProbe {
    /// Returns a probe for all enabled points; expressions count as changed relative to their current values.
    pub fn new(points: &DebugPoints, machine: &dyn DynMachine) -> WatchpointProbe {
        let mut probe = WatchpointProbe {
            chip: machine.chip(),
            accesses: Vec::new(),
            pins: Vec::new(),
            changes: Vec::new(),
            ram_only: true,
            watched_ram: BTreeSet::new(),
            observations: Vec::new(),
            chip_events: None,
            pc: machine.pc(),
            stopped_before: None,
            interrupts_entered: 0,
        };
        for point in points.enabled() {
            match &point.trigger {
                PointTrigger::Code(_) => {}
                PointTrigger::Access(range, access) => probe.accesses.push((point.id, *range, *access)),
                PointTrigger::Pin(pin, level) => probe.pins.push((point.id, *pin, *level, machine.pin_level(*pin))),
                PointTrigger::Change(expr) => {
                    probe.ram_only &= expr.depends_only_on_ram(machine);
                    expr.visit_byte_addresses(&mut |addr| {
                        _ = probe.watched_ram.insert(machine.canonical_ram_address(addr).unwrap_or(addr))
                    });
                    probe.changes.push((point.id, expr.clone(), expr.watched_value(machine)));
                }
            }
        }
        probe
    }

    /// Returns how closely a run must be observed.
    pub fn observe_level(&self) -> ObserveLevel {
        let any = !self.changes.is_empty();
        let only_writes =
            (!any || self.ram_only) && self.accesses.iter().all(|(.., access)| *access == AccessKind::Write);
        if only_writes && (any || !self.accesses.is_empty()) {
            ObserveLevel::Writes
        } else if !self.accesses.is_empty() {
            ObserveLevel::All
        } else if !self.changes.is_empty() {
            ObserveLevel::Instructions
        } else if !self.pins.is_empty() || self.chip_events.is_some() {
            ObserveLevel::Events
        } else {
            ObserveLevel::Nothing
        }
    }

    /// Returns true if the byte of RAM is part of a watched expression.
    fn is_watched(&self, space: &'static str, addr: u32) -> bool {
        let byte = byte_of(self.chip, space, addr);
        byte.space == self.chip.ram_space && self.watched_ram.contains(&byte.addr)
    }

    /// Returns points whose expression has changed since the last check, with both values, or whose pin has
    /// changed. An action on a stopped machine (a reset) produces no event, so pins are compared here too.
    pub fn take_changes(&mut self, machine: &dyn DynMachine) -> Vec<PointChange> {
        let mut found = Vec::new();
        for (id, expr, old) in &mut self.changes {
            let new = expr.watched_value(machine);
            if new != *old {
                found.push(PointChange { id: *id, old: std::mem::replace(old, new), new });
            }
        }
        for (id, pin, wanted, old) in &mut self.pins {
            let new = machine.pin_level(*pin);
            if new != std::mem::replace(old, new) && wanted.is_none_or(|wanted| wanted == new) {
                found.push(PointChange { id: *id, old: None, new: None });
            }
        }
        found
    }
}

impl Probe for WatchpointProbe {
    fn on_instruction(&mut self, at: u64, pc: u32) -> bool {
        self.pc = pc;
        !self.changes.is_empty() && !self.ram_only && self.stopped_before.replace(at) != Some(at)
    }

    fn on_data_access(&mut self, _at: u64, space: u8, addr: u16, value: u8, write: bool) -> bool {
        let name = self.chip.spaces.get(usize::from(space)).map_or("", |space| space.name);
        for (id, range, access) in &self.accesses {
            let wanted = match access {
                AccessKind::Read => !write,
                AccessKind::Write => write,
                AccessKind::Any => true,
            };
            let watch = AccessWatch { range: *range, write };
            if wanted && let Some(MatchedAccess { value, .. }) = watch.matching_access(self.chip, name, addr, value) {
                self.observations.push(Observation { id: *id, pc: self.pc, value: Some(value), write });
            }
        }
        !self.observations.is_empty() || write && self.ram_only && self.is_watched(name, addr.into())
    }

    fn on_interrupt(&mut self, _at: u64, _vector: u8) {
        self.interrupts_entered += 1;
    }

    fn on_event(&mut self, event: ChipEvent) -> bool {
        if let Some(events) = &mut self.chip_events {
            events.push(event);
        }
        let ChipEvent::Edge { pin, level, .. } = event else { return false };
        let before = self.observations.len();
        for (id, _, wanted, old) in self.pins.iter_mut().filter(|(_, of, ..)| *of == pin) {
            if std::mem::replace(old, level) != level && wanted.is_none_or(|wanted| wanted == level) {
                self.observations.push(Observation { id: *id, pc: self.pc, value: None, write: true });
            }
        }
        self.observations.len() > before
    }
}

/// A byte of a memory, or one of its bits.
pub(super) struct ByteOrBit {
    /// The memory.
    pub space: &'static str,
    /// Address of the byte.
    pub addr: u32,
    /// Position of the bit, 0 to 7; `None` for the byte.
    pub bit: Option<u8>,
}

/// Returns the byte that contains a bit of the memory `bit`; otherwise the location itself.
pub(super) fn byte_of(chip: &Chip, space: &'static str, addr: u32) -> ByteOrBit {
    match (space == BIT_SPACE).then(|| bit_space::byte_of_bit(chip, addr)).flatten() {
        Some(at) => ByteOrBit { space: at.space, addr: at.byte, bit: Some(at.bit as u8) },
        None => ByteOrBit { space, addr, bit: None },
    }
}

/// A point whose expression or pin has changed.
pub(super) struct PointChange {
    /// Number of the point.
    pub id: u32,
    /// Value before; `None` if there was none, and for pins.
    pub old: Option<i64>,
    /// Value now; `None` if there is none, and for pins.
    pub new: Option<i64>,
}

/// Returns the points with an observation, each once, regardless of their conditions.
pub(super) fn candidate_hits(
    points: &DebugPoints,
    machine: &dyn DynMachine,
    observations: &[Observation],
    changes: &[PointChange],
    stop: StopReason,
) -> Vec<PointHit> {
    let pc = machine.pc();
    let mut hits: Vec<PointHit> = Vec::new();
    if let StopReason::Breakpoint { pc } = stop {
        let here =
            points.enabled().filter(|point| matches!(&point.trigger, PointTrigger::Code(words) if words.contains(&pc)));
        hits.extend(here.map(|point| PointHit { id: point.id, old: None, new: None, write: None, pc }));
    }
    for observation in observations {
        if hits.iter().all(|hit| hit.id != observation.id) {
            let new = observation.value.map(i64::from);
            hits.push(PointHit {
                id: observation.id,
                old: None,
                new,
                write: new.map(|_| observation.write),
                pc: observation.pc,
            });
        }
    }
    for &PointChange { id, old, new } in changes {
        if hits.iter().all(|hit| hit.id != id) {
            hits.push(PointHit { id, old, new, write: None, pc });
        }
    }
    hits.sort_by_key(|hit| hit.id);
    hits
}
