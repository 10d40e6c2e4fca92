//! Random commands in valid and invalid order, reads, resets and EEPROM writes: peripheral and model must
//! agree in every cycle.

use emu_avr::periph::spm::{ConfigBytes, SelfProgramming, SpmKind, SpmRegister};
use emu_avr::periph::{AvrOutbox, AvrSignal, Device};
use emu_core::rng::Rng;

use crate::model::Model;

const RATES: [u64; 3] = [2_000, 5_000, 10_000];
const KINDS: [SpmKind; 5] = [SpmKind::MEGA328, SpmKind::MEGA88, SpmKind::MEGA48, SpmKind::MEGA8, SpmKind::MEGA128];
const COMMANDS: [u8; 6] = [0x01, 0x03, 0x05, 0x09, 0x11, 0x21];

/// Returns an address in one of a few pages, including those at the borders of the sections.
fn address(rng: &mut Rng, kind: SpmKind, boot: u32) -> u32 {
    let base =
        [0, boot, boot.wrapping_sub(1), kind.nrww, kind.nrww.wrapping_sub(1), kind.flash - 1][rng.below(6) as usize];
    base.wrapping_add(rng.below(6) as u32) & 0x1_FFFF
}

/// Applies the signals to a program memory, and updates the edge up to which the core is halted.
fn carry_out(flash: &mut [u16], out: &mut AvrOutbox, kind: SpmKind, halted_until: &mut u64) {
    for signal in out.drain(..) {
        match signal {
            AvrSignal::ErasePage { addr } => flash[addr as usize / 2..][..kind.page as usize / 2].fill(0xFFFF),
            AvrSignal::WritePage { addr, words } => {
                assert_eq!(words.len(), kind.page as usize / 2);
                flash[addr as usize / 2..].iter_mut().zip(words).for_each(|(old, new)| *old &= new);
            }
            AvrSignal::Stall { until } => *halted_until = until,
            other => panic!("{other:?}"),
        }
    }
}

fn live(seed: u64, seen: &mut [u64; 5]) {
    let mut rng = Rng::new(seed);
    let kind = KINDS[[0, 0, 1, 2, 3, 4][rng.below(6) as usize]];
    let boot = if kind.boot { kind.flash - [0x800, 0x200][rng.below(2) as usize] } else { 0 };
    let lock = if rng.one_in(2) { 0xFF } else { rng.next_u64() as u8 };
    let bytes = ConfigBytes { lock, fuses: [0x62, 0xDF, 0xF9], signature: [0x1E, 0x95, 0x0F], calibration: 0xA7 };
    let hz = RATES[rng.below(3) as usize];
    let (mut dut, mut model) = (SelfProgramming::new(kind, bytes, boot, hz), Model::new(kind, bytes, boot, hz));
    let mut flash = model.flash.clone();
    let (mut halted_until, mut promised) = (0, (0, 0));
    // Edge at which an SPM or LPM follows, and which of them.
    let mut plan = (0, false);
    let (end, mut changed) = (60 + rng.below(200), false);
    for t in 1..end {
        let at = || format!("seed {seed}, cycle {t}");
        let mut out = AvrOutbox::new();
        model.tick();
        if dut.next_deadline() <= t || rng.one_in(20) {
            dut.run_due(t, &mut out);
        }
        assert!(t >= promised.0 || model.spmcsr() == promised.1, "SPMCSR promised, {}", at());
        let z = address(&mut rng, kind, boot);
        let pc = if rng.one_in(3) { address(&mut rng, kind, boot) } else { kind.flash - 2 };
        let data = rng.next_u64() as u16 | 0xFF00;
        let (planned, spm) = (plan.0 == t, plan.1);
        match rng.below(40) {
            0..=5 | 10..=15 | 20 if planned && spm => {
                dut.spm(z, data, pc, t, &mut out);
                model.spm(z, data, pc);
                promised = (0, 0);
            }
            _ if planned => {
                let z = if rng.one_in(4) { z } else { rng.below(6) as u32 };
                let row = model.armed.is_some();
                let got = dut.lpm(z, pc, t);
                assert_eq!(got, model.lpm(z, pc), "LPM, {}", at());
                seen[3] += u64::from(row && got.is_some_and(|byte| byte != 0xFF));
                promised = (0, 0);
            }
            0..=4 => {
                let value = COMMANDS[rng.below(6) as usize] | [0, 0x80, 0x40][rng.below(3) as usize];
                let value = if rng.one_in(8) { rng.next_u64() as u8 } else { value };
                dut.write(SpmRegister::SPMCSR, value, 0xFF, t, &mut out);
                model.write(value);
                plan = (t + 1 + rng.below(5), !rng.one_in(4));
                promised = (0, 0);
            }
            5 => {
                dut.spm(z, data, pc, t, &mut out);
                model.spm(z, data, pc);
                promised = (0, 0);
            }
            6 => {
                assert_eq!(dut.lpm(z, pc, t), model.lpm(z, pc), "LPM, {}", at());
                promised = (0, 0);
            }
            7 if rng.one_in(4) => {
                model.eeprom = rng.below(20);
                if model.eeprom > 0 {
                    model.buffer.fill(None);
                }
                dut.block_until(if model.eeprom == 0 { 0 } else { t + model.eeprom }, t);
            }
            8 if rng.one_in(6) => {
                dut.reset(false, t, &mut out);
                model.reset();
                (halted_until, promised) = (0, (0, 0));
            }
            9 if rng.one_in(6) => {
                model.hz = RATES[rng.below(3) as usize];
                dut.set_clock_hz(model.hz, t);
                promised = (0, 0);
                if model.halted {
                    halted_until = dut.busy_until();
                }
            }
            _ => {}
        }
        changed |= !out.is_empty();
        carry_out(&mut flash, &mut out, kind, &mut halted_until);
        assert_eq!(t < halted_until, model.halted, "the core is stopped, {}", at());
        assert_eq!(dut.peek(SpmRegister::SPMCSR, t), model.spmcsr(), "SPMCSR, {}", at());
        let ready = model.spmie && model.busy.is_none() && model.armed.is_none() && model.eeprom == 0;
        assert_eq!(dut.interrupt_requests(), u8::from(ready), "interrupt, {}", at());
        let asked = address(&mut rng, kind, boot);
        assert_eq!(dut.is_unreadable(asked), model.unreadable(asked), "{asked:X}, {}", at());
        if rng.one_in(4) {
            dut.run_due(t, &mut out);
            assert_eq!(*dut.config_bytes(), model.bytes, "lock bits, {}", at());
            for ivsel in [false, true] {
                assert_eq!(
                    dut.bars_interrupts(asked, ivsel),
                    model.bars_interrupts(asked, ivsel),
                    "{asked:X}, {}",
                    at()
                );
            }
            promised = (dut.steady_until(SpmRegister::SPMCSR, t), model.spmcsr());
        }
        if changed && (rng.one_in(16) || t + 1 == end) {
            assert!(flash == model.flash, "program memory, {}", at());
            changed = false;
        }
        seen[0] += u64::from(model.busy.is_some() && model.halted);
        seen[1] += u64::from(model.rwwsb && model.busy.is_none());
        seen[2] += u64::from(model.bytes.lock != lock);
        seen[4] += u64::from(model.eeprom > 0 && model.spmie);
    }
}

#[test]
fn random_programs_agree_with_the_ticked_model() {
    let mut seen = [0; 5];
    let lives = if cfg!(debug_assertions) { 3_000 } else { 100_000 };
    for seed in 0..lives {
        live(seed, &mut seen);
    }
    assert!(seen.iter().all(|&n| n > lives / 10), "{seen:?}");
}
