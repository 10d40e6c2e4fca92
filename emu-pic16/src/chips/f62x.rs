//! PIC16F628 (DS40300), 16F628A and 648A (DS40044).

use emu_core::chip::{Chip, RamRange};

use super::bits as b;
use super::data::{chip, join, regs};
use super::f87x::PIC16F873;
use super::pins::{self as p, pins18_shared, shared18};
use super::regs as r;
use super::{
    ComparatorKind, ConfigLayout, InternalOscillator, NonvolatileKind, OscillatorMode, Pic16AdcKind, Pic16Part, SfrBit,
    SspKind,
};
use crate::periph::map::Sfr;

/// RAM of 16F628 and 628A (figure 4-2).
const RAM_224: &[RamRange] = &[
    RamRange { first: 0x020, last: 0x07F, canonical: 0x020 },
    RamRange { first: 0x0A0, last: 0x0EF, canonical: 0x0A0 },
    RamRange { first: 0x0F0, last: 0x0FF, canonical: 0x070 },
    RamRange { first: 0x120, last: 0x14F, canonical: 0x120 },
    RamRange { first: 0x170, last: 0x17F, canonical: 0x070 },
    RamRange { first: 0x1F0, last: 0x1FF, canonical: 0x070 },
];
/// RAM of the 648A (figure 4-3).
const RAM_256: &[RamRange] = &[
    RamRange { first: 0x020, last: 0x07F, canonical: 0x020 },
    RamRange { first: 0x0A0, last: 0x0EF, canonical: 0x0A0 },
    RamRange { first: 0x0F0, last: 0x0FF, canonical: 0x070 },
    RamRange { first: 0x120, last: 0x16F, canonical: 0x120 },
    RamRange { first: 0x170, last: 0x17F, canonical: 0x070 },
    RamRange { first: 0x1F0, last: 0x1FF, canonical: 0x070 },
];

const S_628: &[(u16, Sfr)] = join!(r::CORE, r::CORE_HIGH, r::TIMERS, r::USART, r::COMPARATORS_62X, r::EEPROM_62X);
const B_628: &[SfrBit] = join!(
    join!(b::CORE, b::RA5_7, b::INT, b::T0, b::TMR0, b::TIMERS),
    join!(b::USART, b::USART_62X, b::CMCON, b::F62X, b::EEPROM),
);

/// Configuration of the 16F628 (DS40300, register 14-1): bit 9 reads 0.
const CONFIG_628: ConfigLayout = ConfigLayout {
    erased: &[0x3DFF],
    fosc: (
        0x13,
        &[
            OscillatorMode::Lp,
            OscillatorMode::Xt,
            OscillatorMode::Hs,
            OscillatorMode::Ec,
            OscillatorMode::Internal,
            OscillatorMode::Internal,
            OscillatorMode::Rc,
            OscillatorMode::Rc,
        ],
    ),
    osc_ports: &[0, 0, 0, 0x40, 0xC0, 0x80, 0x40, 0],
    mclre: 1 << 5,
    pgm: shared18::RB4,
    cp: 0x3C00,
    cp_first: (0, &[]),
    wrt: (0, &[]),
    ..PIC16F873.config
};
/// Configuration of 628A and 648A (DS40044, register 14-1): bits 12 to 9 read 0.
const CONFIG_628A: ConfigLayout = ConfigLayout { erased: &[0x21FF], cp: 0x2000, ..CONFIG_628 };

/// Row of the PIC16F628.
pub(super) const PIC16F628: Pic16Part = Pic16Part {
    chip: Chip {
        ram_ranges: RAM_224,
        regs: regs!(S_628, CVRCON => "VRCON"),
        pins: &pins18_shared(
            ["AN0", "AN1", "AN2, VREF", "AN3, CMP1", "open drain, T0CKI, CMP2"],
            ["INT", "RX, DT", "TX, CK", "CCP1", "PGM", "", "T1OSO, T1CKI, PGC", "T1OSI, PGD"],
        ),
        ..chip!("pic16f628", "PIC16F628", "DS40300", 2 K, 224, 128, 18, PIC16F873.chip)
    },
    sfr: S_628,
    bits: B_628,
    ports: p::PORTS_62X,
    mclr: shared18::RA5,
    lines: p::L_62X,
    flags: join!(r::F_CORE, r::F_TIMERS, r::F_USART, r::F_62X),
    analog: &[shared18::RA0, shared18::RA1, shared18::RA2, shared18::RA3],
    ccps: 1,
    ssp: SspKind::None,
    adc: Pic16AdcKind::None,
    comparators: ComparatorKind::F62x,
    memory: NonvolatileKind::F62x,
    internal: InternalOscillator::F62x(37_000),
    config: CONFIG_628,
    device_id: Some(0x07C0),
    ..PIC16F873
};

/// Row of the PIC16F628A.
pub(super) const PIC16F628A: Pic16Part = Pic16Part {
    chip: chip!("pic16f628a", "PIC16F628A", "DS40044", 2 K, 224, 128, 18, PIC16F628.chip),
    internal: InternalOscillator::F62x(48_000),
    config: CONFIG_628A,
    device_id: Some(0x1060),
    ..PIC16F628
};

/// Row of the PIC16F648A.
pub(super) const PIC16F648A: Pic16Part = Pic16Part {
    chip: Chip {
        ram_ranges: RAM_256,
        ..chip!("pic16f648a", "PIC16F648A", "DS40044", 4 K, 256, 256, 18, PIC16F628.chip)
    },
    device_id: Some(0x1100),
    ..PIC16F628A
};
