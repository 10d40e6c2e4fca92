//! Random programs and line changes: compares the model with the port, which runs only when it reports
//! something due.

use std::collections::VecDeque;

use emu_avr::periph::usart::{AvrUsart, MPCM, RXEN, TXB8, TXC, TXEN, U2X, UCSZ2, UsartRegister};
use emu_avr::periph::{AvrDrive, AvrLine, AvrSignal, Device};
use emu_core::rng::Rng;

use crate::model::Model;

const REGS: [UsartRegister; 6] = [
    UsartRegister::UDR,
    UsartRegister::UCSRA,
    UsartRegister::UCSRB,
    UsartRegister::UCSRC,
    UsartRegister::UBRRL,
    UsartRegister::UBRRH,
];

/// Future levels of RXD, each with its duration in cycles.
#[derive(Default)]
struct Wire(VecDeque<(u64, bool)>);

impl Wire {
    fn clock(&mut self, bit: u64, data: u64, rng: &mut Rng) -> bool {
        while self.0.front().is_none_or(|run| run.0 == 0) {
            if self.0.pop_front().is_none() {
                self.refill(bit, data, rng);
            }
        }
        let Some(run) = self.0.front_mut() else { return true };
        run.0 -= 1;
        run.1
    }

    /// Adds an idle time and a frame of `data` bits after the start bit, within 3 % of the rate; or a frame
    /// that is clearly off, noise, a glitch or a break.
    fn refill(&mut self, bit: u64, data: u64, rng: &mut Rng) {
        self.0.push_back((rng.below(2) * rng.below(2 * bit), true));
        match rng.below(14) {
            0 => self.0.extend((0..rng.below(30)).map(|n| (1 + rng.below(bit), n & 1 == 0))),
            1 => self.0.extend([(1 + rng.below(bit), false), (rng.below(2 * bit), true)]),
            2 => self.0.push_back((rng.below(15 * bit), false)),
            kind => {
                let rate = bit * if kind == 3 { 650 + rng.below(700) } else { 970 + rng.below(61) };
                let bits = rng.next_u64() << 1 & ((2 << data) - 1) | u64::from(rng.below(8) != 0) << (data + 1);
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

/// Returns a write that is likely to have an effect.
fn write(model: &Model, rng: &mut Rng) -> (UsartRegister, u8, u8) {
    let (b, c) = (model.peek(UsartRegister::UCSRB), model.peek(UsartRegister::UCSRC));
    let any = rng.next_u64() as u8;
    match rng.below(24) {
        0 => (UsartRegister::UCSRC, any, 0xFF),
        1 => (UsartRegister::UCSRC, c ^ 1 << rng.below(8), 0xFF),
        2 => (UsartRegister::UCSRB, any, 0xFF),
        3 => (UsartRegister::UCSRB, b ^ [RXEN, TXEN, UCSZ2][rng.below(3) as usize], 0xFF),
        4 | 5 => (UsartRegister::UCSRB, b | RXEN | TXEN, 0xFF),
        6 => (UsartRegister::UCSRB, b ^ TXB8, 0xFF),
        7 => (UsartRegister::UCSRB, any, 1 << rng.below(8)),
        8 => (UsartRegister::UCSRA, any & (TXC | U2X), 0xFF),
        9 => (UsartRegister::UCSRA, TXC, TXC),
        10 => (UsartRegister::UCSRA, any & any >> 4 & MPCM | model.peek(UsartRegister::UCSRA) & U2X, 0xFF),
        11 => (UsartRegister::UBRRL, rng.below(4) as u8, 0xFF),
        12 => (UsartRegister::UBRRL, model.peek(UsartRegister::UBRRL), 0xFF),
        13 => (UsartRegister::UBRRH, u8::from(rng.one_in(40)), 0xFF),
        _ => (UsartRegister::UDR, any, 0xFF),
    }
}

/// Counts of each kind of event: a run in which nothing happens proves nothing.
#[derive(Default, Debug)]
struct Seen {
    sent: u64,
    received: u64,
    /// UPE, DOR and FE of the words read.
    errors: [u64; 3],
    spi: u64,
    sync: u64,
}

struct Life {
    port: AvrUsart,
    model: Model,
    out: Vec<AvrSignal>,
    asleep: bool,
    steady: [(u8, u64); 6],
}

impl Life {
    fn act(&mut self, t: u64, rng: &mut Rng, seen: &mut Seen) {
        let Life { port, model, out, .. } = self;
        match rng.below(60) {
            _ if self.asleep => {
                if rng.one_in(3) {
                    self.asleep = false;
                    port.restart_clock(t, out);
                }
            }
            0 => {
                self.asleep = true;
                port.stop_clock(t, out);
            }
            1 if rng.one_in(4) => {
                port.reset(false, t, out);
                model.reset(t);
            }
            2 | 3 => {
                let output = rng.below(2) == 0;
                port.on_direction_changed(AvrLine::Xck, output, t, out);
                model.direction(output, t);
            }
            4..10 => {
                let irq = model.requests();
                let irq = irq.trailing_zeros() as u8;
                if irq < 3 {
                    port.on_interrupt_taken(irq, t, out);
                    if irq == 2 {
                        model.taken();
                    }
                }
            }
            10..26 => {
                let status = model.peek(UsartRegister::UCSRA);
                seen.received += u64::from(status >> 7);
                (0..3).for_each(|n| seen.errors[n] += u64::from(status >> (2 + n) & 1));
                match model.peek(UsartRegister::UCSRC) >> 6 {
                    1 => seen.sync += u64::from(status >> 7),
                    3 => seen.spi += u64::from(status >> 7),
                    _ => {}
                }
                assert_eq!(port.read(UsartRegister::UDR, t, out), model.read_udr(), "UDR read");
            }
            _ => {
                let (reg, value, mask) = write(model, rng);
                port.write(reg, value, mask, t, out);
                model.write(reg, value, mask, t);
            }
        }
        self.steady = [(0, 0); 6];
    }
}

fn compare(seed: u64, clocks: u64, seen: &mut Seen) {
    let rng = &mut Rng::new(seed);
    let mut life =
        Life { port: AvrUsart::new(0), model: Model::new(), out: Vec::new(), asleep: false, steady: [(0, 0); 6] };
    let (mut wire, mut xck, mut quiet) = (Wire::default(), 1, 1);
    let umsel = [0, 0, 0, 0x40, 0xC0][rng.below(5) as usize];
    let start = [
        (UsartRegister::UCSRC, umsel | rng.next_u64() as u8 & 0x3F),
        (UsartRegister::UCSRA, if rng.one_in(3) { 0 } else { U2X }),
        (UsartRegister::UBRRL, (rng.below(3) * rng.below(2)) as u8),
        (UsartRegister::UCSRB, rng.next_u64() as u8 | RXEN | TXEN),
    ];
    for (reg, value) in start {
        life.port.write(reg, value, 0xFF, 0, &mut life.out);
        life.model.write(reg, value, 0xFF, 0);
    }
    if rng.one_in(2) {
        life.port.on_direction_changed(AvrLine::Xck, true, 0, &mut life.out);
        life.model.direction(true, 0);
    }
    for t in 1..clocks {
        if !life.asleep {
            life.model.tick(t);
        }
        if life.port.next_deadline() <= t {
            life.port.run_due(t, &mut life.out);
        }
        quiet -= 1;
        if quiet == 0 {
            life.act(t, rng, seen);
            quiet = 1 + if rng.one_in(4) { rng.below(3) } else { rng.below(60) };
        }
        let (port, model, out) = (&mut life.port, &mut life.model, &mut life.out);
        let (a, c) = (model.peek(UsartRegister::UCSRA), model.peek(UsartRegister::UCSRC));
        let tick = u64::from(model.peek(UsartRegister::UBRRL)) + 1;
        let per = match c >> 6 {
            1 | 3 => 2,
            _ if a & U2X != 0 => 8,
            _ => 16,
        };
        let data = 5 + u64::from(c >> 1 & 3) + u64::from(c >> 5 & 1);
        let rxd = wire.clock(tick.min(8) * per, data, rng);
        if rxd != model.rxd {
            port.on_line_changed(AvrLine::Rxd, rxd, t, out);
            model.line(AvrLine::Rxd, rxd);
            life.steady = [(0, 0); 6];
        }
        xck -= 1;
        if xck == 0 {
            // Sometimes faster than the port can follow.
            xck = 1 + if rng.one_in(30) { 0 } else { 1 + rng.below(4) };
            if !model.ddr_xck {
                port.on_line_changed(AvrLine::Xck, !model.xck, t, out);
                model.line(AvrLine::Xck, !model.xck);
                life.steady = [(0, 0); 6];
            }
        }
        let drives = out.iter().rev().find_map(|signal| match *signal {
            AvrSignal::Drive { line: AvrLine::Xck, drive: AvrDrive::Value(level), .. } => Some(level),
            _ => None,
        });
        if let Some(level) = drives.filter(|&level| model.ddr_xck && level != model.xck) {
            port.on_line_changed(AvrLine::Xck, level, t, out);
            model.line(AvrLine::Xck, level);
            life.steady = [(0, 0); 6];
        }
        for (reg, promise) in REGS.into_iter().zip(&mut life.steady) {
            let value = model.peek(reg);
            assert_eq!(port.peek(reg, t), value, "seed {seed}, clock {t}: {reg:?}");
            if t < promise.1 {
                assert_eq!(value, promise.0, "seed {seed}, clock {t}: {reg:?} steady up to {}", promise.1);
            } else {
                *promise = (value, port.steady_until(reg, t));
            }
        }
        assert_eq!(port.interrupt_requests(), model.requests(), "seed {seed}, clock {t}");
        if port.next_deadline() > t {
            assert_eq!(port.is_sending(), model.sending(), "seed {seed}, clock {t}");
        }
        assert_eq!(port.is_receiver_enabled(), model.peek(UsartRegister::UCSRB) & 0x90 == 0x90);
        seen.sent += out.iter().filter(|signal| matches!(signal, AvrSignal::Sent { .. })).count() as u64;
        if *out != model.out {
            // Within one cycle each may send its signals in another order, and may send and undo a change.
            assert_eq!(last(out), last(&model.out), "seed {seed}, clock {t}: port, model");
        }
        out.clear();
        model.out.clear();
    }
}

/// Returns the last signal of each line in one cycle.
fn last(signals: &[AvrSignal]) -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    for (n, signal) in signals.iter().enumerate() {
        let later = |other: &AvrSignal| matches!((signal, other), (AvrSignal::Drive { line: a, .. }, AvrSignal::Drive { line: b, .. }) if a == b);
        if !signals[n + 1..].iter().any(later) {
            all.push(format!("{signal:?}"));
        }
    }
    all.sort();
    all
}

#[test]
fn agrees_with_the_model() {
    let lives = if cfg!(debug_assertions) { 3_000 } else { 100_000 };
    let mut seen = Seen::default();
    for seed in 0..lives {
        compare(seed, 80 + seed % 7 * 40, &mut seen);
    }
    let lives = lives / 100;
    let Seen { sent, received, errors, spi, sync } = seen;
    assert!(sent > 20 * lives && received > 40 * lives && sync > 5 * lives && spi > 5 * lives, "{seen:?}");
    assert!(errors.iter().all(|&n| n > lives / 2), "{seen:?}");
}
