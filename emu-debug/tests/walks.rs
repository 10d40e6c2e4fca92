//! Time travel comes out where it began: real programs of all families, walked forwards and backwards at random, while pins are
//! driven and places are set. n steps back and n forward are the same machine; so is the way to a cycle from behind and from ahead.

mod examples;

use std::collections::BTreeMap;

use emu_core::Chip;
use emu_core::cpu::{Cpu, RamInit, Reset};
use emu_core::image::Image;
use emu_core::pins::{Level, PinId, Time};
use emu_core::rng::Rng;
use emu_core::slices::pick;
use emu_debug::debug::{Action, Goal, Options, Place, Rig, Scope, Session, Target, Why};
use emu_debug::stimulus::{Drive, Put};
use emu_debug::{Board, Clock};

use examples::{chip_8051, chip_pic, load};

const SEED: u64 = 0x0DEB_0001;

/// Walks for each family; a build without optimisation does fewer. EMU_WALKS gives another number.
const WALKS: u64 = if cfg!(debug_assertions) { 8 } else { 1_000 };

/// Acts of a walk.
const ACTS: u64 = 24;

/// Small, so that copies are thinned out.
const HISTORY: usize = 1 << 20;

/// All that could ever be seen of the machine, now and later.
fn print(session: &Session) -> Vec<u8> {
    session.target().save()
}

/// The first byte in which two states differ.
fn same(one: &[u8], other: &[u8], what: &str) {
    let at = one.iter().zip(other).position(|(a, b)| a != b);
    assert!(
        one == other,
        "{what}: byte {at:?} of {}: {:?} {:?}",
        one.len(),
        at.map(|at| one[at]),
        at.map(|at| other[at])
    );
}

#[derive(Clone, Copy)]
struct Family {
    files: &'static [(&'static str, &'static str)],
    build: fn(&'static str, &Image) -> Box<dyn Target>,
    chip: fn(&str) -> &'static Chip,
}

fn boxed<C: Cpu + 'static>(cpu: C) -> Box<dyn Target> {
    Box::new(Rig::new(cpu, Board::new(Vec::new(), Clock { hz: 16_000_000, clocks_per_cycle: 1 })))
}

fn walks(family: Family, name: &str, count: u64) {
    let count = std::env::var("EMU_WALKS").ok().and_then(|text| text.parse().ok()).unwrap_or(count);
    let (mut moves, mut compared) = (0u64, 0u64);
    for walk in 0..count {
        let seed = SEED ^ walk << 16 ^ name.len() as u64;
        let mut rng = Rng::new(seed);
        let log = std::env::var("WALK").is_ok_and(|w| w == format!("{name}{walk}"));
        let (chip, file) = family.files[(walk % family.files.len() as u64) as usize];
        let what = format!("{name} walk {walk} seed {seed:#x} {chip} {file}");
        let row = (family.chip)(chip);
        let image = load(row, file);
        let target = (family.build)(chip, &image);
        let clock = Clock { hz: 16_000_000, clocks_per_cycle: target.clocks_per_cycle() };
        let options = Options { clock, history: HISTORY, follow: None };
        let mut session = Session::new(target, Scope::new(row), options);
        let mut known: BTreeMap<u64, Vec<u8>> = BTreeMap::new();
        let mut on = || true;
        for _ in 0..ACTS {
            let now = session.target().cycle();
            let kind = rng.below(8);
            if log {
                eprintln!(
                    "now {now} pc {:x} n {} settled {} kind {kind} deeds {:?}",
                    session.target().pc(),
                    session.target().instructions(),
                    session.settled(),
                    session.deeds().collect::<Vec<_>>()
                );
            }
            match kind {
                0 | 1 => {
                    let most = pick(&mut rng, &[100, 5_000, 300_000]);
                    let until = now + rng.below(most);
                    session.run(&Goal { until: Some(until), passes: rng.below(2) == 0, ..Goal::default() }, &mut on);
                    // A step ends at a position; else it may stand within one, such as in sleep.
                    if rng.below(2) == 0 {
                        session.stepi(1, until + 100_000, &mut on);
                    }
                }
                2 => {
                    let n = 1 + rng.below(40);
                    session.stepi(n, now + 200_000, &mut on);
                }
                3 | 4 => {
                    let most = pick(&mut rng, &[3, 60]);
                    let n = 1 + rng.below(most);
                    let (before, at) = (print(&session), session.target().cycle());
                    let mut back = 0;
                    for _ in 0..n {
                        if session.back_stepi(1, &mut || true).why == Why::Beginning {
                            break;
                        }
                        back += 1;
                    }
                    let mut forward = 0;
                    while forward < back {
                        session.stepi(1, at + 1_000_000, &mut on);
                        forward += 1;
                    }
                    assert_eq!(session.target().cycle(), at, "{what}: {back} back and forward");
                    same(&print(&session), &before, &format!("{what}: {back} back and forward at {at}"));
                    compared += 1;
                    session.back_stepi(n, &mut || true);
                    if back > 0 && rng.below(2) == 0 {
                        session.stepi(back, u64::MAX, &mut on);
                        assert_eq!(session.target().cycle(), at, "{what}: {back} at once, back and forward");
                        let what = format!("{what}: {back} at once, back and forward at {at}");
                        same(&print(&session), &before, &what);
                        session.back_stepi(n, &mut || true);
                    }
                }
                5 => {
                    let to = rng.below(now + now / 4 + 100);
                    session.goto_cycle(to, &mut on);
                }
                6 => {
                    let pin = rng.below(row.pins.len() as u64) as PinId;
                    let level = pick(&mut rng, &[Level::Low, Level::High, Level::Float]);
                    if session.target().has_pin(pin) {
                        let at = Time::at(now + rng.below(3) * rng.below(2_000));
                        session.act(Action::Drive(Drive { at, put: Put::Level(pin, level) })).expect("a level");
                        known.retain(|cycle, _| *cycle < now);
                    }
                }
                _ => {
                    let addr = u32::from(row.ram_start) + rng.below(u64::from(row.ram_len).min(64)) as u32;
                    let place = Place::Memory { space: row.ram, addr, bytes: 1, signed: false };
                    let action = match rng.below(8) {
                        0 => Action::Reset(Reset::External),
                        _ => Action::Set(place, rng.below(2) as i64),
                    };
                    if session.act(action).is_ok() {
                        known.retain(|cycle, _| *cycle < now);
                    }
                }
            }
            moves += 1;
            // Where a step has ended; behind an act the machine is at its position too.
            let at = session.target().cycle();
            let print = print(&session);
            if !session.settled() {
                continue;
            }
            if let Some(before) = known.insert(at, print.clone()) {
                same(&print, &before, &format!("{what}: the machine at cycle {at} is another than it was"));
                compared += 1;
            }
        }
        // Far back is as far as that many times a little.
        if walk % 8 == 0 && session.settled() {
            let at = session.target().cycle();
            session.back_stepi(5_000, &mut on);
            let far = session.target().cycle();
            session.stepi(u64::MAX, at, &mut on);
            assert_eq!(session.target().cycle(), at, "{what}: forth to {at}");
            (0..5).for_each(|_| _ = session.back_stepi(1_000, &mut on));
            assert_eq!(session.target().cycle(), far, "{what}: 5,000 back from {at}");
        }
        // Some of the way again, from the beginning and back.
        let cycles: Vec<u64> = known.keys().copied().collect();
        for &at in cycles.iter().rev().step_by(3).chain(cycles.iter().step_by(4)) {
            session.goto_cycle(at, &mut on);
            if log {
                eprintln!(
                    "goto {at}: now {} {:?} deeds {:?}",
                    session.target().cycle(),
                    session.target().peek("idata", 11),
                    session.deeds().collect::<Vec<_>>()
                );
            }
            if session.target().cycle() == at {
                same(&print(&session), &known[&at], &format!("{what}: the machine at cycle {at}"));
                compared += 1;
            }
        }
    }
    println!("{name}: {count} walks, seed {SEED:#x}, {moves} moves, {compared} states compared");
    assert!(compared > count * 4, "{name}: only {compared} compared");
}

#[test]
fn avr() {
    let files = &[
        ("atmega328p", "avr/millis.elf"),
        ("atmega328p", "avr/nap.elf"),
        ("atmega328p", "avr/echo.elf"),
        ("atmega328p", "avr/watchdog.elf"),
        ("atmega328p", "avr/logger.elf"),
        ("atmega328p", "avr/tone.elf"),
        ("atmega328p", "avr/boot.elf"),
    ];
    let build = |chip: &'static str, image: &Image| boxed(emu_avr::Avr::new(avr_chip(chip), image, RamInit::Zero));
    walks(Family { files, build, chip: avr_chip }, "avr", WALKS);
}

fn avr_chip(name: &str) -> &'static Chip {
    emu_avr::chips::CHIPS.iter().copied().find(|chip| chip.name == name).expect("a chip")
}

#[test]
fn mcs51() {
    let files = &[
        ("at89s52", "8051/blink.hex"),
        ("8052", "8051/hello.hex"),
        ("8051", "8051/mode0.hex"),
        ("8052", "8051/traffic.hex"),
    ];
    let build = |chip: &'static str, image: &Image| {
        boxed(emu_8051::Mcs51::with(chip_8051(chip), image, RamInit::Zero, emu_8051::Options::default()))
    };
    walks(Family { files, build, chip: chip_8051 }, "mcs51", WALKS);
}

#[test]
fn pic16() {
    let files = &[("pic16f877a", "pic16/blink.hex"), ("pic16f873", "pic16/hello.hex")];
    let build = |chip: &'static str, image: &Image| {
        boxed(emu_pic16::Pic16::with(chip_pic(chip), image, RamInit::Zero, emu_pic16::Options::default()))
    };
    walks(Family { files, build, chip: chip_pic }, "pic16", WALKS);
}

#[test]
fn ap101() {
    let files = &[("ap101", "timer.asm"), ("ap101", "latch.asm"), ("ap101", "multiprogram.asm"), ("ap101", "jump.asm")];
    let build = |_: &'static str, image: &Image| boxed(emu_ap101::Ap101::with(image, emu_ap101::Options::default()));
    walks(Family { files, build, chip: |_| &emu_ap101::chips::AP101 }, "ap101", WALKS);
}
