//! Frames of one start bit, eight data bits (lowest first) and one stop bit: the shifter that sends them and the sampler
//! that finds them on a line.

use crate::cpu::NEVER;
use crate::parts::prescaler::Ticks;
use crate::pins::Level;

/// Bits of a frame, start and stop bit included.
const FRAME: u8 = 10;

/// The shifter of a transmitter. It takes its steps at the edges of a clock of one edge a bit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sender {
    byte: u8,
    /// Bits already put on the line.
    done: u8,
    next: u64,
}

/// What a step of a [`Sender`] did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// The line has this level from now on.
    Bit(bool),
    /// The stop bit of this byte is over; the shifter is idle.
    End(u8),
}

impl Sender {
    /// An idle shifter.
    pub const IDLE: Sender = Sender { byte: 0, done: 0, next: NEVER };

    /// The cycle of the next step; [`NEVER`] when idle.
    #[must_use]
    pub const fn next(&self) -> u64 {
        self.next
    }

    /// Loads a byte at the cycle `at`; its start bit begins at the first edge after it.
    pub fn load(&mut self, byte: u8, at: u64, bits: Ticks) {
        *self = Sender { byte, done: 0, next: bits.nth(at, 1) };
    }

    /// Loads a byte at the end of another; its start bit begins at once, at the cycle `at`. The line goes low.
    pub fn follow(&mut self, byte: u8, at: u64, bits: Ticks) {
        *self = Sender { byte, done: 1, next: bits.nth(at, 1) };
    }

    /// Takes the step that is due at [`Sender::next`].
    pub fn step(&mut self, bits: Ticks) -> Step {
        if self.done == FRAME {
            self.next = NEVER;
            return Step::End(self.byte);
        }
        let bit = frame_bit(self.byte, self.done);
        self.done += 1;
        self.next = bits.nth(self.next, 1);
        Step::Bit(bit)
    }

    /// The clock has other edges from the cycle `at` on.
    pub fn retime(&mut self, at: u64, bits: Ticks) {
        if self.next != NEVER {
            self.next = bits.nth(at, 1);
        }
    }
}

/// The sampler of a receiver: 16 or 8 samples a bit, the majority of three in the middle decides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Receiver {
    on: bool,
    /// The last sample was high, so that a low one begins a frame.
    armed: bool,
    /// Bit being sampled: 0 is the start bit, 9 the stop bit. `None` between frames.
    bit: Option<u8>,
    /// Votes taken in this bit, and how many of them were high.
    votes: u8,
    highs: u8,
    data: u8,
    /// Edges of the sampling clock from `since` to the next sample that matters.
    wait: u64,
    since: u64,
    next: u64,
}

/// What a [`Receiver`] found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Found {
    /// A start bit was confirmed.
    Start,
    /// A frame is complete.
    Frame {
        /// Its data.
        byte: u8,
        /// The stop bit was high, as it should be.
        stop: bool,
    },
}

impl Receiver {
    /// A receiver that is off.
    pub const OFF: Receiver =
        Receiver { on: false, armed: false, bit: None, votes: 0, highs: 0, data: 0, wait: 0, since: 0, next: NEVER };

    /// The cycle of the next sample that matters; [`NEVER`] while the line rests.
    #[must_use]
    pub const fn next(&self) -> u64 {
        self.next
    }

    /// Switches on at the cycle `at`; the first sample is taken at the first edge after it.
    pub fn enable(&mut self, at: u64, samples: Ticks) {
        *self = Receiver { on: true, ..Receiver::OFF };
        self.sleep(1, at, samples);
    }

    /// The line changed at the cycle `at`; a sampler sees it from the next cycle on.
    pub fn line_changed(&mut self, at: u64, samples: Ticks) {
        if self.on && self.bit.is_none() && self.next == NEVER {
            self.sleep(1, at, samples);
        }
    }

    /// The sampling clock has other edges from the cycle `at` on.
    pub fn retime(&mut self, at: u64, old: Ticks, new: Ticks) {
        if self.next != NEVER {
            let left = self.wait.saturating_sub(old.count(self.since, at)).max(1);
            self.sleep(left, at, new);
        }
    }

    /// Takes the sample that is due at [`Receiver::next`]: `sample` is the line as sampled, `line` the line as it stands,
    /// `per_bit` the samples in a bit (16 or 8).
    pub fn step(&mut self, sample: bool, line: bool, per_bit: u8, samples: Ticks) -> Option<Found> {
        let at = self.next;
        let Some(bit) = self.bit else {
            let start = self.armed && !sample;
            self.armed = sample;
            if start {
                // This is sample 1; the votes are samples 8, 9, 10 of 16 or 4, 5, 6 of 8.
                (self.bit, self.votes, self.highs) = (Some(0), 0, 0);
                self.sleep(u64::from(per_bit) / 2 - 1, at, samples);
            } else {
                self.rest(line, at, samples);
            }
            return None;
        };
        self.votes += 1;
        self.highs += u8::from(sample);
        if self.votes < 3 {
            self.sleep(1, at, samples);
            return None;
        }
        let high = self.highs >= 2;
        (self.votes, self.highs) = (0, 0);
        if bit == FRAME - 1 || (bit == 0 && high) {
            self.bit = None;
            self.armed = sample;
            self.rest(line, at, samples);
            return (bit != 0).then_some(Found::Frame { byte: self.data, stop: high });
        }
        if bit != 0 {
            self.data = self.data >> 1 | u8::from(high) << 7;
        }
        self.bit = Some(bit + 1);
        self.sleep(u64::from(per_bit) - 2, at, samples);
        (bit == 0).then_some(Found::Start)
    }

    /// Between frames only a level that differs from the last sample is worth a look.
    fn rest(&mut self, line: bool, at: u64, samples: Ticks) {
        if line == self.armed {
            self.next = NEVER;
        } else {
            self.sleep(1, at, samples);
        }
    }

    fn sleep(&mut self, wait: u64, at: u64, samples: Ticks) {
        (self.wait, self.since, self.next) = (wait, at, samples.nth(at, wait));
    }
}

/// The level changes of one frame on a line that rests high, to drive a receiver with: the start bit begins at cycle
/// `start`, and bit `k` at `start + k * num / den`, rounded down. The next frame may start at `k` = 10. A `den` of 0
/// counts as 1.
pub fn frame_edges(byte: u8, start: u64, num: u64, den: u64) -> impl Iterator<Item = (u64, Level)> {
    (0..FRAME).filter_map(move |k| {
        let before = k == 0 || frame_bit(byte, k - 1);
        let bit = frame_bit(byte, k);
        let after = u128::from(num) * u128::from(k) / u128::from(den.max(1));
        let at = start.saturating_add(u64::try_from(after).unwrap_or(NEVER));
        (bit != before).then_some((at, Level::of(bit)))
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
        // Byte, cycles per bit as a fraction, changes: first the start bit, then wherever neighbours differ.
        let cases = [
            (0x00, 10, 1, "100 Low, 190 High"),
            (0xFF, 10, 1, "100 Low, 110 High"),
            (0x0F, 25, 2, "100 Low, 112 High, 162 Low, 212 High"),
            (0x80, 7, 2, "100 Low, 128 High"),
        ];
        for (byte, num, den, want) in cases {
            let edges: Vec<_> = frame_edges(byte, 100, num, den).map(|(at, level)| format!("{at} {level:?}")).collect();
            assert_eq!(edges.join(", "), want, "byte {byte:#04x}");
        }
    }

    #[test]
    fn a_sender_puts_ten_bits_on_the_line_and_then_ends() {
        let bits = Ticks { origin: 2, every: 16 };
        let mut sender = Sender::IDLE;
        sender.load(0xA5, 5, bits);
        let mut seen = Vec::new();
        while sender.next() != NEVER {
            let at = sender.next();
            seen.push((at, sender.step(bits)));
        }
        let levels = [false, true, false, true, false, false, true, false, true, true];
        let mut want: Vec<_> = (0..10).map(|k| (18 + 16 * k as u64, Step::Bit(levels[k]))).collect();
        want.push((178, Step::End(0xA5)));
        assert_eq!(seen, want);
    }
}
