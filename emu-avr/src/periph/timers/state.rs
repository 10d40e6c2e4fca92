//! A timer as snapshot state ([`emu_core::state`]).

use emu_core::NEVER;
use emu_core::state;

use super::{AvrTimer, CompareChannel, TimerClock};

state! { CompareChannel { written, buffer, compare, level, driven } stays { action } }
state! { enum TimerClock { 0 = Stopped, 1 = Io(ticks), 2 = Tosc { div, base }, 3 = Pin { rising } } }

// Mode and actions are derived from the registers; the event times are computed again.
state! {
    AvrTimer {
        tccra, tccrb, timsk, tifr, assr, temp, icr, channels, effective_control, value, down, match_blocked, clock, edges_counted, prescaler, pin, icp, line_levels,
        asleep, listened_interrupts, tosc, cleared, busy, due, tcnt_next, strobe, pending_flags, stale_count,
    } stays { shape, mode, next_event, next_flag } if |timer, now| timer.is_valid_state(now), then AvrTimer::update_derived
}

impl AvrTimer {
    /// Checks that a restored state is possible for a timer that has executed everything up to `now`.
    fn is_valid_state(&self, now: u64) -> bool {
        let words = self.channels.iter().flat_map(|channel| [channel.written, channel.buffer, channel.compare]);
        let fits = words.chain([self.value, self.tcnt_next]).all(|word| word <= self.shape.max());
        // After a write from outside at a boundary, counting starts with the edge after it.
        let done = self.edges_counted == self.edges(now) || self.edges_counted == self.edges(now + 1);
        fits && done && self.asleep.is_none_or(|since| since <= now + 1) && self.cleared != NEVER
    }

    fn update_derived(&mut self) {
        self.update_actions();
        (self.next_event, self.next_flag) = (0, 0);
    }
}
