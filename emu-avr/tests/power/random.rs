//! Random programs, resets and supply voltages compared with the model.

use emu_avr::chips::ATMEGA328P;
use emu_avr::soc::AvrSoc;
use emu_avr::{Avr, Options};
use emu_core::CycleTime;
use emu_core::external_io::OutsideInput;
use emu_core::image::Image;
use emu_core::rng::Rng;
use emu_core::{Bus, PinLevel, RamInit};

use crate::model::{Act, BODS, BODSE, CLKPCE, FUSES, Fuses, IVCE, Model};

const REGS: [u16; 10] = [0x61, 0x55, 0x54, 0x53, 0x64, 0x43, 0x66, 0x3E, 0x45, 0x46];
/// Pin PC6.
const RESET_PIN: u16 = 14;

fn chip(fuses: &Fuses, start_up: bool, hz: u64) -> AvrSoc {
    let options = Options { fuses: Some(fuses.bytes), start_up, ..Options::at_hz(hz) };
    Avr::with(&ATMEGA328P, &Image::default(), RamInit::Zero, options).soc().clone()
}

/// All tested chips: by fuses, with and without start-up time, at each clock.
struct Chips(Vec<(usize, bool, u64, AvrSoc)>);

impl Chips {
    fn new() -> Chips {
        let all = (0..FUSES.len())
            .flat_map(|n| [true, false].into_iter().flat_map(move |waits| CLOCKS.map(|hz| (n, waits, hz))));
        Chips(all.map(|(n, waits, hz)| (n, waits, hz, chip(&FUSES[n], waits, hz))).collect())
    }
}

/// Clocks in Hz: at a slow clock the start-up time takes few cycles.
const CLOCKS: [u64; 3] = [1_000, 4_000, 1_000_000];

/// Returns a write that is likely to matter; in half of the cases it continues the sequence of the last
/// action.
fn write(last: Act, rng: &mut Rng) -> Act {
    match last {
        Act::Write(0x55, value) if value == BODS | BODSE && rng.one_in(2) => return Act::Write(0x55, BODS),
        Act::Write(0x55, BODS) if rng.one_in(2) => return Act::Sleep,
        _ => {}
    }
    let any = rng.next_u64() as u8;
    match rng.below(16) {
        0..3 => Act::Write(0x61, CLKPCE),
        3..5 => Act::Write(0x61, any & 0x0F | if rng.one_in(6) { CLKPCE } else { 0 }),
        5 => Act::Write(0x55, any & !0x70 | IVCE),
        6 => Act::Write(0x55, any & 0x13),
        7 => Act::Write(0x55, BODS | BODSE),
        8 => Act::Write(0x55, BODS),
        9 => Act::Write(0x53, any | 1),
        10 => Act::Write(0x64, any & 0x24),
        11 => Act::Write(0x45, u8::from(!rng.one_in(4))),
        12 => Act::Write(0x46, any),
        _ => Act::Write(REGS[rng.below(8) as usize], any),
    }
}

/// Counts of events: starts, resets by the pin, resets by the supply, sleeps with and without the I/O clock,
/// wake-ups that take time, brown-outs at waking.
#[derive(Debug, Default)]
struct Seen([u64; 6]);

fn live(seed: u64, chips: &Chips, seen: &mut Seen) {
    let mut rng = Rng::new(seed);
    let (n, waits, hz, soc) = &chips.0[rng.below(chips.0.len() as u64) as usize];
    let (mut soc, mut model) = (soc.clone(), Model::new(&FUSES[*n], *waits, *hz));
    let cycles = if rng.one_in(60) { 2_000 } else { 150 };
    // Cycles until the core acts again.
    let (mut rest, mut last) = (0, Act::Nothing);
    // After sleep the core stays stopped for 4 cycles more than its clock takes to start (7.7.1).
    let mut up = 0;
    for now in 0..cycles {
        if rng.one_in(90) {
            let low = rng.one_in(2);
            soc.queue_input(CycleTime::at(now), now, OutsideInput::Level(RESET_PIN, PinLevel::from_bit(!low)));
            seen.0[1] += u64::from(low && !model.held());
            model.pin(low);
        } else if rng.one_in(if model.asleep.is_some() { 15 } else { 60 }) {
            let millivolts = [5_000, 5_000, 3_000, 2_000, 1_500, 900][rng.below(6) as usize];
            soc.queue_input(CycleTime::at(now), now, OutsideInput::Supply(millivolts));
            let before = model.held();
            model.power(millivolts);
            seen.0[2] += u64::from(model.held() && !before);
        }
        soc.fire(now);
        if let Some(why) = soc.requested_reset(now) {
            soc.reset(why, now);
            (rest, up) = (0, 0);
        }
        if model.asleep.is_some() && !model.held() && rng.one_in(12) {
            let held = model.look_and_wake();
            soc.wake_up(now);
            rest = model.waking + 4;
            up = now + rest;
            seen.0[4] += u64::from(model.waking > 0);
            if held {
                let why = soc.requested_reset(now);
                assert!(why.is_some(), "brown-out at waking, seed {seed}, cycle {now}");
                why.into_iter().for_each(|why| soc.reset(why, now));
                model.power_again();
                (rest, up) = (0, 0);
                seen.0[5] += 1;
            }
        }
        let stopped = model.held() || model.standing > 0 || now < up;
        assert_eq!(soc.is_core_stopped(), stopped, "stopped, seed {seed}, cycle {now}");
        for reg in REGS {
            assert_eq!(soc.peek(reg, now), model.read(reg), "register {reg:02x}, seed {seed}, cycle {now}");
        }
        let mut act = Act::Nothing;
        if !stopped && model.asleep.is_none() && rest == 0 && rng.one_in(2) {
            seen.0[0] += 1;
            act = if rng.one_in(8) { Act::Sleep } else { write(last, &mut rng) };
            last = act;
        }
        rest = rest.saturating_sub(1);
        match act {
            Act::Write(reg, value) => _ = soc.write(reg, value, now),
            Act::Sleep => {
                let sleeps = soc.sleep(now);
                assert_eq!(sleeps, model.read(0x53) & 1 != 0, "sleep, seed {seed}, cycle {now}");
                seen.0[3] += u64::from(sleeps);
            }
            Act::Nothing => {}
        }
        model.edge(act);
    }
}

#[test]
fn random_programs_agree_with_the_ticked_model() {
    let (chips, mut seen) = (Chips::new(), Seen::default());
    let lives = if cfg!(debug_assertions) { 3_000 } else { 100_000 };
    for seed in 0..lives {
        live(seed, &chips, &mut seen);
    }
    assert!(seen.0[..5].iter().all(|&n| n > lives / 10) && seen.0[5] > lives / 1000, "{seen:?}");
}
