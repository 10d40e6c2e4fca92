//! Variants of the converter in the AVR family, and its registers.

/// The registers of the converter.
#[allow(missing_docs)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AdcRegister {
    ADMUX,
    ADCSRA,
    /// Bits 2 to 0 are ADTS and bit 6 is ACME, also on chips that have them in SFIOR.
    ADCSRB,
    ADCL,
    ADCH,
    DIDR0,
}

/// Variant of the converter of a chip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AvrAdcKind {
    /// Mask of MUX in ADMUX. Values 0 to 7 select the pins ADC0 to ADC7.
    pub mux: u8,
    /// Value of MUX for the temperature sensor, if the chip has one.
    pub temperature: Option<u8>,
    /// Value of MUX for the bandgap reference.
    pub bandgap: u8,
    /// Voltage of the bandgap reference in millivolts.
    pub bandgap_mv: u32,
    /// Voltage of the internal reference that REFS = 3 selects, in millivolts.
    pub reference_mv: u32,
    /// Voltage of the internal reference that REFS = 2 selects, in millivolts; without one REFS = 2 selects
    /// AREF.
    pub low_reference_mv: Option<u32>,
    /// True if ADTS selects trigger sources; otherwise bit 5 of ADCSRA is ADFR.
    pub triggers: bool,
    /// Existing bits of DIDR0.
    pub didr0: u8,
}

impl AvrAdcKind {
    /// ATmega48, 88, 168, 328 and related chips (DS40002061).
    pub const MEGA48: AvrAdcKind = AvrAdcKind {
        mux: 0x0F,
        temperature: Some(8),
        bandgap: 14,
        bandgap_mv: 1_100,
        reference_mv: 1_100,
        low_reference_mv: None,
        triggers: true,
        didr0: 0x3F,
    };
    /// ATmega8 (Atmel 2486, ADC).
    pub const MEGA8: AvrAdcKind = AvrAdcKind {
        temperature: None,
        bandgap_mv: 1_300,
        reference_mv: 2_560,
        triggers: false,
        didr0: 0,
        ..AvrAdcKind::MEGA48
    };
    /// ATmega16 and 32 (Atmel 2466 and 2503, ADC), and ATmega64 (2490); differential channels are not
    /// modelled and read 0.
    pub const MEGA16: AvrAdcKind =
        AvrAdcKind { mux: 0x1F, bandgap: 30, bandgap_mv: 1_220, triggers: true, ..AvrAdcKind::MEGA8 };
    /// ATmega164, 324, 644 and 1284 (Atmel 8272, ADC); differential channels are not modelled and read 0.
    pub const MEGA644: AvrAdcKind =
        AvrAdcKind { bandgap_mv: 1_100, low_reference_mv: Some(1_100), didr0: 0xFF, ..AvrAdcKind::MEGA16 };
    /// ATmega128 (Atmel 2467, ADC): as ATmega16 without trigger sources.
    pub const MEGA128: AvrAdcKind = AvrAdcKind { triggers: false, bandgap_mv: 1_230, ..AvrAdcKind::MEGA16 };
}
