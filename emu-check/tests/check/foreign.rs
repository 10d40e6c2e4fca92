//! Foreign images: our own images without their map must agree, and hand-written ones in the style of other
//! compilers must be judged correctly.

use crate::common;
use emu_check::{CheckOptions, ForeignImage, ForeignReport, check_foreign};
use emu_core::image::{Image, load_hex};
use ladder::LadderProgram;
use ladder_compile::PinAssignment;

/// Checks an image of our own compiler as a foreign image; its pins are given like on the command line.
fn check_own_image(program: &LadderProgram, mcu: &str, with_map: bool, scans: u64) -> Option<ForeignReport> {
    check_image_against(program, program, mcu, with_map, scans)
}

/// Checks the image of a program against another program in the same way.
fn check_image_against(
    compiled: &LadderProgram,
    program: &LadderProgram,
    mcu: &str,
    with_map: bool,
    scans: u64,
) -> Option<ForeignReport> {
    let compiled = ladder_compile::compile(
        compiled,
        &ladder_compile::CompileOptions { mcu: mcu.to_owned(), ..ladder_compile::CompileOptions::default() },
    )
    .ok()?;
    let chip = ladder_compile::find_chip(mcu)?;
    let image = load_hex("own.hex", compiled.hex.as_bytes(), chip.hex_spaces).expect("an image").image;
    let mut pins: Vec<_> = compiled.map.pins.iter().map(|pin| PinAssignment::new(&pin.name, &pin.pin)).collect();
    pins.extend(compiled.map.specials.iter().filter_map(|special| match special {
        ladder_compile::SpecialPin::Analog { pin, name } => Some(PinAssignment::new(name, pin)),
        _ => None,
    }));
    let options = CheckOptions { mcu: mcu.to_owned(), pins, ..CheckOptions::default() };
    let foreign = ForeignImage {
        file: "own.hex",
        image: &image,
        map: with_map.then_some(("own.json", &compiled.map)),
        scans: Some(scans),
    };
    let report = check_foreign(program, &foreign, &options, &mut |_, _| {});
    Some(report.unwrap_or_else(|faults| panic!("{} on {mcu}: {faults:?}", program.file)))
}

#[test]
fn own_images_agree() {
    let mut checked = 0;
    for path in common::folder("../examples").into_iter().chain(common::folder("tests/programs")) {
        let program = common::read(&path);
        for (mcu, with_map) in [("atmega328p", true), ("atmega8", false), ("at89s52", false), ("pic16f877", false)] {
            let Some(report) = check_own_image(&program, mcu, with_map, 400) else { continue };
            assert!(report.agreed, "{}", report.text());
            assert!(report.compared >= report.scans, "{}", report.text());
            checked += 1;
        }
    }
    assert!(checked >= 24, "{checked}");
}

/// A program whose output depends on a byte of a device on a bus.
fn bus_program(write: &str, read: &str) -> LadderProgram {
    let text = format!(
        "LDmicro0.2\nCYCLE=10000\nCRYSTAL=4000000\nPROGRAM\nRUNG\n ADD n n 1\nEND\nRUNG\n CONTACTS Xa 0\n {write}\nEND\n\
         RUNG\n CONTACTS Xa 0\n {read}\nEND\nRUNG\n GRT r 100\n COIL Yb 0 0 0\nEND\n"
    );
    common::parse("bus.ld", &text)
}

#[test]
fn transfers_on_buses_are_judged_from_the_pins() {
    let spi = "SPI b n r Master 0b00 8 MSB_FIRST 100000";
    for (write, read, another) in [
        ("I2C_WR b n - Master 32 5 MSB 0", "I2C_RD b - r Master 32 5 MSB 0", "I2C_WR b n - Master 32 6 MSB 0"),
        (spi, spi, "SPI b 7 r Master 0b00 8 MSB_FIRST 100000"),
    ] {
        for mcu in ["atmega328p", "pic16f877"] {
            let (program, other) = (bus_program(write, read), bus_program(another, read));
            let report = check_own_image(&program, mcu, false, 300).expect("an image");
            assert!(report.agreed && report.left_out.is_empty(), "{}", report.text());
            let report = check_image_against(&other, &program, mcu, false, 300).expect("an image");
            assert!(report.text().contains("a bus [EC"), "{}", report.text());
        }
    }
}

#[test]
fn peripherals_of_own_images_agree() {
    let text = "LDmicro0.1\nCYCLE=10000\nCRYSTAL=4000000\nBAUD=2400\nIO LIST\nEND\nPROGRAM\n\
        RUNG\n CONTACTS Xgo 0\n FORMATTED_STRING n 5 92 51 44 65 66\nEND\n\
        RUNG\n CONTACTS Xup 0\n OSR\n ADD n n 1\nEND\nRUNG\n UART_RECV b\n MOVE n b\nEND\n\
        RUNG\n READ_ADC Av\nEND\nRUNG\n GRT Av 512\n COIL Yhot 0 0 0\nEND\n\
        RUNG\n DIV duty Av 11\nEND\nRUNG\n SET_PWM duty 1000\nEND\nRUNG\n PERSIST n\nEND\n";
    let program = common::parse("parts.ld", text);
    for mcu in ["atmega16", "pic16f877"] {
        let report = check_own_image(&program, mcu, false, 1_200).expect("an image");
        assert!(report.agreed, "{}", report.text());
    }
}

/// An AVR program in the style of other compilers: contacts read the pin, coils write the port directly;
/// `top` is OCR1A.
fn avr_in_foreign_style(top: u32, setup: &str, scan: &str) -> String {
    format!(
        "ldi r16, 0x04\nout 0x3e, r16\nldi r16, 0x5f\nout 0x3d, r16\n{setup}\nldi r16, {hi}\nsts 0x89, r16\nldi r16, {lo}\n\
         sts 0x88, r16\nldi r16, 0x09\nsts 0x81, r16\nclr r10\n\
         wait:\nsbis 0x16, 1\nrjmp wait\nldi r16, 2\nout 0x16, r16\n{scan}\nrjmp wait\n",
        hi = top >> 8,
        lo = top & 0xff
    )
}

const LIFT: &str = "RUNG\n CONTACTS Xa 0\n COIL Ya 0 0 0\nEND";
const GOOD_SETUP: &str = "sbi 0x04, 5\nsbi 0x0b, 2";
const GOOD_SCAN: &str = "sbic 0x09, 2\nsbi 0x05, 5\nsbis 0x09, 2\ncbi 0x05, 5";

fn assembled(mcu: &str, source: &str) -> Image {
    emu_asm::assemble_text(ladder_compile::find_chip(mcu).expect("a chip"), source)
        .unwrap_or_else(|why| panic!("{why}"))
}

/// A PIC16 program at 4 MHz in the same style: `top` is CCPR1, and timer 1 restarts at each match.
fn pic16_in_foreign_style(top: u32, setup: &str, scan: &str) -> String {
    format!(
        "bsf 0x03, 5\nmovlw 0x06\nmovwf 0x1f\nbcf 0x03, 5\n{setup}\nmovlw 0x{hi:x}\nmovwf 0x16\nmovlw 0x{lo:x}\nmovwf 0x15\n\
         movlw 0x0b\nmovwf 0x17\nclrf 0x0f\nclrf 0x0e\nclrf 0x20\nmovlw 0x01\nmovwf 0x10\n\
         wait:\nclrwdt\nbtfss 0x0c, 2\ngoto wait\nbcf 0x0c, 2\n{scan}\ngoto wait\n",
        hi = top >> 8,
        lo = top & 0xff
    )
}

/// An 8052 program at 12 MHz in the same style: timer 2 counts `count` machine cycles and reloads itself.
fn mcs51_in_foreign_style(count: u32, setup: &str, scan: &str) -> String {
    let from = 0x1_0000 - count;
    format!(
        "{setup}\nmov 0xcb, #{hi}\nmov 0xca, #{lo}\nmov 0xcd, #{hi}\nmov 0xcc, #{lo}\nmov 0x20, #0\nsetb 0xca\n\
         wait:\njnb 0xcf, wait\nclr 0xcf\n{scan}\nsjmp wait\n",
        hi = from >> 8,
        lo = from & 0xff
    )
}

/// Enables the pull-ups of port B, and makes RB5 an output.
const PIC_SETUP: &str = "bcf 0x06, 5\nbsf 0x03, 5\nbcf 0x06, 5\nbcf 0x01, 7\nbcf 0x03, 5";
const PIC_SCAN: &str = "btfsc 0x06, 2\nbsf 0x06, 5\nbtfss 0x06, 2\nbcf 0x06, 5";
const MCS51_SCAN: &str = "mov c, 0x92\nmov 0x95, c";

/// A program with these rungs and a cycle of 1 ms at `hz`.
fn with_head(file: &str, hz: u32, rungs: &str) -> LadderProgram {
    let head = format!("LDmicro0.1\nCYCLE=1000\nCRYSTAL={hz}\nBAUD=2400\nIO LIST\nEND\nPROGRAM");
    common::parse(file, &format!("{head}\n{rungs}\n"))
}

/// The codes of findings and difference for the image of `source`, with the report.
fn codes(
    program: &LadderProgram,
    mcu: &str,
    source: &str,
    pins: [(&str, &str); 2],
) -> (Vec<&'static str>, ForeignReport) {
    let image = assembled(mcu, source);
    let pins = pins.map(|(symbol, pin)| PinAssignment::new(symbol, pin)).to_vec();
    let options = CheckOptions { mcu: mcu.to_owned(), pins, ..CheckOptions::default() };
    let foreign = ForeignImage { file: "theirs.hex", image: &image, map: None, scans: Some(600) };
    let report = check_foreign(program, &foreign, &options, &mut |_, _| {})
        .unwrap_or_else(|faults| panic!("{mcu}: {faults:?}\n{source}"));
    let mut codes: Vec<&str> = report.findings.iter().map(|finding| finding.code).collect();
    codes.extend(report.difference.iter().map(|difference| difference.code));
    (codes, report)
}

/// Rows are `image | codes`. The period is 1 ms: 1,000 machine cycles on each chip at its clock here.
#[test]
fn images_of_others_are_judged() {
    let avr_late = "in r11, 0x09\nsbrc r10, 2\nsbi 0x05, 5\nsbrs r10, 2\ncbi 0x05, 5\nmov r10, r11";
    let avr_inverted = GOOD_SCAN.replace("sbic", "nop\nsbis").replacen("sbis 0x09, 2\ncbi", "sbic 0x09, 2\ncbi", 1);
    let pic_late = "btfsc 0x20, 2\nbsf 0x06, 5\nbtfss 0x20, 2\nbcf 0x06, 5\nmovf 0x06, 0\nmovwf 0x20";
    let pic_glitch = format!("bsf 0x06, 5\n{}\nnop\nbcf 0x06, 5", PIC_SETUP.trim_start_matches("bcf 0x06, 5\n"));
    let pic_inverted = "btfss 0x06, 2\nbsf 0x06, 5\nbtfsc 0x06, 2\nbcf 0x06, 5";
    let mcs51_late = "mov c, 0x00\nmov 0x95, c\nmov c, 0x92\nmov 0x00, c";
    let (avr, pic, mcs51) = ("atmega328p", "pic16f873", "at89s52");
    let cases: [(&str, &str, String, &[&str]); 18] = [
        ("as it should be", avr, avr_in_foreign_style(999, GOOD_SETUP, GOOD_SCAN), &[]),
        ("a tick short", avr, avr_in_foreign_style(998, GOOD_SETUP, GOOD_SCAN), &["EC053"]),
        ("a tick long", avr, avr_in_foreign_style(1000, GOOD_SETUP, GOOD_SCAN), &["EC053"]),
        ("no pull-up", avr, avr_in_foreign_style(999, "sbi 0x04, 5", GOOD_SCAN), &["EC054"]),
        (
            "a glitch",
            avr,
            avr_in_foreign_style(999, "sbi 0x0b, 2\nsbi 0x05, 5\nsbi 0x04, 5\nnop\ncbi 0x05, 5", GOOD_SCAN),
            &["EC055"],
        ),
        ("inverted", avr, avr_in_foreign_style(999, GOOD_SETUP, &avr_inverted), &["EC011"]),
        ("a scan late", avr, avr_in_foreign_style(999, GOOD_SETUP, avr_late), &["EC011"]),
        ("as it should be", pic, pic16_in_foreign_style(999, PIC_SETUP, PIC_SCAN), &[]),
        ("a tick short", pic, pic16_in_foreign_style(998, PIC_SETUP, PIC_SCAN), &["EC053"]),
        ("a tick long", pic, pic16_in_foreign_style(1000, PIC_SETUP, PIC_SCAN), &["EC053"]),
        ("a glitch", pic, pic16_in_foreign_style(999, &pic_glitch, PIC_SCAN), &["EC055"]),
        ("inverted", pic, pic16_in_foreign_style(999, PIC_SETUP, pic_inverted), &["EC011"]),
        ("a scan late", pic, pic16_in_foreign_style(999, PIC_SETUP, pic_late), &["EC011"]),
        ("as it should be", mcs51, mcs51_in_foreign_style(1000, "clr 0x95", MCS51_SCAN), &[]),
        ("a tick short", mcs51, mcs51_in_foreign_style(999, "clr 0x95", MCS51_SCAN), &["EC053"]),
        ("a tick long", mcs51, mcs51_in_foreign_style(1001, "clr 0x95", MCS51_SCAN), &["EC053"]),
        ("inverted", mcs51, mcs51_in_foreign_style(1000, "clr 0x95", "mov c, 0x92\ncpl c\nmov 0x95, c"), &["EC011"]),
        ("a scan late", mcs51, mcs51_in_foreign_style(1000, "clr 0x95", mcs51_late), &["EC011"]),
    ];
    for (what, mcu, source, wanted) in cases {
        let (hz, pins) = match mcu {
            "pic16f873" => (4_000_000, [("Xa", "RB2"), ("Ya", "RB5")]),
            "at89s52" => (12_000_000, [("Xa", "P1.2"), ("Ya", "P1.5")]),
            _ => (1_000_000, [("Xa", "PD2"), ("Ya", "PB5")]),
        };
        let (codes, report) = codes(&with_head("lift.ld", hz, LIFT), mcu, &source, pins);
        assert_eq!(codes, wanted, "{what} on {mcu}: {}", report.text());
        if let Some(period) = report.period.filter(|_| what == "a tick short") {
            assert!((period.mean_clocks * 1000.0 / f64::from(hz) - 0.999).abs() < 0.0001, "{mcu}: {period:?}");
        }
    }
}

/// Known faults of LDmicro 2.3 (facts/ladder.md, L1 and L3): a look-up that uses the value it has just
/// written as an index, and a string at power-up.
#[test]
fn known_faults_of_others_are_found() {
    let table = "RUNG\n MOVE n 3\nEND\nRUNG\n CONTACTS Xa 0\n MOVE n 0\nEND\n\
        RUNG\n LOOK_UP_TABLE n n 4 0 1 2 3 9\nEND\nRUNG\n EQU n 1\n COIL Ya 0 0 0\nEND";
    // r16 is n; each line tests for one index, so a written value may be taken as the index of a later line.
    let chained = |skip: &str| {
        let line =
            |index: u32, value: u32| format!("cpi r16, {index}\nbrne l{index}\nldi r16, {value}\n{skip}l{index}:\n");
        let lines = [(0, 1), (1, 2), (2, 3), (3, 9)].map(|(index, value)| line(index, value)).concat();
        format!(
            "ldi r16, 3\nsbic 0x09, 2\nldi r16, 0\n{lines}over:\ncpi r16, 1\nbreq on\ncbi 0x05, 5\nrjmp wait\non:\nsbi 0x05, 5"
        )
    };
    let sends = "RUNG\n MOVE c 65\nEND\nRUNG\n CONTACTS Xa 0\n OSR\n UART_SEND c\nEND\nRUNG\n CONTACTS Xa 0\n COIL Ya 0 0 0\nEND";
    // The baud rate is 1 MHz / 8 / (51 + 1) = 2,404 bits per second with U2X0.
    let uart = "ldi r16, 51\nsts 0xc4, r16\nldi r16, 2\nsts 0xc0, r16\nldi r16, 8\nsts 0xc1, r16";
    let edge = |early: &str| {
        let setup = format!("{GOOD_SETUP}\n{uart}\nclr r12\nldi r17, 65\n{early}");
        // r11 is the current Xa, r10 its value in the previous scan; r12 is set once a byte was sent, TXC0
        // once it is complete.
        let scan = "in r11, 0x09\nsbrs r11, 2\nrjmp no\nsbrc r10, 2\nrjmp no\nlds r18, 0xc0\nsbrs r12, 0\nrjmp send\n\
            sbrs r18, 6\nrjmp no\nsend:\nldi r18, 0x42\nsts 0xc0, r18\nsts 0xc6, r17\nmov r12, r17\nno:\nmov r10, r11";
        avr_in_foreign_style(999, &setup, &format!("{GOOD_SCAN}\n{scan}"))
    };
    let cases: [(&str, &str, String, &[&str]); 4] = [
        ("a look-up", table, avr_in_foreign_style(999, GOOD_SETUP, &chained("rjmp over\n")), &[]),
        ("a chained look-up", table, avr_in_foreign_style(999, GOOD_SETUP, &chained("")), &["EC011"]),
        ("a byte", sends, edge(""), &[]),
        ("a byte at power-up", sends, edge("sts 0xc6, r17"), &["EC056", "EC017"]),
    ];
    for (what, rungs, source, wanted) in cases {
        let (codes, report) =
            codes(&with_head("habit.ld", 1_000_000, rungs), "atmega328p", &source, [("Xa", "PD2"), ("Ya", "PB5")]);
        assert_eq!(codes, wanted, "{what}: {}", report.text());
    }
}

/// Rows are `image, chip, pins known | code of the refusal`.
#[test]
fn unusable_images_are_refused() {
    let program = common::rungs("lift.ld", LIFT);
    let cases = [
        ("nothing is cleared", "atmega328p", "wait: rjmp wait\n".to_owned(), true, "EC050"),
        ("twice as fast", "atmega328p", avr_in_foreign_style(499, GOOD_SETUP, GOOD_SCAN), true, "EC050"),
        ("no instruction", "atmega328p", ".word 0xffff\n".to_owned(), true, "EC050"),
        ("no pins", "atmega328p", avr_in_foreign_style(999, GOOD_SETUP, GOOD_SCAN), false, "EC051"),
    ];
    for (what, mcu, source, pinned, code) in cases {
        let image = assembled(mcu, &source);
        let pins = [("Xa", "PD2"), ("Ya", "PB5")].map(|(symbol, pin)| PinAssignment::new(symbol, pin));
        let pins = if pinned { pins.to_vec() } else { Vec::new() };
        let options = CheckOptions { mcu: mcu.to_owned(), pins, ..CheckOptions::default() };
        let foreign = ForeignImage { file: "theirs.hex", image: &image, map: None, scans: Some(50) };
        let faults = check_foreign(&program, &foreign, &options, &mut |_, _| {}).expect_err(what);
        assert!(faults.iter().any(|fault| fault.code == code), "{what}: {faults:?}");
    }
}

/// Rows are `fault | replacement`: each fault shows after a thousand scans or more, and a check with the
/// default number of scans finds it.
#[test]
fn slow_faults_are_found_by_default() {
    let text = "LDmicro0.1\nCYCLE=10000\nCRYSTAL=4000000\nIO LIST\nEND\nPROGRAM\n\
        RUNG\n CONTACTS Rbeat 1\n TON Tup 400000\n TOF Tdown 600000\n COIL Rbeat 0 0 0\nEND\n\
        RUNG\n CONTACTS Rbeat 0\n CTC Cday 14\nEND\n\
        RUNG\n GEQ Cday 9\n LES Cday 13\n COIL Ynight 0 0 0\nEND\nRUNG\n CONTACTS Xa 0\n COIL Ya 0 0 0\nEND\n";
    let program = common::parse("day.ld", text);
    let cases =
        [("CTC Cday 14", "CTC Cday 13"), ("GEQ Cday 9", "GEQ Cday 10"), ("LES Cday 13", "LES Cday 14"), ("", "")];
    for (right, wrong) in cases {
        let other = common::parse("day.ld", &text.replace(right, wrong));
        let wanted =
            ladder_compile::CompileOptions { mcu: "atmega128".to_owned(), ..ladder_compile::CompileOptions::default() };
        let compiled = ladder_compile::compile(&other, &wanted).expect("an image");
        let chip = ladder_compile::find_chip("atmega128").expect("a chip");
        let image = load_hex("own.hex", compiled.hex.as_bytes(), chip.hex_spaces).expect("an image").image;
        let pins = compiled.map.pins.iter().map(|pin| PinAssignment::new(&pin.name, &pin.pin)).collect();
        let options = CheckOptions { mcu: "atmega128".to_owned(), pins, ..CheckOptions::default() };
        let foreign = ForeignImage { file: "own.hex", image: &image, map: None, scans: None };
        let report = check_foreign(&program, &foreign, &options, &mut |_, _| {}).expect("a report");
        assert_eq!(report.agreed, right.is_empty(), "{wrong}: {}", report.text());
        assert!(report.difference.is_some() || report.scans >= 20_000, "{}", report.text());
    }
}
