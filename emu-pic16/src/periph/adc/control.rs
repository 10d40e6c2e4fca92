//! Control registers of each variant of the converter.

use crate::chips::Pic16AdcKind;

/// Digital pins by PCFG3:PCFG0, AN7 in bit 7 (DS30292 register 11-2). Chips with fewer channels use the low
/// bits of each row.
#[rustfmt::skip]
const PCFG_DIGITAL: [u8; 16] = [
    0b0000_0000, 0b0000_0000, 0b1110_0000, 0b1110_0000, 0b1111_0100, 0b1111_0100, 0b1111_1111, 0b1111_1111,
    0b0000_0000, 0b1100_0000, 0b1100_0000, 0b1100_0000, 0b1110_0000, 0b1111_0000, 0b1111_1110, 0b1111_0010,
];
/// Values of PCFG3:PCFG0 with VREF+ on AN3, as a mask of bits 0 to 15.
const PCFG_VREF_PLUS: u16 = 0b1011_1101_0010_1010;
/// Values of PCFG3:PCFG0 with VREF- on AN2, as a mask of bits 0 to 15.
const PCFG_VREF_MINUS: u16 = 0b1011_1001_0000_0000;
/// Digital pins of the 16C71 by PCFG1:PCFG0; the value 01 has VREF on AN3 (DS30272, ADCON1).
const PCFG8_DIGITAL: [u8; 4] = [0b0000, 0b0000, 0b1100, 0b1111];

/// Returns the writable bits of ADCON0. On the 16C71 bit 1 is ADIF, and CHS has two bits.
pub(super) fn adcon0_mask(kind: Pic16AdcKind) -> u8 {
    match kind {
        Pic16AdcKind::None => 0,
        Pic16AdcKind::Bits8 => 0b1101_1111,
        _ => 0b1111_1101,
    }
}

/// Returns the existing bits of ADCON1.
pub(super) fn adcon1_mask(kind: Pic16AdcKind) -> u8 {
    match kind {
        Pic16AdcKind::None => 0,
        Pic16AdcKind::Bits8 => 0b0000_0011,
        Pic16AdcKind::Bits10 => 0b1000_1111,
        Pic16AdcKind::Bits10Adcs2 => 0b1100_1111,
        Pic16AdcKind::Ansel => 0b1111_0000,
    }
}

/// Returns the existing bits of ANSEL, which a reset sets.
pub(super) fn ansel_mask(kind: Pic16AdcKind) -> u8 {
    if kind == Pic16AdcKind::Ansel { 0x7F } else { 0 }
}

/// Returns the channel that CHS selects in a value of ADCON0.
pub(super) fn chs(kind: Pic16AdcKind, adcon0: u8) -> usize {
    usize::from(adcon0 >> 3 & if kind == Pic16AdcKind::Bits8 { 3 } else { 7 })
}

/// Returns a mask of the digital inputs among eight channels.
pub(super) fn digital(kind: Pic16AdcKind, adcon1: u8, ansel: u8) -> u8 {
    match kind {
        Pic16AdcKind::None => 0xFF,
        Pic16AdcKind::Bits8 => PCFG8_DIGITAL[usize::from(adcon1 & 3)],
        Pic16AdcKind::Bits10 | Pic16AdcKind::Bits10Adcs2 => PCFG_DIGITAL[usize::from(adcon1 & 15)],
        Pic16AdcKind::Ansel => !ansel,
    }
}

/// The sources of the reference voltages.
pub(super) struct AdcReferences {
    /// True if VREF+ is AN3, false if it is VDD.
    pub plus_is_an3: bool,
    /// True if VREF- is AN2, false if it is VSS.
    pub minus_is_an2: bool,
}

/// Returns the sources of the reference voltages. The 16F88 has a bit for each: VCFG1 and VCFG0 (DS30487
/// section 12, ADCON1).
pub(super) fn references(kind: Pic16AdcKind, adcon1: u8) -> AdcReferences {
    let pcfg = 1u16 << (adcon1 & 15);
    let (plus_is_an3, minus_is_an2) = match kind {
        Pic16AdcKind::Bits8 => (adcon1 & 3 == 1, false),
        Pic16AdcKind::Ansel => (adcon1 & 1 << 5 != 0, adcon1 & 1 << 4 != 0),
        _ => (PCFG_VREF_PLUS & pcfg != 0, PCFG_VREF_MINUS & pcfg != 0),
    };
    AdcReferences { plus_is_an3, minus_is_an2 }
}
