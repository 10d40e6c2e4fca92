//! Clock and data recovery (section 20.8), and the shift register of the receiver.

use emu_core::NEVER;

use super::baud::BaudClock;
use super::frame::{FrameFormat, FrameProgress, FrameReader};

/// The receiver of a USART.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct UsartReceiver {
    on: bool,
    /// True if the last sample was high, so that a low sample starts a frame.
    armed: bool,
    frame: Option<FrameReader>,
    /// Number of samples of the current bit taken for the majority vote, and how many of them were high.
    votes: u8,
    highs: u8,
    /// Shift register of master SPI mode.
    pub(super) shift: u8,
    /// Asynchronous mode: ticks of the generator from `since` to the next relevant sample, and its cycle.
    wait: u64,
    since: u64,
    next: u64,
}

emu_core::state! {
    UsartReceiver { on, armed, frame, votes, highs, shift, wait, since, next }
    if |of, _now| of.votes <= 2 && of.highs <= of.votes && of.wait <= 32 && of.since != NEVER
}

impl UsartReceiver {
    /// A receiver that is switched off.
    pub(super) const OFF: UsartReceiver = UsartReceiver {
        on: false,
        armed: false,
        frame: None,
        votes: 0,
        highs: 0,
        shift: 0,
        wait: 0,
        since: 0,
        next: NEVER,
    };

    /// Returns the cycle of the next relevant sample; `NEVER` while the line is idle, and in the clocked
    /// modes.
    pub(super) const fn next(&self) -> u64 {
        self.next
    }

    /// Returns a receiver after it was switched on, or to another mode. A low line does not start a frame.
    pub(super) fn begin(on: bool) -> UsartReceiver {
        UsartReceiver { on, ..UsartReceiver::OFF }
    }

    /// Schedules the next relevant sample at the `wait`th tick after `t`.
    fn wait(&mut self, wait: u64, t: u64, baud: &BaudClock) {
        (self.wait, self.since, self.next) = (wait, t, baud.nth(t, wait));
    }

    /// Asynchronous mode: schedules a sample at the next tick, because the line may have changed or the
    /// receiver was switched on.
    pub(super) fn schedule_sample(&mut self, t: u64, baud: &BaudClock) {
        if self.on && self.frame.is_none() && self.next == NEVER {
            self.wait(1, t, baud);
        }
    }

    /// Counts the ticks up to `t`, before the tick rate changes.
    pub(super) fn catch_up(&mut self, t: u64, baud: &BaudClock) {
        if self.next != NEVER {
            self.wait = self.wait.saturating_sub(baud.divided_between(self.since, t, 1)).max(1);
            self.since = t;
        }
    }

    /// Schedules the next sample again, after the tick rate has changed at `t`.
    pub(super) fn schedule(&mut self, t: u64, baud: &BaudClock) {
        if self.next != NEVER {
            self.wait(self.wait, t, baud);
        }
    }

    /// Processes the sample that is due; `per_bit` is 16 or 8.
    pub(super) fn sample(&mut self, high: bool, format: FrameFormat, per_bit: u64, baud: &BaudClock) -> FrameProgress {
        let t = std::mem::replace(&mut self.next, NEVER);
        let Some(mut frame) = self.frame else {
            if std::mem::replace(&mut self.armed, high) && !high {
                // This is sample 1; samples 8, 9 and 10 vote, or 4, 5 and 6 with double speed.
                self.frame = Some(FrameReader::new(format));
                self.wait(per_bit / 2 - 1, t, baud);
            }
            return FrameProgress::More;
        };
        self.votes += 1;
        self.highs += u8::from(high);
        if self.votes < 3 {
            self.wait(1, t, baud);
            return FrameProgress::More;
        }
        let high = self.highs >= 2;
        let found = frame.take_bit(high);
        (self.votes, self.highs) = (0, 0);
        if matches!(found, FrameProgress::More | FrameProgress::Start) {
            self.frame = Some(frame);
            self.wait(per_bit - 2, t, baud);
        } else {
            // The next start bit may already have begun (section 20.8.3): the result of the vote counts as
            // the last sample.
            (self.frame, self.armed) = (None, high);
            self.wait(1, t, baud);
        }
        found
    }

    /// Samples a bit at an edge of the clock (synchronous mode).
    pub(super) fn sample_clocked(&mut self, high: bool, format: FrameFormat) -> FrameProgress {
        let begins = std::mem::replace(&mut self.armed, high) && !high;
        if self.frame.is_none() && begins {
            self.frame = Some(FrameReader::new(format));
        }
        let Some(mut frame) = self.frame else { return FrameProgress::More };
        let found = frame.take_bit(high);
        self.frame = matches!(found, FrameProgress::More | FrameProgress::Start).then_some(frame);
        found
    }

    /// Returns the cycle at which the frame is complete, or the next sample if there is no frame.
    pub(super) fn end(&self, per_bit: u64, baud: &BaudClock) -> u64 {
        match &self.frame {
            Some(frame) if self.next != NEVER => {
                let ticks = self.wait + u64::from(2 - self.votes) + u64::from(frame.bits_left()) * per_bit;
                baud.nth(self.since, ticks)
            }
            _ => self.next,
        }
    }

    /// Delays everything by the cycles for which the clock was stopped.
    pub(super) fn postpone(&mut self, cycles: u64) {
        self.since = self.since.saturating_add(cycles);
        self.next = self.next.saturating_add(cycles);
    }
}
