//! Random programs and line changes: compares the model with the port, which runs only when it reports
//! something due.

use std::collections::VecDeque;

use emu_core::rng::Rng;
use emu_pic16::periph::map::{Pic16Line, Sfr};
use emu_pic16::periph::usart::{ADDEN, BRGH, CREN, CSRC, Pic16Usart, RX9, SPEN, SREN, SYNC, TX9, TX9D, TXEN};
use emu_pic16::periph::{Device, Pic16Signal};

use crate::model::Model;

const REGS: [Sfr; 5] = [Sfr::RCSTA, Sfr::TXSTA, Sfr::TXREG, Sfr::RCREG, Sfr::SPBRG];

/// Future levels of RX, each with its duration in clocks.
#[derive(Default)]
struct Wire(VecDeque<(u64, bool)>);

impl Wire {
    fn clock(&mut self, bit: u64, nine: bool, rng: &mut Rng) -> bool {
        while self.0.front().is_none_or(|run| run.0 == 0) {
            if self.0.pop_front().is_none() {
                self.refill(bit, nine, rng);
            }
        }
        let Some(run) = self.0.front_mut() else { return true };
        run.0 -= 1;
        run.1
    }

    /// Adds an idle time and a frame within 3 % of the rate, one that is clearly off, noise, a glitch or a
    /// break.
    fn refill(&mut self, bit: u64, nine: bool, rng: &mut Rng) {
        self.0.push_back((rng.below(3) * rng.below(2 * bit), true));
        match rng.below(14) {
            0 => self.0.extend((0..rng.below(60)).map(|n| (1 + rng.below(bit), n & 1 == 0))),
            1 => self.0.extend([(1 + rng.below(bit), false), (rng.below(2 * bit), true)]),
            2 => self.0.push_back((rng.below(25 * bit), false)),
            kind => {
                let rate = bit * if kind == 3 { 650 + rng.below(700) } else { 970 + rng.below(61) };
                let data = 8 + u64::from(nine);
                let bits = rng.next_u64() << 1 & ((2 << data) - 1) | u64::from(rng.below(12) != 0) << (data + 1);
                let mut at = 0;
                for n in 0..data + 2 {
                    let end = rate * (n + 1) / 1000;
                    self.0.push_back((end - at, bits >> n & 1 != 0));
                    at = end;
                }
                if rng.one_in(5) {
                    let hit = rng.below(self.0.len() as u64) as usize;
                    let (length, level) = self.0[hit];
                    self.0[hit].0 = rng.below(length + 1);
                    self.0.insert(hit + 1, (1 + rng.below(bit / 3), !level));
                }
            }
        }
    }
}

/// Returns a register and a value that is likely to have an effect.
fn write(regs: (u8, u8), rng: &mut Rng) -> (Sfr, u8) {
    let (rcsta, txsta) = regs;
    let flip = |value: u8, bits: &[u8], rng: &mut Rng| value ^ bits[rng.below(bits.len() as u64) as usize];
    match rng.below(36) {
        0 => (Sfr::RCSTA, rng.next_u64() as u8),
        1 => (Sfr::TXSTA, rng.next_u64() as u8),
        2 => (Sfr::SPBRG, rng.below(4) as u8),
        3 => (Sfr::SPBRG, rng.below(12) as u8),
        4 => (Sfr::TXSTA, flip(txsta, &[CSRC, SYNC, BRGH, TXEN], rng)),
        5 => (Sfr::TXSTA, txsta | TXEN),
        6 => (Sfr::TXSTA, flip(txsta, &[TX9, TX9D, TX9D], rng)),
        7 => (Sfr::RCSTA, flip(rcsta, &[SPEN, CREN], rng)),
        8 => (Sfr::RCSTA, flip(rcsta, &[RX9, ADDEN], rng)),
        9 => (Sfr::RCSTA, rcsta & !(CREN | SREN)),
        10 | 11 | 15 | 16 => (Sfr::RCSTA, rcsta | SPEN | CREN),
        12 | 13 => (Sfr::RCSTA, rcsta | SPEN | SREN),
        14 => (Sfr::RCREG, rng.next_u64() as u8),
        _ => (Sfr::TXREG, rng.next_u64() as u8),
    }
}

/// Counts of each kind of event: a run in which nothing happens proves nothing.
#[derive(Default, Debug)]
struct Seen {
    sent: u64,
    received: u64,
    overruns: u64,
    bad_stops: u64,
}

fn compare(seed: u64, clocks: u64, seen: &mut Seen) {
    let rng = &mut Rng::new(seed);
    let (mut port, mut model, mut out) = (Pic16Usart::new(), Model::new(), Vec::new());
    let (mut wire, mut ck) = (Wire::default(), 0);
    let (mut asleep, mut quiet) = (false, 100);
    let mut steady = [(0_u8, 0_u64); REGS.len()];
    for t in 1..clocks {
        let ctx = || format!("seed {seed}, clock {t}");
        model.tick(t);
        assert_eq!(port.txif(t), model.txif(), "{}: TXIF before its change is run", ctx());
        if port.next_deadline() <= t {
            port.run_due(t, &mut out);
        }
        if t % 4 == 0 {
            quiet = u64::saturating_sub(quiet, 1);
            if asleep {
                if rng.one_in(60) {
                    asleep = false;
                    port.restart_clock(t, &mut out);
                    model.wake();
                    steady = Default::default();
                }
            } else if quiet == 0 {
                let (reg, value) = write((model.peek(Sfr::RCSTA), model.peek(Sfr::TXSTA)), rng);
                port.write(reg, value, 0xFF, t, &mut out);
                model.write(reg, value, t);
                steady = Default::default();
                quiet = 1 + if rng.one_in(3) { rng.below(3) } else { rng.below(150) };
            } else if rng.one_in(5000) {
                port.reset(rng.one_in(2), t, &mut out);
                model.reset(t);
                steady = Default::default();
            } else if rng.one_in(2000) {
                asleep = true;
                port.stop_clock(t, &mut out);
                model.sleep();
                steady = Default::default();
            }
        }
        let (rcsta, txsta) = (model.peek(Sfr::RCSTA), model.peek(Sfr::TXSTA));
        let period = 4 * (u64::from(model.peek(Sfr::SPBRG)) + 1);
        let bit = period
            * match txsta & (SYNC | BRGH) {
                0 => 16,
                BRGH => 4,
                _ => 1,
            };
        let rx = wire.clock(bit, rcsta & RX9 != 0, rng);
        let mut moved = false;
        if rx != model.rx_line {
            port.on_line_changed(Pic16Line::Rx, rx, t, &mut out);
            model.line(Pic16Line::Rx, rx, t);
            moved = true;
        }
        if txsta & (SYNC | CSRC) == SYNC {
            if ck == 0 {
                ck = 1 + rng.below(12);
                port.on_line_changed(Pic16Line::Tx, !model.tx_line, t, &mut out);
                model.line(Pic16Line::Tx, !model.tx_line, t);
                moved = true;
            }
            ck -= 1;
        }
        if moved {
            steady = Default::default();
        }
        if t % 4 == 0 && !asleep && rng.one_in(40) {
            assert_eq!(port.read(Sfr::RCREG, t, &mut out), model.read(Sfr::RCREG, t), "{}", ctx());
            steady = Default::default();
        }
        for (reg, promise) in REGS.into_iter().zip(&mut steady) {
            let value = model.peek(reg);
            assert_eq!(port.peek(reg, t), value, "{}: {}", ctx(), reg.name());
            if t < promise.1 {
                assert_eq!(value, promise.0, "{}: {} was to be steady up to {}", ctx(), reg.name(), promise.1);
            } else {
                *promise = (value, port.steady_until(reg, t));
            }
        }
        assert_eq!((port.txif(t), port.rcif()), (model.txif(), model.rcif()), "{}", ctx());
        assert_eq!(
            (port.txif_since().is_some(), port.rcif_since().is_some()),
            (model.txif(), model.rcif()),
            "{}: since",
            ctx()
        );
        for signal in &out {
            match *signal {
                Pic16Signal::Sent { .. } => seen.sent += 1,
                Pic16Signal::Flag { t, flag: emu_pic16::periph::map::InterruptFlag::RCIF } => {
                    assert_eq!(port.rcif_since().unwrap_or(t), t, "{}", ctx());
                    seen.received += 1;
                    seen.bad_stops += u64::from(model.peek(Sfr::RCSTA) & 4 != 0);
                }
                _ => {}
            }
        }
        seen.overruns += u64::from(model.peek(Sfr::RCSTA) & 2 != 0);
        // Within one clock each may send its signals in another order.
        let key = |signal: &Pic16Signal| format!("{signal:?}");
        let (mut is, mut ought) = (std::mem::take(&mut out), std::mem::take(&mut model.out));
        is.sort_by_key(key);
        ought.sort_by_key(key);
        assert_eq!(is, ought, "{}: port, model", ctx());
    }
}

#[test]
fn agrees_with_the_model() {
    let mut seen = Seen::default();
    for seed in 0..12 {
        compare(seed, 150_000, &mut seen);
    }
    let Seen { sent, received, overruns, bad_stops } = seen;
    assert!(sent > 500 && received > 500 && overruns > 1000 && bad_stops > 50, "{seen:?}");
}
