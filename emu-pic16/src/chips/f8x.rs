//! PIC16C71 (DS30272), 16C84 (DS30445), 16F84 (DS30430), 16F84A (DS35007).

use emu_core::chip::{Chip, ChipSpace, RamRange};
use emu_core::image::{ImageSpace, WordBits};

use super::bits as b;
use super::data::{chip, join, regs};
use super::f87x::PIC16F873;
use super::pins::{self as p, dip18, pins18};
use super::regs as r;
use super::{ConfigLayout, NO_PIN, NonvolatileKind, Pic16AdcKind, Pic16Part, SfrBit, SspKind, TimingRanges};
use crate::periph::map::Sfr;

/// RAM of the 16F84 (figure 4-2): bank 1 mirrors bank 0. RP1 and IRP are not used (section 4.2.2.1), so banks
/// 2 and 3 mirror banks 0 and 1.
const RAM_68: &[RamRange] = &[
    RamRange { first: 0x00C, last: 0x04F, canonical: 0x0C },
    RamRange { first: 0x08C, last: 0x0CF, canonical: 0x0C },
    RamRange { first: 0x10C, last: 0x14F, canonical: 0x0C },
    RamRange { first: 0x18C, last: 0x1CF, canonical: 0x0C },
];
/// RAM of 16C84 (figure 4-2) and 16C71 (figure 4-5).
const RAM_36: &[RamRange] = &[
    RamRange { first: 0x00C, last: 0x02F, canonical: 0x0C },
    RamRange { first: 0x08C, last: 0x0AF, canonical: 0x0C },
    RamRange { first: 0x10C, last: 0x12F, canonical: 0x0C },
    RamRange { first: 0x18C, last: 0x1AF, canonical: 0x0C },
];

const BANKS_84: &[(u16, Sfr)] = join!(r::CORE, r::EEPROM_84);
const BANKS_71: &[(u16, Sfr)] = join!(r::CORE, r::ADC_71);
const S_84: &[(u16, Sfr)] = &r::mirrored::<{ 2 * BANKS_84.len() }>(BANKS_84);
const S_71: &[(u16, Sfr)] = &r::mirrored::<{ 2 * BANKS_71.len() }>(BANKS_71);

const B_ANY: &[SfrBit] = join!(b::CORE, b::INT, b::T0);
const B_C84: &[SfrBit] = join!(B_ANY, b::EEPROM, b::EEPROM_84);
const B_84: &[SfrBit] = join!(B_C84, b::TMR0);
const B_71: &[SfrBit] = join!(B_ANY, b::ADC_ANY, b::ADC_71);

/// Configuration of the 16F84 (register 8-1).
const CONFIG_84: ConfigLayout = ConfigLayout {
    boren: 0,
    lvp: 0,
    pgm: NO_PIN,
    cpd: 0,
    cp: 0x3FF0,
    cp_first: (0, &[]),
    wrt: (0, &[]),
    ..PIC16F873.config
};
/// Configuration of 16C84 (figure 8-1) and 16C71 (figure 8-1): PWRTE is 1 if the timer is on.
const CONFIG_C84: ConfigLayout = ConfigLayout { pwrte: (1 << 3, true), cp: 0x10, ..CONFIG_84 };

/// Row of the PIC16F84. A write of an EEPROM byte takes 10 ms, at most 20 ms (parameter D122).
pub(super) const PIC16F84: Pic16Part = Pic16Part {
    chip: Chip {
        ram_ranges: RAM_68,
        ram_start: 0x0C,
        max_hz: 10_000_000,
        regs: regs!(S_84),
        pins: &pins18(["", "", "", "", "open drain, T0CKI"]),
        ..chip!("pic16f84", "PIC16F84", "DS30430", 1 K, 68, 64, 18, PIC16F873.chip)
    },
    sfr: S_84,
    bits: B_84,
    ports: p::PORTS18,
    mclr: dip18::MCLR,
    lines: p::L18,
    flags: join!(r::F_CORE, r::F_EEPROM_84),
    analog: &[],
    ccps: 0,
    timers: false,
    ssp: SspKind::None,
    usart: false,
    adc: Pic16AdcKind::None,
    memory: NonvolatileKind::F84,
    config: CONFIG_84,
    device_id: None,
    times: TimingRanges { eeprom: [10_000, 10_000, 20_000], ..PIC16F873.times },
    ..PIC16F873
};

/// Row of the PIC16F84A.
pub(super) const PIC16F84A: Pic16Part = Pic16Part {
    chip: Chip { max_hz: 20_000_000, ..chip!("pic16f84a", "PIC16F84A", "DS35007", 1 K, 68, 64, 18, PIC16F84.chip) },
    device_id: Some(0x0560),
    times: PIC16F873.times,
    ..PIC16F84
};

/// Row of the PIC16C84.
pub(super) const PIC16C84: Pic16Part = Pic16Part {
    chip: Chip { ram_ranges: RAM_36, ..chip!("pic16c84", "PIC16C84", "DS30445", 1 K, 36, 64, 18, PIC16F84.chip) },
    bits: B_C84,
    config: CONFIG_C84,
    ..PIC16F84
};

/// Row of the PIC16C71.
pub(super) const PIC16C71: Pic16Part = Pic16Part {
    chip: Chip {
        ram_ranges: RAM_36,
        name: "pic16c71",
        constants: || super::names::names_of_chip("pic16c71"),
        title: "PIC16C71: 1K words EPROM, 36 bytes RAM, 18 pins",
        data_sheet: "DS30272",
        max_hz: 20_000_000,
        ram_len: 36,
        eeprom_bytes: 0,
        hex_spaces: &[
            ImageSpace { name: "flash", start: 0, len: 0x800, word: 2, word_bits: WordBits::Only(14) },
            ImageSpace { name: "config", start: 0x4000, len: 0x20, word: 2, word_bits: WordBits::Low(14) },
        ],
        spaces: &[
            ChipSpace::new("flash", 0x400, 2),
            ChipSpace::new("data", 0x200, 1),
            ChipSpace::new("config", 0x10, 2),
        ],
        regs: regs!(S_71, ADRESH => "ADRES"),
        pins: &pins18(["AN0", "AN1", "AN2", "AN3, VREF", "open drain, T0CKI"]),
        ..PIC16F84.chip
    },
    sfr: S_71,
    bits: B_71,
    flags: join!(r::F_CORE, r::F_ADC_71),
    analog: &[dip18::RA0, dip18::RA1, dip18::RA2, dip18::RA3],
    adc: Pic16AdcKind::Bits8,
    memory: NonvolatileKind::None,
    config: CONFIG_C84,
    ..PIC16F84
};
