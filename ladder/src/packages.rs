//! LDmicro's names of chips, and the port bit at each pin of their packages.

/// A chip in one package: a word of LDmicro's name, the number of pins, the short name, and runs of
/// consecutive pins.
struct ChipPackage {
    word: &'static str,
    pins: u32,
    chip: &'static str,
    pin_runs: &'static [PinRun],
}

/// A run of pins: the number of its first pin, and the port bits from there on.
type PinRun = (u32, &'static [&'static str]);

#[rustfmt::skip]
const PIC_18: &[PinRun] = &[
    (1,  &["RA2", "RA3", "RA4", "RA5"]),
    (6,  &["RB0", "RB1", "RB2", "RB3", "RB4", "RB5", "RB6", "RB7"]),
    (15, &["RA6", "RA7", "RA0", "RA1"]),
];
#[rustfmt::skip]
const PIC_28: &[PinRun] = &[
    (2,  &["RA0", "RA1", "RA2", "RA3", "RA4", "RA5"]),
    (11, &["RC0", "RC1", "RC2", "RC3", "RC4", "RC5", "RC6", "RC7"]),
    (21, &["RB0", "RB1", "RB2", "RB3", "RB4", "RB5", "RB6", "RB7"]),
];
#[rustfmt::skip]
const PIC_40: &[PinRun] = &[
    (2,  &["RA0", "RA1", "RA2", "RA3", "RA4", "RA5"]),
    (8,  &["RE0", "RE1", "RE2"]),
    (15, &["RC0", "RC1", "RC2", "RC3"]),
    (19, &["RD0", "RD1", "RD2", "RD3"]),
    (23, &["RC4", "RC5", "RC6", "RC7"]),
    (27, &["RD4", "RD5", "RD6", "RD7"]),
    (33, &["RB0", "RB1", "RB2", "RB3", "RB4", "RB5", "RB6", "RB7"]),
];
#[rustfmt::skip]
const MEGA_8: &[PinRun] = &[
    (2,  &["PD0", "PD1", "PD2", "PD3", "PD4"]),
    (11, &["PD5", "PD6", "PD7"]),
    (14, &["PB0", "PB1", "PB2", "PB3", "PB4", "PB5"]),
    (23, &["PC0", "PC1", "PC2", "PC3", "PC4", "PC5"]),
];
#[rustfmt::skip]
const MEGA_328: &[PinRun] = &[
    (2,  &["PD0", "PD1", "PD2", "PD3", "PD4"]),
    (9,  &["PB6", "PB7", "PD5", "PD6", "PD7"]),
    (14, &["PB0", "PB1", "PB2", "PB3", "PB4", "PB5"]),
    (23, &["PC0", "PC1", "PC2", "PC3", "PC4", "PC5"]),
];
#[rustfmt::skip]
const MEGA_328_TQFP: &[PinRun] = &[
    (1,  &["PD3", "PD4"]),
    (7,  &["PB6", "PB7", "PD5", "PD6", "PD7"]),
    (12, &["PB0", "PB1", "PB2", "PB3", "PB4", "PB5"]),
    (23, &["PC0", "PC1", "PC2", "PC3", "PC4", "PC5"]),
    (30, &["PD0", "PD1", "PD2"]),
];
#[rustfmt::skip]
const MEGA_16: &[PinRun] = &[
    (1,  &["PB0", "PB1", "PB2", "PB3", "PB4", "PB5", "PB6", "PB7"]),
    (14, &["PD0", "PD1", "PD2", "PD3", "PD4", "PD5", "PD6", "PD7"]),
    (22, &["PC0", "PC1", "PC2", "PC3", "PC4", "PC5", "PC6", "PC7"]),
    (33, &["PA7", "PA6", "PA5", "PA4", "PA3", "PA2", "PA1", "PA0"]),
];
#[rustfmt::skip]
const MEGA_162: &[PinRun] = &[
    (1,  &["PB0", "PB1", "PB2", "PB3", "PB4", "PB5", "PB6", "PB7"]),
    (10, &["PD0", "PD1", "PD2", "PD3", "PD4", "PD5", "PD6", "PD7"]),
    (21, &["PC0", "PC1", "PC2", "PC3", "PC4", "PC5", "PC6", "PC7"]),
    (29, &["PE2", "PE1", "PE0"]),
    (32, &["PA7", "PA6", "PA5", "PA4", "PA3", "PA2", "PA1", "PA0"]),
];
#[rustfmt::skip]
const MEGA_128: &[PinRun] = &[
    (2,  &["PE0", "PE1", "PE2", "PE3", "PE4", "PE5", "PE6", "PE7"]),
    (10, &["PB0", "PB1", "PB2", "PB3", "PB4", "PB5", "PB6", "PB7"]),
    (18, &["PG3", "PG4"]),
    (25, &["PD0", "PD1", "PD2", "PD3", "PD4", "PD5", "PD6", "PD7"]),
    (33, &["PG0", "PG1"]),
    (35, &["PC0", "PC1", "PC2", "PC3", "PC4", "PC5", "PC6", "PC7"]),
    (43, &["PG2"]),
    (44, &["PA7", "PA6", "PA5", "PA4", "PA3", "PA2", "PA1", "PA0"]),
    (54, &["PF7", "PF6", "PF5", "PF4", "PF3", "PF2", "PF1", "PF0"]),
];

#[rustfmt::skip]
const PACKAGES: &[ChipPackage] = &[
    ChipPackage { word: "ATMEGA128", pins: 64, chip: "atmega128",  pin_runs: MEGA_128 },
    ChipPackage { word: "ATMEGA64",  pins: 64, chip: "atmega64",   pin_runs: MEGA_128 },
    ChipPackage { word: "ATMEGA162", pins: 40, chip: "atmega162",  pin_runs: MEGA_162 },
    ChipPackage { word: "ATMEGA32",  pins: 40, chip: "atmega32",   pin_runs: MEGA_16  },
    ChipPackage { word: "ATMEGA16",  pins: 40, chip: "atmega16",   pin_runs: MEGA_16  },
    ChipPackage { word: "ATMEGA48",  pins: 28, chip: "atmega48",   pin_runs: MEGA_328 },
    ChipPackage { word: "ATMEGA88",  pins: 28, chip: "atmega88",   pin_runs: MEGA_328 },
    ChipPackage { word: "ATMEGA168", pins: 28, chip: "atmega168",  pin_runs: MEGA_328 },
    ChipPackage { word: "ATMEGA8",   pins: 28, chip: "atmega8",    pin_runs: MEGA_8   },
    ChipPackage { word: "ATMEGA328", pins: 28, chip: "atmega328p", pin_runs: MEGA_328 },
    ChipPackage { word: "ATMEGA328", pins: 32, chip: "atmega328p", pin_runs: MEGA_328_TQFP },
    ChipPackage { word: "PIC16F628A", pins: 18, chip: "pic16f628a", pin_runs: PIC_18  },
    ChipPackage { word: "PIC16F873A", pins: 28, chip: "pic16f873a", pin_runs: PIC_28  },
    ChipPackage { word: "PIC16F874A", pins: 40, chip: "pic16f874a", pin_runs: PIC_40  },
    ChipPackage { word: "PIC16F876A", pins: 28, chip: "pic16f876a", pin_runs: PIC_28  },
    ChipPackage { word: "PIC16F877A", pins: 40, chip: "pic16f877a", pin_runs: PIC_40  },
    ChipPackage { word: "PIC16F873", pins: 28, chip: "pic16f873",  pin_runs: PIC_28   },
    ChipPackage { word: "PIC16F874", pins: 40, chip: "pic16f874",  pin_runs: PIC_40   },
    ChipPackage { word: "PIC16F628", pins: 18, chip: "pic16f628",  pin_runs: PIC_18   },
    ChipPackage { word: "PIC16F88",  pins: 18, chip: "pic16f88",   pin_runs: PIC_18   },
    ChipPackage { word: "PIC16F819", pins: 18, chip: "pic16f819",  pin_runs: PIC_18   },
    ChipPackage { word: "PIC16F877", pins: 40, chip: "pic16f877",  pin_runs: PIC_40   },
    ChipPackage { word: "PIC16F876", pins: 28, chip: "pic16f876",  pin_runs: PIC_28   },
    ChipPackage { word: "PIC16F887", pins: 40, chip: "pic16f887",  pin_runs: &[]      },
    ChipPackage { word: "PIC16F886", pins: 28, chip: "pic16f886",  pin_runs: &[]      },
];

/// Returns the short name of a chip, such as `atmega328p`, for LDmicro's name, such as `Atmel AVR ATmega328
/// 28-PDIP`.
///
/// The chip's word may be anywhere in the name, in any case, and letters of a variant may follow it
/// (`ATmega328P`).
#[must_use]
pub fn chip_of(micro: &str) -> Option<&'static str> {
    find_package(micro).map(|p| p.chip)
}

/// Returns the port bit, such as `PD2` or `RB0`, at a pin of the package named in LDmicro's name of a chip.
///
/// Returns `None` if the chip or its pins are unknown, if the name states another package, or if the pin is
/// not a port pin. Pins count from 1. PIC16F886 and PIC16F887 are known by name only.
#[must_use]
pub fn package_pin(micro: &str, pin: u32) -> Option<&'static str> {
    let package = find_package(micro).filter(|p| has_pin_count(micro, p))?;
    package.pin_runs.iter().find_map(|(first, bits)| bits.get(pin.checked_sub(*first)? as usize).copied())
}

/// True when [`package_pin`] knows the pins of this chip in this package.
#[must_use]
pub fn has_pin_table(micro: &str) -> bool {
    find_package(micro).is_some_and(|p| !p.pin_runs.is_empty() && has_pin_count(micro, p))
}

/// The first package of the chip, or the one with the number of pins that the name states.
fn find_package(micro: &str) -> Option<&'static ChipPackage> {
    let name = micro.to_uppercase();
    let is_named = |p: &&ChipPackage| {
        // ATMEGA16 must not match ATMEGA162, so no digit may follow.
        name.match_indices(p.word)
            .any(|(at, word)| !name.get(at + word.len()..).unwrap_or("").starts_with(|c: char| c.is_ascii_digit()))
    };
    let first = PACKAGES.iter().find(is_named)?;
    Some(PACKAGES.iter().find(|p| p.word == first.word && has_pin_count(micro, p)).unwrap_or(first))
}

/// True unless the name states another number of pins (`32-TQFP`, `32-Pin packages`).
fn has_pin_count(micro: &str, package: &ChipPackage) -> bool {
    micro
        .split_whitespace()
        .filter_map(|word| word.split_once('-')?.0.parse::<u32>().ok())
        .all(|pins| pins == package.pins)
}
