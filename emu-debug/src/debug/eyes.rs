//! The probe of the debugger: it sees what the points wait for.

use std::collections::BTreeSet;

use emu_core::chip::Chip;
use emu_core::cpu::{Probe, Stop};
use emu_core::pins::{Event, Level, PinId};

use super::events::Events;
use super::expr::Expr;
use super::points::{Access, Points, What};
use super::session::Hit;
use super::target::{Look, Target};
use crate::bits::{self, BIT};
use crate::close::Watch;
use crate::place::Range;

/// Something that a point waited for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Sight {
    /// Number of the point.
    pub id: u32,
    /// Program word of the instruction; for a pin the one before which it was seen.
    pub pc: u32,
    /// Byte read or written.
    pub value: Option<u8>,
    pub write: bool,
}

/// What is looked at, and what was seen since the last look.
pub(super) struct Eyes {
    chip: &'static Chip,
    accesses: Vec<(u32, Range, Access)>,
    /// Pins with the level that is waited for, and the one that they have.
    pins: Vec<(u32, PinId, Option<Level>, Level)>,
    /// Expressions with the value that they had.
    changes: Vec<(u32, Expr, Option<i64>)>,
    /// All of them are of RAM, so that nothing but a write can change them.
    ram_only: bool,
    /// Where those bytes are kept.
    ram: BTreeSet<u32>,
    /// What was seen in this instruction.
    pub seen: Vec<Sight>,
    /// Events, when somebody keeps them.
    pub events: Option<Events>,
    pc: u32,
    /// The instruction before which the last stop came: it is not stopped before again.
    stopped: Option<u64>,
    /// Interrupts entered.
    pub entered: u32,
}

impl Eyes {
    /// For all points that are enabled; expressions have changed when they are no longer what they are now.
    pub fn new(points: &Points, target: &dyn Target) -> Eyes {
        let mut eyes = Eyes {
            chip: target.chip(),
            accesses: Vec::new(),
            pins: Vec::new(),
            changes: Vec::new(),
            ram_only: true,
            ram: BTreeSet::new(),
            seen: Vec::new(),
            events: None,
            pc: target.pc(),
            stopped: None,
            entered: 0,
        };
        for point in points.enabled() {
            match &point.what {
                What::Code(_) => {}
                What::Access(range, access) => eyes.accesses.push((point.id, *range, *access)),
                What::Pin(pin, level) => eyes.pins.push((point.id, *pin, *level, target.level(*pin))),
                What::Change(expr) => {
                    eyes.ram_only &= expr.is_of_ram(target);
                    expr.bytes(&mut |addr| _ = eyes.ram.insert(target.ram_at(addr).unwrap_or(addr)));
                    eyes.changes.push((point.id, expr.clone(), expr.seen(target)));
                }
            }
        }
        eyes
    }

    /// How closely a run must be looked at for all of this.
    pub fn look(&self) -> Look {
        let any = !self.changes.is_empty();
        let only_writes = (!any || self.ram_only) && self.accesses.iter().all(|(.., access)| *access == Access::Write);
        if only_writes && (any || !self.accesses.is_empty()) {
            Look::Writes
        } else if !self.accesses.is_empty() {
            Look::All
        } else if !self.changes.is_empty() {
            Look::Insns
        } else if !self.pins.is_empty() || self.events.is_some() {
            Look::Events
        } else {
            Look::Nothing
        }
    }

    /// The byte of RAM is a part of a watched expression.
    fn is_watched(&self, space: &'static str, addr: u32) -> bool {
        let (space, addr, _) = byte_of(self.chip, space, addr);
        space == self.chip.ram && self.ram.contains(&addr)
    }

    /// Points whose expression has another value now than at the last look, with both, or whose pin has another level: what is done to
    /// a machine that stands (a reset) makes no event.
    pub fn changed(&mut self, target: &dyn Target) -> Vec<(u32, Option<i64>, Option<i64>)> {
        let mut found = Vec::new();
        for (id, expr, old) in &mut self.changes {
            let new = expr.seen(target);
            if new != *old {
                found.push((*id, std::mem::replace(old, new), new));
            }
        }
        for (id, pin, wanted, old) in &mut self.pins {
            let new = target.level(*pin);
            if new != std::mem::replace(old, new) && wanted.is_none_or(|wanted| wanted == new) {
                found.push((*id, None, None));
            }
        }
        found
    }
}

impl Probe for Eyes {
    fn insn(&mut self, at: u64, pc: u32) -> bool {
        self.pc = pc;
        !self.changes.is_empty() && !self.ram_only && self.stopped.replace(at) != Some(at)
    }

    fn data(&mut self, _at: u64, space: u8, addr: u16, value: u8, write: bool) -> bool {
        let name = self.chip.spaces.get(usize::from(space)).map_or("", |space| space.0);
        for (id, range, access) in &self.accesses {
            let wanted = match access {
                Access::Read => !write,
                Access::Write => write,
                Access::Any => true,
            };
            let watch = Watch { range: *range, write };
            if wanted && let Some((.., value)) = watch.hit(self.chip, name, addr, value) {
                self.seen.push(Sight { id: *id, pc: self.pc, value: Some(value), write });
            }
        }
        !self.seen.is_empty() || write && self.ram_only && self.is_watched(name, addr.into())
    }

    fn irq(&mut self, _at: u64, _vector: u8) {
        self.entered += 1;
    }

    fn event(&mut self, event: Event) -> bool {
        if let Some(events) = &mut self.events {
            events.push(event);
        }
        let Event::Edge { pin, level, .. } = event else { return false };
        let before = self.seen.len();
        for (id, _, wanted, old) in self.pins.iter_mut().filter(|(_, of, ..)| *of == pin) {
            if std::mem::replace(old, level) != level && wanted.is_none_or(|wanted| wanted == level) {
                self.seen.push(Sight { id: *id, pc: self.pc, value: None, write: true });
            }
        }
        self.seen.len() > before
    }
}

/// The byte of memory that holds a bit of the memory `bit`, else the place itself.
pub(super) fn byte_of(chip: &Chip, space: &'static str, addr: u32) -> (&'static str, u32, Option<u8>) {
    match (space == BIT).then(|| bits::byte_of(chip, addr)).flatten() {
        Some((space, byte, bit)) => (space, byte, Some(bit as u8)),
        None => (space, addr, None),
    }
}

/// Points that saw something, each once, whatever their conditions.
pub(super) fn candidates(
    points: &Points,
    target: &dyn Target,
    sights: &[Sight],
    changes: &[(u32, Option<i64>, Option<i64>)],
    stop: Stop,
) -> Vec<Hit> {
    let pc = target.pc();
    let mut hits: Vec<Hit> = Vec::new();
    if let Stop::Trap { pc } = stop {
        let here = points.enabled().filter(|point| matches!(&point.what, What::Code(words) if words.contains(&pc)));
        hits.extend(here.map(|point| Hit { id: point.id, old: None, new: None, write: None, pc }));
    }
    for sight in sights {
        if hits.iter().all(|hit| hit.id != sight.id) {
            let new = sight.value.map(i64::from);
            hits.push(Hit { id: sight.id, old: None, new, write: new.map(|_| sight.write), pc: sight.pc });
        }
    }
    for &(id, old, new) in changes {
        if hits.iter().all(|hit| hit.id != id) {
            hits.push(Hit { id, old, new, write: None, pc });
        }
    }
    hits.sort_by_key(|hit| hit.id);
    hits
}
