//! What passes between a chip and what is around it: drives that are to come, and the log of what has left.

use std::collections::VecDeque;

use crate::cpu::NEVER;
use crate::pins::{Event, Level, PinId, Time};
use crate::state::{Damaged, State, Tape};

/// Drives from outside that are to come (of a pin to a level, if nothing else is said), in order of time; those of one moment in
/// the order in which they were asked for. Moments are machine cycles, or clocks where a chip counts those.
#[derive(Debug, Clone)]
pub struct Drives<T = (PinId, Level)>(VecDeque<(u64, T)>);

/// In the order in which they come.
impl<T: State + Default> State for Drives<T> {
    fn state(&mut self, tape: &mut Tape<'_>) -> Result<(), Damaged> {
        self.0.state(tape)?;
        let in_order = self.0.iter().zip(self.0.iter().skip(1)).all(|(first, second)| first.0 <= second.0);
        tape.demand(in_order && self.0.iter().all(|drive| drive.0 != NEVER))
    }
}

impl<T: Copy> Drives<T> {
    /// None.
    pub const NONE: Drives<T> = Drives(VecDeque::new());

    /// It will come at the moment `at`.
    pub fn add(&mut self, at: u64, drive: T) {
        let place = self.0.partition_point(|&(due, _)| due <= at);
        self.0.insert(place, (at, drive));
    }

    /// The moment of the next one, [`NEVER`] where there is none.
    #[must_use]
    pub fn next(&self) -> u64 {
        self.0.front().map_or(NEVER, |drive| drive.0)
    }

    /// Takes the next one, if it is due by the moment `now`.
    pub fn take(&mut self, now: u64) -> Option<T> {
        let &(_, drive) = self.0.front().filter(|drive| drive.0 <= now)?;
        self.0.pop_front();
        Some(drive)
    }
}

/// Events on their way to a probe.
#[derive(Debug, Clone)]
pub struct Log {
    events: VecDeque<Event>,
    on: bool,
}

impl Log {
    /// Off.
    pub const OFF: Log = Log { events: VecDeque::new(), on: false };

    /// Logs from the machine cycle `now` on, first the pins that are fought for already, or stops and forgets.
    pub fn switch(&mut self, on: bool, now: u64, fights: impl Iterator<Item = PinId>) {
        if on && !self.on {
            self.events.extend(fights.map(|pin| Event::Contention { at: Time::at(now), pin }));
        } else if !on {
            self.events.clear();
        }
        self.on = on;
    }

    /// Somebody wants events.
    #[inline]
    #[must_use]
    pub const fn is_on(&self) -> bool {
        self.on
    }

    /// Logs an event, if somebody wants it. Parts run one after the other, so within a cycle one may come that is before what is
    /// logged already.
    pub fn note(&mut self, event: Event) {
        if self.on {
            let place = self.events.partition_point(|logged| logged.at() <= event.at());
            self.events.insert(place, event);
        }
    }

    /// Logs the change of a pin, if there was one, behind a fight over it.
    pub fn pin(&mut self, at: Time, pin: PinId, fought: bool, changed: Option<Level>) {
        if fought {
            self.note(Event::Contention { at, pin });
        }
        if let Some(level) = changed {
            self.note(Event::Edge { at, pin, level });
        }
    }

    /// Takes the oldest event.
    #[inline]
    pub fn take(&mut self) -> Option<Event> {
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
