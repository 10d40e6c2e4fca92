//! Waveform generation modes and compare output modes (tables 15-2 to 15-8, 16-1 to 16-4, 18-2 to 18-8).

/// How the counter goes, which says when the rest happens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Slope {
    /// Up to MAX; also where the mode is reserved.
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

/// Where TOP comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Top {
    /// A constant.
    Fixed(u16),
    /// OCRnA.
    OcrA,
    /// ICRn.
    Icr,
}

/// A mode of waveform generation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Mode {
    pub slope: Slope,
    pub top: Top,
}

impl Mode {
    /// The mode `wgm`: WGM02:0 of an 8-bit timer, WGM13:0 of a 16-bit one.
    pub(super) const fn of(wide: bool, wgm: u8) -> Mode {
        use Slope::{Ctc, Fast, Frequency, Normal, Phase};
        use Top::{Fixed, Icr, OcrA};
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
        Mode { slope, top }
    }

    /// The bits of the high byte of OCR that there are: a fixed TOP masks what is written (16.9.3, 16.9.4).
    pub(super) const fn high_bits(self) -> u8 {
        match self.top {
            Top::Fixed(top) => (top >> 8) as u8,
            Top::OcrA | Top::Icr => 0xFF,
        }
    }

    /// OCR is double buffered: the PWM modes.
    pub(super) const fn buffered(self) -> bool {
        matches!(self.slope, Slope::Fast | Slope::Phase | Slope::Frequency)
    }

    /// It counts up and down.
    pub(super) const fn dual(self) -> bool {
        matches!(self.slope, Slope::Phase | Slope::Frequency)
    }

    /// What the bits COMnx1:0 make of the pin of `channel`.
    pub(super) const fn action(self, channel: usize, com: u8) -> Action {
        match (com & 3, self.buffered()) {
            (0, _) => Action::None,
            (1, false) => Action::Toggle,
            (1, true) => match (channel, self.top, self.slope) {
                (0, Top::OcrA, _) | (0, Top::Icr, Slope::Fast) => Action::Toggle,
                _ => Action::None,
            },
            (com, false) => Action::Level(com == 3),
            (com, true) => Action::Wave(com == 3),
        }
    }
}

/// What a compare match does to the output of its channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Action {
    /// Nothing; the pin is the port's.
    None,
    /// Toggles it.
    Toggle,
    /// Gives it this level.
    Level(bool),
    /// PWM: this level at a match upwards; the other one at a match downwards (two slopes) or from TOP to BOTTOM (one slope).
    Wave(bool),
}
