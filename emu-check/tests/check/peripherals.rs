//! The serial line, A/D converter, PWM output, buses and EEPROM on every chip that has them, and images with
//! faults in them.

use crate::common;
use emu_check::{CheckOptions, CheckReport, DifferenceKind, check_compiled};
use ladder::LadderProgram;
use ladder_compile::{CHIPS, compile};

/// Number of scans of a check: enough to send a string and to write an EEPROM cell.
const SCANS: u64 = 120;

/// A program with a clock that fits common baud rates and that all chips support.
fn program(rungs: &str) -> LadderProgram {
    let release = if [" Master ", " Pa", " 2 1\n"].iter().any(|of| rungs.contains(of)) { "0.2" } else { "0.1" };
    let head = format!("LDmicro{release}\nCYCLE=10000\nCRYSTAL=3686400\nBAUD=2400\nIO LIST\nEND\nPROGRAM");
    common::parse("peripherals.ld", &format!("{head}\n{rungs}\n"))
}

/// Name and rungs. Each program is checked on every chip; a chip without the peripheral refuses it with LC
/// codes only.
const PROGRAMS: &[(&str, &str)] = &[
    (
        "echo",
        "
        RUNG\n UART_RECV c\n COIL Rgot 0 0 0\nEND
        RUNG\n CONTACTS Rgot 0\n ADD c c 1\nEND
        RUNG\n CONTACTS Rgot 0\n UART_SEND c\n COIL Ybusy 0 0 0\nEND",
    ),
    (
        "string",
        "
        RUNG\n CONTACTS Xgo 0\n FORMATTED_STRING v 9 118 61 92 45 52 92 114 92 110\n COIL Yon 0 0 0\nEND
        RUNG\n CONTACTS Xup 0\n OSR\n ADD v v 7\nEND",
    ),
    (
        "analog",
        "
        RUNG\n CONTACTS Xa 0\n READ_ADC Ain\nEND
        RUNG\n READ_ADC Aother\nEND
        RUNG\n GRT Ain 511\n COIL Yhalf 0 0 0\nEND",
    ),
    ("pwm", "RUNG\n CONTACTS Xa 0\n SET_PWM d 2000\nEND"),
    (
        "pwms",
        "
        RUNG\n ADD d d 9\nEND
        RUNG\n CONTACTS Xa 0\n SET_PWM d 1800 Pa 0-100\nEND
        RUNG\n CONTACTS Xb 0\n SET_PWM 30 1800 Pb\nEND
        RUNG\n CONTACTS Xb 1\n SET_PWM e 1800 Pb\nEND
        RUNG\n SUB e 90 d\nEND",
    ),
    ("held scan", "RUNG\n UART_RECV n 2 1\n COIL Ya 0 0 0\nEND\nRUNG\n CONTACTS Xa 0\n COIL Yb 0 0 0\nEND"),
    (
        "i2c",
        "
        RUNG\n CONTACTS Xa 0\n ADD n n 37\n I2C_WR b n - Master 0x20 5 MSB 100000\nEND
        RUNG\n CONTACTS Xb 0\n I2C_RD b - r Master 0x50 n MSB 400000\n COIL Ya 0 0 0\nEND",
    ),
    (
        "spi",
        "
        RUNG\n CONTACTS Xa 0\n ADD n n 37\n SPI b n r Master 0b00 8 MSB_FIRST 1000000\n COIL Ya 0 0 0\nEND
        RUNG\n CONTACTS Xb 0\n SPI_WR b Hello - Master 0b00 8 MSB_FIRST 0\nEND",
    ),
    (
        "persist",
        "
        RUNG\n CONTACTS Xa 0\n PERSIST p\nEND
        RUNG\n CONTACTS Xb 0\n OSR\n ADD p p 1\nEND
        RUNG\n PERSIST q\nEND",
    ),
    (
        "tables",
        "
        RUNG\n CONTACTS Xup 0\n SHIFT_REGISTER s 4\nEND
        RUNG\n CONTACTS Xup 0\n LOOK_UP_TABLE d s1 5 0 5 6 7 -8 1000\nEND
        RUNG\n LOOK_UP_TABLE i i 3 0 2 0 1\nEND
        RUNG\n PIECEWISE_LINEAR p v 4 -100 0 0 100 50 -300 32000 -299\nEND",
    ),
];

fn checked(rungs: &str, mcu: &str, scans: u64) -> Result<CheckReport, Vec<diag::Diagnostic>> {
    let options = CheckOptions { mcu: mcu.to_owned(), scans, ..CheckOptions::default() };
    emu_check::check(&program(rungs), &options, &mut |_, _| {})
}

#[test]
fn every_chip_that_has_the_part_agrees() {
    let mut agreed = Vec::new();
    for (name, rungs) in PROGRAMS {
        for chip in CHIPS.iter() {
            match checked(rungs, chip.name, SCANS) {
                Ok(report) => {
                    assert!(report.agreed, "{name}: {}", report.text());
                    agreed.push((*name, chip.name));
                }
                Err(faults) => {
                    println!("{name} on {}: {faults:?}", chip.name);
                    assert!(faults.iter().all(|fault| fault.code.starts_with("LC")), "{name}: {faults:?}");
                }
            }
        }
    }
    println!("{agreed:?}");
    // On chips with one CCP module, CCP1 generates the PWM output.
    for (name, mcu) in [("i2c", "pic16f873"), ("i2c", "atmega128"), ("spi", "pic16f877a"), ("spi", "atmega162")] {
        assert!(agreed.contains(&(name, mcu)), "{name} on {mcu} is refused");
    }
    for mcu in ["pic16f628", "pic16f628a", "pic16f88", "pic16f819"] {
        assert!(agreed.contains(&("pwm", mcu)), "pwm on {mcu} is refused");
    }
    for mcu in ["pic16f877", "atmega328p", "atmega644", "atmega16", "atmega128", "atmega162"] {
        assert!(agreed.contains(&("pwms", mcu)), "two PWM outputs on {mcu} are refused");
    }
    // A program that all chips refuse would not be tested.
    for (name, _) in PROGRAMS {
        assert!(agreed.iter().any(|(other, _)| other == name), "{name} runs on no chip");
    }
}

/// Rungs that are checked, rungs of the faulty image, and the kind of difference that must be found.
const FAULTS: &[(&str, &str, &str, DifferenceKind)] = &[
    (
        "another byte",
        "RUNG\n CONTACTS Xa 0\n UART_SEND v\n COIL Ya 0 0 0\nEND\nRUNG\n MOVE v 65\nEND",
        "RUNG\n CONTACTS Xa 0\n UART_SEND w\n COIL Ya 0 0 0\nEND\nRUNG\n MOVE v 65\nEND",
        DifferenceKind::Serial,
    ),
    (
        "another string",
        "RUNG\n CONTACTS Xgo 0\n FORMATTED_STRING (none) 2 118 61\nEND",
        "RUNG\n CONTACTS Xgo 0\n FORMATTED_STRING (none) 2 118 62\nEND",
        DifferenceKind::Serial,
    ),
    (
        "another byte on I2C",
        "RUNG\n CONTACTS Xa 0\n I2C_WR b 5 - Master 32 1 MSB 0\nEND",
        "RUNG\n CONTACTS Xa 0\n I2C_WR b 6 - Master 32 1 MSB 0\nEND",
        DifferenceKind::Bus,
    ),
    (
        "another register on I2C",
        "RUNG\n CONTACTS Xa 0\n I2C_RD b - r Master 32 1 MSB 0\nEND",
        "RUNG\n CONTACTS Xa 0\n I2C_RD b - r Master 32 2 MSB 0\nEND",
        DifferenceKind::Bus,
    ),
    (
        "no transfer on SPI",
        "RUNG\n CONTACTS Xa 0\n SPI b 5 - Master 0b00 8 MSB 0\nEND",
        "RUNG\n CONTACTS Xa 1\n SPI b 5 - Master 0b00 8 MSB 0\nEND",
        DifferenceKind::Bus,
    ),
    ("another frequency", "RUNG\n SET_PWM 50 2000\nEND", "RUNG\n SET_PWM 50 2300\nEND", DifferenceKind::Map),
    (
        "two outputs exchanged",
        "RUNG\n SET_PWM 20 1800 Pa\nEND\nRUNG\n SET_PWM 70 1800 Pb\nEND",
        "RUNG\n SET_PWM 70 1800 Pa\nEND\nRUNG\n SET_PWM 20 1800 Pb\nEND",
        DifferenceKind::Pwm,
    ),
    ("another duty", "RUNG\n SET_PWM 50 2000\nEND", "RUNG\n SET_PWM 52 2000\nEND", DifferenceKind::Pwm),
    ("no pulses", "RUNG\n SET_PWM 50 2000\nEND", "RUNG\n SET_PWM 0 2000\nEND", DifferenceKind::Pwm),
    (
        "a duty too early",
        "RUNG\n CONTACTS Xa 0\n SET_PWM 100 2000\nEND",
        "RUNG\n CONTACTS Xa 1\n SET_PWM 100 2000\nEND",
        DifferenceKind::Pwm,
    ),
];

/// The first chip that supports both programs.
fn first_chip(good: &LadderProgram, bad: &LadderProgram) -> Option<(&'static str, ladder_compile::CompiledProgram)> {
    CHIPS.iter().find_map(|chip| {
        let target = ladder_compile::CompileOptions { mcu: chip.name.to_owned(), ..Default::default() };
        compile(good, &target).ok()?;
        Some((chip.name, compile(bad, &target).ok()?))
    })
}

#[test]
fn wrong_images_are_found() {
    for (name, good, bad, what) in FAULTS {
        let (good, bad) = (program(good), program(bad));
        let (mcu, mut image) = first_chip(&good, &bad).unwrap_or_else(|| panic!("{name}: no chip"));
        // Symbols of the good program that the bad one lacks get any location of the same kind.
        for symbol in good.symbols() {
            if !image.map.symbols.iter().any(|s| s.name == symbol.name)
                && let Some(mut other) = image.map.symbols.iter().find(|s| s.kind == symbol.kind).cloned()
            {
                other.name = symbol.name;
                image.map.symbols.push(other);
            }
        }
        let options = CheckOptions { mcu: mcu.to_owned(), scans: 400, ..CheckOptions::default() };
        let report =
            check_compiled(&good, &image, &options, &mut |_, _| {}).unwrap_or_else(|f| panic!("{name}: {f:?}"));
        let difference = report.difference.as_ref().unwrap_or_else(|| panic!("{name}: {}", report.text()));
        assert_eq!(difference.what, *what, "{name}: {}", report.text());
        println!("{name}: {}", report.text());
    }
}

#[test]
fn a_rate_that_is_off_is_found() {
    let rungs = "RUNG\n CONTACTS Xa 0\n UART_SEND v\n COIL Ya 0 0 0\nEND";
    let good = program(rungs);
    let mut fast = good.clone();
    fast.settings.baud = Some(4_800);
    let (mcu, mut image) = first_chip(&good, &fast).expect("a chip with a serial line");
    // The map claims 2,400 bits per second; the serial line runs at another rate.
    for special in &mut image.map.specials {
        if let ladder_compile::SpecialPin::Transmit { baud, .. } | ladder_compile::SpecialPin::Receive { baud, .. } =
            special
        {
            *baud = 2_400;
        }
    }
    let options = CheckOptions { mcu: mcu.to_owned(), scans: 400, ..CheckOptions::default() };
    let report = check_compiled(&good, &image, &options, &mut |_, _| {}).expect("a report");
    assert_eq!(report.difference.as_ref().map(|d| d.what), Some(DifferenceKind::Serial), "{}", report.text());
}
