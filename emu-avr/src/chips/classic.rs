//! Register layouts and fuses that the older AVR chips share.
//!
//! One register of an older chip often holds bits that newer chips have in several registers. Each entry
//! gives the bit in the old register, then the register and bit of the newer layout.

use super::FuseLayout;
use super::fuses::start_up_old;
use crate::chips::FuseField;

/// TCCRn of an 8-bit timer with one channel: FOC, WGM0, COM1, COM0, WGM1, CS2 to CS0. FOC is written last,
/// because its effect depends on the other bits.
macro_rules! tccr {
    ($n:literal) => {
        Split(&[
            SplitBit { bit: 6, slot: Timer($n, TCCRA), its_bit: 0 },
            SplitBit { bit: 5, slot: Timer($n, TCCRA), its_bit: 7 },
            SplitBit { bit: 4, slot: Timer($n, TCCRA), its_bit: 6 },
            SplitBit { bit: 3, slot: Timer($n, TCCRA), its_bit: 1 },
            SplitBit { bit: 7, slot: Timer($n, TCCRB), its_bit: 7 },
            SplitBit { bit: 2, slot: Timer($n, TCCRB), its_bit: 2 },
            SplitBit { bit: 1, slot: Timer($n, TCCRB), its_bit: 1 },
            SplitBit { bit: 0, slot: Timer($n, TCCRB), its_bit: 0 },
        ])
    };
}
pub(super) use tccr;

/// TCCRnA of a 16-bit timer with two channels, with FOCnA and FOCnB as bits 3 and 2.
macro_rules! tccra {
    ($n:literal) => {
        Split(&[
            SplitBit { bit: 7, slot: Timer($n, TCCRA), its_bit: 7 },
            SplitBit { bit: 6, slot: Timer($n, TCCRA), its_bit: 6 },
            SplitBit { bit: 5, slot: Timer($n, TCCRA), its_bit: 5 },
            SplitBit { bit: 4, slot: Timer($n, TCCRA), its_bit: 4 },
            SplitBit { bit: 1, slot: Timer($n, TCCRA), its_bit: 1 },
            SplitBit { bit: 0, slot: Timer($n, TCCRA), its_bit: 0 },
            SplitBit { bit: 3, slot: Timer($n, TCCRC), its_bit: 7 },
            SplitBit { bit: 2, slot: Timer($n, TCCRC), its_bit: 6 },
        ])
    };
}
pub(super) use tccra;

/// ASSR: ASn, TCNnUB, OCRnUB, TCRnUB.
macro_rules! assr {
    ($n:literal) => {
        Split(&[
            SplitBit { bit: 3, slot: Timer($n, ASSR), its_bit: 5 },
            SplitBit { bit: 2, slot: Timer($n, ASSR), its_bit: 4 },
            SplitBit { bit: 1, slot: Timer($n, ASSR), its_bit: 3 },
            SplitBit { bit: 0, slot: Timer($n, ASSR), its_bit: 1 },
        ])
    };
}
pub(super) use assr;

/// TIMSK or TIFR of ATmega16, 32, 64 and 128.
macro_rules! timers {
    ($reg:ident) => {
        Split(&[
            SplitBit { bit: 7, slot: Timer(2, $reg), its_bit: 1 },
            SplitBit { bit: 6, slot: Timer(2, $reg), its_bit: 0 },
            SplitBit { bit: 5, slot: Timer(1, $reg), its_bit: 5 },
            SplitBit { bit: 4, slot: Timer(1, $reg), its_bit: 1 },
            SplitBit { bit: 3, slot: Timer(1, $reg), its_bit: 2 },
            SplitBit { bit: 2, slot: Timer(1, $reg), its_bit: 0 },
            SplitBit { bit: 1, slot: Timer(0, $reg), its_bit: 1 },
            SplitBit { bit: 0, slot: Timer(0, $reg), its_bit: 0 },
        ])
    };
}
pub(super) use timers;

/// GICR or GIFR without their other bits.
macro_rules! general {
    ($reg:ident $(, $more:expr)*) => {
        Split(&[SplitBit { bit: 7, slot: External($reg), its_bit: 1 }, SplitBit { bit: 6, slot: External($reg), its_bit: 0 } $(, $more)*])
    };
}
pub(super) use general;

/// MCUCSR: the reset flags, and the further bits that some chips have in it.
macro_rules! mcucsr {
    ($($more:expr),*) => {
        Split(&[SplitBit { bit: 3, slot: Own(MCUSR), its_bit: 3 }, SplitBit { bit: 2, slot: Own(MCUSR), its_bit: 2 }, SplitBit { bit: 1, slot: Own(MCUSR), its_bit: 1 }, SplitBit { bit: 0, slot: Own(MCUSR), its_bit: 0 } $(, $more)*])
    };
}
pub(super) use mcucsr;

/// Fuses of ATmega8, 16 and 32: BODEN is bit 6 and BODLEVEL bit 7 of the low byte.
pub(super) const FUSES: FuseLayout = FuseLayout {
    default_bytes: [0xE0, 0xD9, 0xFF],
    ckdiv8: None,
    cksel: FuseField { byte: 0, bit: 0, bits: 4 },
    sut: FuseField { byte: 0, bit: 4, bits: 2 },
    start_up: start_up_old,
    reset_clocks: 0,
    wdton: None,
    eesave: FuseField { byte: 1, bit: 3, bits: 1 },
    bootsz: Some(FuseField { byte: 1, bit: 1, bits: 2 }),
    bootrst: Some(FuseField { byte: 1, bit: 0, bits: 1 }),
    rstdisbl: None,
    bodlevel: FuseField { byte: 0, bit: 6, bits: 2 },
    bod_mv: &[4_000, 0, 2_700, 0],
};

/// Names of the fuses in the low byte, from bit 7 to bit 0.
pub(super) const LOW_FUSES: &str =
    "FUSE_BODLEVEL FUSE_BODEN FUSE_SUT1 FUSE_SUT0 FUSE_CKSEL3 FUSE_CKSEL2 FUSE_CKSEL1 FUSE_CKSEL0";
/// Names of the fuses in the high byte of ATmega16, 32, 64 and 128, from bit 7 to bit 0.
pub(super) const HIGH_FUSES: &str =
    "FUSE_OCDEN FUSE_JTAGEN FUSE_SPIEN FUSE_CKOPT FUSE_EESAVE FUSE_BOOTSZ1 FUSE_BOOTSZ0 FUSE_BOOTRST";
