//! Waits that are more than a poll: a loop in the wait, the poll in a function, a delay after the scan. Scans
//! are found in all of them, correct images agree, and planted faults are found.

use crate::common;
use emu_check::{CheckOptions, ForeignImage, check_foreign};
use ladder_compile::PinAssignment;

/// How the main loop of a program waits.
#[derive(Debug, Clone, Copy)]
enum WaitStyle {
    /// A short loop between two polls.
    LoopInside,
    /// A delay of a quarter of the period between two polls.
    DelayInside,
    /// The poll is in a function that returns whether it saw the flag.
    Function,
    /// A bare poll, and a delay of most of the period after the scan.
    DelayBehind,
}

/// Scans of 1 ms until a timer of 5 ms expires.
const LIMIT: u32 = 5;

const WAYS: [WaitStyle; 4] =
    [WaitStyle::LoopInside, WaitStyle::DelayInside, WaitStyle::Function, WaitStyle::DelayBehind];

/// A chip, its clock in Hz, and the pins of input and output.
type ChipPins = (&'static str, u32, [(&'static str, &'static str); 2]);

const PLACES: [ChipPins; 3] = [
    ("atmega328p", 1_000_000, [("Xa", "PD2"), ("Ya", "PB5")]),
    ("at89s52", 12_000_000, [("Xa", "P1.2"), ("Ya", "P1.5")]),
    ("pic16f873", 4_000_000, [("Xa", "RB2"), ("Ya", "RB5")]),
];

/// A program for an ATmega328P at 1 MHz; timer 1 matches every `count` cycles.
fn avr_source(way: WaitStyle, count: u32, scan: &str) -> String {
    let top = count - 1;
    let main = match way {
        WaitStyle::LoopInside => {
            "w:\nsbic 0x16, 1\nrjmp go\nldi r20, 10\nd:\ndec r20\nbrne d\nwdr\nrjmp w\ngo:\nldi r16, 2\nout 0x16, r16\nSCAN\nrjmp w\n"
        }
        WaitStyle::DelayInside => {
            "w:\nsbic 0x16, 1\nrjmp go\nldi r20, 83\nd:\ndec r20\nbrne d\nrjmp w\ngo:\nldi r16, 2\nout 0x16, r16\nSCAN\nrjmp w\n"
        }
        WaitStyle::Function => {
            "w:\nrcall due\ntst r24\nbreq w\nSCAN\nrjmp w\n\
             due:\nsbis 0x16, 1\nrjmp not\nldi r24, 2\nout 0x16, r24\nret\nnot:\nldi r24, 0\nret\n"
        }
        WaitStyle::DelayBehind => {
            "w:\nsbis 0x16, 1\nrjmp w\nldi r16, 2\nout 0x16, r16\nSCAN\nldi r20, 230\nd:\nnop\ndec r20\nbrne d\nrjmp w\n"
        }
    };
    format!(
        "ldi r16, 0x04\nout 0x3e, r16\nldi r16, 0x5f\nout 0x3d, r16\nsbi 0x04, 5\nsbi 0x0b, 2\nldi r16, {hi}\nsts 0x89, r16\n\
         ldi r16, {lo}\nsts 0x88, r16\nldi r16, 0x09\nsts 0x81, r16\nldi r21, 0\n{main}",
        hi = top >> 8,
        lo = top & 0xff,
        main = main.replace("SCAN", scan)
    )
}

/// A program for an AT89S52 at 12 MHz; timer 2 overflows every `count` machine cycles.
fn mcs51_source(way: WaitStyle, count: u32, scan: &str) -> String {
    let from = 0x1_0000 - count;
    let main = match way {
        WaitStyle::LoopInside => "w: jb 0xcf, go\nmov r2, #10\nd: djnz r2, d\nsjmp w\ngo: clr 0xcf\nSCAN\nsjmp w\n",
        WaitStyle::DelayInside => "w: jb 0xcf, go\nmov r2, #120\nd: djnz r2, d\nsjmp w\ngo: clr 0xcf\nSCAN\nsjmp w\n",
        WaitStyle::Function => {
            "w: lcall due\njnc w\nSCAN\nsjmp w\ndue: jbc 0xcf, seen\nclr c\nret\nseen: setb c\nret\n"
        }
        WaitStyle::DelayBehind => {
            "w: jnb 0xcf, w\nclr 0xcf\nSCAN\nmov r3, #2\ne: mov r2, #230\nd: djnz r2, d\ndjnz r3, e\nsjmp w\n"
        }
    };
    format!(
        "clr 0x95\nmov 0xcb, #{hi}\nmov 0xca, #{lo}\nmov 0xcd, #{hi}\nmov 0xcc, #{lo}\nmov 0x30, #0\nsetb 0xca\n{main}",
        hi = from >> 8,
        lo = from & 0xff,
        main = main.replace("SCAN", scan)
    )
}

/// A program for a PIC16F873 at 4 MHz; timer 1 restarts every `count` machine cycles.
fn pic16_source(way: WaitStyle, count: u32, scan: &str) -> String {
    let top = count - 1;
    let main = match way {
        WaitStyle::LoopInside => {
            "w: btfsc 0x0c, 2\ngoto go\nmovlw 10\nmovwf 0x21\nd: decfsz 0x21, f\ngoto d\nclrwdt\ngoto w\ngo: bcf 0x0c, 2\nSCAN\ngoto w\n"
        }
        WaitStyle::DelayInside => {
            "w: btfsc 0x0c, 2\ngoto go\nmovlw 0x53\nmovwf 0x21\nd: decfsz 0x21, f\ngoto d\nclrwdt\ngoto w\ngo: bcf 0x0c, 2\nSCAN\ngoto w\n"
        }
        WaitStyle::Function => {
            "w: clrwdt\ncall due\nandlw 1\nbtfsc 3, 2\ngoto w\nSCAN\ngoto w\n\
             due: btfss 0x0c, 2\nretlw 0\nbcf 0x0c, 2\nretlw 1\n"
        }
        WaitStyle::DelayBehind => {
            "w: clrwdt\nbtfss 0x0c, 2\ngoto w\nbcf 0x0c, 2\nSCAN\nmovlw 0xe6\nmovwf 0x21\nd: nop\ndecfsz 0x21, f\ngoto d\ngoto w\n"
        }
    };
    format!(
        "bsf 0x03, 5\nmovlw 0x06\nmovwf 0x1f\nbcf 0x03, 5\nbcf 0x06, 5\nbsf 0x03, 5\nbcf 0x06, 5\nbcf 0x01, 7\nbcf 0x03, 5\n\
         movlw 0x{hi:x}\nmovwf 0x16\nmovlw 0x{lo:x}\nmovwf 0x15\nmovlw 0x0b\nmovwf 0x17\nclrf 0x0f\nclrf 0x0e\nclrf 0x20\n\
         movlw 0x01\nmovwf 0x10\n{main}",
        hi = top >> 8,
        lo = top & 0xff,
        main = main.replace("SCAN", scan)
    )
}

/// A scan of `TON 5 ms` from Xa to Ya: it counts true scans up to `limit`; from there its output is on, or
/// off if `inverted`.
fn scan_source(mcu: &str, limit: u32, inverted: bool) -> String {
    let text = match mcu {
        "at89s52" => {
            "jb 0x92, t\nmov 0x30, #0\nsjmp out\nt: mov a, 0x30\ncjne a, #LIMIT, up\nsjmp out\nup: inc 0x30\n\
             out: mov a, 0x30\ncjne a, #LIMIT, no\nIF_ON\nsjmp fin\nno: IF_OFF\nfin:"
        }
        "pic16f873" => {
            "btfss 0x06, 2\nclrf 0x20\nbtfss 0x06, 2\ngoto out\nmovlw LIMIT\nsubwf 0x20, w\nbtfss 3, 2\nincf 0x20, f\n\
             out: movlw LIMIT\nsubwf 0x20, w\nbtfsc 3, 2\ngoto yes\nIF_OFF\ngoto fin\nyes: IF_ON\nfin:"
        }
        _ => {
            "sbis 0x09, 2\nldi r21, 0\nsbis 0x09, 2\nrjmp out\ncpi r21, LIMIT\nbreq out\ninc r21\n\
             out:\ncpi r21, LIMIT\nbreq yes\nIF_OFF\nrjmp fin\nyes:\nIF_ON\nfin:"
        }
    };
    let write = |on: bool| match (mcu, on != inverted) {
        ("at89s52", true) => "setb 0x95",
        ("at89s52", false) => "clr 0x95",
        ("pic16f873", true) => "bsf 0x06, 5",
        ("pic16f873", false) => "bcf 0x06, 5",
        (_, true) => "sbi 0x05, 5",
        (_, false) => "cbi 0x05, 5",
    };
    text.replace("LIMIT", &limit.to_string()).replace("IF_ON", write(true)).replace("IF_OFF", write(false))
}

#[test]
fn scans_are_found_whatever_else_a_wait_does() {
    for (mcu, hz, pins) in PLACES {
        let text = format!(
            "LDmicro0.1\nCYCLE=1000\nCRYSTAL={hz}\nIO LIST\nEND\nPROGRAM\nRUNG\n CONTACTS Xa 0\n TON Ta 5000\n COIL Ya 0 0 0\nEND\n"
        );
        let program = common::parse("wait.ld", &text);
        let chip = ladder_compile::find_chip(mcu).expect("a chip");
        let pins = pins.map(|(symbol, pin)| PinAssignment::new(symbol, pin)).to_vec();
        let options = CheckOptions { mcu: mcu.to_owned(), pins, ..CheckOptions::default() };
        for way in WAYS {
            let faults: [(&str, u32, u32, bool, &[&str]); 5] = [
                ("as it should be", 1000, LIMIT, false, &[]),
                ("inverted", 1000, LIMIT, true, &["EC011"]),
                ("a scan short", 1000, LIMIT - 1, false, &["EC011"]),
                ("a scan long", 1000, LIMIT + 1, false, &["EC011"]),
                ("a tick short", 999, LIMIT, false, &["EC053"]),
            ];
            for (what, count, limit, inverted, wanted) in faults {
                let scan = scan_source(mcu, limit, inverted);
                // The error of a period that is one tick short accumulates to more than the time between two
                // polls.
                let scans = if count == 1000 { 400 } else { 1_500 };
                let source = match mcu {
                    "at89s52" => mcs51_source(way, count, &scan),
                    "pic16f873" => pic16_source(way, count, &scan),
                    _ => avr_source(way, count, &scan),
                };
                let image =
                    emu_asm::assemble_text(chip, &source).unwrap_or_else(|why| panic!("{way:?} on {mcu}: {why}"));
                let foreign = ForeignImage { file: "theirs.hex", image: &image, map: None, scans: Some(scans) };
                let report = check_foreign(&program, &foreign, &options, &mut |_, _| {})
                    .unwrap_or_else(|faults| panic!("{way:?}, {what}, on {mcu}: {faults:?}\n{source}"));
                let differs = report.difference.iter().map(|difference| difference.code);
                let codes: Vec<&str> = report.findings.iter().map(|finding| finding.code).chain(differs).collect();
                assert_eq!(codes, wanted, "{way:?}, {what}, on {mcu}: {}\n{source}", report.text());
            }
        }
    }
}

/// A flag that is cleared at the right rate but never read does not pace scans, so the check is refused.
#[test]
fn images_whose_scans_are_not_found_are_refused() {
    let text =
        "LDmicro0.1\nCYCLE=1000\nCRYSTAL=1000000\nIO LIST\nEND\nPROGRAM\nRUNG\n CONTACTS Xa 0\n COIL Ya 0 0 0\nEND\n";
    let program = common::parse("wait.ld", text);
    let setup = avr_source(WaitStyle::LoopInside, 1000, "").split("w:\n").next().unwrap_or("").to_owned();
    let scan = "ldi r16, 2\nout 0x16, r16\nsbic 0x09, 2\nsbi 0x05, 5\nsbis 0x09, 2\ncbi 0x05, 5\nrjmp w\n";
    let cases = [("does not wait", "w:\nldi r20, 247\nd:\nnop\ndec r20\nbrne d\n")];
    let chip = ladder_compile::find_chip("atmega328p").expect("a chip");
    let pins = [("Xa", "PD2"), ("Ya", "PB5")].map(|(symbol, pin)| PinAssignment::new(symbol, pin)).to_vec();
    let options = CheckOptions { mcu: "atmega328p".to_owned(), pins, ..CheckOptions::default() };
    for (says, wait) in cases {
        let image = emu_asm::assemble_text(chip, &format!("{setup}{wait}{scan}")).expect("an image");
        let foreign = ForeignImage { file: "theirs.hex", image: &image, map: None, scans: Some(200) };
        let faults = check_foreign(&program, &foreign, &options, &mut |_, _| {}).expect_err("nothing to compare");
        assert!(faults.iter().all(|fault| fault.code == "EC050" && fault.cause.contains(says)), "{faults:?}");
    }
}
