//! Random writes, edges, sleeps and resets: timers and model must agree at every clock.

use emu_core::NEVER;
use emu_core::rng::Rng;
use emu_pic16::periph::map::{InterruptFlag, Pic16Line, Sfr};
use emu_pic16::periph::timers::{Pic16Timers, Timer1Crystal};
use emu_pic16::periph::{Device, Pic16Drive, Pic16Signal};

use crate::model::Model;

#[rustfmt::skip]
const REGS: [Sfr; 13] = [
    Sfr::TMR1L, Sfr::TMR1H, Sfr::T1CON, Sfr::TMR2, Sfr::T2CON, Sfr::PR2, Sfr::CCPR1L, Sfr::CCPR1H, Sfr::CCP1CON,
    Sfr::CCPR2L, Sfr::CCPR2H, Sfr::CCP2CON, Sfr::TMR0,
];
const LINES: [Pic16Line; 4] = [Pic16Line::T1cki, Pic16Line::Ccp1, Pic16Line::Ccp2, Pic16Line::T0cki];
const CRYSTALS: [Option<(u64, u64)>; 9] = [
    None,
    Some((4_000_000, 32_768)),
    Some((200_000, 32_768)),
    Some((100_000, 32_768)),
    Some((32_768, 32_768)),
    Some((10, 3)),
    Some((13, 7)),
    Some((4, 1)),
    Some((8, 1)),
];

/// Returns a value that soon has an effect: bytes near the counters' values or near the wrap.
fn value(rng: &mut Rng, reg: Sfr, model: &Model) -> u8 {
    let near = |byte: u8, rng: &mut Rng| byte.wrapping_add(rng.below(7) as u8).wrapping_sub(2);
    match reg {
        _ if rng.one_in(12) => rng.next_u64() as u8,
        Sfr::TMR1H if rng.one_in(3) => 0xFF,
        Sfr::TMR1H | Sfr::CCPR1H | Sfr::CCPR2H => [0, 0xFF, (model.tmr1 >> 8) as u8][rng.below(3) as usize],
        Sfr::TMR1L => [0xFD, near(model.modules.first().map_or(0, |m| m.low), rng)][rng.below(2) as usize],
        Sfr::CCPR1L | Sfr::CCPR2L if rng.one_in(2) => near(model.tmr1 as u8, rng),
        Sfr::CCPR1L | Sfr::CCPR2L => rng.below(12) as u8,
        Sfr::CCP1CON | Sfr::CCP2CON if rng.one_in(4) => 11,
        Sfr::CCP1CON | Sfr::CCP2CON => (rng.next_u64() as u8 & 0xF0) | (4 + rng.below(12) as u8),
        // The timers are on more often than off.
        Sfr::T1CON => rng.next_u64() as u8 | u8::from(!rng.one_in(5)),
        Sfr::T2CON => (rng.next_u64() as u8 & if rng.one_in(2) { 0x83 } else { 0x9F }) | u8::from(!rng.one_in(5)) << 2,
        Sfr::PR2 => rng.below(8) as u8,
        Sfr::TMR2 => near(model.pr2, rng),
        _ => rng.next_u64() as u8,
    }
}

/// Returns all signals except those of lines, sorted.
fn others(signals: &[Pic16Signal]) -> Vec<String> {
    let others = signals.iter().filter(|s| !matches!(s, Pic16Signal::Drive { .. }));
    let mut text: Vec<String> = others.map(|s| format!("{s:?}")).collect();
    text.sort();
    text
}

/// Counts of the model's signals, in the order TMR1IF, TMR2IF, CCPxIF, Convert, Timer2, Drive.
type Heard = [usize; 6];

fn run(seed: u64, clocks: u64, heard: &mut Heard) {
    let mut rng = Rng::new(seed);
    let ccps = [2, 2, 2, 1, 0][rng.below(5) as usize];
    let crystal = CRYSTALS[rng.below(9) as usize];
    let (mut timers, mut model) =
        (Pic16Timers::new(ccps, crystal.map(|(osc, hz)| Timer1Crystal { osc, hz })), Model::new(ccps, crystal));
    // Eager timers run at every clock, lazy ones only when they report something due.
    let eager = rng.one_in(4);
    let mut asleep = false;
    let busy = [3, 12, 60, 300][rng.below(4) as usize];
    let edges = [2, 5, 20, 100][rng.below(4) as usize];
    let mut drives = [Pic16Drive::Port; 2];
    let mut levels = [false; LINES.len()];
    let mut steady = [(0u8, 0u64); REGS.len()];
    let mut out = Vec::new();
    for t in 1..clocks {
        let mut write = None;
        // A program starts with some settings.
        if t % 4 == 0 && !asleep && (t < 80 || rng.one_in(busy)) {
            let reg = REGS[rng.below(REGS.len() as u64) as usize];
            write = Some((reg, value(&mut rng, reg, &model)));
        }
        model.tick(t, write);
        let mut quiet = write.is_none();
        if let Some((reg, value)) = write {
            timers.write(reg, value, 0xFF, t, &mut out);
        } else if eager || timers.next_deadline() <= t {
            timers.run_due(t, &mut out);
        }
        if rng.one_in(edges) {
            let i = rng.below(LINES.len() as u64) as usize;
            levels[i] = !levels[i];
            model.line(LINES[i], levels[i]);
            timers.on_line_changed(LINES[i], levels[i], t, &mut out);
            quiet = false;
        }
        if t % 4 == 0 && rng.one_in(if asleep { 20 } else { 8 * busy }) {
            quiet = false;
            match (asleep, rng.below(16)) {
                (_, power_on @ 0..=1) => {
                    asleep = false;
                    model.reset(power_on == 0);
                    timers.reset(power_on == 0, t, &mut out);
                }
                (_, 2..=5) => {
                    model.listener = !model.listener;
                    timers.set_timer2_listener(model.listener, t, &mut out);
                }
                (false, _) => {
                    asleep = true;
                    model.sleep();
                    timers.stop_clock(t, &mut out);
                }
                (true, _) => {
                    asleep = false;
                    model.wake();
                    timers.restart_clock(t, &mut out);
                }
            }
        }
        // Only the last change of a line within one clock is kept.
        for signal in &out {
            if let Pic16Signal::Drive { t: at, line, drive } = signal {
                assert_eq!(*at, t, "{signal:?}, seed {seed}");
                drives[usize::from(*line == Pic16Line::Ccp2)] = *drive;
            }
        }
        for (i, drive) in drives.iter().enumerate() {
            let want = model.modules.get(i).map_or(Pic16Drive::Port, |m| m.drive);
            assert_eq!(*drive, want, "CCP{}, seed {seed}, clock {t}", i + 1);
        }
        for signal in &model.said {
            let kind = match signal {
                Pic16Signal::Flag { flag: InterruptFlag::TMR1IF, .. } => 0,
                Pic16Signal::Flag { flag: InterruptFlag::TMR2IF, .. } => 1,
                Pic16Signal::Flag { .. } => 2,
                Pic16Signal::Convert { .. } => 3,
                Pic16Signal::Timer2 { .. } => 4,
                _ => 5,
            };
            heard[kind] += 1;
        }
        assert_eq!(others(&out), others(&model.said), "signals, seed {seed}, clock {t}");
        out.clear();
        model.said.clear();
        for (i, &reg) in REGS.iter().enumerate() {
            let byte = timers.peek(reg, t);
            assert_eq!(byte, model.read(reg), "{reg:?}, seed {seed}, clock {t}");
            let (promised, until) = steady[i];
            if quiet && t < until {
                assert_eq!(byte, promised, "steady {reg:?} until {until}, seed {seed}, clock {t}");
            }
            steady[i] = (byte, timers.steady_until(reg, t));
        }
        assert!(timers.next_deadline() > t, "nothing stays due, seed {seed}, clock {t}");
        let next = timers.timer2_match_next(t);
        assert!(next > t && (!asleep || next == NEVER), "seed {seed}, clock {t}");
    }
}

#[test]
fn agrees_with_the_model_that_ticks() {
    let mut heard = Heard::default();
    (0..250).for_each(|seed| run(seed, 5000, &mut heard));
    assert!(heard.iter().all(|&n| n > 150), "there was little to agree on: {heard:?}");
}

#[test]
fn agrees_where_writes_are_rare() {
    let mut heard = Heard::default();
    (1000..1008).for_each(|seed| run(seed, 100_000, &mut heard));
    assert!(heard.iter().all(|&n| n > 20), "there was little to agree on: {heard:?}");
}

#[test]
fn the_end_of_a_period_comes_when_it_is_said() {
    let mut out = Vec::new();
    let mut timers = Pic16Timers::new(2, None);
    timers.set_timer2_listener(true, 0, &mut out);
    timers.write(Sfr::PR2, 2, 0xFF, 8, &mut out);
    timers.write(Sfr::T2CON, 0x05, 0xFF, 12, &mut out);
    // Three counts of four cycles are 48 clocks.
    for (t, next) in [(12, 60), (59, 60), (60, 108), (107, 108), (108, 156)] {
        assert_eq!(timers.timer2_match_next(t), next, "after {t}");
    }
    timers.run_due(200, &mut out);
    let ends: Vec<String> = [60, 108, 156].map(|t| format!("Timer2 {{ t: {t} }}")).to_vec();
    let said: Vec<String> = out.iter().map(|s| format!("{s:?}")).filter(|s| s.starts_with("Timer2")).collect();
    assert_eq!(said, ends);
}
