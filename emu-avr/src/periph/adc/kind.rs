//! What differs between the converters of the family, and the registers that they share.

/// The registers.
#[allow(missing_docs)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AdcRegister {
    ADMUX,
    ADCSRA,
    /// Bits 2 to 0 are ADTS and bit 6 is ACME, also where they stand in SFIOR.
    ADCSRB,
    ADCL,
    ADCH,
    DIDR0,
}

/// What differs between the converters of the family.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AvrAdcKind {
    /// The bits of MUX in ADMUX. Values 0 to 7 are the pins ADC0 to ADC7.
    pub mux: u8,
    /// MUX of the temperature sensor, where there is one.
    pub temperature: Option<u8>,
    /// MUX of the bandgap reference.
    pub bandgap: u8,
    /// Voltage of the bandgap reference in millivolts.
    pub bandgap_mv: u32,
    /// The internal reference that REFS = 3 selects, in millivolts.
    pub reference_mv: u32,
    /// Conversions are triggered by the sources of ADTS; without them bit 5 of ADCSRA is ADFR.
    pub triggers: bool,
    /// The bits of DIDR0 that there are.
    pub didr0: u8,
}

impl AvrAdcKind {
    /// ATmega48, 88, 168, 328 and their relatives (DS40002061).
    pub const MEGA48: AvrAdcKind = AvrAdcKind {
        mux: 0x0F,
        temperature: Some(8),
        bandgap: 14,
        bandgap_mv: 1_100,
        reference_mv: 1_100,
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
    /// ATmega16 and 32 (Atmel 2466 and 2503, ADC), and ATmega64 (2490); differential channels are not modelled and read 0.
    pub const MEGA16: AvrAdcKind =
        AvrAdcKind { mux: 0x1F, bandgap: 30, bandgap_mv: 1_220, triggers: true, ..AvrAdcKind::MEGA8 };
    /// ATmega128 (Atmel 2467, ADC): as ATmega16 without trigger sources.
    pub const MEGA128: AvrAdcKind = AvrAdcKind { triggers: false, bandgap_mv: 1_230, ..AvrAdcKind::MEGA16 };
}
