//! Target chips: their pins in order of assignment, and the fuses that an image needs.

use emu_avr::chips::AVR_CHIPS;
use emu_core::chip::Chip;

use super::build;
use crate::target::{CompileTarget, PwmPin};

/// Chips of the family that the compiler supports.
pub const TARGETS: &[CompileTarget] = &[
    target_x8("atmega328p"),
    target_x8("atmega328"),
    target_x8("atmega168"),
    target_x8("atmega88"),
    target_x8("atmega48"),
    // Timer 0 has no PWM, and timer 1 paces the scans.
    CompileTarget { pwm: &[PwmPin::new("PB3", 2, 0)], ..target_x8("atmega8") },
    target_mega16("atmega16"),
    target_mega16("atmega32"),
    CompileTarget { pwm: PWM_644, ..target_mega16("atmega164p") },
    CompileTarget { pwm: PWM_644, ..target_mega16("atmega324p") },
    CompileTarget { pwm: PWM_644, ..target_mega16("atmega644") },
    CompileTarget { pwm: PWM_644, ..target_mega16("atmega1284") },
    target_mega128("atmega64"),
    target_mega128("atmega128"),
    CompileTarget {
        pins: PINS_162,
        uart: Some(("PB3", "PB2")),
        pwm: &[PwmPin::new("PB1", 2, 0), PwmPin::new("PB0", 0, 0)],
        adc: &[],
        i2c: None,
        spi: SPI_40,
        ..target_x8("atmega162")
    },
];

/// Pins of the PWM outputs of timers 2 and 0; timer 1 paces the scans.
const PWM_X8: &[PwmPin] =
    &[PwmPin::new("PB3", 2, 0), PwmPin::new("PD6", 0, 0), PwmPin::new("PD3", 2, 1), PwmPin::new("PD5", 0, 1)];
const PWM_128: &[PwmPin] = &[PwmPin::new("PB7", 2, 0), PwmPin::new("PB4", 0, 0)];
const PWM_16: &[PwmPin] = &[PwmPin::new("PD7", 2, 0), PwmPin::new("PB3", 0, 0)];
const PWM_644: &[PwmPin] =
    &[PwmPin::new("PD7", 2, 0), PwmPin::new("PB3", 0, 0), PwmPin::new("PD6", 2, 1), PwmPin::new("PB4", 0, 1)];

/// PC6 is reset, PB6 and PB7 connect the crystal. PD0 and PD1 come last, because boards use them for the
/// serial line.
const fn target_x8(name: &str) -> CompileTarget {
    CompileTarget {
        pins: &[
            "PD2", "PD3", "PD4", "PD5", "PD6", "PD7", "PB0", "PB1", "PB2", "PB3", "PB4", "PB5", "PC0", "PC1", "PC2",
            "PC3", "PC4", "PC5", "PD0", "PD1",
        ],
        uart: Some(("PD1", "PD0")),
        pwm: PWM_X8,
        i2c: Some(("PC4", "PC5")),
        spi: Some(["PB2", "PB5", "PB3", "PB4"]),
        adc: &[("PC0", 0), ("PC1", 1), ("PC2", 2), ("PC3", 3), ("PC4", 4), ("PC5", 5)],
        chip: chip(name),
        eeprom: chip(name).eeprom_bytes,
        build,
    }
}

/// PC2 to PC5 belong to JTAG, so they are assigned late.
const fn target_mega16(name: &str) -> CompileTarget {
    CompileTarget {
        pins: &[
            "PB0", "PB1", "PB2", "PB3", "PB4", "PB5", "PB6", "PB7", "PD2", "PD3", "PD4", "PD5", "PD6", "PC0", "PC1",
            "PC6", "PC7", "PA0", "PA1", "PA2", "PA3", "PA4", "PA5", "PA6", "PA7", "PD7", "PC2", "PC3", "PC4", "PC5",
            "PD0", "PD1",
        ],
        pwm: PWM_16,
        i2c: Some(("PC1", "PC0")),
        spi: SPI_40,
        adc: &[("PA0", 0), ("PA1", 1), ("PA2", 2), ("PA3", 3), ("PA4", 4), ("PA5", 5), ("PA6", 6), ("PA7", 7)],
        ..target_x8(name)
    }
}

/// PF4 to PF7 belong to JTAG, PE0 and PE1 to the programmer, so they are assigned late.
const fn target_mega128(name: &str) -> CompileTarget {
    CompileTarget {
        pins: &[
            "PA0", "PA1", "PA2", "PA3", "PA4", "PA5", "PA6", "PA7", "PC0", "PC1", "PC2", "PC3", "PC4", "PC5", "PC6",
            "PC7", "PB0", "PB1", "PB2", "PB3", "PB4", "PB5", "PB6", "PD0", "PD1", "PD4", "PD5", "PD6", "PD7", "PE2",
            "PE3", "PE4", "PE5", "PE6", "PE7", "PG0", "PG1", "PG2", "PG3", "PG4", "PF0", "PF1", "PF2", "PF3", "PB7",
            "PF4", "PF5", "PF6", "PF7", "PE0", "PE1", "PD2", "PD3",
        ],
        uart: Some(("PD3", "PD2")),
        pwm: PWM_128,
        i2c: Some(("PD1", "PD0")),
        spi: Some(["PB0", "PB1", "PB2", "PB3"]),
        adc: &[("PF0", 0), ("PF1", 1), ("PF2", 2), ("PF3", 3), ("PF4", 4), ("PF5", 5), ("PF6", 6), ("PF7", 7)],
        ..target_x8(name)
    }
}

/// PC4 to PC7 belong to JTAG, PB2 and PB3 to the second serial line, so they are assigned last.
const PINS_162: &[&str] = &[
    "PA0", "PA1", "PA2", "PA3", "PA4", "PA5", "PA6", "PA7", "PB0", "PB4", "PB5", "PB6", "PB7", "PD0", "PD1", "PD2",
    "PD3", "PD4", "PD5", "PD6", "PD7", "PC0", "PC1", "PC2", "PC3", "PE0", "PE1", "PE2", "PB1", "PC4", "PC5", "PC6",
    "PC7", "PB2", "PB3",
];

/// Pins of the SPI bus of the chips with 40 pins.
const SPI_40: Option<[&str; 4]> = Some(["PB4", "PB7", "PB5", "PB6"]);

/// The chip with this name.
const fn chip(name: &str) -> &'static Chip {
    let mut n = 0;
    while n < AVR_CHIPS.len() {
        if equal_bytes(AVR_CHIPS[n].name.as_bytes(), name.as_bytes()) {
            return AVR_CHIPS[n];
        }
        n += 1;
    }
    panic!("no such chip")
}

const fn equal_bytes(a: &[u8], b: &[u8]) -> bool {
    let mut n = 0;
    while n < a.len() && n < b.len() && a[n] == b[n] {
        n += 1;
    }
    n == a.len() && n == b.len()
}

/// Fuse settings that an image needs for a crystal of this frequency in Hz ("Clock sources" and "Fuse bits"
/// of the chip's data sheet).
#[must_use]
pub fn fuse_requirements(chip: &Chip, clock_hz: u64) -> Vec<String> {
    let has = |name: &str| (chip.constants)().iter().any(|known| known.name == name);
    let select = match (has("FUSE_CKOPT"), clock_hz) {
        (true, 0..400_000) => "CKSEL = 1001, for a watch crystal; CKSEL = 0000 for a clock from outside",
        (true, 400_000..900_000) => "CKOPT = 1, CKSEL3..1 = 101",
        (true, 900_000..3_000_000) => "CKOPT = 1, CKSEL3..1 = 110",
        (true, 3_000_000..=8_000_000) => "CKOPT = 1, CKSEL3..1 = 111",
        (true, _) => "CKOPT = 0, CKSEL3..1 = 111",
        (false, 0..400_000) => "CKSEL = 0100, for a watch crystal; CKSEL = 0000 for a clock from outside",
        (false, 400_000..900_000) => "CKSEL3..1 = 100",
        (false, 900_000..3_000_000) => "CKSEL3..1 = 101",
        (false, 3_000_000..8_000_000) => "CKSEL3..1 = 110",
        (false, 8_000_000..=16_000_000) => "CKSEL3..1 = 111",
        (false, _) => "CKSEL3..1 = 011, full swing",
    };
    let mut fuses = vec![format!("clock: crystal of {clock_hz} Hz at XTAL1 and XTAL2 ({select})")];
    let lines = [
        ("FUSE_CKDIV8", "CKDIV8 = 1: the clock is not divided"),
        ("FUSE_WDTON", "WDTON = 1: the watchdog is off"),
        ("FUSE_BOOTRST", "BOOTRST = 1: reset starts at address 0"),
        ("FUSE_M103C", "M103C = 1: no compatibility with the ATmega103"),
        ("FUSE_M161C", "M161C = 1: no compatibility with the ATmega161"),
    ];
    fuses.extend(lines.into_iter().filter(|(fuse, _)| has(fuse)).map(|(_, line)| line.to_owned()));
    fuses
}
