//! Random writes, correct and wrong unlock sequences, sleeps and resets: the EEPROM must agree with the
//! stepped model in every cycle.

use emu_core::rng::Rng;
use emu_pic16::chips::NonvolatileKind;
use emu_pic16::periph::eeprom::{FlashAccess, Pic16Eeprom};
use emu_pic16::periph::map::Sfr;
use emu_pic16::periph::{Device, Pic16Outbox, Pic16Signal};

use crate::model::Model;

const KINDS: [NonvolatileKind; 7] = [
    NonvolatileKind::F84,
    NonvolatileKind::F62x,
    NonvolatileKind::Word,
    NonvolatileKind::Block4,
    NonvolatileKind::Read,
    NonvolatileKind::Row32,
    NonvolatileKind::None,
];

/// Returns five instructions that start a write, or something similar: the write of each cycle from the first
/// on.
fn key(rng: &mut Rng, eecon1: u8) -> Vec<Option<(Sfr, u8)>> {
    let wren = if rng.one_in(12) { 0 } else { 4 };
    let mut list = vec![
        Some((Sfr::EECON1, eecon1 & !3 | wren)),
        Some((Sfr::EECON2, 0x55)),
        None,
        Some((Sfr::EECON2, 0xAA)),
        Some((Sfr::EECON1, eecon1 & !1 | wren | 2)),
    ];
    if rng.one_in(6) {
        let at = rng.below(5) as usize;
        match rng.below(4) {
            0 => list.insert(at, None),
            1 => _ = list.remove(at),
            2 => list.swap(at, 2),
            _ => list[at] = Some((Sfr::EECON2, rng.next_u64() as u8)),
        }
    }
    list
}

fn live(seed: u64, cycles: u64) -> [usize; 3] {
    let mut rng = Rng::new(seed);
    let kind = KINDS[rng.below(KINDS.len() as u64) as usize];
    let (write, clocks) = (1 + rng.below(300), 1 + rng.below(300));
    let first = rng.below(3) as u16 * 0x100;
    let mut bytes = vec![0; 64];
    rng.fill(&mut bytes);
    let mut eeprom =
        Pic16Eeprom::new(kind, &bytes, write, FlashAccess { words: 0x800, writable: first..0x800, clocks });
    let mut model = Model::new(kind, &bytes, write, clocks, first);
    let (mut reported, mut expected) = (Pic16Outbox::new(), Pic16Outbox::new());
    let mut script: Vec<Option<(Sfr, u8)>> = Vec::new();
    let mut steady = Vec::new();
    for t in 0..4 * cycles {
        let (from, known) = (reported.len(), expected.len());
        let mut fresh = Pic16Outbox::new();
        if t > 0 {
            model.tick(t, &mut fresh);
        }
        let cycle = t.is_multiple_of(4);
        if cycle && script.is_empty() {
            let eecon1 = model.eecon1() & !0x90 | if rng.one_in(2) { 0x80 } else { 0 } | rng.next_u64() as u8 & 0x10;
            script = match rng.below(8) {
                0 => key(&mut rng, eecon1),
                1 => vec![Some((Sfr::EECON1, rng.next_u64() as u8))],
                2 => vec![Some((Sfr::EEADR, rng.next_u64() as u8 & if rng.one_in(4) { 0xFF } else { 0x43 }))],
                3 => vec![Some((Sfr::EEADRH, rng.next_u64() as u8))],
                4 => vec![Some((Sfr::EEDATA, rng.next_u64() as u8))],
                5 => vec![Some((Sfr::EEDATH, rng.next_u64() as u8))],
                6 => vec![Some((Sfr::EECON1, 0x81))],
                _ => vec![None; rng.below(40) as usize + 1],
            };
        }
        let write = if cycle { script.remove(0) } else { None };
        if write.is_none() && eeprom.next_deadline() <= t {
            eeprom.run_due(t, &mut reported);
            assert!(!fresh.is_empty(), "seed {seed:#x}: nothing was due at {t}");
        }
        if cycle {
            model.cycle(write, t, &mut fresh);
        }
        if let Some((reg, value)) = write {
            eeprom.write(reg, value, 0xFF, t, &mut reported);
        }
        super::answer(&mut eeprom, &reported, from);
        let mut disturbed = write.is_some();
        if rng.one_in(4000) {
            disturbed = true;
            let power_on = rng.one_in(3);
            model.reset(power_on);
            eeprom.reset(power_on, t, &mut reported);
            script.clear();
        } else if rng.one_in(1000) {
            eeprom.stop_clock(t, &mut reported);
            eeprom.restart_clock(t, &mut reported);
        }
        expected.extend(fresh);
        assert_eq!(reported[from..], expected[known..], "seed {seed:#x}, {kind:?}, at {t}");
        let mut seen: Vec<(Sfr, u8)> = [Sfr::EEDATA, Sfr::EEADR, Sfr::EEDATH, Sfr::EEADRH]
            .into_iter()
            .map(|reg| (reg, model.regs[reg.name()]))
            .collect();
        seen.push((Sfr::EECON1, model.eecon1()));
        seen.push((Sfr::EECON2, 0));
        for &(reg, value) in &seen {
            assert_eq!(eeprom.peek(reg, t), value, "seed {seed:#x}, {kind:?}: {} at {t}", reg.name());
        }
        if disturbed {
            steady = seen.iter().map(|&(reg, value)| (reg, value, eeprom.steady_until(reg, t))).collect();
        }
        for &(reg, value, until) in &steady {
            let now = seen.iter().find(|s| s.0 == reg).map(|s| s.1);
            assert!(t >= until || now == Some(value), "seed {seed:#x}: {} not steady up to {until}", reg.name());
        }
        // Compares all cells, but only sometimes: a wrong byte stays wrong for a while.
        let cells = if t.is_multiple_of(16) { eeprom.bytes() } else { &[] };
        for (n, byte) in cells.iter().enumerate() {
            assert_eq!(model.cells[&(n as u8)], *byte, "seed {seed:#x}: cell {n} at {t}");
        }
    }
    let count = |f: fn(&Pic16Signal) -> bool| reported.iter().filter(|s| f(s)).count();
    [
        count(|s| matches!(s, Pic16Signal::Flag { .. })),
        count(|s| matches!(s, Pic16Signal::FlashWrite { .. } | Pic16Signal::FlashProgram { .. })),
        count(|s| matches!(s, Pic16Signal::FlashRead { .. })),
    ]
}

#[test]
fn random_lives_agree_with_the_ticked_model() {
    let base = 0x00ee_0000;
    let met = (0..70).map(|n| live(base + n, 4000)).fold([0; 3], |a, b| [0, 1, 2].map(|i| a[i] + b[i]));
    assert!(met.iter().all(|&n| n > 200), "{met:?} flags, program writes, program reads");
}
