//! PIC16F818 and 819 (DS39598), 16F87 and 88 (DS30487).

use emu_core::chip::{Chip, RamRange};

use super::bits as b;
use super::data::{chip, join, regs};
use super::f62x::PIC16F628;
use super::f87x::{PIC16F873, RAM_368};
use super::pins::{self as p, pins18_shared, shared18};
use super::regs as r;
use super::{
    ComparatorKind, ConfigLayout, InternalOscillator, NonvolatileKind, Pic16AdcKind, Pic16Part, SfrBit, SspKind,
    TimingRanges,
};
use crate::periph::map::Sfr;

/// RAM of the 818 (figure 2-3).
const RAM_128: &[RamRange] = &[
    RamRange { first: 0x020, last: 0x07F, canonical: 0x20 },
    RamRange { first: 0x0A0, last: 0x0BF, canonical: 0xA0 },
    RamRange { first: 0x0C0, last: 0x0FF, canonical: 0x40 },
    RamRange { first: 0x120, last: 0x17F, canonical: 0x20 },
    RamRange { first: 0x1A0, last: 0x1FF, canonical: 0x20 },
];
/// RAM of the 819 (figure 2-4).
const RAM_256: &[RamRange] = &[
    RamRange { first: 0x020, last: 0x07F, canonical: 0x020 },
    RamRange { first: 0x0A0, last: 0x0EF, canonical: 0x0A0 },
    RamRange { first: 0x0F0, last: 0x0FF, canonical: 0x070 },
    RamRange { first: 0x120, last: 0x16F, canonical: 0x120 },
    RamRange { first: 0x170, last: 0x17F, canonical: 0x070 },
    RamRange { first: 0x1A0, last: 0x1FF, canonical: 0x020 },
];

/// Registers that all chips of this file have.
const S_ANY: &[(u16, Sfr)] = join!(r::CORE, r::CORE_HIGH, r::TIMERS, r::SSP, r::FLASH, r::OSCILLATOR);
const S_819: &[(u16, Sfr)] = join!(S_ANY, r::ADC);
const S_87: &[(u16, Sfr)] = join!(S_ANY, r::USART, r::COMPARATORS, r::WATCHDOG);
const S_88: &[(u16, Sfr)] = join!(S_87, r::ADC, r::ANSEL);

/// Bits that all chips of this file have.
const B_ANY: &[SfrBit] = join!(
    join!(b::CORE, b::RA5_7, b::TMR0, b::TIMERS, b::T1INSYNC, b::SSP),
    join!(b::EEPROM, b::FLASH, b::FREE, b::OSCILLATOR),
);
const B_819: &[SfrBit] = join!(B_ANY, b::INT, b::ADC_ANY, b::ADC, b::PCFG, b::ADCS2);
const B_87: &[SfrBit] = join!(B_ANY, b::INT0, b::INT, b::T1RUN, b::USART, b::USART_87X, b::CMCON, b::CVRCON, b::CLOCKS);
const B_88: &[SfrBit] = join!(B_87, b::ADC_ANY, b::ADC, b::ADCS2, b::ANSEL);

/// Configuration of 818 and 819 (register 12-1).
const CONFIG_819: ConfigLayout = ConfigLayout {
    erased: &[0x3FFF],
    pgm: shared18::RB3,
    ccpmx: (1 << 12, shared18::RB2, shared18::RB3),
    cp: 0x2000,
    wrt: (3 << 9, &[0x600, 0x400, 0x200, 0]),
    ..PIC16F628.config
};
/// Configuration of the 818. The data sheet does not define the WRT value 00; 01 protects all words, so 00
/// does too.
const CONFIG_818: ConfigLayout = ConfigLayout { wrt: (3 << 9, &[0xFFFF, 0xFFFF, 0x200, 0]), ..CONFIG_819 };
/// Configuration of 87 and 88 (registers 15-1 and 15-2).
const CONFIG_88: ConfigLayout = ConfigLayout {
    words: &[0x2007, 0x2008],
    erased: &[0x3FFF, 0x3FFF],
    fcmen: 1,
    ieso: 1 << 1,
    ccpmx: (1 << 12, shared18::RB0, shared18::RB3),
    wrt: (3 << 9, &[0xFFFF, 0x800, 0x100, 0]),
    ..CONFIG_819
};

/// Row of the PIC16F819. Its watchdog runs on the internal oscillator (table 15-3); a write of program memory
/// takes 2 ms (D133).
pub(super) const PIC16F819: Pic16Part = Pic16Part {
    chip: Chip {
        ram_ranges: RAM_256,
        regs: regs!(S_819),
        pins: &pins18_shared(
            ["AN0", "AN1", "AN2, VREF-", "AN3, VREF+", "AN4, T0CKI"],
            ["INT", "SDI, SDA", "SDO, CCP1", "CCP1, PGM", "SCK, SCL", "SS", "T1OSO, T1CKI, PGC", "T1OSI, PGD"],
        ),
        ..chip!("pic16f819", "PIC16F819", "DS39598", 2 K, 256, 256, 18, PIC16F873.chip)
    },
    sfr: S_819,
    bits: B_819,
    ports: p::PORTS_88,
    mclr: shared18::RA5,
    lines: p::L_819,
    flags: join!(r::F_CORE, r::F_TIMERS, r::F_SSP, r::F_ADC, r::F_EEPROM),
    analog: &[shared18::RA0, shared18::RA1, shared18::RA2, shared18::RA3, shared18::RA4],
    ccps: 1,
    ssp: SspKind::Basic,
    usart: false,
    adc: Pic16AdcKind::Bits10Adcs2,
    memory: NonvolatileKind::Row32,
    internal: InternalOscillator::Osccon,
    config: CONFIG_819,
    device_id: Some(0x04E0),
    times: TimingRanges {
        wdt: [13_600, 16_000, 18_400],
        pwrt: [61_200, 72_000, 82_800],
        flash: [2_000, 2_000, 4_000],
        ..PIC16F873.times
    },
    ..PIC16F873
};

/// Row of the PIC16F818.
pub(super) const PIC16F818: Pic16Part = Pic16Part {
    chip: Chip { ram_ranges: RAM_128, ..chip!("pic16f818", "PIC16F818", "DS39598", 1 K, 128, 128, 18, PIC16F819.chip) },
    config: CONFIG_818,
    device_id: Some(0x04C0),
    ..PIC16F819
};

/// Row of the PIC16F87.
pub(super) const PIC16F87: Pic16Part = Pic16Part {
    chip: Chip {
        ram_ranges: RAM_368,
        regs: regs!(S_87),
        pins: &pins18_shared(
            ["AN0", "AN1", "AN2, CVREF", "AN3, C1OUT", "T0CKI, C2OUT"],
            [
                "INT, CCP1",
                "SDI, SDA",
                "SDO, RX, DT",
                "CCP1, PGM",
                "SCK, SCL",
                "SS, TX, CK",
                "T1OSO, T1CKI, PGC",
                "T1OSI, PGD",
            ],
        ),
        ..chip!("pic16f87", "PIC16F87", "DS30487", 4 K, 368, 256, 18, PIC16F819.chip)
    },
    sfr: S_87,
    bits: B_87,
    lines: p::L_88,
    flags: join!(r::F_CORE, r::F_TIMERS, r::F_SSP, r::F_USART, r::F_EEPROM, r::F_COMPARATORS, r::F_OSCILLATOR),
    analog: &[shared18::RA0, shared18::RA1, shared18::RA2, shared18::RA3],
    usart: true,
    adc: Pic16AdcKind::None,
    comparators: ComparatorKind::F88,
    config: CONFIG_88,
    device_id: Some(0x0720),
    ..PIC16F819
};

/// Row of the PIC16F88: the 87 with a converter.
pub(super) const PIC16F88: Pic16Part = Pic16Part {
    chip: Chip {
        regs: regs!(S_88),
        pins: &pins18_shared(
            ["AN0", "AN1", "AN2, VREF-, CVREF", "AN3, VREF+, C1OUT", "AN4, T0CKI, C2OUT"],
            [
                "INT, CCP1",
                "SDI, SDA",
                "SDO, RX, DT",
                "CCP1, PGM",
                "SCK, SCL",
                "SS, TX, CK",
                "AN5, T1OSO, T1CKI, PGC",
                "AN6, T1OSI, PGD",
            ],
        ),
        ..chip!("pic16f88", "PIC16F88", "DS30487", 4 K, 368, 256, 18, PIC16F87.chip)
    },
    sfr: S_88,
    bits: B_88,
    flags: join!(PIC16F87.flags, r::F_ADC),
    analog: &[shared18::RA0, shared18::RA1, shared18::RA2, shared18::RA3, shared18::RA4, shared18::RB6, shared18::RB7],
    adc: Pic16AdcKind::Ansel,
    device_id: Some(0x0760),
    ..PIC16F87
};
