//! Runs a compiled program, with the start-up code of avr-libc, on every chip. `cargo test -p plcemu-avr
//! --test compiled -- --ignored`; needs avr-gcc and avr-libc.

use std::fs;
use std::path::Path;
use std::process::Command;

use emu_avr::Avr;
use emu_avr::chips::AVR_CHIPS;
use emu_core::image::load_elf;
use emu_core::pins::ChipEvent;
use emu_core::{Cpu, Probe, RamInit};

/// Probe that collects the sent bytes.
#[derive(Default)]
struct Sent(Vec<u8>);

impl Probe for Sent {
    const EVENTS: bool = true;

    fn on_event(&mut self, event: ChipEvent) -> bool {
        if let ChipEvent::Sent { byte, .. } = event {
            self.0.push(byte);
        }
        false
    }
}

#[test]
#[ignore = "needs avr-gcc and avr-libc"]
fn a_compiled_program_runs_on_every_chip() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/compiled.c");
    for chip in AVR_CHIPS {
        let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{}.elf", chip.name));
        let mcu = format!("-mmcu={}", chip.name);
        let run = Command::new("avr-gcc").args([&mcu, "-Os", "-o"]).arg(&file).arg(&source).output().expect("avr-gcc");
        assert!(run.status.success(), "{}: {}", chip.name, String::from_utf8_lossy(&run.stderr));
        let bytes = fs::read(&file).expect("an image");
        let loaded = load_elf(chip.name, &bytes, chip.elf_spaces, chip.elf_machine).expect("an image");
        let mut avr = Avr::new(chip, &loaded.image, RamInit::Random(1));
        let mut sent = Sent::default();
        avr.run(400_000, &mut sent);
        let wanted = format!("Hello from {} 3\n", chip.ram_start + chip.ram_len - 1);
        assert_eq!(String::from_utf8_lossy(&sent.0), wanted, "{}", chip.name);
    }
}
