//! Records the edges that a program makes on a pin.

use std::path::Path;

use emu_avr::{Avr, chips};
use emu_core::image::{ElfMachine, load};
use emu_core::{ChipEvent, Cpu, PinId, PinLevel, Probe, RamInit, StopReason};

use super::MCU;

/// Records the edges of a pin.
struct Edges {
    pin: PinId,
    edges: Vec<(u64, bool)>,
}

impl Probe for Edges {
    const EVENTS: bool = true;
    fn on_event(&mut self, event: ChipEvent) -> bool {
        if let ChipEvent::Edge { at, pin, level } = event
            && pin == self.pin
        {
            self.edges.push((at.cycle, level == PinLevel::High));
        }
        false
    }
}

/// Returns the edges of a pin until the program ends: the cycle, and the new level.
pub fn edges(image: &Path, pin: &str) -> Vec<(u64, bool)> {
    let chip = chips::chip(MCU).expect("the chip");
    let bytes = std::fs::read(image).unwrap_or_else(|e| panic!("{}: {e}", image.display()));
    let name = image.to_string_lossy();
    let loaded = load(&name, &bytes, chip.hex_spaces, chip.elf_spaces, ElfMachine(chip.elf_machine)).expect("an image");
    let mut seen = Edges { pin: chip.pin(pin).expect("a pin"), edges: Vec::new() };
    let stop = Avr::new(chip, &loaded.image, RamInit::Random(1)).run(20_000_000, &mut seen);
    assert_eq!(stop, StopReason::Halted, "{name}");
    seen.edges
}

/// Returns the pulses shorter than 300 cycles: the cycle at which each begins, and its length in cycles.
pub fn pulses(edges: &[(u64, bool)]) -> Vec<(u64, u64)> {
    let pulse = |pair: &[(u64, bool)]| (pair[0].0, pair[1].0 - pair[0].0);
    edges.windows(2).filter(|pair| pair[0].1).map(pulse).filter(|pulse| pulse.1 < 300).collect()
}
