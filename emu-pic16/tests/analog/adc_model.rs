//! A model of the converter that steps clock by clock: it counts TADs and charges the capacitor a little in
//! every clock, in floating point, which only a test may use. Sampled voltages may differ by the rounding to
//! microvolts.

use emu_core::rng::Rng;
use emu_pic16::chips;
use emu_pic16::periph::adc::{ClockFraction, Pic16Adc};
use emu_pic16::periph::map::{InterruptFlag, Sfr};
use emu_pic16::periph::{Device, Pic16Outbox, Pic16Signal};

use crate::script::adc_kind;

/// PCFG3:PCFG0 and the pins AN7 to AN0: analog, digital, R and r for VREF+ and VREF- (DS30292 register 11-2).
const PCFG: [&str; 16] = [
    "AAAAAAAA", "AAAARAAA", "DDDAAAAA", "DDDARAAA", "DDDDADAA", "DDDDRDAA", "DDDDDDDD", "DDDDDDDD", //
    "AAAARrAA", "DDAAAAAA", "DDAARAAA", "DDAARrAA", "DDDARrAA", "DDDDRrAA", "DDDDDDDA", "DDDDRrDA",
];
/// PCFG1:PCFG0 and the pins AN3 to AN0 of the 16C71 (DS30272).
const PCFG8: [&str; 4] = ["AAAA", "RAAA", "DDAA", "DDDD"];

/// A conversion: clocks since its start, and the voltages once it is sampled.
struct Running {
    clocks: u64,
    /// TAD is `tad.0 / tad.1` clocks.
    tad: (u64, u64),
    own: bool,
    /// Volts of the sample, of VREF+ and of VREF- at the sample.
    sampled: Option<[f64; 3]>,
}

struct Model {
    kind: chips::Pic16AdcKind,
    channels: usize,
    rc: (u64, u64),
    hz: f64,
    pins: [f64; 8],
    vdd: f64,
    ohms: f64,
    adcon0: u8,
    adcon1: u8,
    ansel: u8,
    adres: [u8; 2],
    /// Highest allowed value of ADRES, where rounding decides.
    or: [u8; 2],
    running: Option<Running>,
    asleep: bool,
    cap: f64,
    /// Clocks until the capacitor is connected; None while it is disconnected.
    open_for: Option<u64>,
    /// Clocks since it was connected, and since the last disturbance after the settling time.
    connected: u64,
    charged: u64,
    flagged: bool,
}

impl Model {
    fn eight(&self) -> bool {
        self.kind == chips::Pic16AdcKind::Bits8
    }

    fn chs(&self) -> usize {
        usize::from(self.adcon0 >> 3) & if self.eight() { 3 } else { 7 }
    }

    fn source(&self) -> f64 {
        if self.chs() < self.channels { self.pins[self.chs()] } else { 0.0 }
    }

    fn own_clock(&self) -> bool {
        self.adcon0 & 0xC0 == 0xC0
    }

    fn tad(&self) -> (u64, u64) {
        match (self.adcon1 & 0x40 != 0, self.adcon0 & 0xC0) {
            (_, 0xC0) => self.rc,
            (false, 0x00) => (2, 1),
            (false, 0x40) => (8, 1),
            (false, _) => (32, 1),
            (true, 0x00) => (4, 1),
            (true, 0x40) => (16, 1),
            (true, _) => (64, 1),
        }
    }

    /// Returns the settling time of amplifier and temperature, and RC times the natural logarithm, in clocks.
    fn times(&self) -> (u64, u64) {
        let (c, settle, steps) = if self.eight() { (51.2e-12, 6.25e-6, 511f64) } else { (120e-12, 3.25e-6, 2047f64) };
        let charge = (1_000.0 + 7_000.0 + self.ohms) * c * steps.ln();
        let dead = (settle * self.hz - 1e-6).ceil();
        let all = ((settle + charge) * self.hz - 1e-6).ceil();
        (dead as u64, (all - dead) as u64)
    }

    fn connect_in(&mut self, clocks: u64) {
        (self.open_for, self.connected, self.charged) = (Some(clocks), 0, 0);
    }

    fn wait(tad: (u64, u64)) -> u64 {
        (2 * tad.0).div_ceil(tad.1)
    }

    /// Executes one clock of the capacitor.
    fn charge(&mut self) {
        let Some(wait) = self.open_for else { return };
        if wait > 0 {
            self.open_for = Some(wait - 1);
            return;
        }
        self.connected += 1;
        let (dead, full) = self.times();
        if self.connected > dead {
            self.charged += 1;
            let tau = (8_000.0 + self.ohms) * if self.eight() { 51.2e-12 } else { 120e-12 };
            self.cap += (self.source() - self.cap) * (1.0 - (-1.0 / (tau * self.hz)).exp());
            if self.charged >= full {
                self.cap = self.source();
            }
        }
    }

    fn references(&self) -> (f64, f64) {
        let (plus, minus) = match self.kind {
            chips::Pic16AdcKind::Ansel => (self.adcon1 & 0x20 != 0, self.adcon1 & 0x10 != 0),
            chips::Pic16AdcKind::Bits8 => (PCFG8[usize::from(self.adcon1 & 3)].contains('R'), false),
            _ => {
                let row = PCFG[usize::from(self.adcon1 & 15)];
                (row.contains('R'), row.contains('r'))
            }
        };
        (if plus { self.pins[3] } else { self.vdd }, if minus { self.pins[2] } else { 0.0 })
    }

    fn result(&self, volts: f64, plus: f64, minus: f64) -> [u8; 2] {
        let steps = if self.eight() { 256.0 } else { 1024.0 };
        let code = if plus <= minus {
            if volts > minus { steps - 1.0 } else { 0.0 }
        } else {
            ((volts - minus) * steps / (plus - minus)).floor().clamp(0.0, steps - 1.0)
        } as u16;
        match (self.eight(), self.adcon1 & 0x80 != 0) {
            (true, _) => [code as u8, 0],
            (_, true) => [(code >> 8) as u8, code as u8],
            (_, false) => [(code >> 2) as u8, (code << 6) as u8],
        }
    }

    fn tick(&mut self) {
        self.flagged = false;
        self.charge();
        let (volts, eight) = (self.cap, self.eight());
        let (plus, minus) = self.references();
        let Some(running) = &mut self.running else { return };
        running.clocks += 1;
        // The first segment lasts TAD (1.5 TAD with 8 bits), at least TCY; the own oscillator starts after
        // TCY.
        let first = if eight { 3 } else { 2 };
        let (num, den) = running.tad;
        let late = if running.own { 4 } else { 4u64.saturating_sub((first * num).div_ceil(2 * den)) };
        let halves = |n: u64| running.clocks >= late && 2 * den * (running.clocks - late) >= n * num;
        if running.sampled.is_none() && halves(first) {
            running.sampled = Some([volts, plus, minus]);
            self.open_for = None;
        }
        if halves(if eight { 19 } else { 24 })
            && let Some([volts, plus, minus]) = running.sampled
        {
            let wait = Self::wait(running.tad);
            self.running = None;
            self.adres = self.result(volts - 3e-6, plus, minus);
            self.or = self.result(volts + 3e-6, plus, minus);
            self.adcon0 = self.adcon0 & !4 | if eight { 2 } else { 0 };
            self.flagged = true;
            if self.adcon0 & 1 != 0 && (!self.asleep || self.own_clock()) {
                self.connect_in(wait);
            }
        }
    }

    fn abort(&mut self) {
        if let Some(running) = self.running.take() {
            self.adcon0 &= !4;
            self.connect_in(Self::wait(running.tad));
        }
    }

    fn start(&mut self) {
        self.adcon0 |= 4;
        self.running = Some(Running { clocks: 0, tad: self.tad(), own: self.own_clock(), sampled: None });
    }

    fn write_adcon0(&mut self, value: u8) {
        let value = value & if self.eight() { 0xDF } else { 0xFD };
        let was_on = self.adcon0 & 1 != 0;
        let (on, go) = (value & 1 != 0, value & 4 != 0);
        if !on || !go || !was_on {
            self.abort();
        }
        let old = self.chs();
        self.adcon0 = value & !4 | if self.running.is_some() { 4 } else { 0 };
        if !on {
            self.open_for = None;
        } else if !was_on {
            self.connect_in(0);
        } else {
            if self.chs() != old
                && let Some(wait) = self.open_for
            {
                self.connect_in(wait);
            }
            if go && self.running.is_none() {
                self.start();
            }
        }
    }

    fn digital(&self) -> u8 {
        let row = match self.kind {
            chips::Pic16AdcKind::Bits8 => PCFG8[usize::from(self.adcon1 & 3)],
            chips::Pic16AdcKind::Ansel => return !self.ansel,
            _ => PCFG[usize::from(self.adcon1 & 15)],
        };
        (0..8).fold(0, |mask, n| {
            let digital = n >= self.channels || row.chars().rev().nth(n) == Some('D');
            mask | u8::from(digital) << n
        })
    }
}

const LEVELS: [u32; 8] = [0, 4, 1_000, 1_250, 2_500, 3_333, 5_000, 5_500];

#[test]
fn the_converter_agrees_with_one_stepped_clock_by_clock() {
    let (mut results, mut partial) = (0, 0);
    for seed in 0..160 {
        let mut rng = Rng::new(seed);
        let (name, channels) = [("8", 4), ("87X", 5), ("87XA", 8), ("88", 7)][rng.below(4) as usize];
        let kind = adc_kind(name);
        let (rc, hz) = [((16, 1), 4_000_000), ((7, 3), 1_000_000), ((250, 3), 20_000_000)][rng.below(3) as usize];
        let mut dut = Pic16Adc::new(kind, channels, ClockFraction { num: rc.0, den: rc.1 }, hz);
        let mut model = Model {
            kind,
            channels: usize::from(channels),
            rc,
            hz: hz as f64,
            pins: [0.0; 8],
            vdd: 5.0,
            ohms: 10_000.0,
            adcon0: 0,
            adcon1: 0,
            ansel: if kind == chips::Pic16AdcKind::Ansel { 0x7F } else { 0 },
            adres: [0; 2],
            or: [0; 2],
            running: None,
            asleep: false,
            cap: 0.0,
            open_for: None,
            connected: 0,
            charged: 0,
            flagged: false,
        };
        for t in 1..8_000u64 {
            model.tick();
            let mut out: Pic16Outbox = Vec::new();
            let writes = t % 4 == 0 && !model.asleep && rng.one_in(30);
            if writes || dut.next_deadline() <= t || rng.one_in(5) {
                dut.run_due(if writes { t - 1 } else { t }, &mut out);
            }
            if writes {
                write(&mut rng, &mut dut, &mut model, t, &mut out);
            } else if rng.one_in(60) {
                let (n, level) = (rng.below(9) as usize, LEVELS[rng.below(8) as usize]);
                dut.set_input(n as u8, level, t);
                if n < model.channels {
                    let volts = f64::from(level) / 1_000.0;
                    if n == model.chs() && volts != model.pins[n] {
                        model.charged = 0;
                    }
                    model.pins[n] = volts;
                }
            } else if rng.one_in(900) {
                model.vdd = [2.0, 5.0][rng.below(2) as usize];
                dut.set_supply((model.vdd * 1_000.0) as u32, t);
            } else if rng.one_in(900) {
                model.ohms = [0.0, 2_500.0, 10_000.0, 100_000.0][rng.below(4) as usize];
                model.charged = 0;
                dut.set_source_ohms(model.ohms as u32, t);
            } else if rng.one_in(300) {
                if model.running.is_none() && model.adcon0 & 1 != 0 && (!model.asleep || model.own_clock()) {
                    model.start();
                }
                dut.start(t, &mut out);
            } else if t % 4 == 0 && rng.one_in(200) {
                if model.asleep {
                    dut.restart_clock(t, &mut out);
                    model.asleep = false;
                    if model.adcon0 & 1 != 0 && model.running.is_none() && model.open_for.is_none() {
                        model.connect_in(0);
                    }
                } else {
                    dut.stop_clock(t, &mut out);
                    model.asleep = true;
                    let on = model.adcon0 & 1 != 0 && model.own_clock();
                    if !model.running.as_ref().map_or(on, |running| running.own) {
                        model.abort();
                        model.open_for = None;
                    }
                }
            }
            let at = format!("{name}, seed {seed}, clock {t}");
            let flagged = out == [Pic16Signal::Flag { t, flag: InterruptFlag::ADIF }];
            assert!(flagged || out.is_empty(), "{out:?}, {at}");
            assert_eq!(flagged, model.flagged, "ADIF, {at}");
            let adres = [dut.peek(Sfr::ADRESH, t), dut.peek(Sfr::ADRESL, t)];
            // Both justifications order the bytes as they order the results.
            let [low, high, got] = [model.adres, model.or, adres].map(u16::from_be_bytes);
            assert!(low <= got && got <= high, "ADRES {got:04X}, not {low:04X} to {high:04X}, {at}");
            (model.adres, model.or) = (adres, adres);
            assert_eq!(dut.peek(Sfr::ADCON0, t), model.adcon0, "ADCON0, {at}");
            assert_eq!(dut.peek(Sfr::ADCON1, t), model.adcon1, "ADCON1, {at}");
            assert_eq!(dut.digital_pins(), model.digital(), "digital pins, {at}");
            let (dead, full) = model.times();
            let acquired = model.open_for == Some(0) && model.connected >= dead + full && model.running.is_none();
            assert_eq!(dut.is_acquired(t), acquired, "acquired, {at}");
            results += u64::from(flagged);
            partial += u64::from(flagged && ![0, 0xFF].contains(&adres[0]));
        }
    }
    assert!(results > 1_000 && partial > 300, "{results} results, {partial} of them between the ends");
}

fn write(rng: &mut Rng, dut: &mut Pic16Adc, model: &mut Model, t: u64, out: &mut Pic16Outbox) {
    let value = rng.next_u64() as u8;
    match rng.below(10) {
        0 => {
            model.adcon1 = value
                & match model.kind {
                    chips::Pic16AdcKind::Bits8 => 0x03,
                    chips::Pic16AdcKind::Bits10 => 0x8F,
                    chips::Pic16AdcKind::Ansel => 0xF0,
                    _ => 0xCF,
                };
            dut.write(Sfr::ADCON1, value, 0xFF, t, out);
        }
        1 => {
            model.adres[0] = value;
            model.or = model.adres;
            dut.write(Sfr::ADRESH, value, 0xFF, t, out);
        }
        2 => {
            model.ansel = if model.kind == chips::Pic16AdcKind::Ansel { value & 0x7F } else { 0 };
            dut.write(Sfr::ANSEL, value, 0xFF, t, out);
        }
        3 => {
            model.write_adcon0(value);
            dut.write(Sfr::ADCON0, value, 0xFF, t, out);
        }
        // Mostly what programs do: on, same clock and channel, and GO.
        _ => {
            let value = model.adcon0 & 0xFB | 1 | if rng.one_in(5) { value & 0x38 } else { 4 };
            model.write_adcon0(value);
            dut.write(Sfr::ADCON0, value, 0xFF, t, out);
        }
    }
}
