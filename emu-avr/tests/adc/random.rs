//! Random programs, levels, triggers, sleeps and resets: the converter must agree with the stepped model in
//! every cycle.

use emu_avr::periph::adc::{AdcRegister, AvrAdc, AvrAdcKind};
use emu_avr::periph::{AvrOutbox, Device};
use emu_core::NEVER;
use emu_core::rng::Rng;

use crate::model::Model;

const REGS: [AdcRegister; 6] = [
    AdcRegister::ADMUX,
    AdcRegister::ADCSRA,
    AdcRegister::ADCSRB,
    AdcRegister::ADCL,
    AdcRegister::ADCH,
    AdcRegister::DIDR0,
];
const KINDS: [AvrAdcKind; 5] =
    [AvrAdcKind::MEGA48, AvrAdcKind::MEGA48, AvrAdcKind::MEGA8, AvrAdcKind::MEGA16, AvrAdcKind::MEGA128];
const LEVELS: [u32; 10] = [0, 1, 5, 999, 1_100, 1_101, 2_500, 3_333, 5_000, 6_000];

/// Counts of events in all executions: results, results between the ends, results lost by the lock, triggered
/// starts.
#[derive(Default)]
struct Seen {
    ends: u64,
    between: u64,
    lost: u64,
    triggered: u64,
}

fn write(rng: &mut Rng, dut: &mut AvrAdc, model: &mut Model, t: u64, out: &mut AvrOutbox) {
    let byte = rng.next_u64() as u8;
    // Most writes keep the current ADPS, which is small.
    let adps = if rng.one_in(8) { [byte & 7, byte & 3][usize::from(!rng.one_in(8))] } else { model.adps };
    let (reg, value) = match rng.below(12) {
        0 => (AdcRegister::ADMUX, byte),
        1 => (AdcRegister::ADMUX, byte & 0xE7),
        2 => (AdcRegister::ADCSRB, byte),
        3 => (AdcRegister::ADCSRB, byte & 0x43),
        4 => (AdcRegister::DIDR0, byte),
        5 => ([AdcRegister::ADCL, AdcRegister::ADCH][usize::from(byte & 1)], byte),
        6 if rng.one_in(4) => (AdcRegister::ADCSRA, byte),
        7 if rng.one_in(8) => (AdcRegister::ADCSRA, byte & 0x7F),
        // If a trigger source is selected, most conversions are left to it.
        _ if model.listens().is_some() && !rng.one_in(4) => (AdcRegister::ADCSRA, 0xA0 | byte & 0x18 | adps),
        _ => (AdcRegister::ADCSRA, 0x80 | byte & 0x78 | adps),
    };
    let mask = if rng.one_in(6) { 1 << rng.below(8) } else { 0xFF };
    dut.write(reg, value, mask, t, out);
    model.write(reg, value, mask);
}

/// One random execution of `cycles` cycles.
fn live(seed: u64, seen: &mut Seen) {
    let mut rng = Rng::new(seed);
    let kind = KINDS[rng.below(5) as usize];
    let (mut dut, mut model) = (AvrAdc::new(kind), Model::new(kind));
    let mut out = AvrOutbox::new();
    let cycles = if rng.one_in(50) { 4_000 } else { 150 + rng.below(250) };
    let busy = [3, 10, 40][rng.below(3) as usize];
    // Per register: the cycle up to which its value is guaranteed, and the value.
    let mut promised = [(0, 0); 6];
    for n in 0..9 {
        model.pins[n] = rng.below(6_000) as u32;
        dut.set_millivolts(n as u8, model.pins[n], 0);
    }
    if !rng.one_in(5) {
        let source = if rng.one_in(2) { 3 } else { 0 };
        dut.write(AdcRegister::ADCSRB, source, 0xFF, 0, &mut out);
        model.write(AdcRegister::ADCSRB, source, 0xFF);
        let value = 0xC0 | rng.next_u64() as u8 & 0x29 | rng.below(4) as u8;
        dut.write(AdcRegister::ADCSRA, value, 0xFF, 0, &mut out);
        model.write(AdcRegister::ADCSRA, value, 0xFF);
    }
    for t in 1..cycles {
        let was = (model.flag, model.result, model.blocked);
        model.tick();
        let at = || format!("seed {seed}, cycle {t}");
        if dut.next_deadline() <= t || rng.one_in(30) {
            dut.run_due(t, &mut out);
        }
        for (n, &(until, value)) in promised.iter().enumerate().filter(|(_, p)| p.0 > t) {
            assert_eq!(model.get(REGS[n]), value, "{:?} promised until {until}, {}", REGS[n], at());
        }
        if model.flag && !was.0 {
            seen.ends += 1;
            seen.lost += u64::from(was.2);
            seen.between += u64::from(model.result != was.1 && ![0, 1023].contains(&model.result));
        }
        if rng.one_in(busy) {
            promised = [(0, 0); 6];
            match rng.below(16) {
                0 => {
                    let (n, mv) = (rng.below(10) as usize, LEVELS[rng.below(10) as usize]);
                    dut.set_millivolts(n as u8, mv, t);
                    if n < 9 {
                        model.pins[n] = mv;
                    }
                }
                1 => {
                    model.aref = LEVELS[1 + rng.below(9) as usize];
                    dut.set_aref(model.aref, t);
                }
                2 => {
                    model.avcc = LEVELS[1 + rng.below(9) as usize];
                    dut.set_avcc(model.avcc, t);
                }
                3..=5 => {
                    let wanted = model.listens().filter(|_| !rng.one_in(3));
                    let source = wanted.unwrap_or(rng.below(8) as u8);
                    let set = !model.flags[usize::from(source)] || rng.one_in(4);
                    let idle = model.adcsra() & 0x40 == 0;
                    dut.trigger(source, set, t);
                    model.set_flag(source, set);
                    seen.triggered += u64::from(idle && model.adcsra() & 0x40 != 0);
                }
                6 => {
                    dut.on_core_halted(t);
                    model.halt();
                }
                7 if model.clock_on => {
                    dut.stop_clock(t, &mut out);
                    model.clock_on = false;
                }
                7 | 8 if !model.clock_on => {
                    dut.restart_clock(t, &mut out);
                    model.clock_on = true;
                }
                8 => {
                    dut.on_interrupt_taken(0, t, &mut out);
                    model.flag = false;
                }
                9 if rng.one_in(6) => {
                    dut.reset(false, t, &mut out);
                    model.reset();
                }
                _ => write(&mut rng, &mut dut, &mut model, t, &mut out),
            }
        }
        // The lock is usually short.
        let reg = if model.blocked && !rng.one_in(8) { AdcRegister::ADCH } else { REGS[rng.below(6) as usize] };
        if rng.one_in(12) {
            promised = [(0, 0); 6];
            assert_eq!(dut.read(reg, t, &mut out), model.read(reg), "read of {reg:?}, {}", at());
        }
        for reg in REGS {
            assert_eq!(dut.peek(reg, t), model.get(reg), "{reg:?}, {}", at());
        }
        assert_eq!(dut.interrupt_requests(), u8::from(model.flag && model.enable_irq), "interrupt, {}", at());
        assert_eq!(dut.listened_trigger(), model.listens(), "trigger source, {}", at());
        let channel = (model.adcsrb & 0x40 != 0 && !model.enabled).then_some(model.admux & 7);
        assert_eq!(dut.comparator_channel(), channel, "{}", at());
        assert_eq!((dut.enabled(), dut.digital_off()), (model.enabled, model.didr0), "{}", at());
        if rng.one_in(20) {
            for (promise, reg) in promised.iter_mut().zip(REGS) {
                *promise = (dut.steady_until(reg, t), model.get(reg));
                let changes_lock =
                    reg == AdcRegister::ADCL && !model.blocked || reg == AdcRegister::ADCH && model.blocked;
                assert!(
                    promise.0 >= t && (!changes_lock || promise.0 == t),
                    "{reg:?} steady until {}, {}",
                    promise.0,
                    at()
                );
            }
        }
    }
    assert!(out.is_empty(), "seed {seed}: {out:?}");
}

#[test]
fn random_programs_agree_with_the_ticked_model() {
    let mut seen = Seen::default();
    let lives = if cfg!(debug_assertions) { 3_000 } else { 100_000 };
    for seed in 0..lives {
        live(seed, &mut seen);
    }
    let Seen { ends, between, lost, triggered } = seen;
    assert!(ends > lives && between > lives / 10 && lost > lives / 50 && triggered > lives / 10, "too little happens");
}

/// After a long time without reads, the result is that of the last conversion.
#[test]
fn a_long_time_of_free_running_is_one_step() {
    let (mut dut, mut model) = (AvrAdc::new(AvrAdcKind::MEGA48), Model::new(AvrAdcKind::MEGA48));
    let mut out = AvrOutbox::new();
    for (reg, value) in [(AdcRegister::ADMUX, 0x42), (AdcRegister::ADCSRA, 0xE3)] {
        dut.write(reg, value, 0xFF, 1, &mut out);
        model.write(reg, value, 0xFF);
    }
    assert_eq!(dut.next_deadline(), NEVER);
    dut.set_millivolts(2, 1_000, 1);
    model.pins[2] = 1_000;
    for _ in 1..1_000_003 {
        model.tick();
    }
    dut.set_millivolts(2, 3_000, 1_000_003);
    model.pins[2] = 3_000;
    for t in 1_000_003..1_000_500 {
        assert_eq!(dut.peek(AdcRegister::ADCL, t), model.get(AdcRegister::ADCL), "cycle {t}");
        assert_eq!(dut.peek(AdcRegister::ADCH, t), model.get(AdcRegister::ADCH), "cycle {t}");
        model.tick();
    }
    assert_eq!(model.result, 614);
    assert_eq!(dut.peek(AdcRegister::ADCL, u64::MAX / 2), 614u16 as u8);
}
