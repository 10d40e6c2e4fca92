//! The findings of the lint collector, case by case in `lints.txt`.

use emu_core::chip::Chip;
use emu_core::cpu::{Cpu, RamInit};
use emu_core::image::{Image, SymbolAt};
use emu_core::lint::Lint;
use emu_debug::lints::describe_lint;
use emu_debug::stop_condition::parse_condition;
use emu_debug::{AddressNames, RunPlan};
use emu_test_support::case_lines;

fn image(chip: &'static Chip, program: &str) -> Image {
    emu_asm::assemble_text(chip, &program.replace(';', "\n")).unwrap_or_else(|e| panic!("{program}: {e}"))
}

/// Returns the findings of a run: program word, code, memory and address of RAM, count, first cycle.
fn found<C: Cpu>(mut cpu: C, waits: &str) -> String {
    let names = AddressNames { chip: cpu.chip(), symbols: &[] };
    let mut plan = RunPlan { limit: 12, lint: true, ..RunPlan::default() };
    for wait in waits.split(',').map(str::trim).filter(|wait| !wait.is_empty()) {
        match wait.split_once(' ').expect("a word and more") {
            ("filled", range) => plan.initialized.push(names.parse_range(range).expect("a range")),
            ("until", condition) => plan.until.push(parse_condition(&names, condition).expect("a condition")),
            other => panic!("{other:?}"),
        }
    }
    let ended = emu_debug::run(&mut cpu, &plan, None, &mut |_| true);
    let each = ended.lints.iter().map(|found| {
        let place = match found.lint {
            Lint::UnwrittenRead { space, addr } | Lint::UnwrittenUse { space, addr } => format!(" {space}:{addr:x}"),
            _ => String::new(),
        };
        format!("{:x} {}{place} x{} @{}", found.pc, found.lint.code(), found.count, found.first)
    });
    each.collect::<Vec<_>>().join(", ")
}

fn case(chip: &str, program: &str, waits: &str) -> String {
    match chip {
        "avr" => {
            let chip = &emu_avr::chips::ATMEGA328P;
            found(emu_avr::Avr::new(chip, &image(chip, program), RamInit::Zero), waits)
        }
        "8051" => {
            let chip = emu_8051::chips::chips().find(|chip| chip.name == "8051").expect("an 8051");
            found(emu_8051::Mcs51::new(chip, &image(chip, program), RamInit::Zero), waits)
        }
        "pic16" => {
            let options = emu_pic16::Options { config: Some(0x3F31), start_up: false, ..Default::default() };
            let chip = &emu_pic16::chips::PIC16F873.chip;
            found(emu_pic16::Pic16::with(chip, &image(chip, program), RamInit::Zero, options), waits)
        }
        other => panic!("no chip {other}"),
    }
}

#[test]
fn what_is_found() {
    let (mut wrong, mut count) = (Vec::new(), 0);
    for line in case_lines(include_str!("lints.txt")) {
        let columns: Vec<&str> = line.split('|').map(str::trim).collect();
        let [chip, program, waits, wanted] = columns[..] else { panic!("four columns wanted: {line}") };
        let found = case(chip, program, waits);
        count += 1;
        if found != wanted {
            wrong.push(format!("{line}\n    found {found}"));
        }
    }
    assert!(count > 20, "only {count} cases were read");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Without the option, nothing is collected.
#[test]
fn nothing_is_found_unasked() {
    let chip: &'static Chip = &emu_pic16::chips::PIC16F873.chip;
    let image = image(chip, "movf 0x20, W; movf 0x05, W; goto 0x002");
    let mut cpu = emu_pic16::Pic16::new(chip, &image, RamInit::Zero);
    let plan = RunPlan { limit: 100_000, ..RunPlan::default() };
    let ended = emu_debug::run(&mut cpu, &plan, None, &mut |_| true);
    assert!(cpu.instructions() > 3 && ended.lints.is_empty());
}

#[test]
fn names_of_registers_pins_and_symbols() {
    let symbol = |name: &str, space, addr| SymbolAt::new(name, space, addr, 1);
    let symbols = [symbol("count", "data", 0x20), symbol("far", "flash", 2 * 0x810)];
    let names = AddressNames { chip: &emu_pic16::chips::PIC16F873.chip, symbols: &symbols };
    #[rustfmt::skip]
    let cases = [
        (Lint::AnalogRead { port: 5, bits: 0x21 },             "PORTA is read; RA0, RA5 are analog inputs and read 0"),
        (Lint::UnintendedLatchChange { port: 6, bits: 2 },              "the instruction also changes the latch of PORTB at RB1"),
        (Lint::PageNotSelected { target: 0x812 },                         "the jump goes to 0x0812 (far+0x2), in another page, and this page did not set PCLATH"),
        (Lint::PageNotSelected { target: 0x10 },                          "the jump goes to 0x0010, in another page, and this page did not set PCLATH"),
        (Lint::UnwrittenRead { space: "data", addr: 0x20 },      "data:0x20 (count) is read before it was written"),
        (Lint::UnwrittenRead { space: "data", addr: 0x21 },      "data:0x21 is read before it was written"),
        (Lint::NotSaved { register: "W" },                     "the service routine returns with a changed value in W"),
        (Lint::StackOverflow,                                  "the stack is full: the oldest return address is overwritten"),
        // An address without a name in the chip row is printed as a number.
        (Lint::AnalogRead { port: 0x20, bits: 1 },             "data:0x20 is read; bit 0 are analog inputs and read 0"),
    ];
    for (lint, wanted) in cases {
        assert_eq!(describe_lint(lint, &names), wanted);
    }

    let symbol = |name: &str, addr, size| SymbolAt::new(name, "data", addr, size);
    let symbols = [symbol("buf", 0x100, 8), symbol("_end", 0x120, 0)];
    let names = AddressNames { chip: &emu_avr::chips::ATMEGA328P, symbols: &symbols };
    #[rustfmt::skip]
    let cases = [
        (Lint::UnwrittenUse { space: "data", addr: 5 },          "r5 is used before it was written"),
        (Lint::UnwrittenUse { space: "data", addr: 0x100 },      "data:0x100 (buf) is used before it was written"),
        (Lint::UnwrittenUse { space: "data", addr: 0x107 },      "data:0x107 (buf+0x7) is used before it was written"),
        (Lint::UnwrittenUse { space: "data", addr: 0x108 },      "data:0x108 is used before it was written"),
        (Lint::StackCollision { limit: 0x120 },                    "the stack grows below 0x0120 (_end)"),
        (Lint::StackCollision { limit: 0x100 },                    "the stack grows below 0x0100, where RAM begins"),
        (Lint::StackCollision { limit: 0x180 },                    "the stack grows below 0x0180, the end of the heap"),
        (Lint::UnimplementedAddress { addr: 0xE0 },                    "data:0xe0 is written, but is not implemented"),
        (Lint::ReservedBits { addr: 0xC5, bits: 0x10 },        "the reserved bit 4 of UBRR0H is written as 1"),
        (Lint::ReservedBits { addr: 0x45, bits: 0x30 },        "the reserved bits 4, 5 of TCCR0B are written as 1"),
        (Lint::Baud { uart: 0, baud: 111_111 },                "serial port 0 runs at 111111 baud, -3.5 % off 115200"),
        (Lint::Baud { uart: 0, baud: 117_647 },                "serial port 0 runs at 117647 baud, +2.1 % off 115200"),
        (Lint::TakenWithoutHandler { vector: 16 },                       "the interrupt TIMER0_OVF is taken, but has no service routine"),
        (Lint::EnabledWithoutHandler { vector: 1 },                        "the interrupt INT0 is enabled, but has no service routine"),
        (Lint::FloatingRead { port: 0x29, bits: 0x84 },        "PIND is read and used, but nothing drives PD2, PD7"),
    ];
    for (lint, wanted) in cases {
        assert_eq!(describe_lint(lint, &names), wanted);
    }
}
