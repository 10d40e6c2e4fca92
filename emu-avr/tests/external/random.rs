//! Random writes, pins, sleeps and resets: peripheral and stepped model must agree in every cycle in register
//! reads, interrupts, and the flag signalled to the converter.

use emu_avr::periph::external::{ExternalInterrupts, ExternalKind, ExternalRegister};
use emu_avr::periph::{AvrLine, AvrOutbox, AvrSignal, Device};
use emu_core::rng::Rng;

use super::model::{Chip, Model};

const REGS: [ExternalRegister; 10] = [
    ExternalRegister::EICRA,
    ExternalRegister::EICRB,
    ExternalRegister::EIMSK,
    ExternalRegister::EIFR,
    ExternalRegister::PCICR,
    ExternalRegister::PCIFR,
    ExternalRegister::PCMSK0,
    ExternalRegister::PCMSK1,
    ExternalRegister::PCMSK2,
    ExternalRegister::PCMSK3,
];

static CHIPS: [(ExternalKind, Chip); 6] = [
    (ExternalKind::MEGA328, Chip { edges_wake: true, ..FIRST_48 }),
    (ExternalKind::MEGA48, FIRST_48),
    (ExternalKind::MEGA8, Chip { masks: [0; 4], ..FIRST_48 }),
    (ExternalKind::MEGA16, Chip { masks: [0; 4], ..MEGA162 }),
    (ExternalKind::MEGA162, MEGA162),
    (ExternalKind::MEGA128, Chip { ints: 8, unclocked: &[0, 1, 2, 3], masks: [0; 4], ..FIRST_48 }),
];

const FIRST_48: Chip =
    Chip { ints: 2, unclocked: &[], edge_only: &[], edges_wake: false, masks: [0xFF, 0x7F, 0xFF, 0] };
const MEGA162: Chip = Chip { ints: 3, unclocked: &[2], edge_only: &[2], edges_wake: false, masks: [0xFF, 0xFF, 0, 0] };

fn live(seed: u64, seen: &mut [u64; 5]) {
    let mut rng = Rng::new(seed);
    let (kind, chip) = &CHIPS[if rng.one_in(2) { 0 } else { rng.below(6) as usize }];
    let (mut dut, mut model) = (ExternalInterrupts::new(*kind), Model::new(chip));
    let busy = [2, 4, 15][rng.below(3) as usize];
    let mut listened = false;
    let mut promised = [(0, 0); 10];
    for t in 1..60 + rng.below(150) {
        let at = || format!("seed {seed}, cycle {t}");
        let mut out = AvrOutbox::new();
        model.tick();
        if dut.next_deadline() <= t || rng.one_in(20) {
            dut.run_due(t, &mut out);
        }
        for (n, &(_, value)) in promised.iter().enumerate().filter(|(_, p)| p.0 > t) {
            assert_eq!(model.get(n), value, "{:?} promised, {}", REGS[n], at());
        }
        let clocked = model.clock_is_on();
        // A flag is signalled in the cycle of the tick, or by an action of this cycle.
        let mut reported = listened && model.reported;
        for _ in 0..if rng.one_in(busy) { 1 + rng.below(4) } else { 0 } {
            promised = [(0, 0); 10];
            model.reported = false;
            let byte = rng.next_u64() as u8;
            let mask = if rng.one_in(4) { 1 << rng.below(8) } else { 0xFF };
            match rng.below(20) {
                0..=4 => {
                    let n = byte & if rng.one_in(2) { 1 } else { 9 };
                    model.int(n.into(), byte & 0x80 != 0);
                    dut.on_line_changed(AvrLine::Int(n), byte & 0x80 != 0, t, &mut out);
                }
                5..=9 => {
                    let n = byte & if rng.one_in(2) { 9 } else { 31 };
                    model.pc(n.into(), byte & 0x80 != 0);
                    dut.on_line_changed(AvrLine::Pc(n), byte & 0x80 != 0, t, &mut out);
                }
                10 if rng.one_in(2) => {
                    model.clock(!clocked && rng.one_in(2));
                    if model.clock_is_on() {
                        dut.restart_clock(t, &mut out);
                    } else {
                        dut.stop_clock(t, &mut out);
                    }
                }
                10 | 11 if !model.clock_is_on() => {
                    model.clock(true);
                    dut.restart_clock(t, &mut out);
                }
                11 | 12 => {
                    let irq = rng.below(model.interrupts() as u64) as u8;
                    model.taken(irq.into());
                    dut.on_interrupt_taken(irq, t, &mut out);
                }
                13 if rng.one_in(4) => {
                    model.reset();
                    dut.reset(false, t, &mut out);
                }
                14 if rng.one_in(2) => {
                    listened = byte & 1 != 0;
                    dut.set_flag_listener(listened, t, &mut out);
                }
                _ => {
                    // Enables and masks are mostly set, and ISC changes rarely enough that edges pass.
                    let reg = [0, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6, 7, 8, 9][rng.below(15) as usize];
                    let byte = if matches!(reg, 2 | 4 | 6..=9) { byte | rng.next_u64() as u8 } else { byte };
                    model.write(reg, byte, mask);
                    dut.write(REGS[reg], byte, mask, t, &mut out);
                }
            }
            reported |= listened && model.reported;
        }
        let mut flagged = false;
        for signal in out.drain(..) {
            assert_eq!(signal, AvrSignal::Flag { t, irq: 0 }, "{}", at());
            flagged = true;
        }
        assert_eq!(flagged, reported, "the reported flag, {}", at());
        for (n, &reg) in REGS.iter().enumerate() {
            assert_eq!(dut.peek(reg, t), model.get(n), "{reg:?}, {}", at());
        }
        assert_eq!(dut.interrupt_requests(), model.requests(), "interrupts, {}", at());
        seen[0] += u64::from(model.set_now.0.contains(&true));
        seen[1] += u64::from(model.set_now.1.contains(&true));
        seen[2] += u64::from(flagged);
        seen[3] += u64::from(!model.clock_is_on() && model.requests() != 0);
        seen[4] += u64::from(model.get(3) & model.get(2) != 0);
        if rng.one_in(6) {
            let mut n = 0;
            promised = REGS.map(|reg| {
                n += 1;
                (dut.steady_until(reg, t), model.get(n - 1))
            });
        }
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
