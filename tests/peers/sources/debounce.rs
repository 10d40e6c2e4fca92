//! A sketch's input counts only after it was stable for the requested time.

use emu_avr::{Avr, chips::ATMEGA328P};
use emu_core::image::{ElfMachine, load};
use emu_core::{Cpu, CycleTime, PinLevel, RamInit, StopReason};
use emu_test_support::{run_tool, test_folder};
use ladder_compile::PinAssignment;
use ladder_compile::emit::arduino::{SketchOptions, emit};

use crate::tools::source;

/// `milliseconds | level of the input before each scan | output after it`, with scans of 10 ms.
const CASES: &str = "
0  | 1 0 1 1 0 0 | 1 0 1 1 0 0
30 | 1 0 1 1 1 1 0 1 0 0 0 0 1 1 1 0 1 1 1 1 | 0 0 0 0 0 1 1 1 1 1 1 0 0 0 0 0 0 0 0 1
11 | 1 1 0 1 1 1 0 0 1 0 0 0 | 0 0 0 0 0 1 1 1 1 1 1 0
";

/// Clocks per scan.
const SCAN: u64 = 160_000;

#[test]
#[ignore = "needs avr-g++ and the core of the Arduino: .ci/peers installs them"]
fn inputs_are_debounced() {
    let text =
        "LDmicro0.1\nCYCLE=10000\nCRYSTAL=16000000\nIO LIST\nEND\nPROGRAM\nRUNG\nCONTACTS Xa 0\nCOIL Ya 0 0 0\nEND\n";
    let program = ladder::parse("follow.ld", text).unwrap_or_else(|e| panic!("{e:?}")).program;
    let dir = test_folder!("sources/debounce");
    for case in CASES.lines().filter(|line| !line.is_empty()) {
        let fields: Vec<&str> = case.split('|').map(str::trim).collect();
        let debounce_ms = fields[0].parse().unwrap_or_else(|e| panic!("{case}: {e}"));
        let pins = vec![PinAssignment::new("Xa", "PD2"), PinAssignment::new("Ya", "PB0")];
        let sketch = emit(&program, &SketchOptions { pins, debounce_ms }).unwrap_or_else(|e| panic!("{e:?}"));
        std::fs::write(dir.join("follow.ino"), &sketch.source.text).unwrap_or_else(|e| panic!("{e}"));
        run_tool(source("emu-check/src/via/arduino.sh"), &["follow.ino", "./follow.elf"], &dir);
        let bytes = std::fs::read(dir.join("follow.elf")).unwrap_or_else(|e| panic!("{e}"));
        let loaded = load("follow.elf", &bytes, ATMEGA328P.hex_spaces, ATMEGA328P.elf_spaces, ElfMachine::AVR);
        let mut cpu = Avr::new(&ATMEGA328P, &loaded.unwrap_or_else(|e| panic!("{e:?}")).image, RamInit::Random(1));
        cpu.set_clock_hz(16_000_000);
        let pin = |name| ATMEGA328P.pin(name).expect("a pin");
        let mut found = Vec::new();
        // Scan k begins soon after k cycle times; its outputs are read, and the next inputs set, in the
        // middle of the wait after it.
        for (scan, level) in (1..).zip(fields[1].split(' ')) {
            cpu.drive(CycleTime::at(cpu.cycle()), pin("PD2"), PinLevel::from_bit(level == "1"));
            assert_eq!(cpu.run(scan * SCAN + SCAN / 2, &mut ()), StopReason::Limit, "{case}");
            found.push(if cpu.pin_level(pin("PB0")) == PinLevel::High { "1" } else { "0" });
        }
        assert_eq!(found.join(" "), fields[2], "{case}");
    }
}
