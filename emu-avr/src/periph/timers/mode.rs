//! Waveform generation modes and compare output modes (tables 15-2 to 15-8, 16-1 to 16-4, 18-2 to 18-8).

/// The course of the counter, which also determines when OCR is updated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CountingSlope {
    /// Up to MAX; also for reserved modes.
    Normal,
    /// Up to TOP, cleared by the compare match.
    Ctc,
    /// Fast PWM: up to TOP; OCR is updated at BOTTOM.
    Fast,
    /// Phase correct PWM: up and down; OCR is updated at TOP.
    Phase,
    /// Phase and frequency correct PWM: up and down; OCR is updated at BOTTOM.
    Frequency,
}

/// Source of the TOP value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TopSource {
    /// A constant.
    Fixed(u16),
    /// OCRnA.
    OcrA,
    /// ICRn.
    Icr,
}

/// A waveform generation mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct TimerMode {
    pub slope: CountingSlope,
    pub top: TopSource,
}

impl TimerMode {
    /// Returns the mode `wgm`: WGM02:0 of an 8-bit timer, WGM13:0 of a 16-bit timer.
    pub(super) const fn from_wgm(wide: bool, wgm: u8) -> TimerMode {
        use CountingSlope::{Ctc, Fast, Frequency, Normal, Phase};
        use TopSource::{Fixed, Icr, OcrA};
        let (slope, top) = match (wide, wgm) {
            (false, 1) => (Phase, Fixed(0xFF)),
            (false, 2) | (true, 4) => (Ctc, OcrA),
            (false, 3) => (Fast, Fixed(0xFF)),
            (false, 5) | (true, 11) => (Phase, OcrA),
            (false, 7) | (true, 15) => (Fast, OcrA),
            (true, 1) => (Phase, Fixed(0xFF)),
            (true, 2) => (Phase, Fixed(0x1FF)),
            (true, 3) => (Phase, Fixed(0x3FF)),
            (true, 5) => (Fast, Fixed(0xFF)),
            (true, 6) => (Fast, Fixed(0x1FF)),
            (true, 7) => (Fast, Fixed(0x3FF)),
            (true, 8) => (Frequency, Icr),
            (true, 9) => (Frequency, OcrA),
            (true, 10) => (Phase, Icr),
            (true, 12) => (Ctc, Icr),
            (true, 14) => (Fast, Icr),
            (wide, _) => (Normal, Fixed(if wide { 0xFFFF } else { 0xFF })),
        };
        TimerMode { slope, top }
    }

    /// Mask of the bits of OCRH that can be written: a fixed TOP masks the written value (16.9.3, 16.9.4).
    pub(super) const fn high_bits(self) -> u8 {
        match self.top {
            TopSource::Fixed(top) => (top >> 8) as u8,
            TopSource::OcrA | TopSource::Icr => 0xFF,
        }
    }

    /// Reports whether OCR is double buffered, as in the PWM modes.
    pub(super) const fn is_buffered(self) -> bool {
        matches!(self.slope, CountingSlope::Fast | CountingSlope::Phase | CountingSlope::Frequency)
    }

    /// Reports whether the counter counts up and down.
    pub(super) const fn is_dual_slope(self) -> bool {
        matches!(self.slope, CountingSlope::Phase | CountingSlope::Frequency)
    }

    /// Returns the effect of the bits COMnx1:0 on the pin of `channel`.
    pub(super) const fn action(self, channel: usize, com: u8) -> MatchAction {
        match (com & 3, self.is_buffered()) {
            (0, _) => MatchAction::None,
            (1, false) => MatchAction::Toggle,
            (1, true) => match (channel, self.top, self.slope) {
                (0, TopSource::OcrA, _) | (0, TopSource::Icr, CountingSlope::Fast) => MatchAction::Toggle,
                _ => MatchAction::None,
            },
            (com, false) => MatchAction::Level(com == 3),
            (com, true) => MatchAction::Wave(com == 3),
        }
    }
}

/// Effect of a compare match on the output of its channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum MatchAction {
    /// None; the port controls the pin.
    None,
    /// Toggles the output.
    Toggle,
    /// Sets the output to this level.
    Level(bool),
    /// PWM: sets this level at a match upwards, and the opposite level at a match downwards (two slopes) or
    /// from TOP to BOTTOM (one slope).
    Wave(bool),
}
