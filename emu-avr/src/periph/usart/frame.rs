//! Frame formats (section 20.4): encoding a character into bits, and decoding it.

use super::{FE, UPE};

/// The format of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct FrameFormat {
    /// Number of data bits, 5 to 9.
    pub(super) size: u8,
    /// Parity bit, if there is one: true for odd parity.
    pub(super) parity: Option<bool>,
    /// True if two stop bits are sent.
    pub(super) two_stops: bool,
}

emu_core::state! { FrameFormat { size, parity, two_stops } if |of, _now| (5..=9).contains(&of.size) }

/// The bits of a frame on the line.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrameBits {
    /// The bits, the first one lowest.
    pub(super) bits: u16,
    /// The number of bits.
    pub(super) count: u8,
}

impl FrameFormat {
    /// Returns the format that UCSRB and UCSRC select. Reserved sizes act as if UCSZ2 were 0, the reserved
    /// parity as no parity.
    pub(super) fn new(ucsrb: u8, ucsrc: u8) -> FrameFormat {
        let nine = ucsrb & 4 != 0 && ucsrc & 6 == 6;
        FrameFormat {
            size: if nine { 9 } else { 5 + (ucsrc >> 1 & 3) },
            parity: (ucsrc & 0x20 != 0).then_some(ucsrc & 0x10 != 0),
            two_stops: ucsrc & 8 != 0,
        }
    }

    /// Returns the data bits of `word`.
    pub(super) fn data(self, word: u16) -> u16 {
        word & ((1 << self.size) - 1)
    }

    fn parity_of(self, word: u16, odd: bool) -> bool {
        (self.data(word).count_ones() % 2 == 1) != odd
    }

    /// Returns the bits of a frame, the first one lowest, and their number.
    pub(super) fn frame(self, word: u16) -> FrameBits {
        let mut bits = self.data(word) << 1;
        let mut n = self.size + 1;
        if let Some(odd) = self.parity {
            bits |= u16::from(self.parity_of(word, odd)) << n;
            n += 1;
        }
        let stops = 1 + u8::from(self.two_stops);
        FrameBits { bits: bits | ((1 << stops) - 1) << n, count: n + stops }
    }

    /// Returns the index of the stop bit; 0 is the start bit.
    pub(super) fn stop_bits(self) -> u8 {
        self.size + 1 + u8::from(self.parity.is_some())
    }
}

/// A received character.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct ReceivedCharacter {
    /// The lower eight bits of the character.
    pub(super) byte: u8,
    /// RXB8.
    pub(super) ninth: bool,
    /// FE, DOR and UPE, in the bits of UCSRA.
    pub(super) errors: u8,
    /// True if the frame is an address frame in multi-processor mode.
    pub(super) address: bool,
}

emu_core::state! { ReceivedCharacter { byte, ninth, errors, address } }

impl ReceivedCharacter {
    /// A character 0 without errors.
    pub(super) const NONE: ReceivedCharacter = ReceivedCharacter { byte: 0, ninth: false, errors: 0, address: false };
}

/// A frame that is being received.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct FrameReader {
    /// Format when the frame began.
    format: FrameFormat,
    /// Index of the current bit; 0 is the start bit.
    pub(super) bit: u8,
    /// Data bits, then the parity bit.
    bits: u16,
}

emu_core::state! { FrameReader { format, bit, bits } if |frame, _now| frame.bit <= frame.format.stop_bits() }

/// Result of a bit for the frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FrameProgress {
    /// More bits follow.
    More,
    /// The start bit is valid.
    Start,
    /// The start bit was noise.
    Noise,
    /// The frame is complete.
    Done(ReceivedCharacter),
}

impl FrameReader {
    /// Returns a reader that waits for the start bit.
    pub(super) const fn new(format: FrameFormat) -> FrameReader {
        FrameReader { format, bit: 0, bits: 0 }
    }

    /// Returns the number of bits after this one, up to the stop bit.
    pub(super) fn bits_left(&self) -> u8 {
        self.format.stop_bits().saturating_sub(self.bit)
    }

    /// Processes the next bit.
    pub(super) fn take_bit(&mut self, high: bool) -> FrameProgress {
        if self.bits_left() == 0 {
            return FrameProgress::Done(self.received(high));
        }
        match self.bit {
            0 if high => return FrameProgress::Noise,
            0 => {}
            n => self.bits |= u16::from(high) << (n - 1),
        }
        self.bit += 1;
        if self.bit == 1 { FrameProgress::Start } else { FrameProgress::More }
    }

    fn received(&self, stop: bool) -> ReceivedCharacter {
        let format = self.format;
        let ninth = format.size == 9 && self.bits & 0x100 != 0;
        let wrong = |odd| format.parity_of(self.bits, odd) != (self.bits >> format.size & 1 != 0);
        let parity_error = if format.parity.is_some_and(wrong) { UPE } else { 0 };
        ReceivedCharacter {
            byte: format.data(self.bits) as u8,
            ninth,
            errors: if stop { 0 } else { FE } | parity_error,
            address: if format.size == 9 { ninth } else { stop },
        }
    }
}
