//! Pins, ports and the lines on the pins (data sheets, "Pin diagrams" and "Pinout description").

use emu_core::chip::PinDef;
use emu_core::pins::PinId;

use super::{NO_PIN, PeripheralPin, PortPins};
use crate::periph::map::{Pic16Line, Sfr};

/// Names of the pins of a package, numbered in order.
macro_rules! package {
    ($(#[$doc:meta])* $module:ident: $($pin:ident)*) => {
        $(#[$doc])*
        // Some pins are not used by any row.
        #[allow(missing_docs, dead_code)]
        pub(super) mod $module {
            use emu_core::pins::PinId;
            #[allow(clippy::upper_case_acronyms)]
            enum Id { $($pin),* }
            $( pub(crate) const $pin: PinId = Id::$pin as PinId; )*
        }
    };
}

package! {
    /// 18 pins, with dedicated pins for oscillator and MCLR.
    dip18: RA0 RA1 RA2 RA3 RA4 RB0 RB1 RB2 RB3 RB4 RB5 RB6 RB7 MCLR
}
package! {
    /// 18 pins, with oscillator and MCLR shared with port A.
    shared18: RA0 RA1 RA2 RA3 RA4 RA5 RA6 RA7 RB0 RB1 RB2 RB3 RB4 RB5 RB6 RB7
}
package! {
    /// 28 pins, with a dedicated pin for MCLR.
    dip28: RA0 RA1 RA2 RA3 RA4 RA5 RB0 RB1 RB2 RB3 RB4 RB5 RB6 RB7 RC0 RC1 RC2 RC3 RC4 RC5 RC6 RC7 MCLR
}
package! {
    /// 40 pins, with a dedicated pin for MCLR.
    dip40: RA0 RA1 RA2 RA3 RA4 RA5 RB0 RB1 RB2 RB3 RB4 RB5 RB6 RB7 RC0 RC1 RC2 RC3 RC4 RC5 RC6 RC7
           RD0 RD1 RD2 RD3 RD4 RD5 RD6 RD7 RE0 RE1 RE2 MCLR
}

/// Pins in the order of the package: name, number in the package, other functions.
macro_rules! pins {
    ($($name:ident $dip:literal $note:expr),* $(,)?) => {
        &[ $( emu_core::chip::PinDef { name: stringify!($name), dip: $dip, note: $note } ),* ]
    };
}

/// Pins of 18-pin chips with a dedicated MCLR; `a` gives the other functions of port A.
pub(super) const fn pins18(a: [&'static str; 5]) -> [PinDef; 14] {
    *pins! {
        RA0 17 a[0], RA1 18 a[1], RA2 1 a[2], RA3 2 a[3], RA4 3 a[4],
        RB0 6 "INT", RB1 7 "", RB2 8 "", RB3 9 "", RB4 10 "", RB5 11 "", RB6 12 "", RB7 13 "", MCLR 4 "reset"
    }
}

/// Pins of 18-pin chips with a shared MCLR; `a` and `b` give the other functions of ports A and B.
pub(super) const fn pins18_shared(a: [&'static str; 5], b: [&'static str; 8]) -> [PinDef; 16] {
    *pins! {
        RA0 17 a[0], RA1 18 a[1], RA2 1 a[2], RA3 2 a[3], RA4 3 a[4], RA5 4 "input only, MCLR", RA6 15 "OSC2, CLKOUT",
        RA7 16 "OSC1, CLKIN",
        RB0 6 b[0], RB1 7 b[1], RB2 8 b[2], RB3 9 b[3], RB4 10 b[4], RB5 11 b[5], RB6 12 b[6], RB7 13 b[7]
    }
}

/// Pins of 28-pin chips; `a` and `c` give the other functions of ports A and C.
pub(super) const fn pins28(a: [&'static str; 6], c: [&'static str; 8]) -> [PinDef; 23] {
    *pins! {
        RA0 2 a[0], RA1 3 a[1], RA2 4 a[2], RA3 5 a[3], RA4 6 a[4], RA5 7 a[5],
        RB0 21 "INT", RB1 22 "", RB2 23 "", RB3 24 "PGM", RB4 25 "", RB5 26 "", RB6 27 "PGC", RB7 28 "PGD",
        RC0 11 c[0], RC1 12 c[1], RC2 13 c[2], RC3 14 c[3], RC4 15 c[4], RC5 16 c[5], RC6 17 c[6], RC7 18 c[7],
        MCLR 1 "reset"
    }
}

/// Pins of 40-pin chips; `a` and `c` give the other functions of ports A and C.
pub(super) const fn pins40(a: [&'static str; 6], c: [&'static str; 8]) -> [PinDef; 34] {
    *pins! {
        RA0 2 a[0], RA1 3 a[1], RA2 4 a[2], RA3 5 a[3], RA4 6 a[4], RA5 7 a[5],
        RB0 33 "INT", RB1 34 "", RB2 35 "", RB3 36 "PGM", RB4 37 "", RB5 38 "", RB6 39 "PGC", RB7 40 "PGD",
        RC0 15 c[0], RC1 16 c[1], RC2 17 c[2], RC3 18 c[3], RC4 23 c[4], RC5 24 c[5], RC6 25 c[6], RC7 26 c[7],
        RD0 19 "PSP0", RD1 20 "PSP1", RD2 21 "PSP2", RD3 22 "PSP3", RD4 27 "PSP4", RD5 28 "PSP5", RD6 29 "PSP6",
        RD7 30 "PSP7",
        RE0 8 "AN5, RD", RE1 9 "AN6, WR", RE2 10 "AN7, CS", MCLR 1 "reset"
    }
}

/// Returns a port whose lowest `bits` bits are consecutive pins from `first` on.
const fn port(port: Sfr, tris: Sfr, first: PinId, bits: u8, inputs: u8, open: u8) -> PortPins {
    let mut pins = [NO_PIN; 8];
    let mut i = 0;
    while i < bits {
        pins[i as usize] = first + i as PinId;
        i += 1;
    }
    PortPins { port, tris, pins, inputs, open }
}

/// Mask of RA4, on chips where it has an open drain.
const RA4: u8 = 1 << 4;
/// Mask of RA5, on chips where it is MCLR or an input.
const RA5: u8 = 1 << 5;

/// Ports of 18-pin chips with a dedicated MCLR.
pub(super) const PORTS18: &[PortPins] = &[
    port(Sfr::PORTA, Sfr::TRISA, dip18::RA0, 5, 0, RA4),
    port(Sfr::PORTB, Sfr::TRISB, dip18::RB0, 8, 0, 0), //
];
/// Ports of the 16F62x: RA4 has an open drain.
pub(super) const PORTS_62X: &[PortPins] =
    &[port(Sfr::PORTA, Sfr::TRISA, shared18::RA0, 8, RA5, RA4), port(Sfr::PORTB, Sfr::TRISB, shared18::RB0, 8, 0, 0)];
/// Ports of 16F818, 819, 87 and 88: RA4 has no open drain.
pub(super) const PORTS_88: &[PortPins] =
    &[port(Sfr::PORTA, Sfr::TRISA, shared18::RA0, 8, RA5, 0), port(Sfr::PORTB, Sfr::TRISB, shared18::RB0, 8, 0, 0)];
/// Ports of 28-pin chips.
pub(super) const PORTS28: &[PortPins] = &[
    port(Sfr::PORTA, Sfr::TRISA, dip28::RA0, 6, 0, RA4),
    port(Sfr::PORTB, Sfr::TRISB, dip28::RB0, 8, 0, 0),
    port(Sfr::PORTC, Sfr::TRISC, dip28::RC0, 8, 0, 0),
];
/// Ports of 40-pin chips.
pub(super) const PORTS40: &[PortPins] = &[
    port(Sfr::PORTA, Sfr::TRISA, dip40::RA0, 6, 0, RA4),
    port(Sfr::PORTB, Sfr::TRISB, dip40::RB0, 8, 0, 0),
    port(Sfr::PORTC, Sfr::TRISC, dip40::RC0, 8, 0, 0),
    port(Sfr::PORTD, Sfr::TRISD, dip40::RD0, 8, 0, 0),
    port(Sfr::PORTE, Sfr::TRISE, dip40::RE0, 3, 0, 0),
];

/// Rows of lines and pins. `over` marks lines whose output is independent of TRIS.
macro_rules! lines {
    (@over) => { false };
    (@over over) => { true };
    ($package:ident: $($line:ident $pin:ident $($over:ident)?),* $(,)?) => { &[ $( PeripheralPin {
        line: Pic16Line::$line, pin: $package::$pin, over_tris: lines!(@over $($over)?),
    } ),* ] };
}

/// Lines of 18-pin chips with a dedicated MCLR.
pub(super) const L18: &[PeripheralPin] = lines! { dip18: T0cki RA4, Int RB0 };
/// Lines of the 16F62x.
pub(super) const L_62X: &[PeripheralPin] = lines! {
    shared18: T0cki RA4, Int RB0, T1cki RB6, Ccp1 RB3, Rx RB1 over, Tx RB2 over, C1out RA3, C2out RA4
};
/// Lines of 16F818 and 819; CCPMX moves CCP1.
pub(super) const L_819: &[PeripheralPin] = lines! {
    shared18: T0cki RA4, Int RB0, T1cki RB6, Ccp1 RB2, Sck RB4, Sdi RB1, Sdo RB2, Ss RB5
};
/// Lines of 16F87 and 88; CCPMX moves CCP1.
pub(super) const L_88: &[PeripheralPin] = lines! {
    shared18: T0cki RA4, Int RB0, T1cki RB6, Ccp1 RB0, Sck RB4, Sdi RB1, Sdo RB2, Ss RB5, Rx RB2 over, Tx RB5 over,
    C1out RA3, C2out RA4
};
/// Lines of timers and CCP1 on 28-pin chips.
pub(super) const L28: &[PeripheralPin] = lines! { dip28: T0cki RA4, Int RB0, T1cki RC0, Ccp1 RC2 };
/// Line of CCP2.
pub(super) const L28_CCP2: &[PeripheralPin] = lines! { dip28: Ccp2 RC1 };
/// Lines of the SSP.
pub(super) const L28_SSP: &[PeripheralPin] = lines! { dip28: Sck RC3, Sdi RC4, Sdo RC5, Ss RA5 };
/// Lines of the USART.
pub(super) const L28_USART: &[PeripheralPin] = lines! { dip28: Tx RC6 over, Rx RC7 over };
/// Lines of the comparators.
pub(super) const L28_COMPARATORS: &[PeripheralPin] = lines! { dip28: C1out RA4, C2out RA5 };
/// Lines of the parallel slave port. The other pins have the same identities as on 28-pin chips.
pub(super) const L40: &[PeripheralPin] = lines! { dip40: Rd RE0, Wr RE1, Cs RE2 };
