//! What passes between a chip and the outside: the queue of future drives, and the log of events that left
//! the chip.

use std::collections::VecDeque;

use crate::cpu::NEVER;
use crate::pins::{ChipEvent, CycleTime, PinId, PinLevel};
use crate::state::{SnapshotDamaged, SnapshotState, StateTape};

/// An input from outside a chip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutsideInput {
    /// A level on a pin, or no drive.
    Level(PinId, PinLevel),
    /// A voltage on a pin, in millivolts.
    Volts(PinId, u32),
    /// The supply voltage, in millivolts.
    Supply(u32),
}

impl Default for OutsideInput {
    fn default() -> OutsideInput {
        OutsideInput::Supply(0)
    }
}

crate::state! { enum OutsideInput { 0 = Level(pin, level), 1 = Volts(pin, millivolts), 2 = Supply(millivolts) } }

/// Future drives from outside (by default of a pin to a level), in order of time. Drives of the same time
/// keep the order in which they were queued. Times are machine cycles, or clocks on a chip that counts
/// clocks.
#[derive(Debug, Clone)]
pub struct DriveQueue<T = (PinId, PinLevel)>(VecDeque<(u64, T)>);

/// The drives are saved in order of time.
impl<T: SnapshotState + Default> SnapshotState for DriveQueue<T> {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        self.0.pass_state(tape)?;
        let in_order = self.0.iter().zip(self.0.iter().skip(1)).all(|(first, second)| first.0 <= second.0);
        tape.require(in_order && self.0.iter().all(|drive| drive.0 != NEVER))
    }
}

impl<T: Copy> DriveQueue<T> {
    /// An empty queue.
    pub const NONE: DriveQueue<T> = DriveQueue(VecDeque::new());

    /// Queues a drive for the time `at`.
    pub fn push(&mut self, at: u64, drive: T) {
        let index = self.0.partition_point(|&(due, _)| due <= at);
        self.0.insert(index, (at, drive));
    }

    /// The time of the next drive, or [`NEVER`].
    #[must_use]
    pub fn next_cycle(&self) -> u64 {
        self.0.front().map_or(NEVER, |drive| drive.0)
    }

    /// Removes and returns the next drive if its time is at most `now`.
    pub fn pop_due(&mut self, now: u64) -> Option<T> {
        let &(_, drive) = self.0.front().filter(|drive| drive.0 <= now)?;
        self.0.pop_front();
        Some(drive)
    }
}

/// Events that wait to be given to a probe.
#[derive(Debug, Clone)]
pub struct EventLog {
    events: VecDeque<ChipEvent>,
    enabled: bool,
}

impl EventLog {
    /// An empty, disabled log.
    pub const OFF: EventLog = EventLog { events: VecDeque::new(), enabled: false };

    /// Enables or disables the log. If it was disabled, enabling it first logs a contention at the machine
    /// cycle `now` for each of `contended_pins`. Disabling it discards all events.
    pub fn set_enabled(&mut self, on: bool, now: u64, contended_pins: Vec<PinId>) {
        if on && !self.enabled {
            self.events
                .extend(contended_pins.into_iter().map(|pin| ChipEvent::Contention { at: CycleTime::at(now), pin }));
        } else if !on {
            self.events.clear();
        }
        self.enabled = on;
    }

    /// Returns true if events are logged.
    #[inline]
    #[must_use]
    pub const fn is_enabled(&self) -> bool {
        self.enabled
    }

    /// Adds an event if the log is enabled. Peripherals run one after the other, so an event can be earlier
    /// than those already logged in the same cycle; it is sorted in by time.
    pub fn record(&mut self, event: ChipEvent) {
        if self.enabled {
            let index = self.events.partition_point(|logged| logged.time() <= event.time());
            self.events.insert(index, event);
        }
    }

    /// Logs a contention of a pin if `is_contended`, then the change of its level if there is one.
    pub fn record_pin(&mut self, at: CycleTime, pin: PinId, is_contended: bool, changed: Option<PinLevel>) {
        if is_contended {
            self.record(ChipEvent::Contention { at, pin });
        }
        if let Some(level) = changed {
            self.record(ChipEvent::Edge { at, pin, level });
        }
    }

    /// Removes and returns the oldest event.
    #[inline]
    pub fn pop(&mut self) -> Option<ChipEvent> {
        self.events.pop_front()
    }

    /// Number of waiting events.
    #[inline]
    #[must_use]
    pub fn len(&self) -> usize {
        self.events.len()
    }

    /// Returns true if no event waits.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.events.is_empty()
    }
}
