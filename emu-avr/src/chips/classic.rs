//! Register layouts and fuses that the older AVR chips share.
//!
//! One register of an older chip often holds bits that newer chips have in several registers. Each entry
//! gives the bit in the old register, then the register and bit of the newer layout.

use super::FuseLayout;
use super::fuses::start_up_old;

/// TCCRn of an 8-bit timer with one channel: FOC, WGM0, COM1, COM0, WGM1, CS2 to CS0. FOC is written last,
/// because its effect depends on the other bits.
macro_rules! tccr {
    ($n:literal) => {
        Split(&[
            (6, Timer($n, TCCRA), 0),
            (5, Timer($n, TCCRA), 7),
            (4, Timer($n, TCCRA), 6),
            (3, Timer($n, TCCRA), 1),
            (7, Timer($n, TCCRB), 7),
            (2, Timer($n, TCCRB), 2),
            (1, Timer($n, TCCRB), 1),
            (0, Timer($n, TCCRB), 0),
        ])
    };
}
pub(super) use tccr;

/// TCCRnA of a 16-bit timer with two channels, with FOCnA and FOCnB as bits 3 and 2.
macro_rules! tccra {
    ($n:literal) => {
        Split(&[
            (7, Timer($n, TCCRA), 7),
            (6, Timer($n, TCCRA), 6),
            (5, Timer($n, TCCRA), 5),
            (4, Timer($n, TCCRA), 4),
            (1, Timer($n, TCCRA), 1),
            (0, Timer($n, TCCRA), 0),
            (3, Timer($n, TCCRC), 7),
            (2, Timer($n, TCCRC), 6),
        ])
    };
}
pub(super) use tccra;

/// ASSR: ASn, TCNnUB, OCRnUB, TCRnUB.
macro_rules! assr {
    ($n:literal) => {
        Split(&[(3, Timer($n, ASSR), 5), (2, Timer($n, ASSR), 4), (1, Timer($n, ASSR), 3), (0, Timer($n, ASSR), 1)])
    };
}
pub(super) use assr;

/// TIMSK or TIFR of ATmega16, 32, 64 and 128.
macro_rules! timers {
    ($reg:ident) => {
        Split(&[
            (7, Timer(2, $reg), 1),
            (6, Timer(2, $reg), 0),
            (5, Timer(1, $reg), 5),
            (4, Timer(1, $reg), 1),
            (3, Timer(1, $reg), 2),
            (2, Timer(1, $reg), 0),
            (1, Timer(0, $reg), 1),
            (0, Timer(0, $reg), 0),
        ])
    };
}
pub(super) use timers;

/// GICR or GIFR without their other bits.
macro_rules! general {
    ($reg:ident $(, $more:expr)*) => {
        Split(&[(7, External($reg), 1), (6, External($reg), 0) $(, $more)*])
    };
}
pub(super) use general;

/// MCUCSR: the reset flags, and the further bits that some chips have in it.
macro_rules! mcucsr {
    ($($more:expr),*) => {
        Split(&[(3, Own(MCUSR), 3), (2, Own(MCUSR), 2), (1, Own(MCUSR), 1), (0, Own(MCUSR), 0) $(, $more)*])
    };
}
pub(super) use mcucsr;

/// Fuses of ATmega8, 16 and 32: BODEN is bit 6 and BODLEVEL bit 7 of the low byte.
pub(super) const FUSES: FuseLayout = FuseLayout {
    default_bytes: [0xE0, 0xD9, 0xFF],
    ckdiv8: None,
    cksel: (0, 0, 4),
    sut: (0, 4, 2),
    start_up: start_up_old,
    reset_clocks: 0,
    wdton: None,
    eesave: (1, 3, 1),
    bootsz: Some((1, 1, 2)),
    bootrst: Some((1, 0, 1)),
    rstdisbl: None,
    bodlevel: (0, 6, 2),
    bod_mv: &[4_000, 0, 2_700, 0],
};

/// Names of the fuses in the low byte, from bit 7 to bit 0.
pub(super) const LOW_FUSES: &str =
    "FUSE_BODLEVEL FUSE_BODEN FUSE_SUT1 FUSE_SUT0 FUSE_CKSEL3 FUSE_CKSEL2 FUSE_CKSEL1 FUSE_CKSEL0";
/// Names of the fuses in the high byte of ATmega16, 32, 64 and 128, from bit 7 to bit 0.
pub(super) const HIGH_FUSES: &str =
    "FUSE_OCDEN FUSE_JTAGEN FUSE_SPIEN FUSE_CKOPT FUSE_EESAVE FUSE_BOOTSZ1 FUSE_BOOTSZ0 FUSE_BOOTRST";
