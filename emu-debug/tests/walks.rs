//! Time travel returns to its start: real programs of all families run forwards and backwards at random,
//! while pins are driven and locations are set. n steps back and n steps forward give the same machine; so
//! does reaching a cycle from before and from after it.

mod examples;

use std::collections::BTreeMap;

use emu_core::Chip;
use emu_core::cpu::{RamInit, ResetCause};
use emu_core::image::Image;
use emu_core::pins::{CycleTime, PinId, PinLevel};
use emu_core::rng::Rng;
use emu_debug::CycleClock;
use emu_debug::debug::{
    DebugSession, DynMachine, ExpressionPlace, NameScope, RunGoal, SessionOptions, SessionStopReason, UserAction,
};
use emu_debug::stimulus::{ExternalDrive, TimedDrive};
use emu_test_machines::DebugMachine;
use emu_test_support::slices::pick_random;

use examples::{chip_8051, chip_pic, load};

const SEED: u64 = 0x0DEB_0001;

/// Random executions for each family; a build without optimisation does fewer. EMU_WALKS selects another
/// number.
const WALKS: u64 = if cfg!(debug_assertions) { 8 } else { 1_000 };

/// Actions of a random execution.
const ACTS: u64 = 24;

/// Frequency of the clock in Hz.
const HZ: u64 = 16_000_000;

/// Small, so that copies are removed.
const HISTORY: usize = 1 << 20;

/// Returns everything that can be observed of the machine, now and later.
fn print(session: &DebugSession) -> Vec<u8> {
    session.machine().save()
}

/// Asserts that two states are equal; reports the first byte that differs.
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
    build: fn(&'static str, &Image) -> Box<dyn DynMachine>,
    chip: fn(&str) -> &'static Chip,
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
        let machine = (family.build)(chip, &image);
        let clock = CycleClock { hz: 16_000_000, clocks_per_cycle: machine.clocks_per_cycle() };
        let options = SessionOptions { clock, max_copy_bytes: HISTORY, follower: None };
        let mut session = DebugSession::new(machine, NameScope::new(row), options);
        let mut known: BTreeMap<u64, Vec<u8>> = BTreeMap::new();
        let mut on = || true;
        for _ in 0..ACTS {
            let now = session.machine().cycle();
            let kind = rng.below(8);
            if log {
                eprintln!(
                    "now {now} pc {:x} n {} settled {} kind {kind} deeds {:?}",
                    session.machine().pc(),
                    session.machine().instructions(),
                    session.is_at_step_end(),
                    session.input_events().collect::<Vec<_>>()
                );
            }
            match kind {
                0 | 1 => {
                    let most = pick_random(&mut rng, &[100, 5_000, 300_000]);
                    let until = now + rng.below(most);
                    session.run(
                        &RunGoal { until: Some(until), runs_while_halted: rng.below(2) == 0, ..RunGoal::default() },
                        &mut on,
                    );
                    // A step ends at a position; otherwise the machine may be within a step, such as in
                    // sleep.
                    if rng.below(2) == 0 {
                        session.step_instructions(1, until + 100_000, &mut on);
                    }
                }
                2 => {
                    let n = 1 + rng.below(40);
                    session.step_instructions(n, now + 200_000, &mut on);
                }
                3 | 4 => {
                    let most = pick_random(&mut rng, &[3, 60]);
                    let n = 1 + rng.below(most);
                    let (before, at) = (print(&session), session.machine().cycle());
                    let mut back = 0;
                    for _ in 0..n {
                        if session.step_back(1, &mut || true) == SessionStopReason::Beginning {
                            break;
                        }
                        back += 1;
                    }
                    let mut forward = 0;
                    while forward < back {
                        session.step_instructions(1, at + 1_000_000, &mut on);
                        forward += 1;
                    }
                    assert_eq!(session.machine().cycle(), at, "{what}: {back} back and forward");
                    same(&print(&session), &before, &format!("{what}: {back} back and forward at {at}"));
                    compared += 1;
                    session.step_back(n, &mut || true);
                    if back > 0 && rng.below(2) == 0 {
                        session.step_instructions(back, u64::MAX, &mut on);
                        assert_eq!(session.machine().cycle(), at, "{what}: {back} at once, back and forward");
                        let what = format!("{what}: {back} at once, back and forward at {at}");
                        same(&print(&session), &before, &what);
                        session.step_back(n, &mut || true);
                    }
                }
                5 => {
                    let to = rng.below(now + now / 4 + 100);
                    session.goto_cycle(to, &mut on);
                }
                6 => {
                    let pin = rng.below(row.pins.len() as u64) as PinId;
                    let level = pick_random(&mut rng, &[PinLevel::Low, PinLevel::High, PinLevel::Float]);
                    if session.machine().has_pin(pin) {
                        let at = CycleTime::at(now + rng.below(3) * rng.below(2_000));
                        session
                            .apply_action(UserAction::Drive(TimedDrive { at, drive: ExternalDrive::Level(pin, level) }))
                            .expect("a level");
                        known.retain(|cycle, _| *cycle < now);
                    }
                }
                _ => {
                    let addr = u32::from(row.ram_start) + rng.below(u64::from(row.ram_len).min(64)) as u32;
                    let place = ExpressionPlace::Memory { space: row.ram_space, addr, bytes: 1, signed: false };
                    let action = match rng.below(8) {
                        0 => UserAction::Reset(ResetCause::External),
                        _ => UserAction::Set(place, rng.below(2) as i64),
                    };
                    if session.apply_action(action).is_ok() {
                        known.retain(|cycle, _| *cycle < now);
                    }
                }
            }
            moves += 1;
            // At the end of a step, or after an action, the machine is at a position.
            let at = session.machine().cycle();
            let print = print(&session);
            if !session.is_at_step_end() {
                continue;
            }
            if let Some(before) = known.insert(at, print.clone()) {
                same(&print, &before, &format!("{what}: the machine at cycle {at} is another than it was"));
                compared += 1;
            }
        }
        // Far back is as far as the same number of single steps.
        if walk % 8 == 0 && session.is_at_step_end() {
            let at = session.machine().cycle();
            session.step_back(5_000, &mut on);
            let far = session.machine().cycle();
            session.step_instructions(u64::MAX, at, &mut on);
            assert_eq!(session.machine().cycle(), at, "{what}: forth to {at}");
            (0..5).for_each(|_| _ = session.step_back(1_000, &mut on));
            assert_eq!(session.machine().cycle(), far, "{what}: 5,000 back from {at}");
        }
        // Some of the positions again, from the beginning and backwards.
        let cycles: Vec<u64> = known.keys().copied().collect();
        for &at in cycles.iter().rev().step_by(3).chain(cycles.iter().step_by(4)) {
            session.goto_cycle(at, &mut on);
            if log {
                eprintln!(
                    "goto {at}: now {} {:?} deeds {:?}",
                    session.machine().cycle(),
                    session.machine().peek("idata", 11),
                    session.input_events().collect::<Vec<_>>()
                );
            }
            if session.machine().cycle() == at {
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
    let build = |chip: &'static str, image: &Image| emu_avr::Avr::new(avr_chip(chip), image, RamInit::Zero).boxed(HZ);
    walks(Family { files, build, chip: avr_chip }, "avr", WALKS);
}

fn avr_chip(name: &str) -> &'static Chip {
    emu_avr::chips::AVR_CHIPS.iter().copied().find(|chip| chip.name == name).expect("a chip")
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
        emu_8051::Mcs51::with(chip_8051(chip), image, RamInit::Zero, emu_8051::Options::default()).boxed(HZ)
    };
    walks(Family { files, build, chip: chip_8051 }, "mcs51", WALKS);
}

#[test]
fn pic16() {
    let files = &[("pic16f877a", "pic16/blink.hex"), ("pic16f873", "pic16/hello.hex")];
    let build = |chip: &'static str, image: &Image| {
        emu_pic16::Pic16::with(chip_pic(chip), image, RamInit::Zero, emu_pic16::Options::default()).boxed(HZ)
    };
    walks(Family { files, build, chip: chip_pic }, "pic16", WALKS);
}

#[test]
fn ap101() {
    let files = &[("ap101", "timer.asm"), ("ap101", "latch.asm"), ("ap101", "multiprogram.asm"), ("ap101", "jump.asm")];
    let build = |_: &'static str, image: &Image| emu_ap101::Ap101::with(image, emu_ap101::Options::default()).boxed(HZ);
    walks(Family { files, build, chip: |_| &emu_ap101::chips::AP101 }, "ap101", WALKS);
}
