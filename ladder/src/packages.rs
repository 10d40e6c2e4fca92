//! LDmicro's names of chips, and what is at each pin of their packages.

/// A chip in one package: a word of LDmicro's name, the short name, and what is at the pins, from pin 1 on.
struct ChipPackage {
    word: &'static str,
    chip: &'static str,
    pins: &'static [&'static str],
}

/// RA5, RA6 and RA7 are also MCLR, OSC2 and OSC1. Sources: DS40300 (PIC16F628), DS30487 (PIC16F88), DS39598
/// (PIC16F819), pin diagrams.
#[rustfmt::skip]
const PIC_18: &[&str] = &[
    "RA2", "RA3", "RA4", "RA5", "VSS", "RB0", "RB1", "RB2", "RB3", "RB4",
    "RB5", "RB6", "RB7", "VDD", "RA6", "RA7", "RA0", "RA1",
];
/// Source: DS30292 (PIC16F87X), pin diagrams.
#[rustfmt::skip]
const PIC_28: &[&str] = &[
    "MCLR", "RA0", "RA1", "RA2", "RA3", "RA4", "RA5", "VSS", "OSC1", "OSC2",
    "RC0", "RC1", "RC2", "RC3", "RC4", "RC5", "RC6", "RC7", "VSS", "VDD",
    "RB0", "RB1", "RB2", "RB3", "RB4", "RB5", "RB6", "RB7",
];
/// Source: DS30292 (PIC16F87X), pin diagrams.
#[rustfmt::skip]
const PIC_40: &[&str] = &[
    "MCLR", "RA0", "RA1", "RA2", "RA3", "RA4", "RA5", "RE0", "RE1", "RE2",
    "VDD", "VSS", "OSC1", "OSC2", "RC0", "RC1", "RC2", "RC3", "RD0", "RD1",
    "RD2", "RD3", "RC4", "RC5", "RC6", "RC7", "RD4", "RD5", "RD6", "RD7",
    "VSS", "VDD", "RB0", "RB1", "RB2", "RB3", "RB4", "RB5", "RB6", "RB7",
];
/// LDmicro keeps PB6 and PB7 for the crystal. Source: Atmel 2486 (ATmega8), figure "Pin Configurations".
#[rustfmt::skip]
const MEGA_8_28: &[&str] = &[
    "RESET", "PD0", "PD1", "PD2", "PD3", "PD4", "VCC", "GND", "XTAL1 (PB6)", "XTAL2 (PB7)",
    "PD5", "PD6", "PD7", "PB0", "PB1", "PB2", "PB3", "PB4", "PB5", "AVCC",
    "AREF", "GND", "PC0", "PC1", "PC2", "PC3", "PC4", "PC5",
];
/// The TQFP and MLF packages. Source: as [`MEGA_8_28`].
#[rustfmt::skip]
const MEGA_8_32: &[&str] = &[
    "PD3", "PD4", "GND", "VCC", "GND", "VCC", "XTAL1 (PB6)", "XTAL2 (PB7)", "PD5", "PD6",
    "PD7", "PB0", "PB1", "PB2", "PB3", "PB4", "PB5", "AVCC", "ADC6", "AREF",
    "GND", "ADC7", "PC0", "PC1", "PC2", "PC3", "PC4", "PC5", "RESET", "PD0",
    "PD1", "PD2",
];
/// Source: DS40002061 (ATmega48A to 328P), figure 1-1.
#[rustfmt::skip]
const MEGA_328_28: &[&str] = &[
    "RESET", "PD0", "PD1", "PD2", "PD3", "PD4", "VCC", "GND", "PB6", "PB7",
    "PD5", "PD6", "PD7", "PB0", "PB1", "PB2", "PB3", "PB4", "PB5", "AVCC",
    "AREF", "GND", "PC0", "PC1", "PC2", "PC3", "PC4", "PC5",
];
/// The TQFP and MLF packages. Source: DS40002061 (ATmega48A to 328P), figure 1-1.
#[rustfmt::skip]
const MEGA_328_32: &[&str] = &[
    "PD3", "PD4", "GND", "VCC", "GND", "VCC", "PB6", "PB7", "PD5", "PD6",
    "PD7", "PB0", "PB1", "PB2", "PB3", "PB4", "PB5", "AVCC", "ADC6", "AREF",
    "GND", "ADC7", "PC0", "PC1", "PC2", "PC3", "PC4", "PC5", "RESET", "PD0",
    "PD1", "PD2",
];
/// Sources: Atmel 2466 (ATmega16) and 8272 (ATmega164A to 1284P), pin configurations.
#[rustfmt::skip]
const MEGA_16: &[&str] = &[
    "PB0", "PB1", "PB2", "PB3", "PB4", "PB5", "PB6", "PB7", "RESET", "VCC",
    "GND", "XTAL2", "XTAL1", "PD0", "PD1", "PD2", "PD3", "PD4", "PD5", "PD6",
    "PD7", "PC0", "PC1", "PC2", "PC3", "PC4", "PC5", "PC6", "PC7", "AVCC",
    "GND", "AREF", "PA7", "PA6", "PA5", "PA4", "PA3", "PA2", "PA1", "PA0",
];
/// Source: Atmel 2513 (ATmega162), figure 1.
#[rustfmt::skip]
const MEGA_162: &[&str] = &[
    "PB0", "PB1", "PB2", "PB3", "PB4", "PB5", "PB6", "PB7", "RESET", "PD0",
    "PD1", "PD2", "PD3", "PD4", "PD5", "PD6", "PD7", "XTAL2", "XTAL1", "GND",
    "PC0", "PC1", "PC2", "PC3", "PC4", "PC5", "PC6", "PC7", "PE2", "PE1",
    "PE0", "PA7", "PA6", "PA5", "PA4", "PA3", "PA2", "PA1", "PA0", "VCC",
];
/// Source: Atmel 2467 (ATmega128), figure 1.
#[rustfmt::skip]
const MEGA_128: &[&str] = &[
    "PEN", "PE0", "PE1", "PE2", "PE3", "PE4", "PE5", "PE6", "PE7", "PB0",
    "PB1", "PB2", "PB3", "PB4", "PB5", "PB6", "PB7", "PG3", "PG4", "RESET",
    "VCC", "GND", "XTAL2", "XTAL1", "PD0", "PD1", "PD2", "PD3", "PD4", "PD5",
    "PD6", "PD7", "PG0", "PG1", "PC0", "PC1", "PC2", "PC3", "PC4", "PC5",
    "PC6", "PC7", "PG2", "PA7", "PA6", "PA5", "PA4", "PA3", "PA2", "PA1",
    "PA0", "VCC", "GND", "PF7", "PF6", "PF5", "PF4", "PF3", "PF2", "PF1",
    "PF0", "AREF", "GND", "AVCC",
];

/// Where a chip has several packages, the first is the one that a name without a number of pins means.
#[rustfmt::skip]
const PACKAGES: &[ChipPackage] = &[
    ChipPackage { word: "ATMEGA128",  chip: "atmega128",  pins: MEGA_128    },
    ChipPackage { word: "ATMEGA64",   chip: "atmega64",   pins: MEGA_128    },
    ChipPackage { word: "ATMEGA162",  chip: "atmega162",  pins: MEGA_162    },
    ChipPackage { word: "ATMEGA32",   chip: "atmega32",   pins: MEGA_16     },
    ChipPackage { word: "ATMEGA16",   chip: "atmega16",   pins: MEGA_16     },
    ChipPackage { word: "ATMEGA164",  chip: "atmega164p", pins: MEGA_16     },
    ChipPackage { word: "ATMEGA324",  chip: "atmega324p", pins: MEGA_16     },
    ChipPackage { word: "ATMEGA644",  chip: "atmega644",  pins: MEGA_16     },
    ChipPackage { word: "ATMEGA1284", chip: "atmega1284", pins: MEGA_16     },
    ChipPackage { word: "ATMEGA48",   chip: "atmega48",   pins: MEGA_328_28 },
    ChipPackage { word: "ATMEGA48",   chip: "atmega48",   pins: MEGA_328_32 },
    ChipPackage { word: "ATMEGA88",   chip: "atmega88",   pins: MEGA_328_28 },
    ChipPackage { word: "ATMEGA88",   chip: "atmega88",   pins: MEGA_328_32 },
    ChipPackage { word: "ATMEGA168",  chip: "atmega168",  pins: MEGA_328_28 },
    ChipPackage { word: "ATMEGA168",  chip: "atmega168",  pins: MEGA_328_32 },
    ChipPackage { word: "ATMEGA8",    chip: "atmega8",    pins: MEGA_8_28   },
    ChipPackage { word: "ATMEGA8",    chip: "atmega8",    pins: MEGA_8_32   },
    ChipPackage { word: "ATMEGA328",  chip: "atmega328p", pins: MEGA_328_28 },
    ChipPackage { word: "ATMEGA328",  chip: "atmega328p", pins: MEGA_328_32 },
    ChipPackage { word: "PIC16F628A", chip: "pic16f628a", pins: PIC_18      },
    ChipPackage { word: "PIC16F873A", chip: "pic16f873a", pins: PIC_28      },
    ChipPackage { word: "PIC16F874A", chip: "pic16f874a", pins: PIC_40      },
    ChipPackage { word: "PIC16F876A", chip: "pic16f876a", pins: PIC_28      },
    ChipPackage { word: "PIC16F877A", chip: "pic16f877a", pins: PIC_40      },
    ChipPackage { word: "PIC16F873",  chip: "pic16f873",  pins: PIC_28      },
    ChipPackage { word: "PIC16F874",  chip: "pic16f874",  pins: PIC_40      },
    ChipPackage { word: "PIC16F628",  chip: "pic16f628",  pins: PIC_18      },
    ChipPackage { word: "PIC16F88",   chip: "pic16f88",   pins: PIC_18      },
    ChipPackage { word: "PIC16F819",  chip: "pic16f819",  pins: PIC_18      },
    ChipPackage { word: "PIC16F877",  chip: "pic16f877",  pins: PIC_40      },
    ChipPackage { word: "PIC16F876",  chip: "pic16f876",  pins: PIC_28      },
];

/// A target of LDmicro's list for which this project has no model.
#[derive(Debug, PartialEq, Eq)]
pub struct UnmodelledTarget {
    /// A word of LDmicro's name.
    word: &'static str,
    /// What the target is, as a phrase.
    pub what: &'static str,
    /// The modelled chip that a program most likely runs on after a change of pins, if any is near.
    pub nearest: Option<&'static str>,
}

#[rustfmt::skip]
const UNMODELLED: &[UnmodelledTarget] = &[
    UnmodelledTarget { word: "PIC16F887",   what: "a PIC16 for which emu has no model", nearest: Some("pic16f877a") },
    UnmodelledTarget { word: "PIC16F886",   what: "a PIC16 for which emu has no model", nearest: Some("pic16f876a") },
    UnmodelledTarget { word: "PIC16F72",    what: "a PIC16 for which emu has no model", nearest: Some("pic16f873a") },
    UnmodelledTarget { word: "PIC16F15",    what: "an enhanced mid-range PIC, for which emu has no model", nearest: Some("pic16f877a") },
    UnmodelledTarget { word: "PIC16F18",    what: "an enhanced mid-range PIC, for which emu has no model", nearest: Some("pic16f88") },
    UnmodelledTarget { word: "PIC12F1",     what: "an enhanced mid-range PIC, for which emu has no model", nearest: Some("pic16f628a") },
    UnmodelledTarget { word: "PIC12F6",     what: "a PIC12 for which emu has no model", nearest: Some("pic16f628a") },
    UnmodelledTarget { word: "PIC10F",      what: "a baseline PIC, for which emu has no model", nearest: Some("pic16f628a") },
    UnmodelledTarget { word: "PIC18F",      what: "a PIC18, for which emu has no model", nearest: Some("pic16f877a") },
    UnmodelledTarget { word: "ATMEGA2560",  what: "an AVR for which emu has no model", nearest: Some("atmega128") },
    UnmodelledTarget { word: "ATMEGA32U4",  what: "an AVR for which emu has no model", nearest: Some("atmega328p") },
    UnmodelledTarget { word: "AT90USB647",  what: "an AVR for which emu has no model", nearest: Some("atmega64") },
    UnmodelledTarget { word: "ATTINY",      what: "an ATtiny, for which emu has no model", nearest: Some("atmega48") },
    UnmodelledTarget { word: "STM32",       what: "an ARM, for which emu has no model", nearest: Some("atmega128") },
    UnmodelledTarget { word: "CONTROLLINO", what: "a controller that LDmicro serves by bytecode (`emu compile --emit bytecode`)", nearest: Some("atmega328p") },
    UnmodelledTarget { word: "BYTE CODE",   what: "a file format and no chip (`emu compile --emit bytecode` writes it)", nearest: None },
    UnmodelledTarget { word: "BYTECODE",    what: "a file format and no chip (`emu compile --emit bytecode` writes it)", nearest: None },
    UnmodelledTarget { word: "ANSI C",      what: "a file format and no chip (`emu compile --emit c` writes it)", nearest: None },
    UnmodelledTarget { word: "ARDUINO",     what: "a file format and no chip (`emu compile --emit arduino` writes it)", nearest: None },
    UnmodelledTarget { word: "PASCAL",      what: "a file format and no chip", nearest: None },
    UnmodelledTarget { word: "NETZER",      what: "a controller that LDmicro serves by bytecode (`emu compile --emit bytecode`)", nearest: None },
];

/// Returns the short name of a chip, such as `atmega328p`, for LDmicro's name, such as `Atmel AVR ATmega328
/// 28-PDIP`.
///
/// The chip's word may be anywhere in the name, in any case, and letters of a variant may follow it
/// (`ATmega328P`). Returns `None` for targets without a model ([`unmodelled_target`]) and for unknown names.
#[must_use]
pub fn chip_of(micro: &str) -> Option<&'static str> {
    if unmodelled_target(micro).is_some() {
        return None;
    }
    packages(micro).next().map(|package| package.chip)
}

/// Returns the row of a target of LDmicro's list that has no model; `None` for modelled chips and for unknown
/// names.
#[must_use]
pub fn unmodelled_target(micro: &str) -> Option<&'static UnmodelledTarget> {
    let name = micro.to_uppercase();
    UNMODELLED.iter().find(|target| name.contains(target.word))
}

/// Returns the port bit, such as `PD2` or `RB0`, at a pin of the package named in LDmicro's name of a chip.
///
/// Returns `None` if the chip or its package is unknown, or if the pin is not a port pin. Pins count from 1.
#[must_use]
pub fn package_pin(micro: &str, pin: u32) -> Option<&'static str> {
    package_pin_name(micro, pin).filter(|name| is_port_bit(name))
}

/// Returns what is at a pin of the package named in LDmicro's name of a chip: a port bit, or the name of a
/// supply, reset or clock pin such as `VCC`.
///
/// Returns `None` if the chip or its package is unknown, or if the package has fewer pins. Pins count from 1.
#[must_use]
pub fn package_pin_name(micro: &str, pin: u32) -> Option<&'static str> {
    let pins = find_package(micro)?.pins;
    pins.get(usize::try_from(pin.checked_sub(1)?).ok()?).copied()
}

/// Returns the pin, from 1, of a port bit such as `PD2` or `RB0` in the package named in LDmicro's name of a
/// chip.
///
/// Returns `None` if the chip or its package is unknown, or if the package has no such pin.
#[must_use]
pub fn pin_of_port_bit(micro: &str, name: &str) -> Option<u32> {
    let pins = find_package(micro).filter(|_| is_port_bit(name))?.pins;
    (1u32..).zip(pins).find_map(|(number, at)| (*at == name).then_some(number))
}

/// Returns the number of pins of the package named in LDmicro's name of a chip, or `None` if
/// [`package_pin_name`] does not know it.
#[must_use]
pub fn package_pin_count(micro: &str) -> Option<usize> {
    find_package(micro).map(|package| package.pins.len())
}

/// Returns true for names such as `PD2` and `RB0`.
fn is_port_bit(name: &str) -> bool {
    matches!(name.as_bytes(), [b'P' | b'R', b'A'..=b'G', b'0'..=b'7'])
}

/// The packages of the chip in LDmicro's name.
fn packages(micro: &str) -> impl Iterator<Item = &'static ChipPackage> {
    let name = micro.to_uppercase();
    PACKAGES.iter().filter(move |package| names_chip(&name, package.word))
}

/// The package in LDmicro's name; the first of the chip if the name states no number of pins (`32-TQFP`,
/// `32-Pin packages`).
fn find_package(micro: &str) -> Option<&'static ChipPackage> {
    let stated = |word: &str| word.split_once('-')?.0.parse::<usize>().ok();
    let counts: Vec<usize> = micro.split_whitespace().filter_map(stated).collect();
    packages(micro).find(|package| counts.iter().all(|count| *count == package.pins.len()))
}

/// Returns true if a word of the chip is in `name` and no digit follows it: `ATMEGA16` does not match
/// `ATMEGA162`.
fn names_chip(name: &str, word: &str) -> bool {
    name.match_indices(word)
        .any(|(at, word)| !name.get(at + word.len()..).unwrap_or("").starts_with(|c: char| c.is_ascii_digit()))
}
