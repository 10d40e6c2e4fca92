//! A timer as a state ([`emu_core::state`]).

use emu_core::NEVER;
use emu_core::state;

use super::{Channel, Clock, Timer};

state! { Channel { written, buffer, compare, level, shown } stays { action } }
state! { enum Clock { 0 = Stopped, 1 = Io(ticks), 2 = Tosc { div, base }, 3 = Pin { rising } } }

// Mode and actions follow from the registers; when it is quiet and calm is found again.
state! {
    Timer {
        tccra, tccrb, timsk, tifr, assr, temp, icr, channels, acting, value, down, blocked, clock, done, prescaler, pin, icp, raw,
        asleep, listened, tosc, cleared, busy, due, tcnt_next, strobe, late, stale,
    } stays { shape, mode, quiet, calm } if |timer, now| timer.sound(now), then Timer::follow
}

impl Timer {
    /// What was read can be of a timer that has done everything up to `now`.
    fn sound(&self, now: u64) -> bool {
        let words = self.channels.iter().flat_map(|channel| [channel.written, channel.buffer, channel.compare]);
        let fits = words.chain([self.value, self.tcnt_next]).all(|word| word <= self.shape.max());
        // What is written by hand at a boundary counts from the edge after it.
        let done = self.done == self.edges(now) || self.done == self.edges(now + 1);
        fits && done && self.asleep.is_none_or(|since| since <= now + 1) && self.cleared != NEVER
    }

    fn follow(&mut self) {
        self.choose();
        (self.quiet, self.calm) = (0, 0);
    }
}
