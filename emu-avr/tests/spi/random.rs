//! Random programs and line changes: compares the model with the peripheral, which runs only when it reports
//! something due.

use emu_avr::periph::spi::{AvrSpi, CPHA, CPOL, DORD, MSTR, SPE, SPI2X, SPIE, SpiRegister};
use emu_avr::periph::{AvrDrive, AvrLine, AvrSignal, Device};
use emu_core::rng::Rng;

use crate::model::Model;

const REGS: [SpiRegister; 3] = [SpiRegister::SPCR, SpiRegister::SPSR, SpiRegister::SPDR];

/// Returns a write that is likely to have an effect.
fn write(model: &Model, rng: &mut Rng) -> (SpiRegister, u8, u8) {
    let c = model.peek(SpiRegister::SPCR);
    let any = rng.next_u64() as u8;
    match rng.below(16) {
        0 => (SpiRegister::SPCR, any, 0xFF),
        1 => (SpiRegister::SPCR, c ^ [MSTR, SPE, CPOL, CPHA, DORD, 1, 2][rng.below(7) as usize], 0xFF),
        2 => (SpiRegister::SPCR, any, 1 << rng.below(8)),
        3..6 => (SpiRegister::SPCR, any & (DORD | CPOL | CPHA | SPIE) | SPE | MSTR, 0xFF),
        6 => (SpiRegister::SPSR, any, 0xFF),
        7 => (SpiRegister::SPSR, SPI2X, 0xFF),
        _ => (SpiRegister::SPDR, any, 0xFF),
    }
}

/// Counts of each kind of event.
#[derive(Default, Debug)]
struct Seen {
    master: u64,
    slave: u64,
    collisions: u64,
    robbed: u64,
}

/// Returns the last signal per line of one cycle.
fn last(signals: &[AvrSignal]) -> Vec<String> {
    let line = |signal: &AvrSignal| if let AvrSignal::Drive { line, .. } = signal { Some(*line) } else { None };
    let stays = |n: usize| !signals[n + 1..].iter().any(|later| line(later) == line(&signals[n]));
    let mut all: Vec<_> = (0..signals.len()).filter(|&n| stays(n)).map(|n| format!("{:?}", signals[n])).collect();
    all.sort();
    all
}

fn compare(seed: u64, clocks: u64, seen: &mut Seen) {
    let rng = &mut Rng::new(seed);
    let (mut port, mut model, mut out) = (AvrSpi::new(), Model::new(), Vec::new());
    let (mut asleep, mut quiet, mut sck) = (false, 1 + rng.below(9), 1);
    let mut steady = [(0_u8, 0_u64); 3];
    let slave = rng.one_in(2);
    let first = SPE | if slave { 0 } else { MSTR } | rng.next_u64() as u8 & (DORD | CPOL | CPHA | SPIE);
    let high = rng.below(4) != 0;
    for (line, high) in [(AvrLine::Ss, !slave && high), (AvrLine::Sck, first & CPOL != 0)] {
        port.on_line_changed(line, high, 0, &mut out);
        model.line(line, high, 0);
    }
    for (reg, value) in [
        (SpiRegister::SPCR, first),
        (SpiRegister::SPSR, u8::from(rng.one_in(2))),
        (SpiRegister::SPDR, rng.next_u64() as u8),
    ] {
        port.write(reg, value, 0xFF, 0, &mut out);
        model.write(reg, value, 0xFF, 0);
    }
    for t in 1..clocks {
        if !asleep {
            let before = (model.peek(SpiRegister::SPCR), model.peek(SpiRegister::SPSR));
            model.tick(t);
            let set = before.1 & 0x80 == 0 && model.peek(SpiRegister::SPSR) & 0x80 != 0;
            let robbed = before.0 != model.peek(SpiRegister::SPCR);
            seen.robbed += u64::from(robbed);
            seen.master += u64::from(set && !robbed && before.0 & MSTR != 0);
            seen.slave += u64::from(set && before.0 & MSTR == 0);
        }
        if port.next_deadline() <= t {
            port.run_due(t, &mut out);
        }
        quiet -= 1;
        let mut touched = quiet == 0;
        if touched {
            quiet = 1 + if rng.one_in(4) { rng.below(3) } else { rng.below(60) };
            match rng.below(40) {
                _ if asleep => {
                    asleep = !rng.one_in(3);
                    if !asleep {
                        port.restart_clock(t, &mut out);
                    }
                }
                0 => {
                    asleep = true;
                    port.stop_clock(t, &mut out);
                }
                1 if rng.one_in(3) => {
                    port.reset(false, t, &mut out);
                    model.reset(t);
                }
                2 => {
                    let output = rng.one_in(2);
                    port.on_direction_changed(AvrLine::Ss, output, t, &mut out);
                    model.ss_output = output;
                }
                3..6 if model.requests() != 0 => {
                    port.on_interrupt_taken(0, t, &mut out);
                    model.taken();
                }
                6..18 => {
                    let reg = REGS[rng.below(3) as usize];
                    assert_eq!(port.read(reg, t, &mut out), model.read(reg), "seed {seed}, clock {t}: {reg:?} read");
                }
                _ => {
                    let (reg, value, mask) = write(&model, rng);
                    let before = model.peek(SpiRegister::SPSR);
                    port.write(reg, value, mask, t, &mut out);
                    model.write(reg, value, mask, t);
                    seen.collisions += u64::from(model.peek(SpiRegister::SPSR) & !before & 0x40 != 0);
                }
            }
        }
        let mut lines = Vec::new();
        sck -= 1;
        let master = model.peek(SpiRegister::SPCR) & (SPE | MSTR) == SPE | MSTR;
        if sck == 0 {
            // Sometimes faster than the peripheral can follow.
            sck = 1 + if rng.one_in(30) { rng.below(2) } else { 2 + rng.below(4) };
            if !master {
                lines.push((AvrLine::Sck, !model.sck));
            }
        }
        if rng.one_in(4) {
            lines.push((AvrLine::Mosi, rng.one_in(2)));
            lines.push((AvrLine::Miso, rng.one_in(2)));
        }
        if rng.one_in(if slave { 150 } else { 300 }) {
            lines.push((AvrLine::Ss, !model.ss));
        }
        for signal in &out {
            if let AvrSignal::Drive {
                line: line @ (AvrLine::Sck | AvrLine::Mosi | AvrLine::Miso),
                drive: AvrDrive::Value(high),
                ..
            } = *signal
            {
                lines.push((line, high));
            }
        }
        for (line, high) in lines {
            touched = true;
            port.on_line_changed(line, high, t, &mut out);
            model.line(line, high, t);
        }
        if touched {
            steady = Default::default();
        }
        for (reg, promise) in REGS.into_iter().zip(&mut steady) {
            let value = model.peek(reg);
            assert_eq!(port.peek(reg, t), value, "seed {seed}, clock {t}: {reg:?}");
            if t < promise.1 {
                assert_eq!(value, promise.0, "seed {seed}, clock {t}: {reg:?} steady up to {}", promise.1);
            } else {
                *promise = (value, port.steady_until(reg, t));
            }
        }
        assert_eq!(port.interrupt_requests(), model.requests(), "seed {seed}, clock {t}");
        if out != model.out {
            assert_eq!(last(&out), last(&model.out), "seed {seed}, clock {t}: part, model");
        }
        out.clear();
        model.out.clear();
    }
}

#[test]
fn agrees_with_the_model() {
    let lives = if cfg!(debug_assertions) { 3_000 } else { 100_000 };
    let mut seen = Seen::default();
    for seed in 0..lives {
        compare(seed, 100 + seed % 7 * 50, &mut seen);
    }
    let Seen { master, slave, collisions, robbed } = seen;
    assert!([master, slave, collisions, robbed].iter().all(|&n| n > lives / 5), "{seen:?}");
}
