//! Images of which nothing is known but the program and the chip: our own with the map thrown away must agree, hand-written ones
//! with the habits of other compilers must be judged rightly.

use crate::common;
use emu_check::{Foreign, ForeignReport, Options, check_foreign};
use emu_core::image::{Image, load_hex};
use ladder::Program;

/// Pins of the map as those of the command line.
fn own(program: &Program, mcu: &str, with_map: bool, scans: u64) -> Option<ForeignReport> {
    let compiled = ladder_compile::compile(
        program,
        &ladder_compile::Options { mcu: mcu.to_owned(), ..ladder_compile::Options::default() },
    )
    .ok()?;
    let chip = ladder_compile::chip(mcu)?;
    let image = load_hex("own.hex", compiled.hex.as_bytes(), chip.hex).expect("an image").image;
    let mut pins: Vec<_> = compiled.map.pins.iter().map(|pin| (pin.name.clone(), pin.pin.clone())).collect();
    pins.extend(compiled.map.specials.iter().filter_map(|special| match special {
        ladder_compile::Special::Analog { pin, name } => Some((name.clone(), pin.clone())),
        _ => None,
    }));
    let options = Options { mcu: mcu.to_owned(), scans, pins, ..Options::default() };
    let foreign = Foreign { file: "own.hex", image: &image, map: with_map.then_some(&compiled.map) };
    let report = check_foreign(program, &foreign, &options, &mut |_, _| {});
    Some(report.unwrap_or_else(|faults| panic!("{} on {mcu}: {faults:?}", program.file)))
}

#[test]
fn own_images_agree() {
    let mut checked = 0;
    for path in common::folder("../examples").into_iter().chain(common::folder("tests/programs")) {
        let program = common::read(&path);
        for (mcu, with_map) in [("atmega328p", true), ("atmega8", false), ("at89s52", false), ("pic16f877", false)] {
            let Some(report) = own(&program, mcu, with_map, 400) else { continue };
            assert!(report.agreed, "{}", report.text());
            assert!(report.compared >= report.scans, "{}", report.text());
            checked += 1;
        }
    }
    assert!(checked >= 24, "{checked}");
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
        let report = own(&program, mcu, false, 1_200).expect("an image");
        assert!(report.agreed, "{}", report.text());
    }
}

/// An AVR program in the manner of others: contacts read the pin, coils write the port at once, `top` is OCR1A.
fn manner(top: u32, setup: &str, scan: &str) -> String {
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
    emu_asm::image(ladder_compile::chip(mcu).expect("a chip"), source).unwrap_or_else(|why| panic!("{why}"))
}

/// `image | codes of findings and of the difference`. 1 ms at 1 MHz are 1,000 clocks.
#[test]
fn images_of_others_are_judged() {
    let program = common::rungs("lift.ld", LIFT);
    let late = "in r11, 0x09\nsbrc r10, 2\nsbi 0x05, 5\nsbrs r10, 2\ncbi 0x05, 5\nmov r10, r11";
    let cases: [(&str, String, &[&str]); 7] = [
        ("as it should be", manner(999, GOOD_SETUP, GOOD_SCAN), &[]),
        ("a tick short", manner(998, GOOD_SETUP, GOOD_SCAN), &["EC053"]),
        ("a tick long", manner(1000, GOOD_SETUP, GOOD_SCAN), &["EC053"]),
        ("no pull-up", manner(999, "sbi 0x04, 5", GOOD_SCAN), &["EC054"]),
        ("a glitch", manner(999, "sbi 0x0b, 2\nsbi 0x05, 5\nsbi 0x04, 5\nnop\ncbi 0x05, 5", GOOD_SCAN), &["EC055"]),
        (
            "inverted",
            manner(
                999,
                GOOD_SETUP,
                &GOOD_SCAN.replace("sbic", "nop\nsbis").replacen("sbis 0x09, 2\ncbi", "sbic 0x09, 2\ncbi", 1),
            ),
            &["EC011"],
        ),
        ("a scan late", manner(999, GOOD_SETUP, late), &["EC011"]),
    ];
    for (what, source, wanted) in cases {
        let image = assembled("atmega328p", &source);
        let pins = vec![("Xa".to_owned(), "PD2".to_owned()), ("Ya".to_owned(), "PB5".to_owned())];
        let options = Options { scans: 600, pins, ..Options::default() };
        let foreign = Foreign { file: "theirs.hex", image: &image, map: None };
        let report =
            check_foreign(&program, &foreign, &options, &mut |_, _| {}).unwrap_or_else(|e| panic!("{what}: {e:?}"));
        let mut codes: Vec<&str> = report.findings.iter().map(|finding| finding.code).collect();
        codes.extend(report.difference.iter().map(|difference| difference.code));
        assert_eq!(codes, wanted, "{what}: {}", report.text());
        if let Some(period) = report.period.filter(|_| what == "a tick short") {
            assert!((period.mean_clocks - 999.0).abs() < 0.06, "{period:?}");
        }
    }
}

/// `image, chip, pins known | code of the refusal`.
#[test]
fn unusable_images_are_refused() {
    let program = common::rungs("lift.ld", LIFT);
    let cases = [
        ("nothing is cleared", "atmega328p", "wait: rjmp wait\n".to_owned(), true, "EC050"),
        ("twice as fast", "atmega328p", manner(499, GOOD_SETUP, GOOD_SCAN), true, "EC050"),
        ("no instruction", "atmega328p", ".word 0xffff\n".to_owned(), true, "EC050"),
        ("no pins", "atmega328p", manner(999, GOOD_SETUP, GOOD_SCAN), false, "EC051"),
    ];
    for (what, mcu, source, pinned, code) in cases {
        let image = assembled(mcu, &source);
        let pins = [("Xa", "PD2"), ("Ya", "PB5")].map(|(name, pin)| (name.to_owned(), pin.to_owned()));
        let pins = if pinned { pins.to_vec() } else { Vec::new() };
        let options = Options { mcu: mcu.to_owned(), scans: 50, pins, ..Options::default() };
        let foreign = Foreign { file: "theirs.hex", image: &image, map: None };
        let faults = check_foreign(&program, &foreign, &options, &mut |_, _| {}).expect_err(what);
        assert!(faults.iter().any(|fault| fault.code == code), "{what}: {faults:?}");
    }
}
