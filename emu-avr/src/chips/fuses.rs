//! Fuses: the position of each fuse in the fuse bytes, and its meaning.

/// Position of a fuse in the fuse bytes. A bit of 0 is programmed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FuseField {
    /// The fuse byte: 0 low, 1 high, 2 extended.
    pub byte: u8,
    /// The lowest bit in it.
    pub bit: u8,
    /// The number of bits.
    pub bits: u8,
}

/// How long a chip waits before its first instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StartUpTime {
    /// Clocks until the oscillator counts as stable.
    pub clocks: u64,
    /// Microseconds more, after a reset.
    pub delay_us: u64,
}

impl StartUpTime {
    const fn new(clocks: u64, delay_us: u64) -> StartUpTime {
        StartUpTime { clocks, delay_us }
    }
}

/// The time by CKSEL and SUT.
pub type StartUpTimes = fn(u8, u8) -> StartUpTime;

/// A fuse byte and a value for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FuseByte {
    /// Which: 0 low, 1 high, 2 extended.
    pub index: u8,
    /// Its value.
    pub value: u8,
}

/// Positions and meanings of a chip's fuses.
#[derive(Debug, Clone, Copy)]
pub struct FuseLayout {
    /// Fuse bytes that the model assumes if the image has none: the factory values, but with an external
    /// clock that is not divided.
    pub default_bytes: [u8; 3],
    /// CKDIV8: the clock is divided by 8 after reset. None on chips without this fuse.
    pub ckdiv8: Option<FuseField>,
    /// CKSEL: the clock source.
    pub cksel: FuseField,
    /// SUT: the start-up time.
    pub sut: FuseField,
    /// The times that CKSEL and SUT select.
    pub start_up: StartUpTimes,
    /// Clocks that every reset takes in addition.
    pub reset_clocks: u64,
    /// WDTON: the watchdog is always on. None on chips without this fuse.
    pub wdton: Option<FuseField>,
    /// EESAVE: a chip erase preserves the EEPROM.
    pub eesave: FuseField,
    /// BOOTSZ: the size of the boot section. None on chips without a boot section.
    pub bootsz: Option<FuseField>,
    /// BOOTRST: reset starts at the boot section.
    pub bootrst: Option<FuseField>,
    /// RSTDISBL: the reset pin is a port pin.
    pub rstdisbl: Option<FuseField>,
    /// BODLEVEL: index into [`FuseLayout::bod_mv`]. Where BODEN is a separate fuse, it is the lowest bit of
    /// this field.
    pub bodlevel: FuseField,
    /// Typical threshold of the brown-out detector in millivolts, by the value of BODLEVEL; 0 is off.
    pub bod_mv: &'static [u32],
}

impl FuseLayout {
    /// Returns the value of a fuse in the fuse bytes `bytes`. A bit of 0 is programmed.
    #[must_use]
    pub const fn value(bytes: [u8; 3], fuse: FuseField) -> u8 {
        let FuseField { byte, bit, bits } = fuse;
        bytes[byte as usize % 3] >> bit & ((1 << bits) - 1)
    }

    /// Reports whether a fuse of one bit is programmed; false if the chip does not have it.
    #[must_use]
    pub fn is_programmed(bytes: [u8; 3], fuse: Option<FuseField>) -> bool {
        fuse.is_some_and(|fuse| FuseLayout::value(bytes, fuse) == 0)
    }
}

/// The shorter delay after a reset, in microseconds.
const SHORT_DELAY_US: u64 = 4_100;
/// The longer delay after a reset, in microseconds.
const LONG_DELAY_US: u64 = 65_000;

/// Crystals and resonators: by the lowest bit of CKSEL and SUT.
const fn crystal(cksel: u8, sut: u8) -> StartUpTime {
    match (cksel & 1, sut) {
        (0, 0) => StartUpTime::new(258, SHORT_DELAY_US),
        (0, 1) => StartUpTime::new(258, LONG_DELAY_US),
        (0, 2) => StartUpTime::new(1_024, 0),
        (0, _) => StartUpTime::new(1_024, SHORT_DELAY_US),
        (_, 0) => StartUpTime::new(1_024, LONG_DELAY_US),
        (_, 1) => StartUpTime::new(16_384, 0),
        (_, 2) => StartUpTime::new(16_384, SHORT_DELAY_US),
        (..) => StartUpTime::new(16_384, LONG_DELAY_US),
    }
}

/// Delay in microseconds by SUT alone. Reserved settings give the longest delay.
const fn delay(sut: u8) -> u64 {
    match sut {
        0 => 0,
        1 => SHORT_DELAY_US,
        _ => LONG_DELAY_US,
    }
}

/// Start-up times of ATmega48 to 328 (DS40002061, tables 9-3 to 9-13), by CKSEL: 0 and 2 are oscillators that
/// start at once, 4 and 5 a watch crystal, 6 and above crystals.
#[must_use]
pub(super) const fn start_up(cksel: u8, sut: u8) -> StartUpTime {
    match cksel {
        6.. => crystal(cksel, sut),
        4 => StartUpTime::new(1_024, delay(sut)),
        5 => StartUpTime::new(32_768, delay(sut)),
        _ => StartUpTime::new(6, delay(sut)),
    }
}

/// Start-up times of the ATmega162 (Atmel 2513, clock sources): as on the ATmega328, with a watch crystal at
/// CKSEL 4 to 7.
#[must_use]
pub(super) const fn start_up_162(cksel: u8, sut: u8) -> StartUpTime {
    start_up(if cksel & 0x0C == 4 { cksel & 5 } else { cksel }, sut)
}

/// Start-up times of ATmega8, 16, 32, 64 and 128 (Atmel 2486, 2466, 2503, 2490, 2467, clock sources), by
/// CKSEL: 0 is an external clock, 1 to 4 the internal oscillator, 5 to 8 an RC oscillator, 9 a watch crystal,
/// 10 and above crystals.
#[must_use]
pub(super) const fn start_up_old(cksel: u8, sut: u8) -> StartUpTime {
    match (cksel, sut) {
        (0..=4, _) => StartUpTime::new(6, delay(sut)),
        (5..=8, 3) => StartUpTime::new(6, SHORT_DELAY_US),
        (5..=8, _) => StartUpTime::new(18, delay(sut)),
        (9, 0) => StartUpTime::new(1_024, SHORT_DELAY_US),
        (9, 1) => StartUpTime::new(1_024, LONG_DELAY_US),
        (9, _) => StartUpTime::new(32_768, LONG_DELAY_US),
        _ => crystal(cksel, sut),
    }
}
