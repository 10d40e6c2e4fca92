//! Images of our compiler run without a lint: every example, with random inputs and uninitialized RAM.

use emu_avr::{Avr, chips};
use emu_core::lint::Lint;
use emu_core::pins::PinId;
use emu_core::rng::Rng;
use emu_core::{Cpu, CycleTime, PinLevel, Probe, RamInit, StopReason, image};
use ladder_compile::{CompileOptions, compile};

/// Every lint with its cycle and place.
#[derive(Default)]
struct Seen(Vec<String>);

impl Probe for Seen {
    const LINT: bool = true;

    fn on_lint(&mut self, at: u64, pc: u32, lint: Lint) {
        self.0.push(format!("cycle {at}, 0x{:04x}: {lint}", 2 * pc));
    }
}

/// Number of scans for each example.
const SCANS: u64 = 20;

#[test]
fn every_example_runs_without_a_lint() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/examples");
    let (mut wrong, mut count, mut floating) = (Vec::new(), 0, 0);
    for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
        let path = entry.path();
        if path.extension().is_none_or(|end| end != "ld") {
            continue;
        }
        let name = path.display().to_string();
        let text = std::fs::read_to_string(&path).expect("a program");
        let program = ladder::parse(&name, &text).expect("a sound program").program;
        let options = CompileOptions { mcu: "atmega328p".into(), ..CompileOptions::default() };
        let compiled = compile(&program, &options).expect("an image");
        let chip = chips::chip("atmega328p").expect("a chip");
        let loaded = image::load_hex("image", compiled.hex.as_bytes(), chip.hex_spaces).expect("a sound image");
        let mut cpu = Avr::new(chip, &loaded.image, RamInit::Random(7));
        let inputs: Vec<PinId> = compiled
            .map
            .pins
            .iter()
            .filter(|pin| pin.name.starts_with('X'))
            .filter_map(|pin| chip.pin(&pin.pin))
            .collect();
        let (mut rng, mut seen) = (Rng::new(3), Seen::default());
        let scan = compiled.map.cycle.num.div_ceil(compiled.map.cycle.den);
        for _ in 0..SCANS {
            for &pin in &inputs {
                let level = PinLevel::from_bit(rng.one_in(2));
                cpu.drive(CycleTime::at(cpu.cycle()), pin, level);
            }
            let stop = cpu.run(cpu.cycle() + scan, &mut seen);
            assert_eq!(stop, StopReason::Limit, "{name}");
        }
        // The inputs have pull-ups. Without them an undriven pin would cause a lint.
        for &pin in &inputs {
            cpu.drive(CycleTime::at(cpu.cycle()), pin, PinLevel::Float);
        }
        cpu.run(cpu.cycle() + 2 * scan, &mut seen);
        for port in ["PORTB", "PORTC", "PORTD"] {
            assert!(cpu.poke("data", chip.reg(port).expect("a port").into(), 0));
        }
        let mut floats = Seen::default();
        cpu.run(cpu.cycle() + 2 * scan, &mut floats);
        floating += usize::from(floats.0.iter().any(|lint| lint.contains("nothing drives")));
        assert!(cpu.instructions() > SCANS * 10, "{name}: it does not run");
        wrong.extend(seen.0.into_iter().map(|lint| format!("{name}: {lint}")));
        count += 1;
    }
    assert!(count > 5 && floating > 5, "{count} examples, {floating} of them with inputs");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
