//! What passes between a chip and what is around it: drives that are to come, and the log of what has left.

use std::collections::VecDeque;

use crate::cpu::NEVER;
use crate::pins::{ChipEvent, CycleTime, PinId, PinLevel};
use crate::state::{SnapshotDamaged, SnapshotState, StateTape};

/// Drives from outside that are to come (of a pin to a level, if nothing else is said), in order of time; those of one moment in
/// the order in which they were asked for. Moments are machine cycles, or clocks where a chip counts those.
#[derive(Debug, Clone)]
pub struct DriveQueue<T = (PinId, PinLevel)>(VecDeque<(u64, T)>);

/// In the order in which they come.
impl<T: SnapshotState + Default> SnapshotState for DriveQueue<T> {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        self.0.pass_state(tape)?;
        let in_order = self.0.iter().zip(self.0.iter().skip(1)).all(|(first, second)| first.0 <= second.0);
        tape.require(in_order && self.0.iter().all(|drive| drive.0 != NEVER))
    }
}

impl<T: Copy> DriveQueue<T> {
    /// None.
    pub const NONE: DriveQueue<T> = DriveQueue(VecDeque::new());

    /// It will come at the moment `at`.
    pub fn push(&mut self, at: u64, drive: T) {
        let place = self.0.partition_point(|&(due, _)| due <= at);
        self.0.insert(place, (at, drive));
    }

    /// The moment of the next one, [`NEVER`] where there is none.
    #[must_use]
    pub fn next_cycle(&self) -> u64 {
        self.0.front().map_or(NEVER, |drive| drive.0)
    }

    /// Takes the next one, if it is due by the moment `now`.
    pub fn pop_due(&mut self, now: u64) -> Option<T> {
        let &(_, drive) = self.0.front().filter(|drive| drive.0 <= now)?;
        self.0.pop_front();
        Some(drive)
    }
}

/// Events on their way to a probe.
#[derive(Debug, Clone)]
pub struct EventLog {
    events: VecDeque<ChipEvent>,
    enabled: bool,
}

impl EventLog {
    /// Off.
    pub const OFF: EventLog = EventLog { events: VecDeque::new(), enabled: false };

    /// Logs from the machine cycle `now` on, first the pins that are fought for already, or stops and forgets.
    pub fn set_enabled(&mut self, on: bool, now: u64, contended_pins: impl Iterator<Item = PinId>) {
        if on && !self.enabled {
            self.events.extend(contended_pins.map(|pin| ChipEvent::Contention { at: CycleTime::at(now), pin }));
        } else if !on {
            self.events.clear();
        }
        self.enabled = on;
    }

    /// Somebody wants events.
    #[inline]
    #[must_use]
    pub const fn is_enabled(&self) -> bool {
        self.enabled
    }

    /// Logs an event, if somebody wants it. Parts run one after the other, so within a cycle one may come that is before what is
    /// logged already.
    pub fn record(&mut self, event: ChipEvent) {
        if self.enabled {
            let place = self.events.partition_point(|logged| logged.time() <= event.time());
            self.events.insert(place, event);
        }
    }

    /// Logs the change of a pin, if there was one, behind a fight over it.
    pub fn record_pin(&mut self, at: CycleTime, pin: PinId, fought: bool, changed: Option<PinLevel>) {
        if fought {
            self.record(ChipEvent::Contention { at, pin });
        }
        if let Some(level) = changed {
            self.record(ChipEvent::Edge { at, pin, level });
        }
    }

    /// Takes the oldest event.
    #[inline]
    pub fn pop(&mut self) -> Option<ChipEvent> {
        self.events.pop_front()
    }

    /// Events that wait.
    #[inline]
    #[must_use]
    pub fn len(&self) -> usize {
        self.events.len()
    }

    /// True when none waits.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.events.is_empty()
    }
}
