//! Timers 0 and 1 compared with the ticked model, with random writes, pins and distances.

use crate::model::Model;
use emu_8051::periph::map::{pin, sfr};
use emu_8051::periph::timer::Mcs51Timers;
use emu_8051::periph::{Device, Mcs51Outbox};
use emu_core::rng::Rng;

/// A random byte; boundary values are more frequent.
pub fn byte(rng: &mut Rng) -> u8 {
    match rng.below(8) {
        0..=2 => 0xFF,
        3 => 0xFE,
        4 => [0, 1, 0x1F, 0x1E, 0x7F, 0x80, 0xE0, 0xFD][rng.below(8) as usize],
        _ => rng.next_u64() as u8,
    }
}

/// Random cycles to the next comparison; mostly few.
pub fn distance(rng: &mut Rng, longest: u64) -> u64 {
    match rng.below(4000) {
        0 => 1 + rng.below(longest),
        1..200 => 1 + rng.below(700),
        _ => 1 + rng.below(6),
    }
}

fn write(rng: &mut Rng, timers: &mut Mcs51Timers, model: &mut Model) {
    let (n, value) = (rng.below(2) as usize, byte(rng));
    match rng.below(5) {
        0 => {
            let value = rng.next_u64() as u8;
            timers.write(sfr::TMOD, value, 0xFF, model.cycle, &mut Mcs51Outbox::new());
            model.tmod = value;
        }
        1 => {
            timers.write([sfr::TL0, sfr::TL1][n], value, 0xFF, model.cycle, &mut Mcs51Outbox::new());
            model.tl[n] = value;
        }
        2 => {
            timers.write([sfr::TH0, sfr::TH1][n], value, 0xFF, model.cycle, &mut Mcs51Outbox::new());
            model.th[n] = value;
        }
        3 => {
            let on = !rng.one_in(4);
            timers.set_run(n, on);
            model.run[n] = on;
        }
        _ => {
            let on = rng.one_in(4);
            timers.set_flag(n, on);
            model.write_flag(n, on);
        }
    }
}

fn pins(rng: &mut Rng, timers: &mut Mcs51Timers, model: &mut Model, cycle: u64) {
    let (n, level) = (rng.below(2) as usize, rng.one_in(2));
    if rng.one_in(2) {
        timers.on_line_changed([pin::T0, pin::T1][n], level, cycle, &mut Mcs51Outbox::new());
        model.t[n] = level;
    } else {
        timers.on_line_changed([pin::INT0, pin::INT1][n], level, cycle, &mut Mcs51Outbox::new());
        model.int[n] = level;
    }
}

fn same(timers: &Mcs51Timers, model: &Model, seed: u64, step: u64) {
    for n in 0..2 {
        let reg = |regs: [u8; 2]| timers.peek(regs[n], model.cycle);
        let found = (
            reg([sfr::TL0, sfr::TL1]),
            reg([sfr::TH0, sfr::TH1]),
            timers.run(n),
            timers.flag(n),
            timers.flag_set_since(n),
        );
        let wanted = (model.tl[n], model.th[n], model.run[n], model.flag[n], model.since[n]);
        assert_eq!(found, wanted, "seed {seed} step {step} cycle {}: timer {n}: tl th run flag since", model.cycle);
    }
    let found = (timers.peek(sfr::TMOD, model.cycle), timers.ticks().count_by_cycle(model.cycle));
    assert_eq!(found, (model.tmod, model.overflows), "seed {seed} step {step}: tmod, overflows");
}

/// Advances both by `cycles`, and checks the predictions made before.
fn advance(rng: &mut Rng, timers: &mut Mcs51Timers, model: &mut Model, cycles: u64, at: &str) {
    let from = model.cycle;
    let upto = from + cycles;
    let flags = [timers.next_flag(0), timers.next_flag(1)];
    let ahead = 1 + rng.below(5);
    let overflow = timers.ticks().cycle_of(model.overflows + ahead);
    let middle = from + rng.below(cycles + 1);
    let by = timers.ticks().count_by_cycle(middle) - model.overflows;
    model.flags_log.iter_mut().for_each(Vec::clear);
    model.overflow_log.clear();
    for _ in 0..cycles {
        model.tick();
    }
    timers.advance_to(upto);
    let check_due = |due: u64, came: Option<&u64>, what: &str| match came {
        Some(&came) => assert_eq!(due, came, "{at}: {what}"),
        None => assert!(due > upto, "{at}: {what} expected at {due}, nothing came until {upto}"),
    };
    check_due(flags[0], model.flags_log[0].first(), "TF0");
    check_due(flags[1], model.flags_log[1].first(), "TF1");
    check_due(overflow, model.overflow_log.get(ahead as usize - 1), "overflow");
    let came = model.overflow_log.iter().filter(|&&cycle| cycle <= middle).count();
    assert_eq!(by, came as u64, "{at}: overflows by {middle}");
}

#[test]
fn timers_0_and_1_as_ticked() {
    for seed in 0..25_000 {
        let mut rng = Rng::new(seed);
        let start = rng.below(3) * 1000;
        let (mut timers, mut model) = (Mcs51Timers::new(start), Model::new(start));
        for step in 0..14 {
            let at = format!("seed {seed} step {step} cycle {}", model.cycle);
            for _ in 0..rng.below(if step == 0 { 9 } else { 3 }) {
                write(&mut rng, &mut timers, &mut model);
            }
            same(&timers, &model, seed, step);
            if rng.one_in(2) {
                let cycle = model.cycle + 1;
                pins(&mut rng, &mut timers, &mut model, cycle);
                let mut earlier = model.clone();
                advance(&mut rng, &mut timers, &mut model, 1, &at);
                if rng.one_in(3) {
                    // Several changes in one cycle: the last level is the one that is sampled.
                    pins(&mut rng, &mut timers, &mut earlier, cycle);
                    pins(&mut rng, &mut timers, &mut earlier, cycle);
                    earlier.tick();
                    model = earlier;
                }
                same(&timers, &model, seed, step);
            } else {
                let cycles = distance(&mut rng, 200_000);
                advance(&mut rng, &mut timers, &mut model, cycles, &at);
                same(&timers, &model, seed, step);
            }
        }
    }
}
