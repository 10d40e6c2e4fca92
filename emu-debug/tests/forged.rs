//! Any bytes as the state of a machine are either refused, or the machine runs with them without a panic.

mod examples;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use emu_core::Chip;
use emu_core::cpu::{Cpu, RamInit};
use emu_core::image::Image;
use emu_core::rng::Rng;
use emu_test_support::slices::pick_random;

use examples::{chip_8051, chip_pic, load};

const SEED: u64 = 0x0F0_46ED;

/// Forgeries of each state; EMU_FORGERIES selects another number.
const FORGERIES: u64 = if cfg!(debug_assertions) { 150 } else { 5_000 };

/// Time limit for a forged machine.
const SLOW: Duration = Duration::from_secs(2);

/// Cycles that a forged machine runs.
const CYCLES: u64 = 20_000;

/// Changes some bytes: bits, values that are likely limits, removed or inserted bytes.
fn forge(rng: &mut Rng, state: &[u8]) -> Vec<u8> {
    let mut forged = state.to_vec();
    for _ in 0..1 + rng.below(2) * rng.below(4) {
        if forged.is_empty() {
            break;
        }
        let at = rng.below(forged.len() as u64) as usize;
        match rng.below(8) {
            0 => drop(forged.remove(at)),
            1 => forged.insert(at, rng.next_u64() as u8),
            2 => forged.truncate(at.max(1)),
            3 | 4 => forged[at] ^= 1 << rng.below(8),
            5 => forged[at] = rng.next_u64() as u8,
            _ => forged[at] = pick_random(rng, &[0, 1, 2, 3, 4, 0x7F, 0x80, 0xFE, 0xFF]),
        }
    }
    forged
}

/// A restored state can be saved, and restored again.
fn saved_again<C: Cpu>(cpu: &C, other: &C) {
    let (state, mut third) = (other.save(), cpu.clone());
    assert!(third.restore(&state).is_ok(), "what it saves is refused");
    assert!(third.save() == state, "what it saves comes back as another");
}

/// Forges states of the machine at several moments.
fn forgeries<C: Cpu>(name: &str, machines: impl Iterator<Item = (&'static str, C)>) {
    let (mut refused, mut ran) = (0u64, 0u64);
    let mut panics = Vec::new();
    let forgeries = std::env::var("EMU_FORGERIES").ok().and_then(|text| text.parse().ok()).unwrap_or(FORGERIES);
    for (file, mut cpu) in machines {
        for moment in [0, 1_000, 30_000, 200_000] {
            cpu.run(moment, &mut ());
            let state = cpu.save();
            for forgery in 0..forgeries {
                let seed = SEED ^ forgery << 20 ^ moment;
                let since = Instant::now();
                let forged = forge(&mut Rng::new(seed), &state);
                let mut other = cpu.clone();
                let went = catch_unwind(AssertUnwindSafe(|| match other.restore(&forged) {
                    Ok(()) => {
                        saved_again(&cpu, &other);
                        let end = other.cycle().saturating_add(CYCLES);
                        other.run(end, &mut ());
                        saved_again(&cpu, &other);
                        true
                    }
                    Err(_) => {
                        assert!(other.save() == state, "a refusal has changed the machine");
                        false
                    }
                }));
                if since.elapsed() > SLOW {
                    panics.push(format!("{file} at {moment}, seed {seed:#x}: {:?}", since.elapsed()));
                }
                match went {
                    Ok(true) => ran += 1,
                    Ok(false) => refused += 1,
                    Err(_) => panics.push(format!("{file} at {moment}, seed {seed:#x}")),
                }
            }
        }
    }
    println!("{name}: seed {SEED:#x}, {refused} refused, {ran} ran on, {} panics", panics.len());
    assert!(panics.is_empty(), "{name}: {panics:#?}");
    assert!(refused > 50 && ran > 50, "{name}: {refused} refused, {ran} ran on");
}

fn avr_chip(name: &str) -> &'static Chip {
    emu_avr::chips::AVR_CHIPS.iter().copied().find(|chip| chip.name == name).expect("a chip")
}

/// Runs a machine with each of these programs.
fn each<C: Cpu>(
    name: &str,
    files: &[(&'static str, &'static str)],
    chip: fn(&str) -> &'static Chip,
    build: impl Fn(&'static Chip, &Image) -> C,
) {
    let machines = files.iter().map(|&(part, file)| {
        let row = chip(part);
        (file, build(row, &load(row, file)))
    });
    forgeries(name, machines);
}

#[test]
fn avr() {
    let files = &[
        ("atmega328p", "avr/echo.elf"),
        ("atmega328p", "avr/nap.elf"),
        ("atmega328p", "avr/watchdog.elf"),
        ("atmega328p", "avr/logger.elf"),
        ("atmega328p", "avr/tone.elf"),
        ("atmega328p", "avr/boot.elf"),
    ];
    each("avr", files, avr_chip, |chip, image| emu_avr::Avr::new(chip, image, RamInit::Zero));
}

#[test]
fn mcs51() {
    let files = &[
        ("at89s52", "8051/blink.hex"),
        ("8052", "8051/hello.hex"),
        ("8051", "8051/mode0.hex"),
        ("8052", "8051/traffic.hex"),
    ];
    each("mcs51", files, chip_8051, |chip, image| {
        emu_8051::Mcs51::with(chip, image, RamInit::Zero, emu_8051::Options::default())
    });
}

#[test]
fn pic16() {
    let files = &[("pic16f877a", "pic16/blink.hex"), ("pic16f873", "pic16/hello.hex")];
    each("pic16", files, chip_pic, |chip, image| {
        emu_pic16::Pic16::with(chip, image, RamInit::Zero, emu_pic16::Options::default())
    });
}

#[test]
fn ap101() {
    let files = &[("ap101", "timer.asm"), ("ap101", "latch.asm"), ("ap101", "multiprogram.asm"), ("ap101", "jump.asm")];
    each(
        "ap101",
        files,
        |_| &emu_ap101::chips::AP101,
        |_, image| emu_ap101::Ap101::with(image, emu_ap101::Options::default()),
    );
}
