//! Chips under arbitrary writes in any order: no write may cause a panic.

use emu_avr::chips::AVR_PARTS;
use emu_avr::{Avr, Options};
use emu_core::CycleTime;
use emu_core::cpu::{Bus, ResetCause};
use emu_core::external_io::OutsideInput;
use emu_core::image::Image;
use emu_core::rng::Rng;
use emu_core::{PinLevel, RamInit};

/// Writes random values to random registers in random order on every chip.
#[test]
fn nothing_written_breaks_a_chip() {
    let rounds = if cfg!(debug_assertions) { 300 } else { 20_000 };
    for part in AVR_PARTS {
        let options = Options::at_hz(part.chip.default_hz);
        let mut soc = Avr::with(part.chip, &Image::default(), RamInit::Zero, options).soc().clone();
        let (seed, mut now) = (0xC41F + part.chip.flash_bytes as u64, 0);
        let mut rng = Rng::new(seed);
        for _ in 0..rounds {
            now += rng.below(300);
            soc.fire(now);
            let reg = 0x20 + rng.below(0xE0) as u16;
            let value = rng.next_u64() as u8;
            match rng.below(12) {
                0 => {
                    let bit = 1 << rng.below(8);
                    soc.write_bits(0x20 + reg % 0x20, bit, value, now);
                }
                1 => {
                    let pin = rng.below(part.chip.pins.len() as u64) as u16;
                    soc.queue_input(
                        CycleTime::at(now),
                        now,
                        OutsideInput::Level(pin, PinLevel::from_bit(value & 1 == 1)),
                    );
                }
                2 => {
                    soc.sleep(now);
                    soc.wake_up(now);
                }
                3 if value < 4 => soc.reset(ResetCause::External, now),
                4 => {
                    if let Some(vector) = soc.pending_interrupt(now) {
                        soc.acknowledge_interrupt(vector, now);
                    }
                }
                5..7 => {
                    let shown = soc.peek(reg, now);
                    let steady = soc.steady_until(reg, now);
                    assert!(steady >= now, "{}: seed {seed:#x}", part.chip.name);
                    let read = soc.read(reg, now).value;
                    assert_eq!(shown, read, "{}: seed {seed:#x}: {reg:#x} at {now}", part.chip.name);
                }
                _ => {
                    soc.write(reg, value, now);
                }
            }
            while soc.next_request(now).is_some() {}
            let _ = soc.requested_reset(now);
            now += 1;
        }
    }
}
