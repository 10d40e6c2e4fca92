//! Models of ports and watchdog that step cycle by cycle, and tests that any slicing gives the same chip.

use crate::script::chip;
use emu_avr::soc::AvrSoc;
use emu_core::CycleTime;
use emu_core::external_io::OutsideInput;
use emu_core::rng::Rng;
use emu_core::{Bus, ChipEvent, NEVER, PinLevel};

const LEVELS: [PinLevel; 3] = [PinLevel::Low, PinLevel::High, PinLevel::Float];

#[derive(Clone, Copy, Default)]
struct Wire {
    outside: PinLevel,
    /// Level that an input reads, now and one cycle ago.
    charge: [bool; 2],
}

#[test]
fn ports_agree_with_wires_stepped_at_every_cycle() {
    let fresh = chip();
    for seed in 0..24 {
        ports_agree(&fresh, seed, 2000);
    }
    for seed in 24..if cfg!(debug_assertions) { 1_000 } else { 100_000 } {
        ports_agree(&fresh, seed, 40);
    }
}

fn ports_agree(fresh: &AvrSoc, seed: u64, cycles: u64) {
    let mut rng = Rng::new(seed);
    let mut soc = fresh.clone();
    soc.set_event_log(true, 0);
    let (mut ddr, mut port, mut pud) = ([0u8; 3], [0u8; 3], false);
    let mut wires = [Wire::default(); 24];
    let mut shown = [PinLevel::Float; 24];
    let mut queue: Vec<(u64, u16, PinLevel)> = Vec::new();
    let mut fought = [false; 24];
    for now in 0..cycles {
        if rng.one_in(6) {
            let (at, pin, level) = (now + rng.below(9), rng.below(24) as u16, LEVELS[rng.below(3) as usize]);
            soc.queue_input(CycleTime::at(at), now, OutsideInput::Level(pin, level));
            queue.push((at, pin, level));
        }
        queue.retain(|&(at, pin, level)| {
            if at == now {
                wires[usize::from(pin)].outside = level;
            }
            at > now
        });
        let (mut edges, mut fights) = (Vec::new(), Vec::new());
        for (i, wire) in wires.iter_mut().enumerate() {
            let (n, bit) = (i / 8, i % 8);
            let [output, high] = [ddr[n], port[n]].map(|reg| reg >> bit & 1 == 1);
            let pull = !output && high && !pud;
            let own = if output { PinLevel::from_bit(high) } else { PinLevel::Float };
            let driven = if own == PinLevel::Float { wire.outside } else { own };
            let level = if driven == PinLevel::Float && pull { PinLevel::High } else { driven };
            let high = level == PinLevel::High || level == PinLevel::Float && wire.charge[0];
            // The level at power-on counts as constant before it.
            wire.charge = [high, if now == 0 { high } else { wire.charge[0] }];
            let fight = own != PinLevel::Float && wire.outside != PinLevel::Float && own != wire.outside;
            if fight && !fought[i] {
                fights.push(i as u16);
            }
            fought[i] = fight;
            if level != shown[i] {
                shown[i] = level;
                edges.push((i as u16, level));
            }
        }
        if rng.one_in(3) {
            soc.fire(now);
        }
        for n in 0..3 {
            let exist = if n == 1 { 0x7F } else { 0xFF };
            let want = (0..8).fold(0u8, |bits, b| bits | u8::from(wires[n * 8 + b].charge[1]) << b) & exist;
            assert_eq!(soc.peek(0x23 + 3 * n as u16, now), want, "PIN of port {n}, seed {seed}, cycle {now}");
        }
        soc.fire(now);
        for (pin, want) in shown.iter().enumerate() {
            assert_eq!(soc.level(pin as u16), *want, "pin {pin}, seed {seed}, cycle {now}");
        }
        // Two drives of one pin in one cycle log two edges; only the last one per pin is compared.
        let mut logged = [None; 24];
        while let Some(event) = soc.event_log().pop() {
            assert_eq!(event.time().cycle, now, "{event:?}, seed {seed}");
            match event {
                ChipEvent::Edge { pin, level, .. } => logged[usize::from(pin)] = Some(level),
                ChipEvent::Contention { pin, .. } => fights.retain(|&fight| fight != pin),
                ChipEvent::Sent { .. } | ChipEvent::Reset { .. } => panic!("{event:?}"),
            }
        }
        assert!(fights.is_empty(), "contention at {fights:?} not reported, seed {seed}, cycle {now}");
        for (pin, level) in edges {
            assert_eq!(logged[usize::from(pin)], Some(level), "edge of pin {pin}, seed {seed}, cycle {now}");
        }
        if rng.one_in(3) {
            let (n, value, mask) = (rng.below(3) as usize, rng.next_u64() as u8, rng.next_u64() as u8);
            let exist = if n == 1 { 0x7F } else { 0xFF };
            let (kind, mask) = (rng.below(4), if rng.one_in(2) { 0xFF } else { mask });
            match kind {
                0 => port[n] = (port[n] ^ value & mask) & exist,
                1 => ddr[n] = (ddr[n] & !mask | value & mask) & exist,
                2 => port[n] = (port[n] & !mask | value & mask) & exist,
                _ => pud = value & 0x10 != 0,
            }
            if kind == 3 {
                soc.write(0x55, value, now);
            } else {
                soc.write_bits(0x23 + 3 * n as u16 + kind as u16, mask, value, now);
            }
        }
    }
}

/// Returns everything visible of a chip.
fn view(soc: &AvrSoc, now: u64) -> Vec<u8> {
    (0x20..=0xFF).map(|reg| soc.peek(reg, now)).chain((0..24).map(|pin| soc.level(pin) as u8)).collect()
}

#[test]
fn any_slicing_gives_the_same_chip_and_the_same_log() {
    for seed in 0..30 {
        let mut rng = Rng::new(seed);
        let mut eager = chip();
        eager.set_event_log(true, 0);
        eager.write(0xC4, rng.below(4) as u8, 0);
        let mut lazy = eager.clone();
        let (mut eager_log, mut lazy_log) = (Vec::new(), Vec::new());
        let mut deadline = 0;
        for now in 1..4000 {
            eager.fire(now);
            if deadline <= now {
                deadline = lazy.fire(now);
            }
            assert_eq!(eager.pending_interrupt(now), lazy.pending_interrupt(now), "seed {seed}, cycle {now}");
            if rng.one_in(12) {
                let regs = [
                    0x23, 0x24, 0x25, 0x29, 0x2A, 0x2B, 0x35, 0x36, 0x37, 0x43, 0x44, 0x45, 0x46, 0x47, 0x48, 0x6E,
                    0x6F, 0x70, 0x80, 0x81, 0x84, 0x85, 0x88, 0x89, 0xB1, 0xB3, 0xC0, 0xC1, 0xC1, 0xC6, 0xC6, 0xC6,
                    0x60,
                ];
                let (reg, value) = (regs[rng.below(regs.len() as u64) as usize], rng.next_u64() as u8);
                let value = if reg == 0xC1 { value | 0x18 } else { value };
                assert_eq!(eager.write(reg, value, now), lazy.write(reg, value, now), "seed {seed}, cycle {now}");
                deadline = 0;
            }
            if rng.one_in(30) {
                let (at, level) = (now + rng.below(300), LEVELS[rng.below(3) as usize]);
                eager.queue_input(CycleTime::at(at), now, OutsideInput::Level(16, level));
                lazy.queue_input(CycleTime::at(at), now, OutsideInput::Level(16, level));
                deadline = 0;
            }
            if rng.one_in(40) {
                assert_eq!(eager.read(0xC6, now).value, lazy.read(0xC6, now).value, "UDR0, seed {seed}, cycle {now}");
                deadline = 0;
            }
            if rng.one_in(25) {
                deadline = lazy.fire(now);
                assert_eq!(view(&eager, now), view(&lazy, now), "seed {seed}, cycle {now}");
            }
            eager_log.extend(std::iter::from_fn(|| eager.event_log().pop()));
        }
        lazy_log.extend(std::iter::from_fn(|| lazy.event_log().pop()));
        assert_eq!(eager_log, lazy_log, "seed {seed}");
        assert!(eager_log.len() > 20, "seed {seed} saw nothing");
        assert!(eager_log.is_sorted_by_key(ChipEvent::time), "seed {seed}: log out of order");
    }
}

#[test]
fn a_clone_is_small_and_an_idle_chip_has_no_deadline() {
    let mut soc = chip();
    assert_eq!(soc.fire(1_000_000), NEVER);
    assert!(std::mem::size_of::<AvrSoc>() <= 6144, "{} bytes", std::mem::size_of::<AvrSoc>());
}
