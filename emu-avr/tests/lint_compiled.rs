//! Correct compiled programs give no diagnostics, at any optimization level. `cargo test -p plcemu-avr --test
//! lint_compiled -- --ignored`; needs avr-gcc and avr-libc.

use std::fs;
use std::path::Path;
use std::process::Command;

use emu_avr::{Avr, Options, chips};
use emu_core::image::load_elf;
use emu_core::lint::Lint;
use emu_core::pins::ChipEvent;
use emu_core::{Cpu, Probe, RamInit, StopReason};

/// Probe that collects the sent bytes and all lints.
#[derive(Default)]
struct Seen {
    sent: Vec<u8>,
    lints: Vec<String>,
}

impl Probe for Seen {
    const EVENTS: bool = true;
    const LINT: bool = true;

    fn on_event(&mut self, event: ChipEvent) -> bool {
        if let ChipEvent::Sent { byte, .. } = event {
            self.sent.push(byte);
        }
        false
    }

    fn on_lint(&mut self, at: u64, pc: u32, lint: Lint) {
        self.lints.push(format!("cycle {at}, 0x{:04x}: {lint}", 2 * pc));
    }
}

const CHIPS: [&str; 7] = ["atmega328p", "atmega168", "atmega8", "atmega32", "atmega128", "atmega644", "atmega1284p"];
/// Chips with one register per function, for a program that sets up every peripheral.
const NEW_CHIPS: [&str; 9] = [
    "atmega48",
    "atmega328p",
    "atmega164a",
    "atmega324pa",
    "atmega644",
    "atmega644p",
    "atmega644pa",
    "atmega1284",
    "atmega1284p",
];
const PROGRAMS: [&str; 5] = ["print", "heap", "stack", "interrupts", "tasks"];
const LEVELS: [&str; 7] =
    ["-O0", "-O1", "-O2", "-O3", "-Os", "-Os -mcall-prologues -mrelax", "-O2 -flto -funroll-loops"];

/// Compiles and runs a program; returns what it sent, and all problems.
fn run(mcu: &str, name: &str, level: &str) -> Option<(String, Vec<String>)> {
    let chip = chips::chip(mcu).expect("a chip");
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/lint/{name}.c"));
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("lint-{mcu}-{name}{}.elf", level.replace(' ', "")));
    let gcc = Command::new("avr-gcc")
        .args(["-std=gnu99", "-w", "-DF_CPU=16000000UL", &format!("-mmcu={mcu}")])
        .args(level.split(' '))
        .arg("-o")
        .args([&file, &source])
        .arg("-lm")
        .output()
        .expect("avr-gcc");
    let said = String::from_utf8_lossy(&gcc.stderr);
    if said.contains("will not fit") || said.contains("overflowed") {
        return None;
    }
    assert!(gcc.status.success(), "{mcu} {name} {level}: {said}");
    let bytes = fs::read(&file).expect("an image");
    let loaded = load_elf(name, &bytes, chip.elf_spaces, chip.elf_machine).expect("an image");
    let options = Options::at_hz(16_000_000);
    let mut avr = Avr::with(chip, &loaded.image, RamInit::Random(5), options);
    let mut seen = Seen::default();
    let stop = avr.run(40_000_000, &mut seen);
    let mut wrong = seen.lints;
    if stop != StopReason::Halted || !seen.sent.ends_with(b"end\n") {
        wrong.push(format!("{stop:?} after {:?}", String::from_utf8_lossy(&seen.sent)));
    }
    Some((String::from_utf8_lossy(&seen.sent).into_owned(), wrong))
}

#[test]
#[ignore = "needs avr-gcc and avr-libc"]
fn sound_programs_give_no_lints() {
    let (mut wrong, mut count) = (Vec::new(), 0);
    let programs = CHIPS.into_iter().flat_map(|mcu| PROGRAMS.map(|name| (mcu, name)));
    for (mcu, name) in programs.chain(NEW_CHIPS.map(|mcu| (mcu, "peripherals"))) {
        let mut first = None;
        for level in LEVELS {
            let Some((sent, found)) = run(mcu, name, level) else { continue };
            count += 1;
            wrong.extend(found.into_iter().map(|lint| format!("{mcu} {name} {level}: {lint}")));
            let first = first.get_or_insert_with(|| sent.clone());
            if *first != sent {
                wrong.push(format!("{mcu} {name} {level}: {sent:?} where others send {first:?}"));
            }
        }
    }
    println!("{count} programs");
    assert!(count > 150, "{count} programs");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
