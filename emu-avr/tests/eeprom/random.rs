//! A model of the EEPROM that steps cycle by cycle, and random programs: both must agree in every cycle.

use std::sync::Arc;

use emu_avr::periph::eeprom::{AvrEeprom, AvrEepromKind, EepromRegister};
use emu_avr::periph::{AvrOutbox, AvrSignal, Device};
use emu_core::rng::Rng;

const SECOND_PS: u64 = 1_000_000_000_000;
/// Clocks in Hz with a whole number of picoseconds per cycle.
const RATES: [u64; 5] = [125_000, 500_000, 1_000_000, 2_000_000, 4_000_000];
const REGS: [EepromRegister; 4] =
    [EepromRegister::EEARL, EepromRegister::EEARH, EepromRegister::EEDR, EepromRegister::EECR];

struct Model {
    kind: AvrEepromKind,
    cells: Vec<u8>,
    hz: u64,
    eear: usize,
    eedr: u8,
    eepm: u8,
    eerie: bool,
    /// Remaining cycles of EEMPE, and whether it was set in the cycle that has just ended.
    eempe: u8,
    was_set: bool,
    /// Remaining picoseconds of a write, and its effect.
    busy: Option<u64>,
    target: (usize, u8, u8),
    /// Remaining cycles of a write of program memory.
    blocked: u64,
    halt: u64,
}

impl Model {
    fn tick(&mut self) {
        self.was_set = self.eempe > 0;
        self.eempe = self.eempe.saturating_sub(1);
        self.blocked = self.blocked.saturating_sub(1);
        self.halt = self.halt.saturating_sub(1);
        if let Some(left) = self.busy {
            let left = left.saturating_sub(SECOND_PS / self.hz);
            self.busy = (left > 0).then_some(left);
            if left == 0 {
                let (addr, value, mode) = self.target;
                let erased = if mode == 0 || mode == 1 { 0xFF } else { self.cells[addr] };
                self.cells[addr] = if mode == 0 || mode == 2 { erased & value } else { erased };
            }
        }
    }

    fn write(&mut self, reg: EepromRegister, value: u8, mask: u8) {
        let mix = |old: u8| old & !mask | value & mask;
        let idle = self.busy.is_none();
        match reg {
            EepromRegister::EEARL if idle => {
                self.eear = (self.eear / 256 * 256 + usize::from(mix(self.eear as u8))) % self.cells.len()
            }
            EepromRegister::EEARH if idle => {
                self.eear = (self.eear % 256 + 256 * usize::from(mix((self.eear / 256) as u8))) % self.cells.len();
            }
            EepromRegister::EEARL | EepromRegister::EEARH => {}
            EepromRegister::EEDR => self.eedr = mix(self.eedr),
            EepromRegister::EECR => {
                let (open, new) = (self.was_set, mix(self.eecr() & 0x38));
                self.eerie = new & 8 != 0;
                if idle && self.kind.modes {
                    self.eepm = new >> 4 & 3;
                }
                if mask & 4 != 0 {
                    self.eempe = if value & 4 != 0 { 4 } else { 0 };
                    self.was_set = false;
                }
                if idle && value & mask & 2 != 0 && open && self.blocked == 0 {
                    let us = if self.eepm == 0 { self.kind.both_us } else { self.kind.half_us };
                    self.busy = Some(u64::from(us) * 1_000_000);
                    self.target = (self.eear, self.eedr, self.eepm);
                    self.halt = 2;
                } else if idle && value & mask & 1 != 0 {
                    self.eedr = self.cells[self.eear];
                    self.halt = 4;
                }
            }
        }
    }

    fn eecr(&self) -> u8 {
        let bits = [self.eerie, self.eempe > 0, self.busy.is_some(), false];
        self.eepm << 4 | bits.iter().fold(0, |value, &bit| value << 1 | u8::from(bit))
    }

    fn get(&self, reg: EepromRegister) -> u8 {
        match reg {
            EepromRegister::EEARL => self.eear as u8,
            EepromRegister::EEARH => (self.eear / 256) as u8,
            EepromRegister::EEDR => self.eedr,
            EepromRegister::EECR => self.eecr(),
        }
    }
}

fn live(seed: u64, seen: &mut [u64; 3]) {
    let mut rng = Rng::new(seed);
    let len = [256, 512, 1024][rng.below(3) as usize];
    let mut cells = vec![0; len];
    rng.fill(&mut cells);
    let hz = RATES[rng.below(5) as usize];
    // Short write times, so that an execution has many writes.
    let kind =
        AvrEepromKind { modes: rng.one_in(2), both_us: 1 + rng.below(60) as u32, half_us: 1 + rng.below(30) as u32 };
    let mut dut = AvrEeprom::new(kind, Arc::new(cells.clone()), hz);
    let mut model = Model {
        kind,
        cells,
        hz,
        eear: 0,
        eedr: 0,
        eepm: 0,
        eerie: false,
        eempe: 0,
        was_set: false,
        busy: None,
        target: (0, 0, 0),
        blocked: 0,
        halt: 0,
    };
    let (mut halted_until, mut promised) = (0, [(0, 0); 4]);
    // Planned writes of a sequence that starts a write, by cycle.
    let mut plan: Vec<(u64, u8, u8)> = Vec::new();
    for t in 1..100 + rng.below(300) {
        let at = || format!("seed {seed}, cycle {t}");
        let mut out = AvrOutbox::new();
        model.tick();
        if dut.next_deadline() <= t || rng.one_in(20) {
            dut.run_due(t, &mut out);
        }
        for (n, &(_, value)) in promised.iter().enumerate().filter(|(_, p)| p.0 > t) {
            assert_eq!(model.get(REGS[n]), value, "{:?} promised, {}", REGS[n], at());
        }
        let byte = rng.next_u64() as u8;
        let mask = if rng.one_in(4) { 1 << rng.below(8) } else { 0xFF };
        let planned = plan.iter().position(|p| p.0 == t).map(|n| plan.remove(n));
        let mut write = |dut: &mut AvrEeprom, model: &mut Model, reg, value, mask| {
            promised = [(0, 0); 4];
            dut.write(reg, value, mask, t, &mut out);
            model.write(reg, value, mask);
        };
        match (planned, rng.below(40)) {
            (Some((_, value, mask)), _) => write(&mut dut, &mut model, EepromRegister::EECR, value, mask),
            (_, 0..=2) => {
                let mode = if rng.one_in(2) { byte & 0x38 } else { 0 };
                plan = vec![(t + 1, 4 | mode, if mode == 0 { 4 } else { 0xFF }), (t + 2 + rng.below(6), 2, 2)];
            }
            (_, 3) => write(&mut dut, &mut model, EepromRegister::EECR, byte, mask),
            (_, 4 | 5) => write(&mut dut, &mut model, EepromRegister::EECR, 1, 1),
            // Few cells, so that the same cell is used again.
            (_, 6) => write(&mut dut, &mut model, EepromRegister::EEARL, byte & 3, mask),
            (_, 7) => write(&mut dut, &mut model, REGS[usize::from(byte & 1)], byte.rotate_left(3), mask),
            (_, 8 | 9) => write(&mut dut, &mut model, EepromRegister::EEDR, byte, mask),
            (_, 10) => {
                model.blocked = [0, 0, rng.below(30)][rng.below(3) as usize];
                dut.block_until(if model.blocked == 0 { 0 } else { t + model.blocked }, t);
            }
            (_, 11) if rng.one_in(4) => {
                model.hz = RATES[rng.below(5) as usize];
                dut.set_clock_hz(model.hz, t);
                promised = [(0, 0); 4];
            }
            (_, 12) if rng.one_in(4) => {
                dut.reset(false, t, &mut out);
                (model.eedr, model.eerie, model.eempe) = (0, false, 0);
                if model.busy.is_none() {
                    model.eepm = 0;
                }
                promised = [(0, 0); 4];
            }
            (_, 13) => dut.stop_clock(t, &mut out),
            (_, 14) => dut.restart_clock(t, &mut out),
            _ => {}
        }
        for signal in out {
            let AvrSignal::Stall { until } = signal else { panic!("{signal:?}, {}", at()) };
            halted_until = until;
        }
        assert_eq!(t < halted_until, model.halt > 0, "the core is stopped, {}", at());
        for reg in REGS {
            assert_eq!(dut.peek(reg, t), model.get(reg), "{reg:?}, {}", at());
        }
        let ready = model.eerie && model.busy.is_none() && model.blocked == 0;
        assert_eq!(dut.interrupt_requests(), u8::from(ready), "interrupt, {}", at());
        if rng.one_in(8) {
            dut.run_due(t, &mut AvrOutbox::new());
            assert!(dut.cells()[..] == model.cells[..], "cells, {}", at());
            seen[1] += u64::from(model.cells[model.eear] == 0xFF);
        }
        seen[0] += u64::from(model.halt == 2 && model.busy.is_some());
        seen[2] += u64::from(model.blocked > 0 && model.eerie);
        if rng.one_in(6) {
            promised = REGS.map(|reg| (dut.steady_until(reg, t), model.get(reg)));
        }
    }
}

#[test]
fn random_programs_agree_with_the_ticked_model() {
    let mut seen = [0; 3];
    let lives = if cfg!(debug_assertions) { 3_000 } else { 100_000 };
    for seed in 0..lives {
        live(seed, &mut seen);
    }
    assert!(seen.iter().all(|&n| n > lives / 10), "{seen:?}");
}
