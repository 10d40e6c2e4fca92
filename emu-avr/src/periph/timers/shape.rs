//! Variants of timer/counters, with their registers, flags and interrupt numbers.

/// Mask of TOVn in TIFRn, and of TOIEn in TIMSKn.
pub const TOV: u8 = 1;
/// Mask of OCFnA and OCIEnA; channels B and C follow.
pub const OCFA: u8 = 1 << 1;
/// Mask of OCFnB and OCIEnB.
pub const OCFB: u8 = 1 << 2;
/// Mask of OCFnC and OCIEnC.
pub const OCFC: u8 = 1 << 3;
/// Mask of ICFn and ICIEn.
pub const ICF: u8 = 1 << 5;

/// Interrupt of an 8-bit timer: compare match A.
pub const COMPA8: u8 = 0;
/// Interrupt of an 8-bit timer: compare match B.
pub const COMPB8: u8 = 1;
/// Interrupt of an 8-bit timer: overflow.
pub const OVF8: u8 = 2;
/// Interrupt of a 16-bit timer: input capture.
pub const CAPT16: u8 = 0;
/// Interrupt of a 16-bit timer: compare match A.
pub const COMPA16: u8 = 1;
/// Interrupt of a 16-bit timer: compare match B.
pub const COMPB16: u8 = 2;
/// Interrupt of a 16-bit timer with three channels: compare match C.
pub const COMPC16: u8 = 3;
/// Interrupt of a 16-bit timer with up to two channels: overflow.
pub const OVF16: u8 = 3;
/// Interrupt of a 16-bit timer with three channels: overflow.
pub const OVF16C: u8 = 4;

/// Registers without the number of the timer. An 8-bit timer has only the L registers of each pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum TimerRegister {
    TCCRA,
    TCCRB,
    TCCRC,
    TCNTL,
    TCNTH,
    OCRAL,
    OCRAH,
    OCRBL,
    OCRBH,
    OCRCL,
    OCRCH,
    ICRL,
    ICRH,
    TIMSK,
    TIFR,
    ASSR,
}

/// Clock source selected by a value of the clock select bits CSn2:0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ClockTap {
    /// None; the timer is stopped.
    #[default]
    Off,
    /// The prescaler, divided by this number.
    Div(u16),
    /// Falling edges of the pin T.
    Falling,
    /// Rising edges of the pin T.
    Rising,
}

/// Variant of a timer/counter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TimerShape {
    /// True for 16 bits with TEMP, and modes by WGM13:0; false for 8 bits and WGM02:0.
    pub wide: bool,
    /// Number of output compare channels, 0 to 3. A timer with 0 channels has only normal mode.
    pub channels: u8,
    /// True if the timer has an input capture unit and ICR.
    pub capture: bool,
    /// Clock sources by CSn2:0.
    pub taps: [ClockTap; 8],
    /// True if the timer can run on TOSC (ASSR); then it has no clock from the pin T.
    pub asynchronous: bool,
    /// If true, ICR accepts a write only in modes that have it as TOP, as the data sheet says; silicon does
    /// not.
    pub icr_only_as_top: bool,
}

impl TimerShape {
    /// Clock sources of the timers that share a prescaler and have a pin T (table 15-9).
    pub const PIN_TAPS: [ClockTap; 8] = [
        ClockTap::Off,
        ClockTap::Div(1),
        ClockTap::Div(8),
        ClockTap::Div(64),
        ClockTap::Div(256),
        ClockTap::Div(1024),
        ClockTap::Falling,
        ClockTap::Rising,
    ];
    /// Clock sources of the timer with its own prescaler (table 18-9).
    pub const OWN_TAPS: [ClockTap; 8] = [
        ClockTap::Off,
        ClockTap::Div(1),
        ClockTap::Div(8),
        ClockTap::Div(32),
        ClockTap::Div(64),
        ClockTap::Div(128),
        ClockTap::Div(256),
        ClockTap::Div(1024),
    ];

    /// Returns an 8-bit timer with a pin T, such as timer 0 of the ATmega328P (2 channels).
    #[must_use]
    pub const fn narrow(channels: u8) -> TimerShape {
        TimerShape {
            wide: false,
            channels,
            capture: false,
            taps: TimerShape::PIN_TAPS,
            asynchronous: false,
            icr_only_as_top: false,
        }
    }

    /// Returns a 16-bit timer with input capture and a pin T, such as timer 1 of the ATmega328P (2 channels).
    #[must_use]
    pub const fn wide(channels: u8) -> TimerShape {
        TimerShape {
            wide: true,
            channels,
            capture: true,
            taps: TimerShape::PIN_TAPS,
            asynchronous: false,
            icr_only_as_top: false,
        }
    }

    /// Returns an 8-bit timer that can run on a watch crystal, such as timer 2 of the ATmega328P (2
    /// channels).
    #[must_use]
    pub const fn crystal(channels: u8) -> TimerShape {
        TimerShape {
            wide: false,
            channels,
            capture: false,
            taps: TimerShape::OWN_TAPS,
            asynchronous: true,
            icr_only_as_top: false,
        }
    }

    /// Returns the highest count.
    #[must_use]
    pub const fn max(&self) -> u16 {
        if self.wide { 0xFFFF } else { 0xFF }
    }

    /// Returns the mask of the existing flags.
    #[must_use]
    pub const fn flags(&self) -> u8 {
        let compare = match self.channels {
            0 => 0,
            1 => OCFA,
            2 => OCFA | OCFB,
            _ => OCFA | OCFB | OCFC,
        };
        TOV | compare | if self.capture { ICF } else { 0 }
    }

    /// Returns the interrupt number of a flag in the timer.
    #[must_use]
    pub const fn irq(&self, flag: u8) -> u8 {
        match (self.wide, flag) {
            (true, ICF) => CAPT16,
            (true, OCFA) => COMPA16,
            (true, OCFB) => COMPB16,
            (true, OCFC) => COMPC16,
            (true, _) if self.channels > 2 => OVF16C,
            (true, _) => OVF16,
            (false, OCFA) => COMPA8,
            (false, OCFB) => COMPB8,
            (false, _) => OVF8,
        }
    }

    /// Returns the flags of a set of interrupt numbers.
    #[must_use]
    pub fn flags_of(&self, irqs: u8) -> u8 {
        self.flags_in(self.flags()).filter(|&flag| irqs >> self.irq(flag) & 1 != 0).fold(0, |set, flag| set | flag)
    }

    /// Returns the interrupt numbers of a set of flags.
    #[must_use]
    pub fn irqs_of(&self, flags: u8) -> u8 {
        self.flags_in(flags).fold(0, |set, flag| set | 1 << self.irq(flag))
    }

    /// Yields the existing flags of `among`, one by one.
    pub(super) fn flags_in(&self, among: u8) -> impl Iterator<Item = u8> + use<> {
        let among = among & self.flags();
        [TOV, OCFA, OCFB, OCFC, ICF].into_iter().filter(move |flag| among & flag != 0)
    }

    /// Mask of the bits of TCCRA that are stored.
    pub(super) const fn tccra_bits(&self) -> u8 {
        match self.channels {
            0 => 0,
            1 => 0xC3,
            2 => 0xF3,
            _ => 0xFF,
        }
    }

    /// Mask of the bits of TCCRB that are stored.
    pub(super) const fn tccrb_bits(&self) -> u8 {
        match (self.wide, self.channels, self.capture) {
            (_, 0, _) => 0x07,
            (false, ..) => 0x0F,
            (true, _, false) => 0x1F,
            (true, _, true) => 0xDF,
        }
    }
}
