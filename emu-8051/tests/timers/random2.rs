//! Timer 2 compared with the ticked model, with random writes, pins and distances.

use crate::model2::Model;
use crate::random::{byte, distance};
use emu_8051::periph::map::{pin, sfr};
use emu_8051::periph::timer2::Mcs51Timer2;
use emu_8051::periph::{Device, Mcs51Outbox};
use emu_core::NEVER;
use emu_core::rng::Rng;

fn write(rng: &mut Rng, timer: &mut Mcs51Timer2, model: &mut Model) {
    model.finish();
    let value = byte(rng);
    let (low, high) = (u16::from(value), u16::from(value) << 8);
    let mut write = |reg, value| timer.write(reg, value, 0xFF, model.cycle, &mut Mcs51Outbox::new());
    match rng.below(6) {
        0 => {
            // Baud generators, counters and stopped timers are less frequent than their opposites.
            let mut value = rng.next_u64() as u8 & (rng.next_u64() as u8 | 0xC9);
            value |= if rng.one_in(5) { 0 } else { 4 };
            write(sfr::T2CON, value);
            model.write_t2con(value);
        }
        1 => {
            let value = rng.next_u64() as u8 & (rng.next_u64() as u8 | 1);
            write(sfr::T2MOD, value);
            model.write_t2mod(value);
        }
        2 => {
            write(sfr::TL2, value);
            model.value = model.value & 0xFF00 | low;
        }
        3 => {
            write(sfr::TH2, value);
            model.value = model.value & 0xFF | high;
        }
        4 => {
            write(sfr::RCAP2L, value);
            model.rcap = model.rcap & 0xFF00 | low;
        }
        _ => {
            write(sfr::RCAP2H, value);
            model.rcap = model.rcap & 0xFF | high;
        }
    }
}

fn pins(rng: &mut Rng, timer: &mut Mcs51Timer2, model: &mut Model, cycle: u64) {
    let (n, level) = (rng.below(2) as usize, rng.one_in(2));
    timer.on_line_changed([pin::T2, pin::T2EX][n], level, cycle, &mut Mcs51Outbox::new());
    model.pins[n] = level;
}

fn same(timer: &Mcs51Timer2, model: &Model, at: &str) {
    let reg = |reg| timer.peek(reg, model.cycle);
    let found = [sfr::T2CON, sfr::T2MOD, sfr::TH2, sfr::TL2, sfr::RCAP2H, sfr::RCAP2L].map(reg);
    let [high, low] = model.value.to_be_bytes();
    let [rcaph, rcapl] = model.rcap.to_be_bytes();
    let wanted = [model.t2con(), model.t2mod, high, low, rcaph, rcapl];
    assert_eq!(found, wanted, "{at} now {}: t2con t2mod th2 tl2 rcap2h rcap2l", model.cycle);
    let found = (timer.flags_set_since(), timer.ticks().count_at(6 * model.cycle + 4), timer.clock_out());
    let wanted = (model.since(), model.overflows, model.clock_on().then_some(model.clock));
    assert_eq!(found, wanted, "{at} now {}: since overflows clock_out", model.cycle);
}

/// Advances both by `cycles`, and checks the predictions made before.
fn advance(rng: &mut Rng, timer: &mut Mcs51Timer2, model: &mut Model, cycles: u64, at: &str) {
    let from = model.cycle;
    let upto = from + cycles;
    let last = 6 * upto + 4;
    let (flag, toggle) =
        (timer.next_flag(), timer.clock_out().map_or(NEVER, |_| timer.ticks().time_of(model.overflows + 1)));
    let ahead = 1 + rng.below(5);
    let overflow = timer.ticks().time_of(model.overflows + ahead);
    let middle = 6 * from + 4 + rng.below(6 * cycles + 1);
    let by = timer.ticks().count_at(middle) - model.overflows;
    model.flag_log.clear();
    model.overflow_log.clear();
    model.toggle_log.clear();
    for _ in 0..cycles {
        model.tick();
    }
    timer.advance_to(upto);
    let check_due = |due: u64, came: Option<&u64>, last: u64, what: &str| match came {
        Some(&came) => assert_eq!(due, came, "{at}: {what}"),
        None => assert!(due > last, "{at}: {what} expected at {due}, nothing came until {last}"),
    };
    // The flag of an overflow in the cycle after the last has the time of the last cycle, and is not set yet.
    check_due(flag, model.flag_log.first(), upto - 1, "flag");
    check_due(overflow, model.overflow_log.get(ahead as usize - 1), last, "overflow");
    check_due(toggle, model.toggle_log.first(), last, "toggle");
    let came = model.overflow_log.iter().filter(|&&state| state <= middle).count();
    assert_eq!(by, came as u64, "{at}: overflows by {middle}");
}

#[test]
fn timer_2_as_ticked() {
    for seed in 0..25_000 {
        let mut rng = Rng::new(seed);
        let start = rng.below(3) * 1000;
        let (mut timer, mut model) = (Mcs51Timer2::new(start), Model::new(start));
        for step in 0..14 {
            let at = format!("seed {seed} step {step} cycle {}", model.cycle);
            for _ in 0..rng.below(if step == 0 { 9 } else { 3 }) {
                write(&mut rng, &mut timer, &mut model);
            }
            same(&timer, &model, &at);
            if rng.one_in(2) {
                let cycle = model.cycle + 1;
                pins(&mut rng, &mut timer, &mut model, cycle);
                let mut earlier = model.clone();
                advance(&mut rng, &mut timer, &mut model, 1, &at);
                if rng.one_in(3) {
                    // Several changes in one cycle: the last level is the one that is sampled.
                    pins(&mut rng, &mut timer, &mut earlier, cycle);
                    pins(&mut rng, &mut timer, &mut earlier, cycle);
                    earlier.tick();
                    model = earlier;
                }
            } else {
                let cycles = distance(&mut rng, 200_000);
                advance(&mut rng, &mut timer, &mut model, cycles, &at);
            }
            same(&timer, &model, &at);
        }
    }
}
