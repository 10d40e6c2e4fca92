//! Clock and data recovery (section 20.8), and the shift register of the receiver.

use emu_core::NEVER;

use super::baud::BaudClock;
use super::frame::{FrameFormat, FrameProgress, FrameReader};

/// The receiver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct UsartReceiver {
    on: bool,
    /// The last sample was high, so that a low one begins a frame.
    armed: bool,
    frame: Option<FrameReader>,
    /// Samples of the bit that have been taken to vote, and how many of them were high.
    votes: u8,
    highs: u8,
    /// The shift register of master SPI mode.
    pub(super) shift: u8,
    /// Asynchronous: ticks of the generator from `since` to the next sample that matters, and when that is.
    wait: u64,
    since: u64,
    next: u64,
}

emu_core::state! {
    UsartReceiver { on, armed, frame, votes, highs, shift, wait, since, next }
    if |of, _now| of.votes <= 2 && of.highs <= of.votes && of.wait <= 32 && of.since != NEVER
}

impl UsartReceiver {
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

    /// When the next sample is taken that matters; `NEVER` while the line rests, and where it is clocked from without.
    pub(super) const fn next(&self) -> u64 {
        self.next
    }

    /// Switched on, or to another mode. A line that is low begins no frame.
    pub(super) fn begin(on: bool) -> UsartReceiver {
        UsartReceiver { on, ..UsartReceiver::OFF }
    }

    /// The next sample that matters is the `wait`th tick after `t`.
    fn wait(&mut self, wait: u64, t: u64, baud: &BaudClock) {
        (self.wait, self.since, self.next) = (wait, t, baud.nth(t, wait));
    }

    /// Asynchronous: the line may have changed, or the receiver is new; looks at it with the next tick.
    pub(super) fn schedule_sample(&mut self, t: u64, baud: &BaudClock) {
        if self.on && self.frame.is_none() && self.next == NEVER {
            self.wait(1, t, baud);
        }
    }

    /// The ticks up to `t` are counted.
    pub(super) fn catch_up(&mut self, t: u64, baud: &BaudClock) {
        if self.next != NEVER {
            self.wait = self.wait.saturating_sub(baud.divided_between(self.since, t, 1)).max(1);
            self.since = t;
        }
    }

    /// The ticks after `t` are others than before.
    pub(super) fn schedule(&mut self, t: u64, baud: &BaudClock) {
        if self.next != NEVER {
            self.wait(self.wait, t, baud);
        }
    }

    /// Takes the sample that is due; `per_bit` is 16 or 8.
    pub(super) fn sample(&mut self, high: bool, format: FrameFormat, per_bit: u64, baud: &BaudClock) -> FrameProgress {
        let t = std::mem::replace(&mut self.next, NEVER);
        let Some(mut frame) = self.frame else {
            if std::mem::replace(&mut self.armed, high) && !high {
                // This is sample 1; 8, 9 and 10 vote, or 4, 5 and 6.
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
            // A start bit may follow that is in sight already (section 20.8.3): what was voted counts as the last sample.
            (self.frame, self.armed) = (None, high);
            self.wait(1, t, baud);
        }
        found
    }

    /// Takes a bit at an edge of the clock (synchronous mode).
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

    /// When the frame is complete; the next sample where there is none yet.
    pub(super) fn end(&self, per_bit: u64, baud: &BaudClock) -> u64 {
        match &self.frame {
            Some(frame) if self.next != NEVER => {
                let ticks = self.wait + u64::from(2 - self.votes) + u64::from(frame.bits_left()) * per_bit;
                baud.nth(self.since, ticks)
            }
            _ => self.next,
        }
    }

    /// The clock stood for so many cycles.
    pub(super) fn postpone(&mut self, cycles: u64) {
        self.since = self.since.saturating_add(cycles);
        self.next = self.next.saturating_add(cycles);
    }
}
