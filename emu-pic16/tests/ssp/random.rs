//! Random programs on random lines: compares the port, which is called only when something is due, with the
//! stepped model.

use emu_core::rng::Rng;
use emu_pic16::periph::map::{InterruptFlag, Pic16Line, Sfr};
use emu_pic16::periph::ssp::Pic16Ssp;

use crate::model::Model;
use crate::rig::{REGS, TestBench};

/// Subject of a run.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Theme {
    SpiMaster,
    SpiSlave,
    Slave,
    Master,
    Any,
}

/// Counts of events in all runs, so that a script that tests nothing is detected.
#[derive(Debug, Default)]
struct Seen {
    sspif: u32,
    bclif: u32,
    wcol: u32,
    sspov: u32,
    stretched: u32,
    read: u32,
    ua: u32,
    ten_reads: u32,
    slept: u32,
    acked: u32,
}

struct Pair {
    bench: TestBench,
    model: Model,
    /// The outside device pulls (I2C) or drives (SPI) SCK and SDI low; then SS.
    outside: [bool; 3],
    levels: [bool; 3],
}

impl Pair {
    /// Passes the lines to both until they are stable; both must drive them equally.
    fn settle(&mut self, t: u64, place: &str) {
        for _ in 0..40 {
            assert_eq!(self.bench.drives, self.model.drives(), "{place}: drives");
            let mut rest = true;
            for (n, line) in [(1, Pic16Line::Sdi), (0, Pic16Line::Sck), (2, Pic16Line::Ss)] {
                let pulled = n < 2 && self.bench.pulls()[n];
                let level = self.outside[n] && !pulled;
                if self.levels[n] != level {
                    rest = false;
                    self.levels[n] = level;
                    self.model.line(line, level, t);
                    self.bench.line(line, level, t);
                    assert_eq!(self.bench.drives, self.model.drives(), "{place}: drives after {line:?}");
                }
            }
            if rest {
                return;
            }
        }
        panic!("{place}: no rest");
    }
}

/// An outside device on the lines: the master or slave that the port communicates with, or noise.
struct Hand {
    /// Future levels of SCK and SDI.
    script: Vec<[bool; 2]>,
    /// Clocks from one to the next.
    pace: u64,
    due: u64,
    waits: bool,
}

impl Hand {
    fn new(rng: &mut Rng) -> Hand {
        Hand { script: Vec::new(), pace: 1 + rng.below(30), due: 0, waits: !rng.one_in(8) }
    }

    fn byte(&mut self, byte: u8, ninth: bool) {
        for bit in (0..9).rev() {
            let level = if bit == 0 { ninth } else { byte >> (bit - 1) & 1 == 1 };
            self.script.extend([[false, level], [true, level], [false, level]]);
        }
    }

    fn start(&mut self) {
        self.script.extend([[false, true], [true, true], [true, false], [false, false]]);
    }

    fn talk(&mut self, rng: &mut Rng, add: u8) {
        self.start();
        if rng.one_in(3) {
            // Both halves of a 10-bit address, and a repeated Start.
            self.byte(add & !1, true);
            self.byte(add, true);
            self.start();
        }
        let first = match rng.below(8) {
            0 => rng.next_u64() as u8,
            1 => 0,
            n => add & !1 | u8::from(n >= 5),
        };
        self.byte(first, true);
        for _ in 0..rng.below(4) {
            let data = if rng.one_in(3) { add } else { rng.next_u64() as u8 };
            // In a read the device must not drive SDA except for its acknowledge.
            self.byte(if first & 1 == 1 { 0xFF } else { data }, first & 1 == 0 || rng.one_in(3));
        }
        if rng.one_in(2) {
            self.script.extend([[false, false], [true, false], [true, true]]);
        }
        if rng.one_in(4) {
            let keep = rng.below(self.script.len() as u64) as usize;
            self.script.truncate(keep);
        }
        self.script.reverse();
    }

    /// Returns the next levels of the outside device, if they are due.
    fn next(&mut self, rng: &mut Rng, t: u64, theme: Theme, pair: &Pair) -> Option<[bool; 2]> {
        if t < self.due {
            return None;
        }
        self.due = t + 1 + rng.below(2 * self.pace);
        let now = [pair.outside[0], pair.outside[1]];
        match theme {
            Theme::Slave => {
                if self.waits && now[0] && !pair.levels[0] {
                    return None;
                }
                if self.script.is_empty() && rng.one_in(4) {
                    self.talk(rng, pair.bench.port_add());
                }
                self.script.pop().or_else(|| rng.one_in(60).then(|| [rng.one_in(2), rng.one_in(2)]))
            }
            Theme::SpiSlave => Some([now[0] == rng.one_in(3), rng.one_in(2)]),
            // A slave that responds and stretches the clock, sometimes another master.
            Theme::Master => Some([!rng.one_in(12), rng.one_in(2) || !rng.one_in(5)]),
            Theme::SpiMaster | Theme::Any => Some([rng.one_in(2), rng.one_in(2)]),
        }
    }
}

fn sspm(rng: &mut Rng, theme: Theme) -> u8 {
    match theme {
        Theme::SpiMaster => rng.below(4) as u8,
        Theme::SpiSlave => 4 + rng.below(2) as u8,
        Theme::Slave => [6, 7, 14, 15][rng.below(4) as usize],
        Theme::Master => 8,
        Theme::Any => rng.below(16) as u8,
    }
}

/// Returns a write of the program, usually one that programs do in this mode.
fn pick(rng: &mut Rng, theme: Theme, pair: &Pair, mode: u8) -> Option<(Sfr, u8)> {
    let any = rng.next_u64() as u8;
    let con = pair.model.chip.con;
    let shifting = pair.model.spi.busy();
    if theme == Theme::Slave && pair.model.chip.ua && rng.one_in(2) {
        return Some((Sfr::SSPADD, pair.model.chip.add));
    }
    if theme == Theme::Slave && !pair.model.chip.ckp() && rng.one_in(4) {
        return Some((Sfr::SSPCON, con & 0x2F | 0x10));
    }
    Some(match rng.below(40) {
        0..=9 => (Sfr::SSPBUF, any),
        10..=17 if theme == Theme::Master => {
            let dt = pair.model.peek(Sfr::SSPCON2) & 0xE0 ^ if rng.one_in(2) { 0x20 } else { 0 };
            (Sfr::SSPCON2, dt | [1, 1, 2, 4, 8, 8, 0x10, 0x10][rng.below(8) as usize])
        }
        10..=11 if theme == Theme::Slave => (Sfr::SSPCON, con & 0x2F | 0x10),
        18 => (Sfr::SSPADD, if theme == Theme::Master { any & 7 } else { any }),
        19 => (Sfr::SSPCON2, any),
        // The figures do not define the effect of a phase change during a byte on the counted bits.
        20 if !shifting => (Sfr::SSPSTAT, any),
        21 => (Sfr::SSPCON, 0x30 | mode),
        22 => (Sfr::SSPCON, con & 0x3F),
        23 if rng.one_in(4) => (Sfr::SSPCON, any & 0xDF | u8::from(!rng.one_in(3)) << 5),
        24 if rng.one_in(4) => (Sfr::SSPCON, 0x20 | sspm(rng, theme) | any & 0x10),
        _ => return None,
    })
}

impl TestBench {
    fn port_add(&self) -> u8 {
        self.regs(0)[3]
    }
}

fn one(seed: u64, theme: Theme, seen: &mut Seen) {
    let mut rng = Rng::new(seed);
    let (mssp, stretch) = (theme == Theme::Master || rng.one_in(2), rng.one_in(2));
    let mut pair = Pair {
        bench: TestBench::new(Pic16Ssp::new(mssp).with_stretch(mssp && stretch)),
        model: Model::new(mssp, mssp && stretch),
        outside: [true, true, false],
        levels: [false; 3],
    };
    let mut hand = Hand::new(&mut rng);
    let mode = sspm(&mut rng, theme);
    let busyness = 1 + rng.below(20);
    let mut wake = None;
    for t in 1..6000_u64 {
        let place = format!("{theme:?}, seed {seed}, clock {t}");
        pair.bench.tick(t);
        pair.model.tick(t);
        if t.is_multiple_of(4) && wake.is_none() && rng.one_in(3) {
            pair.bench.timer2(t);
            pair.model.timer2(t);
        }
        pair.settle(t, &place);
        if let Some([scl, sda]) = hand.next(&mut rng, t, theme, &pair) {
            (pair.outside[0], pair.outside[1]) = (scl, sda);
            pair.settle(t, &place);
        }
        if rng.one_in(150) {
            pair.outside[2] = !pair.outside[2];
            pair.settle(t, &place);
        }
        if t == 4 {
            let add = if theme == Theme::Master { rng.below(6) as u8 } else { rng.next_u64() as u8 & !1 };
            for (reg, value) in [(Sfr::SSPADD, add), (Sfr::SSPCON, 0x30 | mode)] {
                pair.bench.write(reg, value, t);
                pair.model.write(reg, value, t);
                pair.settle(t, &place);
            }
        }
        if t.is_multiple_of(4) && t > 4 {
            if let Some(end) = wake {
                if t >= end {
                    wake = None;
                    pair.bench.wake(t);
                    pair.model.wake(t);
                }
            } else if rng.one_in(400) {
                wake = Some(t + 4 + 4 * rng.below(30));
                seen.slept += 1;
                pair.bench.sleep(t);
                pair.model.sleep(t);
            } else if rng.one_in(busyness) {
                let full = theme == Theme::Slave && pair.model.chip.bf && rng.one_in(2);
                if full {
                    assert_eq!(pair.bench.read(Sfr::SSPBUF, t), pair.model.read(Sfr::SSPBUF), "{place}: SSPBUF");
                } else if rng.one_in(3) {
                    let reg = REGS[rng.below(5) as usize];
                    assert_eq!(pair.bench.read(reg, t), pair.model.read(reg), "{place}: read {reg:?}");
                } else if let Some((reg, value)) = pick(&mut rng, theme, &pair, mode) {
                    let was = pair.model.peek(Sfr::SSPCON);
                    pair.bench.write(reg, value, t);
                    pair.model.write(reg, value, t);
                    seen.wcol += u32::from(!was & pair.model.peek(Sfr::SSPCON) & 0x80 != 0 && reg == Sfr::SSPBUF);
                }
            }
            pair.settle(t, &place);
        }
        let model = REGS.map(|reg| pair.model.peek(reg));
        assert_eq!(pair.bench.regs(t), model, "{place}: {REGS:?}");
        assert_eq!(pair.bench.flags.last(), pair.model.chip.flags.last(), "{place}: flags");
        seen.sspov += u32::from(model[1] & 0x40 != 0);
        seen.read += u32::from(model[4] & 4 != 0);
        seen.ten_reads += u32::from(model[4] & 4 != 0 && matches!(model[1] & 0x2F, 0x27 | 0x2F));
        seen.ua += u32::from(model[4] & 2 != 0);
        seen.stretched += u32::from(pair.bench.pulls()[0] && pair.outside[0]);
        seen.acked += u32::from(pair.bench.pulls()[1]);
    }
    assert_eq!(pair.bench.flags, pair.model.chip.flags, "{theme:?}, seed {seed}");
    seen.sspif += pair.bench.count(InterruptFlag::SSPIF) as u32;
    seen.bclif += pair.bench.count(InterruptFlag::BCLIF) as u32;
}

fn many(theme: Theme, seeds: u64) -> Seen {
    let mut seen = Seen::default();
    for seed in 0..seeds {
        one(seed, theme, &mut seen);
    }
    seen
}

#[test]
fn spi_master_agrees_with_the_figure() {
    let seen = many(Theme::SpiMaster, 80);
    assert!(seen.sspif > 1000 && seen.wcol > 100 && seen.slept > 100, "{seen:?}");
}

#[test]
fn spi_slave_agrees_with_the_figures() {
    let seen = many(Theme::SpiSlave, 80);
    assert!(seen.sspif > 1000 && seen.wcol > 100 && seen.sspov > 100 && seen.slept > 100, "{seen:?}");
}

#[test]
fn i2c_slave_agrees_with_its_history() {
    let seen = many(Theme::Slave, 120);
    assert!(seen.sspif.min(seen.read).min(seen.ua) > 1000 && seen.sspov > 100, "{seen:?}");
    assert!(seen.stretched > 1000 && seen.acked > 1000 && seen.ten_reads > 1000 && seen.slept > 100, "{seen:?}");
}

#[test]
fn i2c_master_agrees_with_its_orders() {
    let seen = many(Theme::Master, 80);
    assert!(seen.sspif > 1000 && seen.bclif > 300 && seen.wcol > 100 && seen.slept > 100, "{seen:?}");
}

/// Arbitrary values in arbitrary order.
#[test]
fn any_values_in_any_order_agree() {
    let seen = many(Theme::Any, 60);
    assert!(seen.sspif > 300 && seen.slept > 100, "{seen:?}");
}
