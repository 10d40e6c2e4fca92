//! Input over a serial line: bytes as the edges that a sender makes, 8 bits, no parity, one stop bit.

use emu_core::pins::{CycleTime, PinId, PinLevel};

use crate::InputError;
use crate::stimulus::{ExternalDrive, TimedDrive};
use crate::text::time::{CycleClock, MAX_CYCLES};

/// Bits of a frame: start bit, 8 data bits from the lowest, stop bit.
const BITS_PER_FRAME: u128 = 10;

/// Maximum rate in bits per second: higher than any USART of these chips reaches.
const MAX_BAUD: u64 = 20_000_000;

/// A sender at a pin of the chip.
#[derive(Debug, Clone, Copy)]
pub struct SerialLineSender {
    /// The pin at the other end of the line.
    pub pin: PinId,
    /// Bits per second.
    baud: u64,
    /// When the line is free, in clocks times the rate: the end of a bit is an integer in this unit.
    free_at: u128,
}

/// Bytes to send, with the time of the first.
#[derive(Debug, Clone)]
pub struct TimedText {
    /// The time from which on they are sent.
    pub at: CycleTime,
    /// The bytes.
    pub bytes: Vec<u8>,
}

impl SerialLineSender {
    /// Returns a sender of `baud` bits per second.
    ///
    /// # Errors
    /// Zero, or more than `MAX_BAUD`.
    pub fn new(pin: PinId, baud: u64) -> Result<SerialLineSender, InputError> {
        SerialLineSender::check_baud_rate(baud).map(|()| SerialLineSender { pin, baud, free_at: 0 })
    }

    /// Checks that a rate is allowed.
    ///
    /// # Errors
    /// It is not within 1 to `MAX_BAUD`.
    pub fn check_baud_rate(baud: u64) -> Result<(), InputError> {
        match baud {
            1..=MAX_BAUD => Ok(()),
            _ => Err(InputError::BadBaudRate { most: MAX_BAUD }),
        }
    }

    /// Returns the line before the first byte: high.
    #[must_use]
    pub fn idle_level(&self) -> TimedDrive {
        TimedDrive { at: CycleTime::default(), drive: ExternalDrive::Level(self.pin, PinLevel::High) }
    }

    /// Returns the edges of bytes from a time on, or after the previous bytes, whichever is later. The line
    /// is high before and after them. Each edge is rounded down to a clock independently, so errors do not
    /// add up.
    ///
    /// # Errors
    /// Edges later than 2^62 cycles.
    pub fn edges_of_bytes(
        &mut self,
        clock: CycleClock,
        at: CycleTime,
        bytes: &[u8],
    ) -> Result<Vec<TimedDrive>, InputError> {
        let per_cycle = u128::from(clock.clocks_per_cycle.max(1));
        let (hz, baud) = (u128::from(clock.hz), u128::from(self.baud));
        let requested = u128::from(at.cycle) * per_cycle + u128::from(at.phase);
        let mut start = self.free_at.max(requested * baud);
        let mut drives = Vec::new();
        for &byte in bytes {
            let levels = u16::from(byte) << 1 | 1 << 9;
            let mut before = true;
            for bit in 0..BITS_PER_FRAME {
                let level = levels >> bit & 1 == 1;
                if level != before {
                    let clocks = (start + bit * hz) / baud;
                    let cycle = u64::try_from(clocks / per_cycle).ok().filter(|&cycle| cycle <= MAX_CYCLES);
                    let cycle = cycle.ok_or(InputError::SerialTextTooLong)?;
                    let at = CycleTime { cycle, phase: (clocks % per_cycle) as u8 };
                    let drive = ExternalDrive::Level(self.pin, if level { PinLevel::High } else { PinLevel::Low });
                    drives.push(TimedDrive { at, drive });
                }
                before = level;
            }
            start += BITS_PER_FRAME * hz;
        }
        self.free_at = start;
        Ok(drives)
    }

    /// Returns the idle line and the edges of `texts`, in order of time.
    ///
    /// # Errors
    /// Those of [`SerialLineSender::edges_of_bytes`].
    pub fn edges_of_texts(mut self, clock: CycleClock, texts: &[TimedText]) -> Result<Vec<TimedDrive>, InputError> {
        let mut drives = vec![self.idle_level()];
        let mut sorted: Vec<&TimedText> = texts.iter().collect();
        sorted.sort_by_key(|text| text.at);
        for text in sorted {
            drives.extend(self.edges_of_bytes(clock, text.at, &text.bytes)?);
        }
        Ok(drives)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLOCK: CycleClock = CycleClock { hz: 16_000_000, clocks_per_cycle: 1 };

    fn edges(clock: CycleClock, baud: u64, texts: &[(u64, &str)]) -> Vec<(u64, u8, bool)> {
        let at = |cycle| CycleTime { cycle, ..CycleTime::default() };
        let texts: Vec<_> =
            texts.iter().map(|(cycle, text)| TimedText { at: at(*cycle), bytes: text.as_bytes().to_vec() }).collect();
        let drives = SerialLineSender::new(7, baud).expect("a rate").edges_of_texts(clock, &texts).expect("edges");
        let edge = |drive: &TimedDrive| match drive.drive {
            ExternalDrive::Level(7, level @ (PinLevel::High | PinLevel::Low)) => {
                (drive.at.cycle, drive.at.phase, level == PinLevel::High)
            }
            ref other => panic!("{other:?}"),
        };
        drives.iter().map(edge).collect()
    }

    #[test]
    fn a_byte_is_a_start_bit_eight_bits_from_the_lowest_and_a_stop_bit() {
        // 0x41 = 0100_0001: low, high, five times low, high, low, high. A bit takes 1,000 cycles.
        let found = edges(CLOCK, 16_000, &[(5_000, "A")]);
        let wanted =
            [(0, true), (5_000, false), (6_000, true), (7_000, false), (12_000, true), (13_000, false), (14_000, true)];
        assert_eq!(found, wanted.map(|(cycle, level)| (cycle, 0, level)));
    }

    #[test]
    fn bytes_follow_each_other_and_so_do_texts_that_come_too_early() {
        // 0xFF would be one low bit; these are seven 1 bits, so that each frame has its start bit and its bit
        // 7 low.
        let starts = |texts: &[(u64, &str)]| -> Vec<u64> {
            edges(CLOCK, 16_000, texts).iter().filter(|edge| !edge.2).step_by(2).map(|edge| edge.0).collect()
        };
        assert_eq!(starts(&[(0, "\x7f\x7f")]), [0, 10_000]);
        assert_eq!(starts(&[(12_000, "\x7f"), (0, "\x7f\x7f")]), [0, 10_000, 20_000]);
        assert_eq!(starts(&[(12_000, "\x7f"), (0, "\x7f")]), [0, 12_000]);
    }

    #[test]
    fn edges_are_rounded_one_by_one() {
        // A bit at 38400 baud takes 416 2/3 cycles. 0x55 has an edge at every bit, ten bits per frame.
        let found: Vec<u64> = edges(CLOCK, 38_400, &[(100, "UU")]).iter().skip(1).map(|edge| edge.0).collect();
        let wanted: Vec<u64> = (0..20).map(|bit| 100 + bit * 1250 / 3).collect();
        assert_eq!(found, wanted);
        // In clocks within cycles of four: a bit takes 1,000 1/8 clocks, from cycle 1 on; bit 8 begins in
        // clock 4 + 8,001.
        let clock = CycleClock { hz: 4_000_500, clocks_per_cycle: 4 };
        let found = edges(clock, 4_000, &[(1, "U")]);
        assert_eq!(found.get(1..3), Some(&[(1, 0, false), (251, 0, true)][..]));
        assert_eq!(found.get(9..11), Some(&[(2_001, 1, false), (2_251, 1, true)][..]));
    }

    #[test]
    fn what_cannot_be_sent_is_refused() {
        assert!(SerialLineSender::new(0, 0).is_err() && SerialLineSender::new(0, MAX_BAUD + 1).is_err());
        let late = TimedText { at: CycleTime { cycle: MAX_CYCLES, ..CycleTime::default() }, bytes: vec![0] };
        assert!(SerialLineSender::new(0, 1).expect("a rate").edges_of_texts(CLOCK, &[late]).is_err());
    }
}
