//! Target chips of this back end, with their pins in order of assignment.
//!
//! Pins with a second function that programs use come last, and after them RA4, which is an open drain on
//! most chips.

use emu_pic16::chips::{PIC16_PARTS, Pic16Part};

use crate::target::{CompileTarget, PwmPin};

const PINS_18: &[&str] = &["RB0", "RB3", "RB4", "RB5", "RB6", "RB7", "RB1", "RB2", "RA0", "RA1", "RA2", "RA3", "RA4"];
const PINS_28: &[&str] = &[
    "RB0", "RB1", "RB2", "RB3", "RB4", "RB5", "RB6", "RB7", "RC0", "RC2", "RC3", "RC4", "RC5", "RC1", "RC6", "RC7",
    "RA0", "RA1", "RA2", "RA3", "RA5", "RA4",
];
const PINS_40: &[&str] = &[
    "RB0", "RB1", "RB2", "RB3", "RB4", "RB5", "RB6", "RB7", "RD0", "RD1", "RD2", "RD3", "RD4", "RD5", "RD6", "RD7",
    "RC0", "RC2", "RC3", "RC4", "RC5", "RC1", "RC6", "RC7", "RA0", "RA1", "RA2", "RA3", "RA5", "RE0", "RE1", "RE2",
    "RA4",
];
const ADC_28: &[(&str, u8)] = &[("RA0", 0), ("RA1", 1), ("RA2", 2), ("RA3", 3), ("RA5", 4)];
const ADC_40: &[(&str, u8)] =
    &[("RA0", 0), ("RA1", 1), ("RA2", 2), ("RA3", 3), ("RA5", 4), ("RE0", 5), ("RE1", 6), ("RE2", 7)];
const ADC_819: &[(&str, u8)] = &[("RA0", 0), ("RA1", 1), ("RA2", 2), ("RA3", 3), ("RA4", 4)];
const ADC_88: &[(&str, u8)] = &[("RA0", 0), ("RA1", 1), ("RA2", 2), ("RA3", 3), ("RA4", 4), ("RB6", 5), ("RB7", 6)];

const fn equal_names(a: &str, b: &str) -> bool {
    let (a, b) = (a.as_bytes(), b.as_bytes());
    let mut n = 0;
    while n < a.len() && n < b.len() && a[n] == b[n] {
        n += 1;
    }
    n == a.len() && n == b.len()
}

/// Description of a chip; an unknown name is a compile-time error.
const fn chip_part(name: &str) -> &'static Pic16Part {
    let mut n = 0;
    while !equal_names(PIC16_PARTS[n].chip.name, name) {
        n += 1;
    }
    &PIC16_PARTS[n]
}

const PWM_18: &[PwmPin] = &[PwmPin::new("RB3", 2, 1)];

/// Both CCP modules have timer 2. CCP1 paces the scan where it is free, so CCP2 comes first.
const PWM_28: &[PwmPin] = &[PwmPin::new("RC1", 2, 2), PwmPin::new("RC2", 2, 1)];

const fn target(name: &str) -> CompileTarget {
    let part = chip_part(name);
    CompileTarget {
        chip: &part.chip,
        pins: PINS_28,
        uart: Some(("RC6", "RC7")),
        pwm: PWM_28,
        i2c: Some(("RC4", "RC3")),
        spi: Some(["RC2", "RC3", "RC5", "RC4"]),
        adc: ADC_28,
        eeprom: part.chip.eeprom_bytes,
        build: super::build,
    }
}

const fn target40(name: &str) -> CompileTarget {
    CompileTarget { pins: PINS_40, adc: ADC_40, ..target(name) }
}

const fn target18(name: &str) -> CompileTarget {
    CompileTarget {
        pins: PINS_18,
        uart: Some(("RB2", "RB1")),
        pwm: PWM_18,
        i2c: None,
        spi: None,
        adc: &[],
        ..target(name)
    }
}

/// Chips of this back end.
pub const TARGETS: &[CompileTarget] = &[
    target("pic16f873"),
    target("pic16f873a"),
    target40("pic16f874"),
    target40("pic16f874a"),
    target("pic16f876"),
    target("pic16f876a"),
    target40("pic16f877"),
    target40("pic16f877a"),
    target18("pic16f628"),
    target18("pic16f628a"),
    CompileTarget { uart: Some(("RB5", "RB2")), pwm: &[PwmPin::new("RB0", 2, 1)], adc: ADC_88, ..target18("pic16f88") },
    CompileTarget { uart: None, pwm: &[PwmPin::new("RB2", 2, 1)], adc: ADC_819, ..target18("pic16f819") },
];
