//! Serial frames of one start bit, eight data bits (lowest first) and one stop bit: the shift register of the
//! transmitter and the sampler of the receiver.

use crate::cpu::NEVER;
use crate::parts::prescaler::TickSeries;
use crate::pins::PinLevel;

/// Bits of a frame, including start and stop bit.
const FRAME_BITS: u8 = 10;

/// The shift register of a transmitter. It takes a step at each edge of a clock with one edge per bit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UartSender {
    byte: u8,
    /// Number of bits that are already on the line.
    bits_sent: u8,
    next: u64,
}

/// The effect of one step of a [`UartSender`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SenderStep {
    /// The line has this level from now on.
    LineLevel(bool),
    /// The stop bit of this byte has ended and the shift register is idle.
    FrameSent(u8),
}

impl UartSender {
    /// An idle shift register.
    pub const IDLE: UartSender = UartSender { byte: 0, bits_sent: 0, next: NEVER };

    /// The cycle of the next step, or [`NEVER`] if idle.
    #[must_use]
    pub const fn next_step(&self) -> u64 {
        self.next
    }

    /// Loads a byte at the cycle `at`. Its start bit begins at the next clock edge.
    pub fn load(&mut self, byte: u8, at: u64, bits: TickSeries) {
        *self = UartSender { byte, bits_sent: 0, next: bits.nth_after(at, 1) };
    }

    /// Loads a byte at the end of another byte. Its start bit begins immediately, at the cycle `at`; the
    /// caller sets the line low.
    pub fn load_back_to_back(&mut self, byte: u8, at: u64, bits: TickSeries) {
        *self = UartSender { byte, bits_sent: 1, next: bits.nth_after(at, 1) };
    }

    /// Takes the step that is due at [`UartSender::next_step`].
    pub fn step(&mut self, bits: TickSeries) -> SenderStep {
        if self.bits_sent == FRAME_BITS {
            self.next = NEVER;
            return SenderStep::FrameSent(self.byte);
        }
        let bit = frame_bit(self.byte, self.bits_sent);
        self.bits_sent += 1;
        self.next = bits.nth_after(self.next, 1);
        SenderStep::LineLevel(bit)
    }

    /// Sets new clock edges from the cycle `at` on.
    pub fn set_clock(&mut self, at: u64, bits: TickSeries) {
        if self.next != NEVER {
            self.next = bits.nth_after(at, 1);
        }
    }
}

/// The sampler of a receiver. It takes 16 or 8 samples per bit; the majority of three samples in the middle
/// decides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UartReceiver {
    on: bool,
    /// The last sample was high, so a low sample starts a frame.
    last_sample_high: bool,
    /// The bit that is being sampled: 0 is the start bit, 9 the stop bit. `None` between frames.
    bit: Option<u8>,
    /// Number of samples of this bit that count, and how many of them were high.
    votes: u8,
    highs: u8,
    data: u8,
    /// Edges of the sampling clock from `wait_start` to the next relevant sample.
    edges_to_next: u64,
    wait_start: u64,
    next: u64,
}

/// An event that a [`UartReceiver`] detected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReceiverEvent {
    /// A start bit was confirmed.
    StartBit,
    /// A frame is complete.
    Frame {
        /// The data byte.
        byte: u8,
        /// Whether the stop bit was high, which is the valid level.
        stop_bit: bool,
    },
}

impl UartReceiver {
    /// A disabled receiver.
    pub const OFF: UartReceiver = UartReceiver {
        on: false,
        last_sample_high: false,
        bit: None,
        votes: 0,
        highs: 0,
        data: 0,
        edges_to_next: 0,
        wait_start: 0,
        next: NEVER,
    };

    /// The cycle of the next relevant sample, or [`NEVER`] while the line is idle.
    #[must_use]
    pub const fn next_sample(&self) -> u64 {
        self.next
    }

    /// Enables the receiver at the cycle `at`. It takes the first sample at the next clock edge.
    pub fn enable(&mut self, at: u64, samples: TickSeries) {
        *self = UartReceiver { on: true, ..UartReceiver::OFF };
        self.schedule_in(1, at, samples);
    }

    /// Reports a change of the line at the cycle `at`. The sampler sees it from the next cycle on.
    pub fn line_changed(&mut self, at: u64, samples: TickSeries) {
        if self.on && self.bit.is_none() && self.next == NEVER {
            self.schedule_in(1, at, samples);
        }
    }

    /// Changes the sampling clock from `old` to `new` at the cycle `at`.
    pub fn set_clock(&mut self, at: u64, old: TickSeries, new: TickSeries) {
        if self.next != NEVER {
            let left = self.edges_to_next.saturating_sub(old.ticks_between(self.wait_start, at)).max(1);
            self.schedule_in(left, at, new);
        }
    }

    /// Takes the sample that is due at [`UartReceiver::next_sample`]. `sample` is the sampled level, `line`
    /// is the present level of the line, and `per_bit` is the number of samples per bit (16 or 8).
    pub fn step(&mut self, sample: bool, line: bool, per_bit: u8, samples: TickSeries) -> Option<ReceiverEvent> {
        let at = self.next;
        let Some(bit) = self.bit else {
            let start = self.last_sample_high && !sample;
            self.last_sample_high = sample;
            if start {
                // This is sample 1. The samples that count are 8, 9, 10 of 16 or 4, 5, 6 of 8.
                (self.bit, self.votes, self.highs) = (Some(0), 0, 0);
                self.schedule_in(u64::from(per_bit) / 2 - 1, at, samples);
            } else {
                self.schedule_idle(line, at, samples);
            }
            return None;
        };
        self.votes += 1;
        self.highs += u8::from(sample);
        if self.votes < 3 {
            self.schedule_in(1, at, samples);
            return None;
        }
        let high = self.highs >= 2;
        (self.votes, self.highs) = (0, 0);
        if bit == FRAME_BITS - 1 || (bit == 0 && high) {
            self.bit = None;
            self.last_sample_high = sample;
            self.schedule_idle(line, at, samples);
            return (bit != 0).then_some(ReceiverEvent::Frame { byte: self.data, stop_bit: high });
        }
        if bit != 0 {
            self.data = self.data >> 1 | u8::from(high) << 7;
        }
        self.bit = Some(bit + 1);
        self.schedule_in(u64::from(per_bit) - 2, at, samples);
        (bit == 0).then_some(ReceiverEvent::StartBit)
    }

    /// Between frames a sample is needed only if the line differs from the last sample.
    fn schedule_idle(&mut self, line: bool, at: u64, samples: TickSeries) {
        if line == self.last_sample_high {
            self.next = NEVER;
        } else {
            self.schedule_in(1, at, samples);
        }
    }

    fn schedule_in(&mut self, wait: u64, at: u64, samples: TickSeries) {
        (self.edges_to_next, self.wait_start, self.next) = (wait, at, samples.nth_after(at, wait));
    }
}

/// A level change on a serial line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameEdge {
    /// The cycle of the change.
    pub cycle: u64,
    /// The level from then on.
    pub level: PinLevel,
}

/// Returns the level changes of one frame on an idle (high) line, for driving a receiver. The start bit
/// begins at cycle `start`, and bit `k` at `start + k * num / den`, rounded down. The next frame can start at
/// `k` = 10. A `den` of 0 counts as 1.
pub fn frame_edges(byte: u8, start: u64, num: u64, den: u64) -> impl Iterator<Item = FrameEdge> {
    (0..FRAME_BITS).filter_map(move |k| {
        let before = k == 0 || frame_bit(byte, k - 1);
        let bit = frame_bit(byte, k);
        let after = u128::from(num) * u128::from(k) / u128::from(den.max(1));
        let at = start.saturating_add(u64::try_from(after).unwrap_or(NEVER));
        (bit != before).then_some(FrameEdge { cycle: at, level: PinLevel::from_bit(bit) })
    })
}

/// Bit `k` of the frame of `byte`: 0 is the start bit, 9 the stop bit.
const fn frame_bit(byte: u8, k: u8) -> bool {
    match k {
        0 => false,
        1..=8 => byte >> (k - 1) & 1 == 1,
        _ => true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_of_a_frame() {
        // Byte, cycles per bit as a fraction, changes: first the start bit, then each bit that differs from
        // the one before.
        let cases = [
            (0x00, 10, 1, "100 Low, 190 High"),
            (0xFF, 10, 1, "100 Low, 110 High"),
            (0x0F, 25, 2, "100 Low, 112 High, 162 Low, 212 High"),
            (0x80, 7, 2, "100 Low, 128 High"),
        ];
        for (byte, num, den, want) in cases {
            let edges: Vec<_> = frame_edges(byte, 100, num, den)
                .map(|FrameEdge { cycle: at, level }| format!("{at} {level:?}"))
                .collect();
            assert_eq!(edges.join(", "), want, "byte {byte:#04x}");
        }
    }

    #[test]
    fn a_sender_puts_ten_bits_on_the_line_and_then_ends() {
        let bits = TickSeries { origin: 2, period: 16 };
        let mut sender = UartSender::IDLE;
        sender.load(0xA5, 5, bits);
        let mut seen = Vec::new();
        while sender.next_step() != NEVER {
            let at = sender.next_step();
            seen.push((at, sender.step(bits)));
        }
        let levels = [false, true, false, true, false, false, true, false, true, true];
        let mut want: Vec<_> = (0..10).map(|k| (18 + 16 * k as u64, SenderStep::LineLevel(levels[k]))).collect();
        want.push((178, SenderStep::FrameSent(0xA5)));
        assert_eq!(seen, want);
    }
}
