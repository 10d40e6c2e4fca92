//! Random writes, edges, sleeps and resets: timer 0 must agree with the stepped model at every clock.

use emu_core::rng::Rng;
use emu_pic16::periph::map::{Pic16Line, Sfr};
use emu_pic16::periph::timer0::Timer0;
use emu_pic16::periph::{Device, Pic16Outbox};

use crate::model::Model;

/// Runs one random execution of `clocks` clocks; returns the number of signals.
fn live(seed: u64, clocks: u64) -> usize {
    let mut rng = Rng::new(seed);
    let (wdte, wdtcon) = (rng.one_in(2), rng.one_in(3));
    let period = if rng.one_in(2) { 1 + rng.below(60) } else { 100 + rng.below(3000) };
    let period = if wdtcon { period * 16 } else { period };
    let mut timer = Timer0::new(wdte, period, wdtcon);
    let mut model = Model::new(wdte, period, wdtcon);
    let (mut reported, mut expected) = (Pic16Outbox::new(), Pic16Outbox::new());
    // Some executions have many writes, some few; in some T0CKI is fast.
    let (busy, pins) = (4 + rng.below(200), 1 + rng.below(60));
    let mut pin = false;
    // Results of `next_deadline` and `steady_until`, valid until the next disturbance.
    let (mut promised, mut steady) = (timer.next_deadline(), (0, 0));
    for t in 0..clocks {
        let cycle = t.is_multiple_of(4);
        let write = (cycle && rng.one_in(busy)).then(|| match rng.below(8) {
            0..3 => (Sfr::TMR0, if rng.one_in(2) { 0xF0 | rng.next_u64() as u8 } else { rng.next_u64() as u8 }),
            3 => (Sfr::WDTCON, rng.next_u64() as u8),
            // Near the current value, so that single bits change.
            4 => (Sfr::OPTION, model.option ^ 1 << rng.below(6)),
            _ => (Sfr::OPTION, rng.next_u64() as u8 & if rng.one_in(2) { 0x1B } else { 0x3F }),
        });
        let write = write.filter(|_| !model.asleep);
        let before = expected.len();
        model.arrive(t, matches!(write, Some((Sfr::TMR0, _))), &mut expected);
        if write.is_none() && timer.next_deadline() <= t {
            timer.run_due(t, &mut reported);
            assert!(expected.len() > before, "seed {seed:#x}: nothing was due at {t}");
        }
        let mut disturbed = write.is_some();
        if let Some((reg, value)) = write {
            timer.write(reg, value, 0xFF, t, &mut reported);
            model.write(reg, value, t, &mut expected);
        }
        if rng.one_in(pins) {
            disturbed = true;
            pin = !pin;
            timer.on_line_changed(Pic16Line::T0cki, pin, t, &mut reported);
            model.pin(pin);
        }
        if cycle && rng.one_in(300) {
            disturbed = true;
            match (rng.below(8), model.asleep) {
                (0, _) => {
                    timer.reset(false, t, &mut reported);
                    model.reset();
                }
                (1..5, false) => {
                    timer.clear_watchdog(t, &mut reported);
                    model.clear();
                }
                (_, false) => {
                    timer.stop_clock(t, &mut reported);
                    model.asleep = true;
                }
                (_, true) => {
                    timer.restart_clock(t, &mut reported);
                    model.clear();
                    model.asleep = false;
                }
            }
        }
        assert_eq!(reported, expected, "seed {seed:#x} at {t}");
        if cycle {
            for (reg, value) in [(Sfr::TMR0, model.tmr0), (Sfr::OPTION, model.option), (Sfr::WDTCON, model.wdtcon)] {
                assert_eq!(timer.peek(reg, t), value, "seed {seed:#x}: {} at {t}", reg.name());
            }
        }
        if disturbed || reported.len() > before {
            promised = timer.next_deadline();
            steady = (timer.steady_until(Sfr::TMR0, t), model.tmr0);
        } else {
            assert_eq!(timer.next_deadline(), promised, "seed {seed:#x}: next() moved at {t}");
            if t < steady.0 {
                assert_eq!(model.tmr0, steady.1, "seed {seed:#x}: TMR0 was not steady up to {t}");
            } else if steady.0 != 0 && t == steady.0 {
                assert_ne!(model.tmr0, steady.1, "seed {seed:#x}: TMR0 was steady beyond {t}");
            }
        }
        model.tick(t);
    }
    reported.len()
}

#[test]
fn random_lives_agree_with_the_ticked_model() {
    let base = 0x0007_1ae0;
    let signals: usize = (0..200).map(|n| live(base + n, 12_000)).sum();
    assert!(signals > 5_000, "only {signals} signals");
}

#[test]
fn a_long_quiet_run_in_one_call_reports_everything() {
    for seed in 0..40 {
        let mut rng = Rng::new(seed);
        let period = 500 + rng.below(5000);
        let mut timer = Timer0::new(true, period, false);
        let mut model = Model::new(true, period, false);
        let (mut reported, mut expected) = (Pic16Outbox::new(), Pic16Outbox::new());
        let option = rng.next_u64() as u8 & 0x0B;
        for t in 0..60_000 {
            model.arrive(t, false, &mut expected);
            if t == 8 {
                model.write(Sfr::OPTION, option, t, &mut expected);
                timer.write(Sfr::OPTION, option, 0xFF, t, &mut reported);
            }
            model.tick(t);
        }
        timer.run_due(59_999, &mut reported);
        assert_eq!(reported, expected, "seed {seed}");
        assert!(!reported.is_empty(), "seed {seed}");
    }
}
