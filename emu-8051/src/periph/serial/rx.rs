//! The receiver of modes 1 to 3: a detector of falling edges, and a divide-by-16 counter that such an edge
//! resets.

use emu_core::state;

/// Ticks from the edge to the vote on the tenth bit: stop bit of mode 1, ninth data bit of modes 2 and 3.
const FRAME_TICKS: u8 = 9 * 16 + VOTE_TICK;
/// The tick of a bit at which its vote is complete.
const VOTE_TICK: u8 = 9;

/// A frame that is being received.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct IncomingFrame {
    /// Ticks since the edge: bit number times 16, plus the state of the counter.
    ticks: u8,
    /// Number of high samples of this bit, of those in the counter's states 7, 8 and 9.
    highs: u8,
    /// The bits after the start bit, the first one lowest.
    bits: u16,
}

state! { IncomingFrame { ticks, highs, bits } if |frame, _now| frame.ticks < 11 * 16 && frame.highs <= 3 }

/// The receiver.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SerialReceiver {
    /// The present level of the line.
    level: bool,
    /// The level of the line at the last tick.
    last: bool,
    frame: Option<IncomingFrame>,
}

state! { SerialReceiver { level, last, frame } }

impl SerialReceiver {
    /// No frame in progress, and the line high.
    pub(super) const IDLE: SerialReceiver = SerialReceiver { level: true, last: true, frame: None };

    /// Sets the present level of the line.
    pub(super) fn set_level(&mut self, level: bool) {
        self.level = level;
    }

    /// The present level of the line.
    pub(super) const fn level(&self) -> bool {
        self.level
    }

    /// Drops the frame in progress.
    pub(super) fn abort(&mut self) {
        self.frame = None;
    }

    /// Whether a frame is in progress.
    pub(super) fn is_receiving(&self) -> bool {
        self.frame.is_some()
    }

    /// Ticks until one that matters if the line does not change: the edge, the vote on the start bit, the end
    /// of the frame. With `detects_edges`, a falling edge begins a frame.
    pub(super) fn ticks_to_next_step(&self, detects_edges: bool) -> Option<u64> {
        let Some(frame) = self.frame else { return (detects_edges && self.last && !self.level).then_some(1) };
        let due = if frame.ticks < VOTE_TICK { VOTE_TICK } else { FRAME_TICKS };
        due.checked_sub(frame.ticks).filter(|&wait| wait != 0).map(u64::from)
    }

    /// Lets `n` ticks pass with an unchanged line, none of which matters.
    pub(super) fn advance(&mut self, mut n: u64, detects_edges: bool, mode_1: bool) {
        debug_assert!(
            self.ticks_to_next_step(detects_edges).is_none_or(|wait| n < wait),
            "{n} ticks pass over an event: {self:?}"
        );
        while let Some(frame) = &mut self.frame {
            let state = frame.ticks & 15;
            let gap = if state < 7 {
                7 - state
            } else if state < VOTE_TICK {
                1
            } else {
                23 - state
            };
            if n < u64::from(gap) {
                frame.ticks += n as u8;
                break;
            }
            frame.ticks += gap - 1;
            self.sample(self.level, detects_edges, mode_1);
            n -= u64::from(gap);
        }
        if n > 0 {
            self.last = self.level;
        }
    }

    /// Executes one tick. Returns the nine bits after the start bit at the vote on the last of them.
    pub(super) fn sample(&mut self, sample: bool, detects_edges: bool, mode_1: bool) -> Option<u16> {
        let fell = self.last && !sample;
        self.last = sample;
        self.level = sample;
        let Some(frame) = &mut self.frame else {
            if detects_edges && fell {
                self.frame = Some(IncomingFrame { ticks: 0, highs: 0, bits: 0 });
            }
            return None;
        };
        frame.ticks += 1;
        let state = frame.ticks & 15;
        if (7..=VOTE_TICK).contains(&state) {
            frame.highs += u8::from(sample);
        }
        if state != VOTE_TICK {
            return None;
        }
        let high = frame.highs >= 2;
        frame.highs = 0;
        let bit = frame.ticks >> 4;
        if (1..=9).contains(&bit) {
            frame.bits |= u16::from(high) << (bit - 1);
        }
        let taken = (bit == 9).then_some(frame.bits);
        // A start bit that is not 0 is rejected. Mode 1 looks for the next edge from the vote on the stop bit
        // on, modes 2 and 3 one bit time after the vote on the ninth bit, regardless of the stop bit.
        if bit == 0 && high || bit == 9 && mode_1 || bit > 9 {
            self.frame = None;
        }
        taken
    }
}
