//! Random writes, edges, sleeps and resets: timer and model must agree in every cycle.

use emu_avr::periph::timers::{AvrTimer, TimerRegister, TimerShape};
use emu_avr::periph::{AvrDrive, AvrLine, AvrSignal, Device};
use emu_core::parts::prescaler::Prescaler;
use emu_core::rng::Rng;

use crate::model::Model;

/// Timers of the ATmega328P and of related chips: with zero, one, two and three channels.
const SHAPES: [TimerShape; 8] = [
    TimerShape::narrow(2),
    TimerShape::wide(2),
    TimerShape::crystal(2),
    TimerShape::wide(3),
    TimerShape::narrow(1),
    TimerShape::crystal(1),
    TimerShape::narrow(0),
    TimerShape { icr_only_as_top: true, ..TimerShape::wide(2) },
];
const REGS: [TimerRegister; 16] = [
    TimerRegister::TCCRA,
    TimerRegister::TCCRB,
    TimerRegister::TCCRC,
    TimerRegister::TCNTL,
    TimerRegister::TCNTH,
    TimerRegister::OCRAL,
    TimerRegister::OCRAH,
    TimerRegister::OCRBL,
    TimerRegister::OCRBH,
    TimerRegister::OCRCL,
    TimerRegister::OCRCH,
    TimerRegister::ICRL,
    TimerRegister::ICRH,
    TimerRegister::TIMSK,
    TimerRegister::TIFR,
    TimerRegister::ASSR,
];
const RATE: u64 = 1_000_000;
const CRYSTALS: [u64; 6] = [250_000, 249_999, 200_000, 137_001, 90_001, 32_768];
/// Registers that change on their own.
const LIVE: [TimerRegister; 4] = [TimerRegister::TIFR, TimerRegister::TCNTL, TimerRegister::ICRL, TimerRegister::ASSR];

/// Counts of the model's events: drives, signalled flags by bit, captures, sleeps, latches.
#[derive(Debug, Default)]
struct Heard {
    drives: u64,
    flags: [u64; 6],
    reported: u64,
    busy: u64,
    stale: u64,
}

struct TestBench {
    rng: Rng,
    shape: TimerShape,
    timer: AvrTimer,
    model: Model,
    prescaler: Prescaler,
    /// Cycle since which the chip sleeps, and whether the prescaler is stopped too.
    asleep: Option<(u64, bool)>,
    listened: u8,
    out: Vec<AvrSignal>,
}

impl TestBench {
    /// Returns a value that soon has an effect.
    fn value(&mut self, reg: TimerRegister) -> u8 {
        let rng = &mut self.rng;
        let (top, model_assr) = (self.model.units[0].temporary as u8, self.model.assr);
        match reg {
            _ if rng.one_in(10) => rng.next_u64() as u8,
            TimerRegister::TCCRB => {
                let select = [1, 1, 1, 1, 1, 2, 6, 7][rng.below(8) as usize];
                rng.next_u64() as u8 & 0xF8 | select
            }
            TimerRegister::TCNTH
            | TimerRegister::OCRAH
            | TimerRegister::OCRBH
            | TimerRegister::OCRCH
            | TimerRegister::ICRH => [0, 0, 0, 0, 0xFF, 1, 3][rng.below(7) as usize],
            TimerRegister::TCNTL if rng.one_in(2) => [0xFD, 0xFE, 0xFF, 0, 1][rng.below(5) as usize],
            TimerRegister::TCNTL => top.wrapping_add(rng.below(5) as u8).wrapping_sub(3),
            TimerRegister::OCRBL | TimerRegister::OCRCL | TimerRegister::ICRL if rng.one_in(3) => top,
            TimerRegister::OCRAL | TimerRegister::OCRBL | TimerRegister::OCRCL | TimerRegister::ICRL
                if rng.one_in(6) =>
            {
                0xFF
            }
            TimerRegister::OCRAL | TimerRegister::OCRBL | TimerRegister::OCRCL | TimerRegister::ICRL => {
                rng.below(10) as u8
            }
            TimerRegister::TIFR if rng.one_in(2) => 0xFF,
            TimerRegister::ASSR if rng.one_in(2) => model_assr,
            TimerRegister::ASSR => [0x20, 0x20, 0x20, 0x60, 0x00][rng.below(5) as usize],
            _ => rng.next_u64() as u8,
        }
    }

    fn pick(&mut self, first: bool) -> (TimerRegister, u8, u8) {
        let reg = if first && self.rng.one_in(2) {
            [TimerRegister::TCCRA, TimerRegister::TCCRB, TimerRegister::TIMSK][self.rng.below(3) as usize]
        } else {
            REGS[self.rng.below(16) as usize]
        };
        let value = self.value(reg);
        let single =
            matches!(reg, TimerRegister::TIFR | TimerRegister::TIMSK | TimerRegister::TCCRA | TimerRegister::TCCRB)
                && self.rng.one_in(6);
        (reg, value, if single { 1 << self.rng.below(8) } else { 0xFF })
    }

    /// Does something other than a write, after the edge `t`.
    fn other(&mut self, t: u64) {
        let TestBench { rng, timer, model, prescaler, out, .. } = self;
        match (self.asleep, rng.below(14)) {
            (Some((since, stood)), 0..=2 | 4..=6) => {
                self.asleep = None;
                timer.restart_clock(t, out);
                model.wake();
                if stood && !model.is_async() {
                    let origin = prescaler.tap(1).origin + (t - since);
                    prescaler.restart(origin, prescaler.is_held());
                    timer.prescaler(*prescaler, t, out);
                }
            }
            (None, 0..=2) => {
                self.asleep = Some((t, !model.is_async() && rng.one_in(2)));
                timer.stop_clock(t, out);
                model.sleep();
            }
            (asleep, 3) => {
                // A reset clears the prescaler.
                model.reset();
                timer.reset(false, t, out);
                if asleep.is_some() || rng.one_in(2) {
                    *prescaler = Prescaler::new(t);
                    model.clear_divider(false);
                    timer.prescaler(*prescaler, t, out);
                } else {
                    model.clear_divider(prescaler.is_held());
                    prescaler.restart(t, prescaler.is_held());
                    timer.prescaler(*prescaler, t, out);
                }
                self.asleep = None;
            }
            (None, 4..=6) => {
                let held = rng.one_in(4);
                prescaler.restart(t, held);
                timer.prescaler(*prescaler, t, out);
                model.clear_divider(held);
            }
            (_, 7..=8) => {
                let irqs = rng.next_u64() as u8;
                timer.set_listened_interrupts(irqs, t, out);
                self.listened = irqs;
            }
            (_, 9) => {
                let hz = CRYSTALS[rng.below(6) as usize];
                timer.crystal_hz(hz, t, out);
                model.crystal.hz = hz;
            }
            (_, 10) => {
                let rate = [RATE, RATE + 1, 2 * RATE][rng.below(3) as usize];
                timer.set_clock_hz(rate, t);
                model.crystal.set_rate(rate);
            }
            (_, 11) => {
                let stopped = !model.crystal.stopped && rng.one_in(2);
                timer.set_oscillator_running(!stopped, t, out);
                model.crystal.stopped = stopped;
            }
            _ if timer.interrupt_requests() != 0 => {
                let irq = timer.interrupt_requests().trailing_zeros() as u8;
                timer.on_interrupt_taken(irq, t, out);
                model.tifr &= !self.shape.flags_of(1 << irq);
            }
            _ => {}
        }
    }

    /// Instructions that read with side effects.
    fn reads(&mut self, t: u64, place: &dyn Fn(&Model) -> String) {
        let reg =
            [TimerRegister::TCNTL, TimerRegister::TCNTH, TimerRegister::ICRL, TimerRegister::ICRH, TimerRegister::TIFR]
                [self.rng.below(5) as usize];
        let model = &mut self.model;
        let want = match reg {
            TimerRegister::TCNTL => {
                model.temp = if self.shape.wide { (model.tcnt >> 8) as u8 } else { 0 };
                model.shown() as u8
            }
            TimerRegister::ICRL => {
                model.temp = if self.shape.wide { (model.icr >> 8) as u8 } else { 0 };
                model.icr as u8
            }
            TimerRegister::TIFR => model.tifr,
            _ => model.temp,
        };
        assert_eq!(self.timer.read(reg, t, &mut self.out), want, "read {reg:?}, {}", place(model));
    }

    fn want(&self, reg: TimerRegister) -> u8 {
        let model = &self.model;
        let [a, b, c] = model.units.map(|unit| unit.temporary);
        match reg {
            TimerRegister::TCCRA => model.tccra,
            TimerRegister::TCCRB => model.tccrb,
            TimerRegister::TCCRC => 0,
            TimerRegister::TCNTL => model.shown() as u8,
            TimerRegister::TCNTH | TimerRegister::ICRH => model.temp,
            TimerRegister::OCRAL => a as u8,
            TimerRegister::OCRAH => (a >> 8) as u8,
            TimerRegister::OCRBL => b as u8,
            TimerRegister::OCRBH => (b >> 8) as u8,
            TimerRegister::OCRCL => c as u8,
            TimerRegister::OCRCH => (c >> 8) as u8,
            TimerRegister::ICRL => model.icr as u8,
            TimerRegister::TIMSK => model.timsk,
            TimerRegister::TIFR => model.tifr,
            TimerRegister::ASSR => model.assr(),
        }
    }
}

fn run(seed: u64, shape: TimerShape, cycles: u64, heard: &mut Heard) {
    let mut rng = Rng::new(seed);
    let mut bench = TestBench {
        shape,
        timer: AvrTimer::new(shape),
        model: Model::new(shape, RATE),
        prescaler: Prescaler::new(0),
        asleep: None,
        listened: 0,
        out: Vec::new(),
        rng: Rng::new(rng.next_u64()),
    };
    bench.timer.set_clock_hz(RATE, 0);
    let hz = CRYSTALS[rng.below(6) as usize];
    bench.timer.crystal_hz(hz, 0, &mut bench.out);
    bench.model.crystal.hz = hz;
    if rng.one_in(2) {
        bench.listened = rng.next_u64() as u8;
        bench.timer.set_listened_interrupts(bench.listened, 0, &mut bench.out);
    }
    let eager = rng.one_in(4);
    // In a long execution, little happens except counting.
    let rare = if cycles > 10_000 { 250 } else { 1 };
    let busy = rare * [4, 10, 40, 200][rng.below(4) as usize];
    let edges = rare * [2, 3, 6, 40][rng.below(4) as usize];
    let odd = rare * [30, 100, 400][rng.below(3) as usize];
    let mut levels = [false; 2];
    let mut drives = [AvrDrive::Port; 3];
    let mut steady = [(0u8, 0u64); LIVE.len()];
    for t in 1..cycles {
        let place = |model: &Model| format!("seed {seed}, cycle {t}, {shape:?}, {model:?}");
        let awake = bench.asleep.is_none();
        let mut quiet = true;
        let write = (awake && (t < 14 || rng.one_in(busy))).then(|| bench.pick(t < 14));
        if let Some((reg, value, mask)) = write {
            bench.timer.write(reg, value, mask, t, &mut bench.out);
            quiet = false;
        } else if eager || bench.timer.next_deadline() <= t {
            bench.timer.run_due(t, &mut bench.out);
        }
        let divider = bench.asleep.is_none_or(|(_, stopped)| !stopped);
        bench.model.tick(t, divider, write);
        for flag in [1, 2, 4, 8, 0x20] {
            if bench.model.rose & flag != 0 {
                heard.flags[flag.trailing_zeros() as usize] += 1;
                let irq = shape.irq(flag);
                let at = bench.out.iter().position(|s| *s == AvrSignal::Flag { t, irq });
                assert_eq!(at.is_some(), bench.listened >> irq & 1 == 1, "flag {flag:#x}, {}", place(&bench.model));
                if let Some(at) = at {
                    bench.out.remove(at);
                    heard.reported += 1;
                }
            }
        }
        if rng.one_in(edges) {
            let i = rng.below(2) as usize;
            levels[i] = !levels[i];
            quiet = false;
            let line = [AvrLine::T, AvrLine::Icp][i];
            [&mut bench.model.t, &mut bench.model.icp][i].line = levels[i];
            if i == 0 && levels[0] && shape.asynchronous {
                bench.model.pulse(t);
            }
            bench.timer.on_line_changed(line, levels[i], t, &mut bench.out);
        }
        if t > 14 && rng.one_in(odd) {
            bench.other(t);
            quiet = false;
        }
        if rng.one_in(20 * rare) && bench.asleep.is_none() {
            bench.reads(t, &place);
            quiet = false;
        }
        for signal in bench.out.drain(..) {
            match signal {
                AvrSignal::Drive { t: at, line, drive } if at == t => {
                    drives[[AvrLine::OcA, AvrLine::OcB, AvrLine::OcC].iter().position(|l| *l == line).unwrap_or(3)] =
                        drive;
                    heard.drives += 1;
                }
                other => panic!("{other:?}, {}", place(&bench.model)),
            }
        }
        for (i, drive) in drives.iter().enumerate() {
            let want = bench.model.drive(i).map_or(AvrDrive::Port, AvrDrive::Value);
            assert_eq!(*drive, want, "channel {i}, {}", place(&bench.model));
        }
        let requests = shape.irqs_of(bench.model.tifr & bench.model.timsk);
        assert_eq!(bench.timer.interrupt_requests(), requests, "requests, {}", place(&bench.model));
        for reg in REGS {
            let live = reg == TimerRegister::TIFR
                || reg == TimerRegister::TCNTL
                || reg == TimerRegister::ICRL && shape.capture;
            if t % 16 == 0 || live || reg == TimerRegister::ASSR && shape.asynchronous {
                assert_eq!(bench.timer.peek(reg, t), bench.want(reg), "{reg:?}, {}", place(&bench.model));
            }
        }
        heard.busy += u64::from(bench.model.assr() & 0x1F != 0);
        heard.stale += u64::from(bench.model.shown() != bench.model.tcnt);
        for (i, reg) in LIVE.into_iter().enumerate() {
            let now = bench.want(reg);
            let (value, until) = steady[i];
            if quiet && t < until {
                assert_eq!(now, value, "{reg:?} was steady until {until}, {}", place(&bench.model));
            } else {
                let until = if t % 8 == 0 { bench.timer.steady_until(reg, t) } else { 0 };
                steady[i] = (now, until);
            }
        }
    }
}

/// Number of random executions; lower in slow builds.
const LIVES: u64 = if cfg!(debug_assertions) { 400 } else { 15_000 };
/// Number of executions of each shape in the thorough tests.
const MANY: u64 = 40_000;

fn check(from: u64, shapes: &[usize], lives: u64) -> Heard {
    let mut heard = Heard::default();
    for seed in 0..lives {
        for &i in shapes {
            let cycles = if SHAPES[i].asynchronous { 240 } else { 120 } + seed % 97;
            run(from + seed * 8 + i as u64, SHAPES[i], cycles, &mut heard);
        }
    }
    assert!(heard.drives > lives && heard.reported > lives, "{heard:?}");
    heard
}

fn without_a_crystal(lives: u64) {
    let heard = check(0, &[0, 1, 4, 6, 7], lives);
    assert!(heard.flags[5] > lives && heard.flags[2] > lives, "{heard:?}");
}

fn others(lives: u64) {
    let heard = check(1 << 40, &[2, 3, 5], lives);
    assert!(heard.busy > lives && heard.stale > lives / 10 && heard.flags[3] > lives / 2, "{heard:?}");
}

#[test]
fn timers_without_a_crystal_agree_with_a_model_that_ticks() {
    without_a_crystal(LIVES);
}

#[test]
#[ignore = "takes a minute; .ci/peers does it"]
fn each_timer_without_a_crystal_in_many_lives() {
    without_a_crystal(MANY);
}

#[test]
fn other_timers_agree_with_a_model_that_ticks() {
    others(LIVES);
}

#[test]
#[ignore = "takes a minute; .ci/peers does it"]
fn each_other_timer_in_many_lives() {
    others(MANY);
}

#[test]
fn long_lives_agree_too() {
    let mut heard = Heard::default();
    for seed in 0..LIVES / 200 {
        run(seed << 20, SHAPES[(seed % 6) as usize], 70_000, &mut heard);
    }
    assert!(heard.drives > LIVES / 200, "{heard:?}");
}
