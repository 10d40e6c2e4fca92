//! What sorts of timer/counters there are, and the names of their registers and interrupts.

/// TOVn in TIFRn, and TOIEn in TIMSKn.
pub const TOV: u8 = 1;
/// OCFnA and OCIEnA; the channels B and C follow.
pub const OCFA: u8 = 1 << 1;
/// OCFnB and OCIEnB.
pub const OCFB: u8 = 1 << 2;
/// OCFnC and OCIEnC.
pub const OCFC: u8 = 1 << 3;
/// ICFn and ICIEn.
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
/// Interrupt of a 16-bit timer of three channels: compare match C.
pub const COMPC16: u8 = 3;
/// Interrupt of a 16-bit timer of up to two channels: overflow.
pub const OVF16: u8 = 3;
/// Interrupt of a 16-bit timer of three channels: overflow.
pub const OVF16C: u8 = 4;

/// Registers, without the number of the timer. The two bytes of an 8-bit timer's registers are the L ones.
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

/// What a value of the clock select bits CSn2:0 clocks the timer with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ClockTap {
    /// Nothing.
    #[default]
    Off,
    /// The prescaler, divided by this.
    Div(u16),
    /// Falling edges of the pin T.
    Falling,
    /// Rising edges of the pin T.
    Rising,
}

/// The sort of a timer/counter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TimerShape {
    /// 16 bits with TEMP, modes by WGM13:0; 8 bits and WGM02:0 otherwise.
    pub wide: bool,
    /// Output compare channels, 0 to 3. One of 0 has normal mode only.
    pub channels: u8,
    /// There are an input capture unit and ICR.
    pub capture: bool,
    /// Clocks by CSn2:0.
    pub taps: [ClockTap; 8],
    /// It may run on TOSC (ASSR); such a timer has no clock from T.
    pub asynchronous: bool,
    /// ICR takes a write only in modes that have it as TOP, as the data sheet says and silicon does not.
    pub icr_only_as_top: bool,
}

impl TimerShape {
    /// Clocks of the timers that share a prescaler and have a pin T (table 15-9).
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
    /// Clocks of the timer with a prescaler of its own (table 18-9).
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

    /// An 8-bit timer with a pin T, as timer 0 of the ATmega328P (2 channels).
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

    /// A 16-bit timer with input capture and a pin T, as timer 1 of the ATmega328P (2 channels).
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

    /// An 8-bit timer that may run on a watch crystal, as timer 2 of the ATmega328P (2 channels).
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

    /// The highest count.
    #[must_use]
    pub const fn max(&self) -> u16 {
        if self.wide { 0xFFFF } else { 0xFF }
    }

    /// The flags that there are.
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

    /// The number of the interrupt of a flag within the timer.
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

    /// The flags of a set of interrupt numbers.
    #[must_use]
    pub fn flags_of(&self, irqs: u8) -> u8 {
        self.flags_in(self.flags()).filter(|&flag| irqs >> self.irq(flag) & 1 != 0).fold(0, |set, flag| set | flag)
    }

    /// The interrupt numbers of a set of flags.
    #[must_use]
    pub fn irqs_of(&self, flags: u8) -> u8 {
        self.flags_in(flags).fold(0, |set, flag| set | 1 << self.irq(flag))
    }

    /// Those of `among` that exist, one by one.
    pub(super) fn flags_in(&self, among: u8) -> impl Iterator<Item = u8> + use<> {
        let among = among & self.flags();
        [TOV, OCFA, OCFB, OCFC, ICF].into_iter().filter(move |flag| among & flag != 0)
    }

    /// Bits of TCCRA that are kept.
    pub(super) const fn tccra_bits(&self) -> u8 {
        match self.channels {
            0 => 0,
            1 => 0xC3,
            2 => 0xF3,
            _ => 0xFF,
        }
    }

    /// Bits of TCCRB that are kept.
    pub(super) const fn tccrb_bits(&self) -> u8 {
        match (self.wide, self.channels, self.capture) {
            (_, 0, _) => 0x07,
            (false, ..) => 0x0F,
            (true, _, false) => 0x1F,
            (true, _, true) => 0xDF,
        }
    }
}
