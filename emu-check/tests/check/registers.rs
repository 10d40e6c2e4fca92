//! Random programs whose integers are registers of ports: the chips and their pins agree with the evaluator.

use emu_check::CheckOptions;
use emu_check::fuzz::generate_program;
use ladder::{LadderDialect, LdFormat};

use crate::common;

/// (Chip, MICRO=, pins of Xa, Xb, Ya and Yb.)
const CHIPS: [(&str, &str, [u32; 4]); 3] = [
    ("atmega328p", "Atmel AVR ATmega328 28-PDIP", [14, 25, 15, 23]),
    ("atmega32", "Atmel AVR ATmega32 40-PDIP", [1, 22, 2, 24]),
    ("pic16f877", "Microchip PIC16F877 40-PDIP", [33, 15, 34, 16]),
];

/// Elements in which a register has no place.
const NONE: [&str; 13] =
    ["TON", "TOF", "RTO", "RTL", "TCY", "THI", "TLO", "CTU", "CTD", "CTC", "CTR", "RES", "PERSIST"];

/// The program with registers in place of `na`, `nb` and `nc`, for a chip.
fn with_registers(program: &ladder::LadderProgram, micro: &str, pins: [u32; 4]) -> String {
    let mut text = String::new();
    for line in ladder::write(program).lines() {
        let keyword = line.split_whitespace().next().unwrap_or_default();
        let register = |word: &str| match word {
            "na" => "#PORTB".to_owned(),
            "nb" => "#TRISB".to_owned(),
            "nc" => "#PORTC".to_owned(),
            other => other.to_owned(),
        };
        match keyword {
            "CYCLE=10000" => text += &format!("MICRO={micro}\n{line}\n"),
            _ if NONE.contains(&keyword) || line.contains("bytes n") => text += &format!("{line}\n"),
            _ => text += &format!("{}\n", line.split(' ').map(register).collect::<Vec<_>>().join(" ")),
        }
    }
    let io = ["Xa", "Xb", "Ya", "Yb"].iter().zip(pins).map(|(name, pin)| format!("    {name} at {pin}\n"));
    let text = text.replacen("IO LIST\n", &format!("IO LIST\n{}", io.collect::<String>()), 1);
    text + "RUNG\n    MOVE level #PINB\n    EQU level #PINC\n    COIL Ra 0 0 0\nEND\n"
}

#[test]
fn random_programs_with_registers_agree() {
    let (mut agreed, mut shared) = (0, 0);
    for number in 0..150 {
        let (mut program, _) = generate_program(5, number);
        // The serial line and the converter have pins on these ports.
        if program.settings.baud.is_some() || program.dialect != LadderDialect::Ldmicro5 {
            continue;
        }
        (program.format, program.settings.cycle_us) = (LdFormat::V02, 10_000);
        for (mcu, micro, pins) in CHIPS {
            let text = with_registers(&program, micro, pins);
            let Ok(parsed) = ladder::parse("registers.ld", &text) else { panic!("{text}") };
            let options = CheckOptions { mcu: mcu.to_owned(), scans: 150, ..CheckOptions::default() };
            // Some programs do not fit the time or the pins.
            let Ok(report) = emu_check::check(&parsed.program, &options, &mut |_, _| {}) else { continue };
            assert!(report.agreed, "{mcu} {number}:\n{text}\n{}", report.text());
            agreed += 1;
            shared += usize::from(text.contains(" #PORTB ") && text.contains("COIL Ya"));
        }
    }
    println!("{agreed} agree, {shared} with a shared output");
    assert!(agreed > 40 && shared > 6, "{agreed} {shared}");
}

#[test]
fn a_program_with_registers_is_refused_where_they_have_no_meaning() {
    let micro = CHIPS[2].1;
    let head = format!("LDmicro0.2\nMICRO={micro}\nCYCLE=10000\nCRYSTAL=4000000\nIO LIST\nEND\nPROGRAM\n");
    let program = common::parse("t.ld", &format!("{head}RUNG\n    MOVE #TRISB 0\nEND\n"));
    for (mcu, why) in [("at89s52", "has no #TRISB"), ("atmega328p", "opposite meaning"), ("ap101", "has no #TRISB")] {
        let options = CheckOptions { mcu: mcu.to_owned(), ..CheckOptions::default() };
        let faults = emu_check::check(&program, &options, &mut |_, _| {}).expect_err(mcu);
        assert!(faults.iter().any(|fault| fault.cause.contains(why)), "{mcu}: {faults:?}");
    }
}
