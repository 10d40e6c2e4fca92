//! Fuses: where they stand, and what they mean.

/// A fuse: byte (low 0, high 1, extended 2), lowest bit, number of bits. 0 is programmed.
pub type FuseField = (u8, u8, u8);

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

/// Where the fuses stand, and what they mean.
#[derive(Debug, Clone, Copy)]
pub struct FuseLayout {
    /// What the model assumes where none are given: as delivered, but for a clock from outside that is not divided.
    pub default_bytes: [u8; 3],
    /// Divide the clock by 8 after reset, where there is the fuse.
    pub ckdiv8: Option<FuseField>,
    /// Clock source.
    pub cksel: FuseField,
    /// Start-up time.
    pub sut: FuseField,
    /// What these two mean.
    pub start_up: StartUpTimes,
    /// Clocks that every reset takes besides.
    pub reset_clocks: u64,
    /// The watchdog is always on, where there is the fuse.
    pub wdton: Option<FuseField>,
    /// The EEPROM outlives a chip erase.
    pub eesave: FuseField,
    /// Size of the boot section, where there is one.
    pub bootsz: Option<FuseField>,
    /// Reset goes to the boot section.
    pub bootrst: Option<FuseField>,
    /// The reset pin is a port pin.
    pub rstdisbl: Option<FuseField>,
    /// Brown-out detector, by [`Fuses::bod_mv`]; with BODEN as its lowest bit where that is a fuse of its own.
    pub bodlevel: FuseField,
    /// Level of the detector by the value of BODLEVEL in millivolts (typical); 0 is off.
    pub bod_mv: &'static [u32],
}

impl FuseLayout {
    /// The value of a fuse in these bytes: 0 is programmed.
    #[must_use]
    pub const fn value(bytes: [u8; 3], fuse: FuseField) -> u8 {
        let (byte, bit, bits) = fuse;
        bytes[byte as usize % 3] >> bit & ((1 << bits) - 1)
    }

    /// A single fuse is programmed; false where there is none.
    #[must_use]
    pub fn is_programmed(bytes: [u8; 3], fuse: Option<FuseField>) -> bool {
        fuse.is_some_and(|fuse| FuseLayout::value(bytes, fuse) == 0)
    }
}

/// The two delays, in microseconds.
const SHORT_DELAY_US: u64 = 4_100;
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

/// The delay by SUT alone; reserved settings count as the longest.
const fn delay(sut: u8) -> u64 {
    match sut {
        0 => 0,
        1 => SHORT_DELAY_US,
        _ => LONG_DELAY_US,
    }
}

/// ATmega48 to 328 (DS40002061, tables 9-3 to 9-13): 0 and 2 oscillators that start at once, 4 and 5 a watch crystal, then
/// crystals.
#[must_use]
pub(super) const fn start_up(cksel: u8, sut: u8) -> StartUpTime {
    match cksel {
        6.. => crystal(cksel, sut),
        4 => StartUpTime::new(1_024, delay(sut)),
        5 => StartUpTime::new(32_768, delay(sut)),
        _ => StartUpTime::new(6, delay(sut)),
    }
}

/// ATmega162 (Atmel 2513, clock sources): as ATmega328, with a watch crystal at 4 to 7.
#[must_use]
pub(super) const fn start_up_162(cksel: u8, sut: u8) -> StartUpTime {
    start_up(if cksel & 0x0C == 4 { cksel & 5 } else { cksel }, sut)
}

/// ATmega8, 16, 32, 64 and 128 (Atmel 2486, 2466, 2503, 2490, 2467, clock sources): 0 a clock from outside, 1 to 4 the internal
/// oscillator, 5 to 8 one of resistor and capacitor, 9 a watch crystal, then crystals.
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
